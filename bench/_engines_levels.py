"""The switch from one level of detail to the next, as three.js draws it with our module.

Cards with default settings, with their head and three suns, as large as on a screen of 1,080 lines
at the distance at which the file switches levels; two sides. FLIP (Andersson et al. 2020) is its
mean over the pixels that show hair.

- levels_pop_flip: difference of successive pictures in the middle of the band in which both levels
  are drawn, while the camera moves by a hundredth of its distance per picture; only the levels
  change, the camera's own motion is left out.
- levels_at_once_flip: difference of one level from the next, without cross-fade.
- levels_moved_flip: difference by the camera's own motion by a hundredth, with one level.
- levels_light_percent, levels_area_percent: largest relative difference of the next level in
  brightness, and in the area that it covers.

Writes out/bench_levels/NAME_N.png: level N, the next, both as they fade, and the difference.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import bpy
import flip_evaluator
import numpy as np
from _engines_plain import _export_head
from _report import chosen

import hairloom
from hairloom.addon.blender.base.images import write_png
from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.setup.sample_scene import add_sample_scene
from hairloom.addon.exchange.textures.srgb import srgb_encoded

REPOSITORY = Path(__file__).parents[1]
PAGE = REPOSITORY / "bench" / "engines" / "levels" / "index.html"
THREE = REPOSITORY / "tools" / "node" / "node_modules" / "three"
SANDBOX = str(REPOSITORY / "tools" / "window_blender")
#: a folder that the browser's sandbox sees
OUTPUT = REPOSITORY / "out" / "bench_levels"
LINES, FIELD_OF_VIEW, SIDES = 1080, 50.0, 2
#: width of a picture, as a multiple of the hair's largest extent
ROOM = 1.35
#: fraction of its distance by which the camera moves from picture to picture
STEP = 0.01
#: of the distance: two places in the middle of the band, which is a tenth of it wide
FACTORS = (1.0 - STEP / 2.0, 1.0 + STEP / 2.0)
SUNS = (((0.5, 0.6, 0.7), 2.0), ((-0.8, 0.3, 0.3), 0.7), ((0.1, 0.5, -0.9), 1.4))
AMBIENT = 1.0
#: least difference that hair makes in a pixel that shows it
SEEN = 1.0 / 255.0


def level_figures(names: list[str]) -> dict[str, Any]:
    """The worst of each figure over these grooms, or over both."""
    shutil.rmtree(OUTPUT, ignore_errors=True)
    found: dict[str, Any] = {}
    for name in chosen(names, GROOMS_OF_LEVELS):
        site = OUTPUT / name
        shutil.copytree(REPOSITORY / "docs" / "engines" / "three", site / "hairloom")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if not hasattr(bpy.types.Scene, "hairloom"):
            hairloom.register()
        GROOMS_OF_LEVELS[name](site)
        for key, value in _of(name, site).items():
            print(f"{name}_{key} {value:.4f}", flush=True)
            found[f"levels_{key}"] = max(value, found.get(f"levels_{key}", 0.0))
    return found


def _sample(site: Path) -> None:
    scene, hair = run_parts(add_sample_scene(()))
    bpy.context.window.scene = scene
    _export_head(hair.data.surface, site / "head.glb")
    verb = ["cards", "--groom", hair.name, "--output", str(site / "cards.glb")]
    assert command_line.run(verb) == 0


def _sintel(site: Path) -> None:
    folder = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data")) / "sintel"
    head = folder / "sintel.obj"
    bpy.ops.wm.obj_import(filepath=str(head))
    bpy.ops.export_scene.gltf(filepath=str(site / "head.glb"))
    strands = folder / "SintelHairOriginal-sintel_hair.16points.tfx"
    verb = ["cards", "--groom", str(strands), "--head", str(head)]
    assert command_line.run([*verb, "--output", str(site / "cards.glb")]) == 0


GROOMS_OF_LEVELS = {"sample": _sample, "sintel": _sintel}


def _of(name: str, site: Path) -> dict[str, float]:
    drawn = _drawn(site)
    max_figures: dict[str, float] = {}
    for number, switch in enumerate(drawn):
        rows = []
        for without, fine, coarse, moved, before, after in switch:
            covered = [np.abs(each - without).max(axis=-1) > SEEN for each in (fine, coarse)]
            is_hair = covered[0] | covered[1]
            figures = {
                "pop_flip": _flip(before, after, is_hair),
                "at_once_flip": _flip(fine, coarse, is_hair),
                "moved_flip": _flip(fine, moved, is_hair),
                "light_percent": 100.0 * abs(coarse[is_hair].sum() / fine[is_hair].sum() - 1.0),
                "area_percent": 100.0 * abs(covered[1].sum() / covered[0].sum() - 1.0),
            }
            max_figures = {
                key: max(float(value), max_figures.get(key, 0.0)) for key, value in figures.items()
            }
            rows.append(np.hstack([fine, coarse, after, np.abs(fine - coarse)]))
        sheet = np.vstack(rows)[::-1]
        opaque = np.dstack([sheet, np.ones_like(sheet[..., :1])])
        write_png(OUTPUT / f"{name}_{number}.png", opaque)
    return max_figures


def _drawn(site: Path) -> list[np.ndarray]:
    """The pictures of each switch: (sides, pictures, size, size, 3), linear, row 0 on top."""
    shutil.copy2(PAGE, site)
    shutil.copytree(THREE, site / "three")
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    glb = (site / "cards.glb").read_bytes()
    length = int.from_bytes(glb[12:16], "little")
    nodes = json.loads(glb[20 : 20 + length])["nodes"]
    (coverage,) = (
        node["extras"]["MSFT_screencoverage"]
        for node in nodes
        if "MSFT_screencoverage" in node.get("extras", {})
    )
    sizes = [int(ROOM * LINES * math.sqrt(each)) for each in coverage[:-1]]
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    view = {
        "sizes": sizes,
        "lines": LINES,
        "field_of_view": FIELD_OF_VIEW,
        "ways": [[math.sin(each), 0.2, math.cos(each)] for each in angles],
        "factors": FACTORS,
        "step": 1.0 + STEP,
        "suns": [{"way": direction, "irradiance": irradiance} for direction, irradiance in SUNS],
        "ambient": AMBIENT,
    }
    (site / "view.json").write_text(json.dumps(view), encoding="utf-8")
    command = [SANDBOX, "run", "python3", str(site / "draw_page.py"), "500"]
    subprocess.run([SANDBOX, "engines"], check=True)
    subprocess.run(command, check=True, timeout=560)
    halves = np.frombuffer((site / "pictures.bin").read_bytes(), np.float16).astype(np.float32)
    shapes = [(SIDES, 4 + len(FACTORS), size, size, 4) for size in sizes]
    parts = np.split(halves, np.cumsum([math.prod(shape) for shape in shapes])[:-1])
    return [
        part.reshape(shape)[..., ::-1, :, :3] for part, shape in zip(parts, shapes, strict=True)
    ]


def _flip(one: np.ndarray, other: np.ndarray, where: np.ndarray) -> float:
    shown = (srgb_encoded(np.clip(each, 0.0, 1.0)) for each in (one, other))
    pictures = [np.ascontiguousarray(each, np.float32) for each in shown]
    found, _, _ = flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False)
    return float(np.asarray(found).reshape(where.shape)[where].mean())
