"""Hair in its own colours, against the same hair with a look of these colours."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands.face import BROWS

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE, CVS, COUNT = 48, 4, 24
RED, BLUE, GREEN = (0.6, 0.03, 0.02), (0.02, 0.05, 0.7), (0.05, 0.4, 0.06)
LIGHTS = (Light.sun((0.3, 0.9, -0.4), (1.0, 0.95, 0.9), 3.0),)
#: a look with all effects that modify the colour
VARIED = ShadingSettings(
    color_variation=0.5, grey_fraction=0.2, tip_tint=0.6, tip_color=(0.3, 0.2, 0.1)
)


def curtain(color: np.ndarray | None = None) -> dict[str, Any]:
    """Upright strands from x = 0 to 1 that do not overlap, in their own colours."""
    strands = np.zeros((COUNT, CVS, 3), np.float32)
    strands[..., 0] = ((np.arange(COUNT) + 0.5) / COUNT)[:, None]
    strands[..., 2] = np.linspace(0.0, 1.0, CVS)
    if color is not None and color.ndim == 2:
        color = np.repeat(color[:, None], CVS, axis=1)
    radius = np.full((COUNT, CVS), 0.4 / COUNT, np.float32)
    return {
        "points": strands,
        "radius": radius,
        "color": None if color is None else color.astype(np.float32),
        "seed": np.arange(COUNT),
        "lights": LIGHTS,
        "ambient": (0.3, 0.3, 0.3),
        "volume_center": np.array([0.5, 0.5, 0.5], np.float32),
    }


def drawn(
    frame: Any, parts: dict[str, Any], shading: ShadingSettings, *, passes: Any = None, **more: Any
) -> np.ndarray:
    camera = Camera(look_at((0.5, -1.0, 0.5), (0.5, 0.0, 0.5)), orthographic(1.0, 1.0, 0.0, 3.0))
    settings = StrandSettings(transparency=more.pop("transparency", "none"), tip_width=1.0)
    snapshot = Snapshot(
        **parts, shading=shading, strand_settings=settings, table_size=PREVIEW_SIZE, **more
    )
    return np.asarray(frame.render_image(snapshot, camera, SIZE, SIZE, 1, passes=passes))


def halves(left: Any, right: Any) -> np.ndarray:
    is_left = (np.arange(COUNT) < COUNT // 2)[:, None]
    return np.where(is_left, left, right)


@pytest.mark.alike
@pytest.mark.parametrize("transparency", ["none", "hashed", "layers"])
@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_hair_of_two_colours_is_drawn_as_two_looks(
    frame: Any, model: str, transparency: str
) -> None:
    """Also with variation, tints, grey strands, and scattering between strands."""
    shading = replace(VARIED, model=model)
    # opacity maps for one model, none for the other
    volume = VolumeSettings(shadows="deep" if model == "marschner" else "none")
    more = {"transparency": transparency, "volume": volume}
    found = drawn(frame, curtain(halves(RED, BLUE)), shading, **more)
    plain = curtain()
    left, right = (
        drawn(frame, plain, replace(shading, base_color=look), **more) for look in (RED, BLUE)
    )
    expected = np.concatenate([left[:, : SIZE // 2], right[:, SIZE // 2 :]], axis=1)
    np.testing.assert_allclose(found, expected, atol=1.0 / 255.0)
    red, blue = (found[:, half, :3].sum(axis=(0, 1)) for half in np.split(np.arange(SIZE), 2))
    assert red[0] > 1.2 * red[2] and blue[2] > 1.2 * blue[0], "grey and tints take the rest"


@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_strands_without_a_colour_have_the_looks(frame: Any, model: str) -> None:
    shading = replace(VARIED, model=model, base_color=GREEN)
    found = drawn(frame, curtain(halves(RED, np.nan)), shading)
    expected = drawn(frame, curtain(halves(RED, GREEN)), shading)
    np.testing.assert_allclose(found, expected, atol=1.0 / 255.0)
    plain = drawn(frame, curtain(), shading)
    np.testing.assert_array_equal(found[:, SIZE // 2 :], plain[:, SIZE // 2 :])


@pytest.mark.parametrize("transparency", ["none", "layers"])
def test_a_colour_changes_along_a_strand(frame: Any, transparency: str) -> None:
    """As a tint from root to tip: linear between the CVs."""
    shading = ShadingSettings(color_variation=0.0, primary_strength=0.0, secondary_strength=0.0)
    along = np.linspace(0.0, 1.0, CVS)[:, None]
    fading = np.array(RED) * (1.0 - along) + np.array(BLUE) * along
    found = drawn(
        frame,
        curtain(np.broadcast_to(fading, (COUNT, CVS, 3))),
        replace(shading, model="kajiya_kay"),
        transparency=transparency,
    )
    white = drawn(
        frame,
        curtain(),
        replace(shading, model="kajiya_kay", base_color=(1.0, 1.0, 1.0)),
        transparency=transparency,
    )
    height = (np.arange(SIZE) + 0.5) / SIZE
    for row in (8, 24, 40):
        base = np.array(RED) * (1.0 - height[row]) + np.array(BLUE) * height[row]
        is_hair = white[row, :, 3] > 0.3
        assert is_hair.sum() > SIZE // 3
        np.testing.assert_allclose(
            found[row, is_hair, :3], white[row, is_hair, :3] * base, atol=0.01
        )


def test_the_look_alone_and_other_colours_are_drawn_from_then_on(frame: Any) -> None:
    """With one pass: data on the GPU follows the snapshot."""
    shading = replace(VARIED, base_color=GREEN)
    red, blue, plain = curtain(halves(RED, RED)), curtain(halves(BLUE, BLUE)), curtain()
    of_look = replace(shading, color_source="look")
    passes = frame.MeshPass(), frame.StrandPass()
    order = (red, shading), (blue, shading), (red, of_look), (red, shading), (plain, shading)
    pictures = [drawn(frame, *each, passes=passes) for each in order]
    looks = RED, BLUE, GREEN, RED, GREEN
    for picture, look in zip(pictures, looks, strict=True):
        np.testing.assert_allclose(
            picture, drawn(frame, plain, replace(shading, base_color=look)), atol=1.0 / 255.0
        )


@pytest.mark.parametrize("transparency", ["hashed", "layers"])
@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_natural_brows_are_drawn_without_the_dye(frame: Any, model: str, transparency: str) -> None:
    """The left half of the strands are brows, which look like hair of their colour without
    tints."""
    dyed = replace(VARIED, model=model, base_color=BLUE, tip_tint=1.0, grey_fraction=0.0)
    natural = replace(dyed, brow_source="natural", brow_color=RED)
    group = np.where(np.arange(COUNT) < COUNT // 2, BROWS, 0)
    more = {"transparency": transparency, "volume": VolumeSettings(shadows="none")}
    found = drawn(frame, curtain() | {"group": group}, natural, **more)
    left = drawn(frame, curtain(), replace(dyed, base_color=RED, tip_tint=0.0), **more)
    right = drawn(frame, curtain(), dyed, **more)
    expected = np.concatenate([left[:, : SIZE // 2], right[:, SIZE // 2 :]], axis=1)
    np.testing.assert_allclose(found, expected, atol=1.0 / 255.0)
