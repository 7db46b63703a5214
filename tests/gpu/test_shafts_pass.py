"""Shafts of light in the shaders against the reference in Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.shafts import light_shafts, lights_on_screen
from hairloom.addon.shading.shafts_settings import ShaftSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

WIDTH, HEIGHT, SAMPLES = 150, 110, 2
ON = ShaftSettings(use_shafts=True, strength=0.8, tint=(0.5, 0.9, 1.0))
CAMERA = Camera(
    look_at((0.0, -2.0, 0.0), (0.0, 0.0, 0.0)),
    perspective(np.radians(40.0), WIDTH / HEIGHT, 0.1, 10.0),
)
LIGHTS = {
    "ahead": Light.sun((0.0, -1.0, 0.0), (1.0, 1.0, 1.0), 4.0),
    "aside": Light.sun((0.1, -1.0, 0.15), (1.0, 0.9, 0.8), 4.0),
    "outside": Light.sun((0.5, -1.0, -0.3), (1.0, 0.9, 0.8), 9.0),
    "point": Light.point((-0.2, 0.5, 0.3), (1.0, 0.5, 0.2), 200.0),
    "on the border": Light.point((0.0, 0.0, 2.0 * np.tan(np.radians(20.0))), (1, 1, 1), 200.0),
}

type Scene = tuple[np.ndarray, np.ndarray, np.ndarray]


@pytest.fixture
def scene() -> Scene:
    """Random strokes: colour (h, w, 4) and depth (h, w) of samples, and the averaged picture."""
    random = np.random.default_rng(8)
    height, width = HEIGHT * SAMPLES, WIDTH * SAMPLES
    drawn, depth = np.zeros((height, width, 4), np.float32), np.ones((height, width), np.float32)
    for _ in range(80):
        row, column = random.integers(height), random.integers(width)
        place = slice(row, row + 3), slice(column, column + 60)
        drawn[place] = (*(0.3 * random.random(3)), random.choice([0.4, 1.0]))
        depth[place] = random.choice([*random.uniform(0.9, 0.99, 4), 1.0])
    blocks = drawn.reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES, 4)
    return drawn, depth, blocks.mean(axis=(1, 3))


def caster(drawn: np.ndarray, depth: np.ndarray, limit: float) -> np.ndarray:
    covered = np.where((depth < limit) | (depth >= 1.0), drawn[..., 3], 0.0)
    return covered.reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES).mean(axis=(1, 3))


@pytest.fixture
def shafts(gpu_context: Any) -> Callable[..., np.ndarray]:
    """The picture of a scene after the pass."""
    from hairloom.addon.render.shafts_pass import add_shafts
    from hairloom.addon.render.textures import texture_from, texture_to_array

    def run(scene: Scene, camera: Camera, lights: list[Light], settings: ShaftSettings) -> Any:
        drawn, depth, picture = scene
        textures = [texture_from(picture, "RGBA32F"), texture_from(drawn, "RGBA32F")]
        textures.append(texture_from(depth[..., None], "R32F"))
        add_shafts(*textures, camera, lights, settings)
        return texture_to_array(textures[0])

    return run


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("samples", [40, 256])
def test_the_shaders_are_the_reference(
    shafts: Callable[..., np.ndarray], scene: Scene, light: Light, samples: int
) -> None:
    settings = replace(ON, samples=samples)
    drawn, depth, picture = scene
    seen = lights_on_screen([light], CAMERA.view, CAMERA.projection, WIDTH, HEIGHT, settings)
    assert len(seen) == 1
    covered = caster(drawn, depth, seen[0].depth)
    expected = light_shafts(picture, covered, np.zeros_like(covered), seen, samples)
    assert np.abs(expected - picture).max() > 0.05
    found = shafts(scene, CAMERA, [light], settings)
    assert np.abs(found - expected).max() < 1e-3
    assert np.array_equal(found[..., 3], picture[..., 3])


def test_a_background_comes_under_what_was_drawn_over_nothing(
    gpu_context: Any, scene: Scene
) -> None:
    from hairloom.addon.render.shafts_pass import put_under
    from hairloom.addon.render.textures import texture_from, texture_to_array

    texture, background = texture_from(scene[2], "RGBA32F"), (0.1, 0.2, 0.3, 0.5)
    put_under(texture, background)
    expected = scene[2] + (1.0 - scene[2][..., 3:]) * np.array(background)
    assert texture_to_array(texture) == pytest.approx(expected, abs=1e-6)


def test_lights_add_up(shafts: Callable[..., np.ndarray], scene: Scene) -> None:
    picture, pair = scene[2], [LIGHTS["aside"], LIGHTS["point"]]
    both = shafts(scene, CAMERA, pair, ON) - picture
    apart = sum(shafts(scene, CAMERA, [light], ON) - picture for light in pair)
    assert both == pytest.approx(apart, abs=1e-5)


@pytest.mark.parametrize(
    ("camera", "lights", "settings"),
    [
        (CAMERA, [], ON),
        (CAMERA, [LIGHTS["ahead"]], replace(ON, use_shafts=False)),
        (CAMERA, [LIGHTS["ahead"]], replace(ON, length=0.0)),
        (CAMERA, [LIGHTS["ahead"]], replace(ON, strength=0.0)),
        (CAMERA, [Light.sun((0.0, 1.0, 0.0), (1, 1, 1), 4.0)], ON),
        (CAMERA, [Light.point((0.0, -2.5, 0.1), (1, 1, 1), 90.0)], ON),
        (Camera(CAMERA.view, orthographic(1.0, 1.0, 0.0, 5.0)), [LIGHTS["ahead"]], ON),
    ],
    ids=["no light", "off", "no length", "no strength", "sun behind", "point behind", "flat"],
)
def test_where_there_are_no_shafts_the_picture_stays_as_it_is(
    shafts: Callable[..., np.ndarray],
    scene: Scene,
    camera: Camera,
    lights: list[Light],
    settings: ShaftSettings,
) -> None:
    assert np.array_equal(shafts(scene, camera, lights, settings), scene[2])
