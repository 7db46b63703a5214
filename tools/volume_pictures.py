"""Draws the errors of opacity maps, for docs/shading.md.

python tools/volume_pictures.py FOLDER

opacity_error.png: the mean error of T on a ball of combed hair, over the number of slices and of
deep layers. opacity_slices.png: that ball without shadows, with 15 slices, with 64, and with 16
deep layers.
"""

import importlib
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import PACKAGE, load_package
from hair_ball import ball_mesh, combed_strands
from preset_pictures import BACKDROP

STRANDS, RADIUS, SUN = 14_000, 0.003, (-0.45, -0.5, -0.8)
#: side of a picture [pixels]; what it shows from bottom to top [m]
SIZE, HEIGHT, SAMPLES = 300, 2.3, 3
WIDE, HIGH, LEFT, RIGHT, LOW, TOP = 720, 400, 70, 110, 50, 30
INK, PALE = (0.02, 0.02, 0.02), (0.75, 0.75, 0.75)
LINES = {"slices": (0.7, 0.12, 0.05), "deep": (0.03, 0.2, 0.6)}
NAMES = {"slices": "slices", "deep": "deep layers"}


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


class Chart:
    """A picture to draw lines and words into, scene-linear, row 0 at the bottom."""

    def __init__(self) -> None:
        self.pixels = np.ones((HIGH, WIDE, 4), np.float32)

    def line(
        self, start: tuple[float, float], end: tuple[float, float], color: Any, width: float
    ) -> None:
        """A line between two places [pixels], its edge a pixel soft."""
        y, x = np.mgrid[:HIGH, :WIDE] + 0.5
        along = np.subtract(end, start)
        fraction = ((x - start[0]) * along[0] + (y - start[1]) * along[1]) / max(
            along @ along, 1e-9
        )
        fraction = np.clip(fraction, 0.0, 1.0)
        distance = np.hypot(x - start[0] - fraction * along[0], y - start[1] - fraction * along[1])
        cover = np.clip(0.5 * width + 0.5 - distance, 0.0, 1.0)[..., None]
        self.pixels[..., :3] += cover * (np.array(color) - self.pixels[..., :3])

    def word(self, position: tuple[float, float], text: str, color: Any, size: int = 15) -> None:
        """A text centred on a place [pixels]."""
        # like gpu, they live inside bpy
        blf, imbuf = importlib.import_module("blf"), importlib.import_module("imbuf")
        blf.size(0, size)
        blf.color(0, 1.0, 1.0, 1.0, 1.0)
        wide, high = blf.dimensions(0, text)
        blf.position(0, round(position[0] - 0.5 * wide), round(position[1] - 0.5 * high), 0)
        page = imbuf.new((WIDE, HIGH))
        with blf.bind_imbuf(0, page):
            blf.draw_buffer(0, text)
        with page.with_buffer() as pixels:
            cover = np.array(pixels, np.float32).reshape(HIGH, WIDE, 4)[..., 3:] / 255.0
        self.pixels[..., :3] += cover * (np.array(color) - self.pixels[..., :3])


def error_chart(errors: dict[str, float]) -> Any:
    """A chart of error over the number of slices or layers, both axes logarithmic."""
    chart = Chart()
    max_error, min_error = 5.0, 0.1

    def position(count: float, error: float) -> tuple[float, float]:
        right = np.log2(count / 4.0) / np.log2(64.0)
        up = np.log2(error / min_error) / np.log2(max_error / min_error)
        return LEFT + right * (WIDE - LEFT - RIGHT), LOW + up * (HIGH - LOW - TOP)

    for error in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0):
        chart.line(position(4, error), position(256, error), PALE, 1.0)
        chart.word((LEFT - 30, position(4, error)[1]), f"{100.0 * error:g} %", INK)
    for count in (4, 8, 16, 64, 255):
        chart.word((position(count, min_error)[0], LOW - 18), str(count), INK)
    chart.line(position(4, errors["none"]), position(256, errors["none"]), INK, 2.0)
    chart.word((WIDE - 52, position(4, errors["none"])[1]), "no shadows", INK)
    for method, color in LINES.items():
        counts = sorted(int(key[len(method) :]) for key in errors if key.startswith(method))
        positions = [position(count, errors[f"{method}{count}"]) for count in counts]
        for start, end in pairwise(positions):
            chart.line(start, end, color, 2.5)
        for point in positions:
            chart.line(point, point, color, 9.0)
        chart.word((positions[-1][0] + 60, positions[-1][1]), NAMES[method], color)
    return chart.pixels


def shadow_pictures(strands: Any) -> list[Any]:
    """The ball without shadows, with few and many slices, and with deep layers."""
    settings = addon_module("parameters").ALL_SETTINGS
    frame, lights = addon_module("render.frame"), addon_module("shading.lights")
    cameras, snapshots = addon_module("render.camera"), addon_module("render.snapshot")
    skin = addon_module("strands").Surface(*ball_mesh())
    ball = replace(snapshots.MeshSnapshot.of(skin, color=(0.0, 0.0, 0.0)), specular=0.0)
    camera = cameras.Camera(
        cameras.look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        cameras.orthographic(HEIGHT, 1.0, 1.0, 9.0),
    )
    volume = settings["volume"](shadows="slices", strand_fraction=1.0)
    methods = (
        replace(volume, extinction=0.0),
        replace(volume, slices=15),
        replace(volume, slices=64),
        replace(volume, shadows="deep"),
    )
    radius = np.full(strands.shape[:2], RADIUS, np.float32)
    sun = lights.Light.sun(SUN, (1.0, 1.0, 1.0), 4.0)
    return [
        frame.render_image(
            snapshots.Snapshot(
                strands,
                radius,
                meshes=(ball,),
                lights=(sun,),
                ambient=(0.02, 0.02, 0.02),
                shading=settings["shading"](model="kajiya_kay", volume_shadow=0.0),
                volume=method,
                volume_center=np.zeros(3, np.float32),
            ),
            camera,
            SIZE,
            SIZE,
            SAMPLES,
            background=BACKDROP,
        )
        for method in methods
    ]


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    images, light = addon_module("blender.base.images"), addon_module("shading.lights").Light
    strands = combed_strands(STRANDS)
    pictures = shadow_pictures(strands)
    images.write_png(folder / "opacity_slices.png", images.contact_sheet(pictures, len(pictures)))
    errors = importlib.import_module("shadow_errors").errors
    measured = errors(strands.astype(np.float64), RADIUS, light.sun(SUN, (1.0, 1.0, 1.0), 1.0))
    images.write_png(folder / "opacity_error.png", error_chart(measured))
    print("Wrote opacity_slices.png and opacity_error.png", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
