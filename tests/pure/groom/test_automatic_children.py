"""Automatic children: as many as cover a body, counted with rays through strands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon import rig_flow
from hairloom.addon.arrays import Floats
from hairloom.addon.groom.automatic_children import automatic_settings
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.face import BROWS, is_face_hair
from hairloom.addon.strands.join import join_strands

GUIDES = GuideSettings(guide_count=30, cv_count=5)
SIDE = 0.2  # [m]


def fur(across: int, length: float, factor: float = 1.0) -> StrandSet:
    """Straight strands on a square, in a slightly random grid, that lean by 60 degrees."""
    step = (np.arange(across) + 0.5) / across
    places = np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2) - 0.5
    places += np.random.default_rng(1).uniform(-0.3, 0.3, places.shape) / across
    root = np.concatenate([places * SIDE, np.zeros((len(places), 1))], axis=1)
    lean = np.array([np.sin(np.pi / 3.0), 0.0, np.cos(np.pi / 3.0)]) * length
    points = root[:, None] + np.linspace(0.0, 1.0, 5)[:, None] * lean
    count = len(root)
    return StrandSet(
        points.reshape(-1, 3) * factor,
        np.arange(count + 1) * 5,
        np.full(5 * count, 4e-5),
        np.zeros(count),
        has_widths=False,
    )


def sheet(factor: float = 1.0) -> Surface:
    """The square below, 20 x 20 fields, without UVs."""
    step = np.linspace(-SIDE / 2.0, SIDE / 2.0, 21) * factor
    x, y = np.meshgrid(step, step, indexing="xy")
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1, 1)
    triangles = (corner + np.array([0, 1, 22, 0, 22, 21])).reshape(-1, 3)
    return Surface(np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3), triangles)


def rig_of(strands: StrandSet, head: Surface | None, method: str = "auto") -> rig_flow.Rig:
    children = ChildrenSettings(method=method)
    return rig_flow.prepare(strands, head, GUIDES, place="fur", children=children, widths="auto")


def hits(rig: rig_flow.Rig, rays: int = 400) -> Floats:
    """The number of strands that random vertical rays in the middle meet, (rays,)."""
    place = np.random.default_rng(2).uniform(-0.25, 0.25, (rays, 2)) * SIDE
    grid = rig.strands.grid[..., :2].astype(np.float64)
    radius = rig.strands.radius.reshape(len(grid), -1)[:, 0]
    first, chord = grid[:, 0], grid[:, -1] - grid[:, 0]
    met = np.empty(rays)
    for ray, each in enumerate(place):
        along = ((each - first) * chord).sum(axis=1) / (chord**2).sum(axis=1)
        nearest = first + np.clip(along, 0.0, 1.0)[:, None] * chord
        met[ray] = (np.linalg.norm(each - nearest, axis=1) <= radius).sum()
    return met


@pytest.mark.parametrize(
    ("across", "length"), few_in_commits([pytest.param(32, 0.04), pytest.param(50, 0.024)])
)
def test_few_strands_get_the_children_that_cover_the_body(across: int, length: float) -> None:
    bare, covered = (
        rig_of(fur(across, length), sheet(), "none"),
        rig_of(fur(across, length), sheet()),
    )
    # sin(60 degrees): the length of leaning hair seen from above
    assert hits(covered).mean() >= 0.87 * 4.0 > hits(bare).mean()
    assert (hits(covered) == 0.0).mean() < 0.05 < (hits(bare) == 0.0).mean()
    assert f"{covered.child_count:,} added, since {across**2:,} curves" in covered.children_line
    assert covered.suggested_children_method == "none"
    assert 0 < covered.child_count < 300_000
    assert covered.notes == ()


def test_the_same_light_is_blocked_with_and_without() -> None:
    """The hair that a strand represents beyond its width becomes children or extinction."""
    blocked = []
    for method in ("none", "auto"):
        rig = rig_of(fur(32, 0.05), sheet(), method)
        area = (rig.strands.lengths() * rig.strands.radius.reshape(-1, 5)[:, 0]).sum()
        blocked.append(area * rig.widths.extinction)
    assert blocked[1] == pytest.approx(blocked[0], rel=0.1)  # children are a little shorter


@pytest.mark.slow(instead="test_few_strands_get_the_children_that_cover_the_body")
@pytest.mark.parametrize("across", [60, 120])
def test_long_hair_gets_strands_of_a_few_hairs(across: int) -> None:
    """Strands that just cover the body would look like noodles from near."""
    rig = rig_of(fur(across, 0.2), sheet())
    each = rig.widths.hairs
    assert each == pytest.approx(3.5, rel=0.1)
    assert rig.strands.strand_count * each == pytest.approx(120_000, rel=0.1)


@pytest.mark.slow
def test_enough_strands_stay_as_combed() -> None:
    full = rig_of(fur(190, 0.2), sheet())
    assert full.child_count == 0 and full.children_line == ""
    np.testing.assert_array_equal(
        full.strands.points, rig_of(fur(190, 0.2), sheet(), "none").strands.points
    )


def test_a_few_curves_may_be_anything() -> None:
    """They could be guides, fly-aways or whiskers, so the artist decides."""
    rig = rig_of(fur(30, 0.2), sheet())
    assert rig.child_count == 0 and "900 curves may be guides" in rig.children_line
    assert rig.suggested_children_method == "multi"
    assert rig_of(fur(1, 0.2), sheet()).children_line == ""


@pytest.mark.slow
def test_brows_and_lashes_get_none_and_keep_their_widths() -> None:
    """However few strands the rest of the hair has."""
    brows, widths = fur(12, 0.004, 0.2), []
    face = replace(brows, group=np.full(brows.strand_count, BROWS))
    for across in (40, 80):
        rig = rig_of(join_strands(fur(across, 0.2), face), sheet())
        is_face = is_face_hair(rig.strands.group)
        assert rig.child_count > 0 and is_face.sum() == brows.strand_count
        assert not is_face[across**2 + brows.strand_count :].any()
        widths.append(rig.strands.radius.reshape(-1, 5)[is_face])
    np.testing.assert_array_equal(*widths)
    assert 2.0 * widths[0].max() <= 0.25 * 1.3 * 0.2 * SIDE / 12


@pytest.mark.slow
def test_own_strands_come_first_and_stay() -> None:
    rig, bare = rig_of(fur(32, 0.05), sheet()), rig_of(fur(32, 0.05), sheet(), "none")
    assert rig.child_count > 0
    np.testing.assert_array_equal(rig.strands.grid[:1024], bare.strands.grid)
    np.testing.assert_array_equal(rig.guides, bare.guides)
    again = rig_of(fur(32, 0.05), sheet())
    np.testing.assert_array_equal(again.strands.points, rig.strands.points)


@pytest.mark.slow(
    instead="tests/pure/groom/test_children.py::test_children_are_the_same_at_any_scale"
)
@pytest.mark.parametrize("factor", few_in_commits([1e-3, 1e3]))
def test_no_unit_of_length_is_assumed(factor: float) -> None:
    one = rig_of(fur(32, 0.05), sheet())
    other = rig_of(fur(32, 0.05, factor), sheet(factor))
    assert one.child_count > 0
    assert other.child_count == pytest.approx(one.child_count, rel=0.01)
    assert other.widths.median == pytest.approx(one.widths.median * factor, rel=0.01)
    assert other.widths.extinction == pytest.approx(one.widths.extinction, rel=0.01)


def test_children_are_as_straight_as_their_curves() -> None:
    """Short hair does not get the frizz of long hair, and baby hair bends only a little."""
    rig = rig_of(fur(32, 0.05), sheet())
    assert rig.child_count > 0
    grid = rig.strands.grid.astype(np.float64)
    chord = np.linalg.norm(grid[:, -1] - grid[:, 0], axis=1)
    length = np.linalg.norm(np.diff(grid, axis=1), axis=2).sum(axis=1)
    assert (chord / length).min() > 0.96 and length.max() < 1.02 * 0.05


def test_a_row_of_lashes_is_left_alone() -> None:
    """Lashes cover no skin."""
    across = np.linspace(-0.015, 0.015, 1024)
    root = np.stack([across, 0.3 * across**2, 0.0 * across], axis=1)
    points = root[:, None] + np.linspace(0.0, 0.009, 5)[:, None] * np.array([0.0, 0.6, 0.8])
    lashes = StrandSet(
        points.reshape(-1, 3), np.arange(1025) * 5, np.full(5120, 4e-5), np.zeros(1024)
    )
    assert rig_of(lashes, sheet()).child_count == 0


def test_without_a_surface_the_line_says_why() -> None:
    rig = rig_of(fur(32, 0.05), None)
    assert rig.child_count == 0 and "no surface" in rig.children_line and rig.notes == ()
    assert rig.suggested_children_method == ""
    assert rig_of(fur(190, 0.2), None).children_line == ""


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_curves_are_drawn_alone(count: int) -> None:
    assert rig_of(fur(2, 0.5).take(np.arange(count)), sheet()).child_count == 0


@pytest.mark.parametrize(("across", "spacings"), [(32, 2.0), (40, 6.0), (150, 6.0)])
def test_there_is_an_end_to_them(across: int, spacings: float) -> None:
    strands = fur(across, spacings * SIDE / across)
    settings, parts = automatic_settings(strands, ChildrenSettings())
    assert settings.strand_count + across**2 <= 300_001
    assert 1.0 < parts <= 300_000 / across**2


def test_all_in_one_place_is_left_alone() -> None:
    values: dict[str, Any] = {"offsets": np.arange(1025) * 5, "radius": np.full(5120, 4e-5)}
    tuft = StrandSet(np.tile(fur(1, 0.05).points, (1024, 1)), group=np.zeros(1024), **values)
    assert rig_of(tuft, sheet()).child_count == 0
