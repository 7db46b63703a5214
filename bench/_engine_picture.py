"""How far a picture of few samples is from one of many, and from that of another process."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import flip_evaluator
import numpy as np
from _engine_stage import build_stage, read_picture, shown_picture

WIDTH, HEIGHT, FEW, MANY = 128, 128, 64, 1024
TOOLS = Path(__file__).resolve().parents[1] / "tools"
#: renders a file in a process of its own, as a farm does
FARM = """
import sys
sys.path.insert(0, {tools!r})
from extension_loader import load_package
import bpy
load_package().register()
bpy.ops.wm.open_mainfile(filepath={file!r})
bpy.ops.render.render(write_still=True)
"""


def picture_figures() -> dict[str, float]:
    """accumulation_flip: mean FLIP of 64 samples against 1,024; accumulation_flip_1: of one sample.
    background_difference: largest difference of the picture of another process, in 1/255;
    run_difference: of a second render in this one.
    """
    scene = build_stage(WIDTH, HEIGHT, FEW)
    one, few, again, many = (shown_picture(scene, n) for n in (1, FEW, FEW, MANY))
    return {
        "accumulation_flip": flip(many, few),
        "accumulation_flip_1": flip(many, one),
        "run_difference": difference(few, again),
        "background_difference": difference(few, _from_another_process()),
    }


def flip(reference: np.ndarray, picture: np.ndarray) -> float:
    """Mean error (Andersson et al. 2020) of pictures (height, width, 3) in 0 to 1."""
    _, mean, _ = flip_evaluator.evaluate(reference, picture, "LDR")
    return float(mean)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """The largest difference of a channel, in 1/255."""
    return float(255.0 * np.abs(one - other).max())


def _from_another_process() -> np.ndarray:
    scene = bpy.context.scene
    scene.hairloom.picture.samples = FEW
    with tempfile.TemporaryDirectory(prefix="hairloom") as folder:
        picture, file = Path(folder) / "picture.png", Path(folder) / "scene.blend"
        scene.render.filepath = str(picture)
        bpy.ops.wm.save_as_mainfile(filepath=str(file))
        script = FARM.format(tools=str(TOOLS), file=str(file))
        subprocess.run([sys.executable, "-c", script], check=True, capture_output=True)
        return read_picture(picture)
