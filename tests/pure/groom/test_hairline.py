"""Hair gets finer at its border, where roots have neighbours on one side only."""

from __future__ import annotations

import numpy as np
import pytest
from flat_ground import children_settings, guides_at, sheet

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.children import Children, make_children
from hairloom.addon.groom.hairline import nearness_to_border
from hairloom.addon.groom.widths import with_widths
from hairloom.addon.strands import StrandSet


def strewn_grid(count: int) -> Floats:
    """Points on a square from 0 to 1, each at a random place of its own cell."""
    cell = np.stack(np.meshgrid(*[np.arange(count)] * 2), axis=-1).reshape(-1, 2)
    place = (cell + np.random.default_rng(5).random(cell.shape)) / count
    return np.pad(place, ((0, 0), (0, 1)))


ROOTS = strewn_grid(60)
#: distance of each root from the border of the square
INSIDE = np.minimum(ROOTS, 1.0 - ROOTS)[:, :2].min(axis=1)
SPACING = 1.0 / 60.0


def upright(length: float = 0.3) -> StrandSet:
    return guides_at(sheet(), ROOTS, np.tile([0.0, 0.0, length], (len(ROOTS), 1)))


def children(**values: float) -> Children:
    chosen = children_settings(strand_count=8000, **values)
    return make_children(upright(), sheet(), chosen, place="test")


def test_roots_on_a_straight_border_have_half_a_disk_around_them() -> None:
    """Against the centroid of a half disk, at 4 / (3 pi) of its radius, also by brute force."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 301), np.linspace(0.0, 1.0, 151))
    disk = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    disk = disk[np.linalg.norm(disk, axis=1) <= 1.0]
    middle = float(disk[:, 1].mean())
    assert middle == pytest.approx(4.0 / (3.0 * np.pi), abs=0.01)
    near = nearness_to_border(ROOTS, ROOTS)
    assert near[INSIDE < 0.5 * SPACING].min() > 0.4
    assert np.median(near[INSIDE < 0.5 * SPACING]) > 0.8
    inner = near[INSIDE > 4.0 * SPACING]
    assert np.median(inner) == 0.0 and inner.max() < 0.5


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_no_unit_of_length_is_assumed(factor: float) -> None:
    near = nearness_to_border(ROOTS * factor, ROOTS * factor)
    np.testing.assert_allclose(near, nearness_to_border(ROOTS, ROOTS), atol=1e-3)


def test_few_roots_and_roots_in_one_place_have_no_border() -> None:
    for roots in (np.zeros((0, 3)), ROOTS[:5], np.zeros((100, 3))):
        assert not nearness_to_border(roots, roots).any()


def test_strands_at_the_border_are_finer_than_others() -> None:
    """Their neighbours, on one side only, are farther away, which would make them wider.

    The hair is long enough for widths to depend on the coverage of a head.
    """
    found, _ = with_widths(upright(2.0), "found")
    width = 2.0 * found.radius[found.offsets[:-1]]
    inner = np.median(width[INSIDE > 4.0 * SPACING])
    assert 0.5 < np.median(width[INSIDE < 0.5 * SPACING]) / inner < 0.72


def test_found_widths_are_multiplied_by_fineness_and_own_ones_are_kept() -> None:
    strands = upright()
    fineness = np.where(np.arange(strands.strand_count) % 2, 0.5, 1.0)
    plain, _ = with_widths(strands, "found")
    finer, _ = with_widths(strands, "found", fineness=fineness)
    factor = np.repeat(fineness, strands.point_counts)
    np.testing.assert_allclose(finer.radius, plain.radius * factor, rtol=1e-6)
    own, _ = with_widths(strands, "own", fineness=fineness)
    np.testing.assert_array_equal(own.radius, strands.radius)


def test_baby_hair_grows_at_the_border_and_is_short_and_fine() -> None:
    plain, made = children().strands, children(baby_hair=0.8).strands
    np.testing.assert_array_equal(made.roots, plain.roots)
    length = made.lengths() / plain.lengths()
    is_baby = length < 0.99
    assert length[is_baby].min() > 0.039 and length[is_baby].max() < 0.31
    outer = np.minimum(made.roots, 1.0 - made.roots)[:, :2].min(axis=1)
    assert is_baby[outer < 0.5 * SPACING].mean() > 0.4
    assert is_baby[outer > 5.0 * SPACING].mean() < 0.01
    finer = made.radius[made.offsets[:-1]] / plain.radius[plain.offsets[:-1]]
    np.testing.assert_allclose(finer[is_baby], 0.5, rtol=1e-5)
    np.testing.assert_array_equal(finer[~is_baby], 1.0)


def test_baby_hair_strays_and_other_hair_does_not() -> None:
    made = children(baby_hair=0.8).strands
    chord = np.linalg.norm(made.grid[:, -1] - made.grid[:, 0], axis=1) / made.lengths()
    is_baby = made.lengths() < 0.29
    assert (chord[is_baby] < 0.9999).mean() > 0.9
    np.testing.assert_allclose(chord[~is_baby], 1.0, atol=1e-5)


def test_more_baby_hair_is_the_same_and_more() -> None:
    plain, some, more = (lengths(part) for part in (0.0, 0.3, 0.9))
    assert 0 < (some < plain).sum() < (more < plain).sum()
    assert ((more < plain) | ~(some < plain)).all()
    np.testing.assert_array_equal(more[some < plain], some[some < plain])


def lengths(baby_hair: float) -> Floats:
    return children(baby_hair=baby_hair).strands.lengths()
