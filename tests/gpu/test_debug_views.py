"""The debug views: colours for detail factors, guides and groups, and for states of dynamics."""

from __future__ import annotations

import colorsys
import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from hair_ball import ball_mesh
from tiers import few_in_commits

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
)
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.refine.detail import PictureView, detail_factors
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.refine.smooth import points_at
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.hair_ball import HairBall
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

#: every strand in its own pieces, none culled
BARE = DetailSettings(culling="none", lod_size=0.0)
#: a ball that hides nothing in these pictures, but needs the culling program
OCCLUDER_SPHERES = np.array([[3.0, 3.0, 3.0, 0.1]], np.float32)


@pytest.fixture(scope="module")
def front() -> Any:
    """An orthographic camera that shows x and z from -0.5 to 0.5 and looks along +y."""
    return Camera(look_at((0, -1, 0), (0, 0, 0)), orthographic(1.0, 1.0, 0.1, 9.0))


def snapshot_of(strands: np.ndarray, detail: DetailSettings, **more: Any) -> Any:
    radius = np.full(strands.shape[:2], 5e-4, np.float32)
    return Snapshot(strands, radius, detail=detail, **more)


def chromaticity(pixel: np.ndarray) -> np.ndarray:
    return pixel[:3] / pixel[:3].max()


@pytest.mark.parametrize("occluder_spheres", [None, OCCLUDER_SPHERES], ids=["plain", "computed"])
def test_the_detail_view_shows_factors_by_colour(
    frame: Any, front: Any, occluder_spheres: np.ndarray | None
) -> None:
    """From blue for 1 piece through green for 8 to red for 64."""
    strands = np.zeros((1, 3, 3), np.float32)
    strands[0, :, 2] = [-0.4, 0.0, 0.4]
    settings = StrandSettings(fullness=60.0, tip_width=1.0)
    for pieces, expected in ((1, [0.0, 0.04, 1.0]), (8, [0.02, 1.0, 0.0]), (64, [1.0, 0.0, 0.0])):
        detail = DetailSettings(mode="fixed", subdivisions=pieces)
        snapshot = snapshot_of(
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
    """With straight and bent segments, more than the factors of one texel."""
    strand = np.zeros((1, 25, 3), np.float32)
    strand[0, :, 2] = np.linspace(-0.45, 0.45, 25)
    strand[0, 20:, 0] = 0.02 * np.array([1, 0, 1, 0, 1])
    detail = dataclasses.replace(BARE, error=0.1)
    snapshot = snapshot_of(
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
        snapshot = snapshot_of(strands, BARE, strand_settings=settings, **more)
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


def hue_of(pixel: np.ndarray) -> float:
    return colorsys.rgb_to_hsv(*(float(each) for each in pixel[:3]))[0]


def upright_strands(count: int, cv_count: int) -> np.ndarray:
    """Upright strands side by side across the picture, (count, cv_count, 3)."""
    strands = np.zeros((count, cv_count, 3), np.float32)
    strands[..., 0] = (np.arange(count)[:, None] + 0.5) / count - 0.5
    strands[..., 2] = np.linspace(-0.4, 0.4, cv_count)
    return strands


WIDE = StrandSettings(fullness=60.0, tip_width=1.0)


def test_stretch_is_red_where_segments_are_longer_and_blue_where_they_are_shorter(
    frame: Any, front: Any
) -> None:
    """The middle segment of three in each strand has changed its length."""
    changes = np.array([-0.02, -0.01, -0.005, 0.0, 0.005, 0.01, 0.02, 0.5])
    strands = upright_strands(len(changes), 4)
    rest = strands.copy()
    rest[:, 2:, 2] -= (strands[:, 2, 2] - strands[:, 1, 2])[:, None] * (
        1.0 - 1.0 / (1.0 + changes)
    )[:, None]

    def shown(**more: Any) -> np.ndarray:
        snapshot = snapshot_of(strands, BARE, strand_settings=WIDE, debug_view="stretch", **more)
        picture = frame.render_image(snapshot, front, 80, 80, 1)
        return np.array(
            [
                [chromaticity(picture[row, 5 + 10 * place]) for place in range(len(changes))]
                for row in (18, 40, 61)
            ]
        )

    root, middle, tip = shown(rest=rest)
    grey = [1.0, 1.0, 1.0]
    for plain in (*root, *tip, middle[3], *shown()[1]):
        assert plain == pytest.approx(grey, abs=0.01)
    red = middle[4:, 0] - middle[4:, 2]
    blue = middle[:3, 2] - middle[:3, 0]
    assert red == pytest.approx([red[0], 0.95, 0.95, 0.95], abs=0.02) and 0.3 < red[0] < 0.8
    assert blue == pytest.approx([0.95, 0.95, blue[2]], abs=0.02) and 0.3 < blue[2] < 0.8


@pytest.mark.parametrize(
    ("kind", "error"),
    few_in_commits(map(pytest.param, ("capsule and ball", "ball", "field"), (0.01, 0.01, 0.15))),
)
def test_depth_is_the_distance_from_colliders(
    frame: Any, front: Any, kind: str, error: float
) -> None:
    """Against the formula of a ball; a distance field samples it in cells."""
    strands = upright_strands(20, 9)
    center, radius = np.array([-0.1, 0.0, 0.0]), 0.25
    posed = np.eye(4)
    posed[:3, 3] = center
    ball = SphereCollider((0.0, 0.0, 0.0), radius)
    far = CapsuleCollider((0.0, 5.0, 0.0), (0.0, 5.0, 1.0), 0.1)
    solids: tuple[Collider, ...] = (far, ball) if kind == "capsule and ball" else (ball,)
    if kind == "field":
        mesh = Surface(*ball_mesh(64, radius))
        solids = (DistanceField.from_surface(mesh, DynamicsSettings()),)
    snapshot = snapshot_of(
        strands,
        BARE,
        strand_settings=WIDE,
        debug_view="depth",
        solids=tuple(PosedCollider(solid, posed, posed) for solid in solids),
    )
    picture = frame.render_image(snapshot, front, 200, 200, 1)
    size = 0.02 * HairBall().ball(snapshot).radius
    found, expected = [], []
    for place in range(20):
        for row in range(30, 170, 7):
            point = np.array([strands[place, 0, 0], 0.0, (row + 0.5) / 200.0 - 0.5])
            away = (np.linalg.norm(point - center) - radius) / size
            inside, outside = 0.16 * (1.0 - min(-away, 1.0)), 0.33 + 0.33 * min(away / 10.0, 1.0)
            if abs(away) > 0.05:  # nearer, the hue jumps
                expected.append(inside if away < 0.0 else outside)
                found.append(hue_of(picture[row, 5 + 10 * place]))
    apart = np.abs(np.array(found) - expected)
    apart = np.minimum(apart, 1.0 - apart)  # red is both 0 and 1
    assert np.ptp(expected) > 0.6 and apart.max() < error


def test_without_colliders_depth_is_grey(frame: Any, front: Any) -> None:
    snapshot = snapshot_of(upright_strands(4, 3), BARE, strand_settings=WIDE, debug_view="depth")
    pixel = frame.render_image(snapshot, front, 80, 80, 1)[40, 10]
    assert pixel[:3].max() > 0.1 and chromaticity(pixel) == pytest.approx([1.0, 1.0, 1.0], abs=0.01)
