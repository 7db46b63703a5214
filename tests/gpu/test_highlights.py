"""Highlights in drawn pictures of a ball of combed hair, against the reference.

tests/pure/shading/test_highlights.py explains their number and colours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hair_ball import ball_mesh, combed_strands
from tiers import few_in_commits

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import read_any_preset
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

LOOKS = Path(__file__).parents[2] / "presets" / "looks"
#: the ball is a little smaller than the picture
SIZE, HEIGHT = 160, 2.1
BLACK = (0.0, 0.0, 0.0)
FROM_THE_EYE = (0.0, 0.0, -1.0)


@pytest.fixture(scope="module")
def draw() -> Callable[..., np.ndarray]:
    """A function that draws a look on the ball, lit along a direction, (SIZE, SIZE, 4)."""
    from hairloom.addon.render import frame

    strands = combed_strands(12_000, cv_count=8, lift=0.004)
    radius = np.full(strands.shape[:2], 0.006, np.float32)
    ball = replace(MeshSnapshot.of(Surface(*ball_mesh()), color=BLACK), specular=0.0)
    camera = Camera(
        look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        orthographic(HEIGHT, 1.0, 1.0, 9.0),
    )

    def draw(shading: ShadingSettings, shines_along: tuple[float, ...]) -> np.ndarray:
        snapshot = Snapshot(
            strands,
            radius,
            meshes=(ball,),
            lights=(Light.sun(shines_along, (1.0, 1.0, 1.0), 1.0),),
            ambient=BLACK,
            shading=shading,
            volume=VolumeSettings(shadows="none"),
            strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0),
            volume_center=np.zeros(3, np.float32),
        )
        return frame.render_image(snapshot, camera, SIZE, SIZE, 3)

    return draw


def look(name: str, model: str) -> ShadingSettings:
    shipped = read_any_preset(LOOKS / f"{name}.json", ALL_SETTINGS).settings
    return replace(
        shipped, model=model, shift_noise=0.0, sparkle=0.0, color_variation=0.0, fake_scattering=0.0
    )


def highlights(picture: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """Place of each maximum, from root to tip, in degrees beyond the equator, and its colour."""
    middle = picture[:, SIZE // 2 - 8 : SIZE // 2 + 8, :3].mean(axis=1)
    smooth = np.apply_along_axis(np.convolve, 0, middle, np.full(5, 0.2), "same")
    bright = smooth.mean(axis=-1)
    inner = bright[1:-1]
    is_top = (inner > bright[:-2]) & (inner >= bright[2:]) & (inner > 0.1 * bright.max())
    row = np.flatnonzero(is_top)[::-1] + 1  # row 0 is the bottom
    height = (row + 0.5) / SIZE * HEIGHT - 0.5 * HEIGHT
    return list(zip(-np.degrees(np.arcsin(height)), smooth[row], strict=True))


@pytest.mark.parametrize("model", few_in_commits(["marschner", "kajiya_kay"]))
def test_blond_shows_two_and_black_one(draw: Any, model: str) -> None:
    (second, second_color), (first, first_color) = highlights(
        draw(look("blond", model), FROM_THE_EYE)
    )
    assert -20.0 < second < -5.0 and 3.0 < first < 10.0
    assert second_color[0] / second_color[2] > 1.3 * first_color[0] / first_color[2]
    ((place, color),) = highlights(draw(look("black", model), FROM_THE_EYE))
    assert 1.0 < place < 10.0
    assert color[0] / color[2] == pytest.approx(1.0, abs=0.25)


def test_separation_sets_where_marschners_two_lie(draw: Any) -> None:
    """R is one tilt beyond the equator, TRT two tilts before it; a pixel is 0.75 degrees."""
    blond = look("blond", "marschner")
    (second, _), (first, _) = highlights(draw(blond, FROM_THE_EYE))
    tilt = np.degrees(blond.cuticle_tilt)
    assert first == pytest.approx(tilt, abs=1.5)
    assert second == pytest.approx(-2.0 * tilt, abs=1.5)


@pytest.mark.slow
def test_the_outline_shines_against_the_light_on_blond_alone(draw: Any) -> None:
    """The third highlight, TT, is as bright as the others, with no light at the front."""
    behind = (-0.5, 0.0, 0.87)
    front = draw(look("blond", "marschner"), FROM_THE_EYE)[..., :3].max(axis=(0, 1)).mean()
    row = slice(SIZE // 2 - 20, SIZE // 2 + 20)

    def outline(name: str, **changes: float) -> np.ndarray:
        picture = draw(replace(look(name, "marschner"), **changes), behind)
        return picture[row, :, :3].mean(axis=0).max(axis=0)

    blond = outline("blond")
    assert blond.mean() > front
    assert blond[0] > 1.1 * blond[2]
    assert outline("blond", strength_tt=0.0).mean() < 0.3 * blond.mean()
    assert outline("black", strength_r=0.0).mean() < 0.03 * blond.mean()
