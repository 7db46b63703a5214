"""Strands and deep opacity maps without image atomics, beside those with.

Sintel's own hair on her head, with deep shadows and scattering, and the ball of
_volume_transparency for the cost of a frame.

make bench NAME=no_atomics          a minute or two; writes out/no_atomics.png
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import flip_evaluator
import numpy as np
from _report import report, start
from _volume_sintel import Sitter, sintel
from _volume_transparency import _ball, _target
from extension_loader import REPOSITORY

from hairloom.addon.arrays import Floats
from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.exchange.textures.srgb import srgb_encoded
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera_window import jittered
from hairloom.addon.render.capabilities import capabilities, choose_image_atomics
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.mesh_pass import MeshPass
from hairloom.addon.render.pixel_filter import jitters
from hairloom.addon.render.snapshot import SKIN, MeshSnapshot, Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.render.textures import drawing_into
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings

REFERENCE = "the same with image atomics"
SHEET = REPOSITORY / "out" / "no_atomics.png"
SIZE, SAMPLES, ROUNDS = 256, 16, 7
#: radius of strands [m], as in the file
RADIUS = 4.0e-5
LIGHTS = (
    Light.sun((-0.2, -0.75, 0.6), (1.0, 1.0, 1.0), 3.0),
    Light.sun((0.7, -0.2, 0.5), (1.0, 0.9, 0.8), 1.0),
)
#: figure -> upper limit
MAX_LIMITS = {"no_atomics_flip": 0.02, "hashed_cost": 1.0, "deep_difference": 1.0}


def main() -> int:
    start()
    found_in = capabilities()
    sitter = sintel()
    found = {
        "probe_ms": found_in.probe_ms,
        **picture_figures(sitter),
        **map_figures(sitter),
        **cost_figures(),
    }
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


def shown(sitter: Sitter, transparency: str) -> Snapshot:
    """Sintel's hair in Marschner's model, with default volume settings."""
    return Snapshot(
        sitter.strands,
        np.full(sitter.strands.shape[:2], RADIUS, np.float32),
        lights=LIGHTS,
        ambient=(0.1, 0.1, 0.1),
        meshes=(MeshSnapshot.of(sitter.head, color=SKIN),),
        shading=ShadingSettings(model="marschner"),
        strand_settings=StrandSettings(transparency=transparency),
        detail=DetailSettings(lod_size=0.0),
    )


def picture_figures(sitter: Sitter) -> dict[str, float]:
    """no_atomics_flip: mean FLIP of 16 samples without atomics against 16 with; layers_flip: of 16
    other samples with. Names with _hair: over the pixels that hair covers.
    """
    layers = accumulated(sitter, 0)
    other = accumulated(sitter, SAMPLES)
    choose_image_atomics("never")
    hashed = accumulated(sitter, 0)
    choose_image_atomics("automatic")
    exposure = 0.8 / np.quantile(layers[..., :3].max(axis=-1), 0.97)
    seen = [
        srgb_encoded(np.clip(exposure * each[..., :3], 0.0, 1.0))
        for each in (layers, hashed, other)
    ]
    SHEET.parent.mkdir(exist_ok=True)
    opaque = [np.dstack([each, np.ones(each.shape[:2])]).astype(np.float32) for each in seen]
    write_png(SHEET, contact_sheet(opaque, len(opaque)))
    hair, found = hair_mask(sitter), {}
    for name, picture in (("no_atomics_flip", seen[1]), ("layers_flip", seen[2])):
        errors = flip_map(seen[0], picture)
        found |= {name: float(errors.mean()), f"{name}_hair": float(errors[hair].mean())}
    return found


def flip_map(one: Floats, other: Floats) -> Floats:
    errors, *_ = flip_evaluator.evaluate(one, other, "LDR", applyMagma=False)
    return np.asarray(errors)[..., 0]


def hair_mask(sitter: Sitter) -> Any:
    """A mask of the pixels that hair, without the head, covers in part."""
    bald = replace(shown(sitter, "layers"), meshes=())
    return render_image(bald, sitter.camera, SIZE, SIZE, 1)[..., 3] > 0.0


def accumulated(sitter: Sitter, first: int) -> Floats:
    """The mean of SAMPLES samples, from this one on, as the render engine takes them."""
    passes, hair, total = (MeshPass(), StrandPass()), shown(sitter, "layers"), np.zeros(1)
    places = jitters(first + SAMPLES, 1.5)
    for number in range(first, first + SAMPLES):
        moved = jittered(sitter.camera, places[number], SIZE, SIZE, number)
        total = total + render_image(hair, moved, SIZE, SIZE, 1, passes=passes)
    return total / SAMPLES


def map_figures(sitter: Sitter) -> dict[str, float]:
    """deep_difference: largest difference of a channel of opaque strands, lit through the maps, in
    1/255 of the brightest.
    """
    pictures = []
    for choice in ("automatic", "never"):
        choose_image_atomics(choice)
        pictures.append(render_image(shown(sitter, "none"), sitter.camera, SIZE, SIZE, 2)[..., :3])
    choose_image_atomics("automatic")
    off = np.abs(pictures[0] - pictures[1]).max() / pictures[0].max()
    return {"deep_difference": float(255.0 * off)}


def cost_figures() -> dict[str, float]:
    """hashed_cost: minimum time of a frame over that with layers; they take turns."""
    width, height = 800, 600
    camera, ball = _ball(width, height)
    snapshots = {
        method: replace(ball, strand_settings=StrandSettings(transparency=method))
        for method in ("layers", "hashed")
    }
    target, color = _target(width, height)
    passes, times = (
        {method: StrandPass() for method in snapshots},
        {method: [] for method in snapshots},
    )
    for _ in range(ROUNDS + 1):
        for method, own in snapshots.items():
            begin = time.perf_counter()
            with drawing_into(target):
                target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
                passes[method].draw(own, camera, width, height)
            color.read()
            times[method].append(time.perf_counter() - begin)
    layers, hashed = (min(own[1:]) for own in times.values())
    return {"hashed_cost": hashed / layers}


if __name__ == "__main__":
    sys.exit(main())
