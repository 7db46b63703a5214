"""An artist's view: whether *Make Real* keeps the picture, and how long edits and jobs take.

`make_real_flip` compares the sample scene, rendered by Hairloom with default settings, with the
same scene after *Make Real*: Blender's own curves, rendered again. FLIP (Andersson et al. 2020) is
averaged over the pixels that hair changes. `make_real_seconds` is processor time.
`real_light_percent` is the relative difference in light between these curves with their material in
Cycles and the hair in Hairloom before, over all pixels of hair, for the worst channel and the worst
of three colours.

`comb_ms` is the time of a stroke on long straight hair of 20,000 children until the strands follow,
`comb_all_ms` until all strands are there, `comb_light_ms` until they have their own light,
`comb_undo_ms` that of the stroke's undo; see `_combing`.
`grow_edit_ms` is the time of an edit of the growth of 4,095 strands until these and their children
follow; see `_growing`.
`silent_seconds_max` is the longest time for which a job keeps the window from showing progress and
from handling Esc; see `_jobs`.

make bench NAME=seat                some five minutes
tools/bench.py seat comb            combing alone
tools/bench.py seat real            Make Real, and its hair in Cycles, alone
tools/bench.py seat grow            growing alone
tools/bench.py seat jobs            long jobs alone
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import bpy
import flip_evaluator
import numpy as np
from _combing import combed, styled
from _growing import edited
from _jobs import silent
from _report import measured, report, start

import hairloom
from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.setup.sample_scene import add_sample_scene
from hairloom.addon.blender.strands.make_real import make_real

REFERENCE = "the same scene before Make Real; Cycles"
MAX_LIMITS = {
    "make_real_flip": 0.05,
    "real_light_percent": 25.0,
    "comb_ms": 100.0,
    "comb_undo_ms": 100.0,
    "comb_all_ms": 1000.0,
    "grow_edit_ms": 500.0,
    "silent_seconds_max": 0.5,
}
SIZE = 480
#: also compared, without a limit: a look whose colours vary from strand to strand and along them
TINTED = {"tip_tint": 0.5, "grey_fraction": 0.1}
#: least change of a pixel that shows hair: as displayed, and in linear light
_CHANGED, _SEEN = 0.01, 0.03
#: of Make Real in Cycles: width and height of a picture, our samples, paths per pixel, bounces
CYCLES_SIZE, SAMPLES, PATHS, BOUNCES = 200, 4, 32, 64
LOOKS = "black", "brown", "blond"


def main(parts: list[str]) -> int:
    start()
    hairloom.register()
    return report(measured(PARTS, parts), REFERENCE, max_limits=MAX_LIMITS)


def _made_real_figures() -> dict[str, float]:
    found = _figures({})
    found |= {f"{name}_tinted": value for name, value in _figures(TINTED).items()}
    lights = {name: _light_in_cycles(name) for name in LOOKS}
    found |= {f"real_light_percent_{name}": value for name, value in lights.items()}
    return {**found, "real_light_percent": max(lights.values())}


def _figures(look: dict[str, float]) -> dict[str, float]:
    scene, hair = _sample("brown", SIZE)
    for name, value in look.items():
        setattr(hair.data.hairloom.shading, name, value)
    before = _picture(scene)
    began = time.process_time()
    real = _made_real(scene, hair)
    seconds = time.process_time() - began
    after = _picture(scene)
    real.hide_render = True
    is_hair = np.abs(before - _picture(scene)).max(axis=-1) > _CHANGED
    flip, _, _ = flip_evaluator.evaluate(before, after, "LDR", applyMagma=False)
    return {
        "make_real_flip": float(np.asarray(flip).reshape(is_hair.shape)[is_hair].mean()),
        "make_real_seconds": seconds,
        "strands": len(real.data.curves),
    }


def _light_in_cycles(look: str) -> float:
    """The worst channel's difference of light between Hairloom and Cycles [%]."""
    scene, hair = _sample(look, CYCLES_SIZE)
    scene.hairloom.picture.samples = SAMPLES
    ours = _picture(scene, "OPEN_EXR")
    hair.hide_render = True
    is_hair = np.abs(ours - _picture(scene, "OPEN_EXR")).max(axis=-1) > _SEEN
    _made_real(scene, hair)
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.samples, cycles.sample_clamp_indirect, cycles.use_denoising = PATHS, 0.0, False
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.glossy_bounces = cycles.transmission_bounces = BOUNCES
    ratio = _picture(scene, "OPEN_EXR")[is_hair].mean(axis=0) / ours[is_hair].mean(axis=0)
    return float(100.0 * np.abs(ratio - 1.0).max())


def _sample(look: str, size: int) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """The sample scene in this look, for pictures of this size."""
    scene, hair = run_parts(add_sample_scene((f"looks/{look}",), "light"))
    scene.render.resolution_x = scene.render.resolution_y = size
    return scene, hair


def _made_real(scene: bpy.types.Scene, hair: bpy.types.Object) -> bpy.types.Object:
    with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        ((real, _),) = run_parts(make_real([hair], scene.view_layers[0].depsgraph))
    return real


def _picture(scene: bpy.types.Scene, kind: str = "PNG") -> np.ndarray:
    """The rendered picture, (size, size, 3): as displayed, or linear light as OPEN_EXR."""
    scene.render.image_settings.file_format = kind
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture"
        scene.render.filepath, scene.render.use_file_extension = str(path), False
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(str(path), check_existing=False)
        width, height = image.size
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return np.ascontiguousarray(pixels.reshape(height, width, -1)[..., :3])


PARTS = {
    "comb": lambda: combed(styled("long_straight")),
    "grow": edited,
    "jobs": silent,
    "real": _made_real_figures,
}
sys.exit(main(sys.argv[1:]))
