"""Hair over the pictures of EEVEE and Cycles, and its blur by the camera, beside Cycles.

The sample scene, its hair composited by *Hairloom Hair*. Where neither hair nor its shadow is, the
picture must equal the engine's own; where our depth of a mesh and the engine's disagree, hair is
cut off wrongly. Depth of field and motion blur are compared by the coverage of each pixel by the
same strands, with the same widths. For the parts environment and soft_shadows see their modules.

Exit code 1: a limit is missed.

make bench NAME=picture
tools/bench.py picture eevee environment      some parts
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import flip_evaluator
import numpy as np
import OpenImageIO as oiio
from _picture_environment import environment
from _picture_soft_shadows import soft_shadows
from _report import measured, report, start

import hairloom
from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.setup.sample_scene import add_sample_scene

REFERENCE = "the engine without hair; Cycles with the same curves"
WIDTH, HEIGHT = 960, 720
#: few, since everything runs on the CPU here
ENGINE_SAMPLES, HAIR_SAMPLES, BLUR_SAMPLES = 8, 8, 64
ENGINES = {"eevee": "BLENDER_EEVEE", "cycles": "CYCLES"}
#: relative tolerance of depths, and size of the pictures of blur [pixels]
DEPTH_TOLERANCE, BLUR_SIZE = 0.01, 320
#: size of a picture that is not timed [percent]
WARMING_UP = 10
#: figure -> upper limit
MAX_LIMITS = {
    **{f"over_{engine}_depth_mismatch_percent": 0.1 for engine in ENGINES},
    **{f"over_{engine}_outside_difference": 0.0 for engine in ENGINES},
    "over_eevee_seconds_ratio": 1.0,
    "dof_flip": 0.05,
    "motion_flip": 0.05,
    "environment_flip_hair": 0.15,
    "environment_light_percent": 10.0,
    "soft_shadow_rms": 0.02,
}

type Passes = dict[str, np.ndarray]


def empty_file() -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Scene, "hairloom"):
        hairloom.register()


def scene_with_hair() -> tuple[Any, Any]:
    empty_file()
    scene, hair = run_parts(add_sample_scene(()))
    bpy.context.window.scene = scene
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.hairloom.picture.samples = HAIR_SAMPLES
    scene.cycles.samples = scene.eevee.taa_render_samples = ENGINE_SAMPLES
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    for layer in scene.view_layers:
        layer.use_pass_z = True
    return scene, hair


def rendered(scene: Any) -> tuple[Passes, float]:
    """Passes by name, (height, width, channels), and the seconds that it took."""
    settings = scene.render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    with tempfile.TemporaryDirectory(prefix="hairloom") as folder:
        path = Path(folder) / "picture.exr"
        scene.render.filepath = str(path)
        began = time.monotonic()
        bpy.ops.render.render(write_still=True, scene=scene.name)
        seconds = time.monotonic() - began
        return _passes_in(path), seconds


def _passes_in(path: Path) -> Passes:
    """Passes by name; the composited one replaces the rendered one."""
    found: Passes = {}
    file, number = oiio.ImageInput.open(str(path)), 0
    while file.seek_subimage(number, 0):
        spec = file.spec()
        layer, _, name = spec.channelnames[0].rpartition(".")[0].rpartition(".")
        if name not in found or layer == "Composite":
            found[name] = file.read_image(number, 0, 0, spec.nchannels, "float")
        number += 1
    file.close()
    return found


@contextmanager
def without(hair: Any) -> Iterator[None]:
    hair.hide_render = True
    try:
        yield
    finally:
        hair.hide_render = False


def over(name: str) -> dict[str, Any]:
    """outside_difference: largest difference of a pixel without hair and shadow.
    depth_mismatch_percent: pixels where our depth of meshes and the engine's disagree.
    seconds_ratio: time of a frame over 1.5 times the engine's own plus that of hair alone.
    """
    scene, hair = scene_with_hair()
    scene.render.engine = ENGINES[name]
    scene.hairloom.use_hair_scene = True
    scene.render.resolution_percentage = WARMING_UP
    rendered(scene)  # shaders are compiled once
    scene.render.resolution_percentage = 100
    scene.hairloom.use_hair_scene = False
    with without(hair):
        bald, engine_seconds = rendered(scene)
    scene.hairloom.use_hair_scene = True
    hair_scene = scene.hairloom.hair_scene
    hair_scene.view_layers[0].use_pass_z = True
    shown, seconds = rendered(scene)
    alone, hair_seconds = rendered(hair_scene)
    with without(hair):
        meshes, _ = rendered(hair_scene)
    is_free = (alone["Combined"][..., 3] == 0.0) & (alone["Hair Shadow"] == 1.0).all(axis=2)
    difference = np.abs(shown["Combined"] - bald["Combined"])[is_free]
    ours, theirs = (each["Depth"][..., 0] for each in (meshes, bald))
    near = np.minimum(ours, theirs)
    is_off = np.abs(ours - theirs) > DEPTH_TOLERANCE * near
    return {
        f"over_{name}_free_percent": 100.0 * float(is_free.mean()),
        f"over_{name}_outside_difference": float(difference.max()),
        f"over_{name}_depth_mismatch_percent": 100.0 * float(is_off.mean()),
        f"over_{name}_seconds": seconds,
        f"over_{name}_engine_seconds": engine_seconds,
        f"over_{name}_hair_seconds": hair_seconds,
        f"over_{name}_seconds_ratio": seconds / (1.5 * engine_seconds + hair_seconds),
    }


def blur() -> dict[str, Any]:
    """Mean FLIP of the coverage of strands, over the pixels where either engine has hair."""
    scene, hair = scene_with_hair()
    scene.render.resolution_x = scene.render.resolution_y = BLUR_SIZE
    scene.render.film_transparent = True
    scene.hairloom.picture.samples = scene.cycles.samples = BLUR_SAMPLES
    scene.hairloom.picture.motion_steps = BLUR_SAMPLES // 2
    groom = hair.data.hairloom
    groom.widths.method, groom.children.method, groom.strands.tip_width = "own", "none", 1.0
    next(each for each in scene.objects if each.type == "MESH").hide_render = True
    found = {"sharp_flip": _cover_flip(scene)}
    dof = scene.camera.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 0.5, 0.6
    found["dof_flip"] = _cover_flip(scene)
    dof.use_dof = False
    scene.render.use_motion_blur = True
    scene.frame_set(10)
    found["motion_flip"] = _cover_flip(scene)
    return found


def _cover_flip(scene: Any) -> float:
    covers = []
    for engine in ("CYCLES", "HAIRLOOM"):
        scene.render.engine = engine
        passes, _ = rendered(scene)
        covers.append(np.repeat(passes["Combined"][..., 3:], 3, axis=2).clip(0.0, 1.0))
    found, _, _ = flip_evaluator.evaluate(*covers, "LDR", applyMagma=False)
    has_hair = np.maximum(*covers)[..., 0] > 0.0
    return float(np.asarray(found).reshape(has_hair.shape)[has_hair].mean())


def main() -> int:
    start()
    parts = {name: partial(over, name) for name in ENGINES}
    parts |= {"blur": blur, "environment": environment, "soft_shadows": _soft_shadows}
    return report(measured(parts, sys.argv[1:]), REFERENCE, max_limits=MAX_LIMITS)


def _soft_shadows() -> dict[str, Any]:
    empty_file()
    return soft_shadows(rendered)


if __name__ == "__main__":
    sys.exit(main())
