"""The table of a view transform: its shaper, and the look-up in the shader against Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.shading.settings import ShadingSettings, StrandSettings

#: largest error, in code values, where a GPU rounds the weights of its filter to 8 bits
FILTER_ERROR = 0.6 / 255.0


@pytest.fixture
def table(gpu_context: Any) -> Any:
    """A transform that mixes channels and is nonlinear, as view transforms are."""
    from hairloom.addon.render.display import DisplayTable, table_radiances

    mixed = table_radiances() @ np.array([[0.8, 0.1, 0.0], [0.15, 0.7, 0.2], [0.05, 0.2, 0.8]])
    return DisplayTable((mixed / (mixed + 0.4)).astype(np.float32))


def test_the_axes_reach_from_nought_past_white_with_white_on_a_texel(gpu_context: Any) -> None:
    from hairloom.addon.render.display import SIZE, shaped, table_radiances

    radiances = table_radiances()
    axis = radiances[0, 0, :, 0]
    assert axis[0] == 0.0 and axis[-1] == pytest.approx(24.40, rel=1e-3)
    assert np.abs(axis - 1.0).min() < 1e-5
    assert (shaped(axis) * (SIZE - 1)) == pytest.approx(np.arange(SIZE), abs=1e-3)
    assert radiances[3, 5, 7] == pytest.approx([axis[7], axis[5], axis[3]])
    assert shaped(np.array([-1.0, 0.0, 1e9, np.inf])) == pytest.approx([0.0, 0.0, 1.0, 1.0])


def test_what_lies_on_a_texel_is_shown_exactly(table: Any) -> None:
    from hairloom.addon.render.display import Display, table_radiances

    shown = Display(table).display_code(table_radiances())
    np.testing.assert_allclose(shown, table.codes, atol=1e-4)
    halved = Display(table, gain=2.0, gamma=2.0).display_code(0.5 * table_radiances())
    np.testing.assert_allclose(halved, np.sqrt(table.codes), atol=1e-4)


def test_another_size_of_table_is_refused(gpu_context: Any) -> None:
    from hairloom.addon.render.display import DisplayTable

    with pytest.raises(ValueError, match="display table"):
        DisplayTable(np.zeros((2, 2, 2, 3), np.float32))


RADIANCES = [
    (0.0, 0.0, 0.0),
    (0.5, 0.2, 0.05),
    (0.003, 0.002, 0.001),
    (4.0, 1.0, 0.25),
    (90.0, 0.7, 0.0),
]


@pytest.mark.parametrize(("gain", "gamma"), [(1.0, 1.0), (2.0, 1.4)])
@pytest.mark.parametrize("radiance", RADIANCES)
def test_the_shader_shows_what_the_reference_shows(
    gpu_context: Any, table: Any, radiance: tuple[float, float, float], gain: float, gamma: float
) -> None:
    """Display.shown against its twin display_code with its gamma, in the strand program itself."""
    from hairloom.addon.render.display import Display

    display = Display(table, gain, gamma)
    shown = drawn(gpu_context, radiance, display) ** (1.0 / 2.2)
    assert shown == pytest.approx(display.display_code(np.array(radiance)), abs=FILTER_ERROR)


def test_without_a_display_it_is_plain_standard(gpu_context: Any) -> None:
    shown = drawn(gpu_context, (0.5, 0.2, 2.0), None) ** (1.0 / 2.2)
    assert shown == pytest.approx([0.7354, 0.4845, 1.0], abs=1e-3)


def drawn(
    gpu_context: Any, radiance: tuple[float, float, float], display: Any
) -> np.ndarray[Any, Any]:
    """The viewport output of a strand of this radiance that fills the picture."""
    from hairloom.addon.render.camera import Camera, look_at, orthographic
    from hairloom.addon.render.snapshot import Snapshot
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import drawing_into, texture_to_array

    snapshot = Snapshot(
        np.array([[[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]], np.float32),
        np.full((1, 2), 9.0, np.float32),
        ambient=radiance,
        shading=ShadingSettings(
            model="kajiya_kay", base_color=(1.0, 1.0, 1.0), color_variation=0.0
        ),
        strand_settings=StrandSettings(tip_width=1.0),
    )
    camera = Camera(look_at((0, -1, 0), (0, 0, 0)), orthographic(1.0, 1.0, 0.0, 3.0))
    color = gpu_context.types.GPUTexture((8, 8), format="RGBA32F")
    target = gpu_context.types.GPUFrameBuffer(color_slots=(color,))
    with drawing_into(target):
        target.clear(color=(0.0, 0.0, 0.0, 0.0))
        StrandPass().draw(snapshot, camera, 8, 8, output="viewport", display=display)
    pixel: np.ndarray[Any, Any] = texture_to_array(color)[4, 4]
    assert pixel[3] == 1.0
    return pixel[:3].astype(np.float64)
