"""The debug views: colours that show detail factors, guides and groups."""

from __future__ import annotations

import colorsys
import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest

from hairloom.addon.refine.detail import PictureView, detail_factors
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.refine.smooth import points_at
from hairloom.addon.shading.settings import StrandSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

#: every strand in its own pieces, none left out
BARE = DetailSettings(culling="none", lod_height=0.0)
#: a ball that hides nothing in these pictures, but has to be looked at
OCCLUDER_SPHERES = np.array([[3.0, 3.0, 3.0, 0.1]], np.float32)


@pytest.fixture(scope="module")
def front(frame: Any) -> Any:
    """An orthographic camera that shows x and z from -0.5 to 0.5 and looks along +y."""
    return frame.Camera(
        frame.look_at((0, -1, 0), (0, 0, 0)), frame.orthographic(1.0, 1.0, 0.1, 9.0)
    )


def snapshot_of(frame: Any, strands: np.ndarray, detail: DetailSettings, **more: Any) -> Any:
    radius = np.full(strands.shape[:2], 5e-4, np.float32)
    return frame.Snapshot(strands, radius, detail=detail, **more)


def chromaticity(pixel: np.ndarray) -> np.ndarray:
    return pixel[:3] / pixel[:3].max()


@pytest.mark.parametrize("occluder_spheres", [None, OCCLUDER_SPHERES], ids=["plain", "computed"])
def test_the_detail_view_shows_factors_by_colour(
    frame: Any, front: Any, occluder_spheres: np.ndarray | None
) -> None:
    """From blue for one piece over green for eight to red for sixty-four."""
    strands = np.zeros((1, 3, 3), np.float32)
    strands[0, :, 2] = [-0.4, 0.0, 0.4]
    settings = StrandSettings(fullness=60.0, tip_width=1.0)
    for pieces, expected in ((1, [0.0, 0.04, 1.0]), (8, [0.02, 1.0, 0.0]), (64, [1.0, 0.0, 0.0])):
        detail = DetailSettings(mode="fixed", subdivisions=pieces)
        snapshot = snapshot_of(
            frame,
            strands,
            detail,
            strand_settings=settings,
            debug_view="detail",
            occluder_spheres=occluder_spheres,
        )
        pixel = frame.render_image(snapshot, front, 200, 200, 1)[30, 100]
        assert pixel.max() > 0.1
        assert chromaticity(pixel) == pytest.approx(expected, abs=0.01)


def test_the_detail_view_colours_each_segment_by_its_own_factor(frame: Any, front: Any) -> None:
    """Straight segments beside bent ones, more of them than a texel has factors."""
    strand = np.zeros((1, 25, 3), np.float32)
    strand[0, :, 2] = np.linspace(-0.45, 0.45, 25)
    strand[0, 20:, 0] = 0.02 * np.array([1, 0, 1, 0, 1])
    detail = dataclasses.replace(BARE, error=0.1)
    snapshot = snapshot_of(
        frame,
        strand,
        detail,
        strand_settings=StrandSettings(fullness=20.0, tip_width=1.0),
        debug_view="detail",
    )
    picture = frame.render_image(snapshot, front, 480, 480, 1)
    view = PictureView(front.view, front.projection, 480, 480)
    factors = detail_factors(strand, view, detail)[0]
    assert factors[:18].max() == 1 and factors[20:].min() > 2
    for segment, pieces in enumerate(factors):
        middle = points_at(strand, [0], [segment], [0.5])[0]
        row, column = ((middle[[2, 0]] + 0.5) * 480).astype(int)
        hue = 0.66 * (1.0 - np.log2(pieces) / 6.0)
        expected = np.array(colorsys.hsv_to_rgb(hue, 1.0, 1.0))
        assert chromaticity(picture[row, column]) == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("name", ["guide", "group"])
def test_guides_and_groups_have_colours_of_their_own(frame: Any, front: Any, name: str) -> None:
    strands = np.zeros((8, 2, 3), np.float32)
    strands[..., 0] = (np.arange(8)[:, None] + 0.5) / 8.0 - 0.5
    strands[:, :, 2] = [-0.6, 0.6]
    numbers = np.array([0, 1, 2, 3, 0, 1, 2, 70_000])
    settings = StrandSettings(fullness=60.0, tip_width=1.0)

    def colors(**more: Any) -> np.ndarray:
        snapshot = snapshot_of(frame, strands, BARE, strand_settings=settings, **more)
        picture = frame.render_image(snapshot, front, 80, 80, 1)
        return np.array([chromaticity(picture[40, 5 + 10 * place]) for place in range(8)])

    shown = colors(debug_view=name, **{name: numbers})
    assert np.abs(shown[:3] - shown[4:7]).max() < 1e-3, "one number, one colour"
    for place, other in itertools.combinations([0, 1, 2, 3, 7], 2):
        assert np.abs(shown[place] - shown[other]).max() > 0.1
    plain = colors(debug_view=name)
    assert np.abs(plain - plain[0]).max() < 1e-3, "without numbers all are alike"


def test_the_occlusion_view_shows_it_in_grey(frame: Any, front: Any) -> None:
    strands = np.zeros((1, 3, 3), np.float32)
    strands[0, :, 2] = [-0.5, 0.0, 0.5]
    occlusion = np.array([[0.2, 0.6, 1.0]], np.float32)
    settings = StrandSettings(fullness=60.0, tip_width=1.0)
    snapshot = snapshot_of(
        frame,
        strands,
        BARE,
        strand_settings=settings,
        debug_view="occlusion",
        occlusion=occlusion,
    )
    picture = frame.render_image(snapshot, front, 200, 200, 1)
    grey = picture[[50, 100, 150], 100, :3]
    assert np.ptp(grey, axis=1).max() < 1e-3 and grey[1].max() > 0.2
    assert grey[:, 0] / grey[1, 0] == pytest.approx([2.0 / 3.0, 1.0, 4.0 / 3.0], abs=0.05)
