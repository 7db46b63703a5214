"""Shafts from bright regions: the shaders against the reference, and a window in a drawn scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.bright_shafts import bright_shafts
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.shafts import shaft_length
from hairloom.addon.shading.shafts_settings import ShaftSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

WIDTH, HEIGHT = 150, 110
ON = ShaftSettings(
    use_shafts=True, source="bright", bright_strength=0.4, tint=(0.5, 0.9, 1.0), samples=200
)
VIEW = look_at((0.0, -2.0, 0.0), (0.0, 0.0, 0.0))
CAMERA = Camera(VIEW, perspective(np.radians(40.0), WIDTH / HEIGHT, 0.1, 10.0))
FLAT = Camera(VIEW, orthographic(1.5, 1.1, 0.0, 5.0))
#: nothing behind the picture
BLACK = (0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def window() -> np.ndarray:
    """A premultiplied picture: a bright window with bars behind strands of many colours and alphas,
    a lamp far from it, and a wall behind all.
    """
    random = np.random.default_rng(5)
    picture = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    picture[..., :3], picture[..., 3] = (0.08, 0.07, 0.06), 1.0
    picture[30:90, 45:110, :3] = (3.0, 4.0, 6.0)
    picture[58:61, 45:110, :3] = picture[30:90, 76:79, :3] = 0.02
    picture[15:19, 8:12, :3] = (40.0, 20.0, 5.0)
    for _ in range(60):
        row, column, alpha = random.integers(20, HEIGHT), random.integers(WIDTH), random.random()
        place = slice(row, row + 25), slice(column, column + 2)
        color = alpha * random.random(3)
        picture[place] = (1.0 - alpha) * picture[place] + np.array([*color, alpha])
    picture[100:] = 0.0  # nothing is drawn there
    return picture


@pytest.fixture
def shafts(gpu_context: Any) -> Callable[..., np.ndarray]:
    """The picture after the pass."""
    from hairloom.addon.render.bright_pass import BrightShafts, one_texel
    from hairloom.addon.render.textures import texture_from, texture_to_array

    def run(
        picture: np.ndarray,
        settings: ShaftSettings = ON,
        camera: Camera = CAMERA,
        behind: Any = BLACK,
    ) -> np.ndarray:
        texture = texture_from(picture, "RGBA32F")
        under = one_texel(behind) if isinstance(behind, tuple) else texture_from(behind, "RGBA32F")
        BrightShafts(texture, under, camera, settings).add_to(texture)
        return texture_to_array(texture)

    return run


def reference(picture: np.ndarray, settings: ShaftSettings, camera: Camera) -> np.ndarray:
    length = shaft_length(camera.projection, picture.shape[0], settings.length)
    return bright_shafts(picture, picture, length, settings)[0]


@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "flat"])
@pytest.mark.parametrize("samples", [40, 256])
def test_the_shafts_of_a_window_are_the_reference(
    shafts: Callable[..., np.ndarray], window: np.ndarray, camera: Camera, samples: int
) -> None:
    settings = replace(ON, samples=samples)
    found, expected = shafts(window, settings, camera), reference(window, settings, camera)
    assert np.abs(expected - window).max() > 0.5
    assert np.abs(found - expected).max() < 1.0 / 255.0
    assert np.array_equal(found[..., 3], window[..., 3])


def test_broken_pixels_are_the_reference_too(
    shafts: Callable[..., np.ndarray], window: np.ndarray
) -> None:
    """Except at the broken pixels themselves."""
    broken = window.copy()
    broken[70, 50:53, :3] = [[np.nan] * 3, [np.inf, 1.0, 0.0], [1e30, 1e6, -3.0]]
    found, expected = shafts(broken), reference(broken, ON, CAMERA)
    is_whole = np.abs(broken[..., :3]).max(axis=2) < 1e5
    assert is_whole.sum() == WIDTH * HEIGHT - 3
    assert np.isfinite(found[is_whole]).all()
    assert np.abs(found[is_whole] - expected[is_whole]).max() < 1.0 / 255.0


def test_a_background_throws_shafts_through_the_picture(
    shafts: Callable[..., np.ndarray], window: np.ndarray
) -> None:
    """For hair over another engine's picture, and over one colour."""
    hair = np.zeros_like(window)
    hair[40:70, 60:64] = (0.1, 0.05, 0.02, 0.7)
    length = shaft_length(CAMERA.projection, HEIGHT, ON.length)
    seen = hair + (1.0 - hair[..., 3:]) * window
    expected = bright_shafts(hair, seen, length, ON)[0]
    assert np.abs(shafts(hair, behind=window) - expected).max() < 1.0 / 255.0
    sky = np.float32([2.0, 2.0, 2.0, 1.0])
    hair[:80] = (0.1, 0.05, 0.02, 1.0)
    expected = bright_shafts(hair, hair + (1.0 - hair[..., 3:]) * sky, length, ON)[0]
    assert np.abs(expected - hair).max() > 0.1
    assert np.abs(shafts(hair, behind=tuple(sky)) - expected).max() < 1.0 / 255.0


@pytest.mark.parametrize(
    "changes",
    [
        {"use_shafts": False},
        {"source": "lights"},
        {"bright_strength": 0.0},
        {"length": 0.0},
        {"bright_threshold": 500.0},
    ],
    ids=str,
)
def test_without_bright_things_the_picture_stays_as_it_is(
    shafts: Callable[..., np.ndarray], window: np.ndarray, changes: dict[str, Any]
) -> None:
    assert np.array_equal(shafts(window, replace(ON, **changes)), window)


def test_a_white_world_stays_as_it_is(shafts: Callable[..., np.ndarray]) -> None:
    white = np.full((64, 64, 4), 4.0, np.float32)
    assert np.array_equal(shafts(white), white)


def scene(settings: ShaftSettings, emission: float = 5.0) -> Snapshot:
    """Hair before a shining window, in a room with a lamp."""
    corners = np.array([[-0.4, 0.5, -0.3], [0.4, 0.5, -0.3], [0.4, 0.5, 0.3], [-0.4, 0.5, 0.3]])
    surface = Surface(corners.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    pane = MeshSnapshot.of(surface, (0.0, 0.0, 0.0))
    random = np.random.default_rng(2)
    roots = random.uniform(-0.15, 0.15, (200, 1, 3)) * (1.0, 1.0, 0.2)
    points = roots + np.linspace(0.0, 0.3, 5)[:, None] * (0.1, 0.0, 1.0)
    return Snapshot(
        points.astype(np.float32),
        np.full(points.shape[:2], 0.002, np.float32),
        meshes=(replace(pane, emission=(emission, emission, 0.8 * emission)),),
        lights=(Light.sun((0.3, -1.0, 0.4), (1.0, 1.0, 1.0), 2.0),),
        shafts=settings,
    )


@pytest.mark.parametrize("samples", [1, 2])
def test_the_shafts_of_a_window_in_a_drawn_scene_are_the_reference(samples: int) -> None:
    """The reference is computed from the picture without shafts."""
    from hairloom.addon.render.frame import render_image

    wall = (0.05, 0.06, 0.08, 1.0)

    def drawn(settings: ShaftSettings) -> np.ndarray:
        return render_image(scene(settings), CAMERA, WIDTH, HEIGHT, samples, background=wall)

    without, found = drawn(replace(ON, use_shafts=False)), drawn(ON)
    assert (without[..., 0] > 4.9).mean() > 0.05
    expected = reference(without, ON, CAMERA)
    assert np.abs(expected - without).max() > 0.3
    assert np.abs(found - expected).max() < 1.0 / 255.0


def test_lights_and_bright_things_add_up_in_a_drawn_scene() -> None:
    """The haze of lights does not count as a bright region itself."""
    from hairloom.addon.render.frame import render_image

    strong = replace(ON, strength=5.0)
    pictures = {
        source: render_image(scene(replace(strong, source=source)), CAMERA, WIDTH, HEIGHT, 1)
        for source in ("lights", "bright", "both")
    }
    without = render_image(scene(replace(ON, use_shafts=False)), CAMERA, WIDTH, HEIGHT, 1)
    apart = pictures["lights"] + pictures["bright"] - without
    assert (pictures["lights"] - without).max() > 1.0
    assert pictures["both"] == pytest.approx(apart, abs=1e-4)


def test_a_mesh_that_shines_shows_its_light_and_one_that_does_not_is_as_before() -> None:
    from hairloom.addon.render.frame import render_image

    def drawn(emission: float) -> np.ndarray:
        return render_image(scene(ShaftSettings(), emission), CAMERA, WIDTH, HEIGHT, 1)

    dark, bright = drawn(0.0), drawn(3.0)
    is_pane = (bright - dark)[..., 0] > 2.9
    assert 0.05 < is_pane.mean() < 0.6
    median = np.median((bright - dark)[is_pane][:, :3], axis=0)
    assert median == pytest.approx([3.0, 3.0, 2.4], rel=1e-4)
