"""Found widths against figures of a human head: 120,000 hairs of 0.08 mm on 600 cm2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.groom.widths import Widths, with_widths
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.clean import clean

AREA = 0.06  # [m2]
LENGTH = 0.25  # [m]


def head_of_hair(count: int, factor: float = 1.0, *, has_widths: bool = False) -> StrandSet:
    """Strands with roots on half a sphere, evenly spread (Fibonacci's spiral)."""
    height = (np.arange(count) + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - height**2)
    normal = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    root = normal * np.sqrt(AREA / (2.0 * np.pi))
    # they hang, as hair does
    along = np.linspace(0.0, LENGTH, 4)[:, None] * np.array([0.0, 0.0, -1.0])
    points = (root[:, None] + along).reshape(-1, 3) * factor
    return StrandSet(
        points,
        np.arange(count + 1) * 4,
        np.full(4 * count, 4e-5),
        np.zeros(count),
        has_widths=has_widths,
    )


def width(strands: StrandSet) -> float:
    found, widths = with_widths(strands)
    assert widths.is_found
    np.testing.assert_allclose(np.median(found.radius) * 2.0, widths.median, rtol=1e-6)
    return widths.median


@pytest.mark.slow(instead="test_widths_that_cannot_be_hair_are_found")
def test_all_hairs_of_a_head_are_hairs() -> None:
    all_of_them = with_widths(head_of_hair(120_000))[1]
    assert all_of_them.median == pytest.approx(8e-5, rel=0.05)
    assert all_of_them.hairs == pytest.approx(1.0, rel=0.05)
    assert with_widths(head_of_hair(12_000))[1].hairs == pytest.approx(10.0, rel=0.05)


@pytest.mark.alike
@pytest.mark.parametrize("factor", [1e-3, 0.05, 1e3])
def test_no_unit_of_length_is_assumed(factor: float) -> None:
    one, other = head_of_hair(3000), head_of_hair(3000, factor)
    assert width(other) == pytest.approx(width(one) * factor, rel=1e-3)
    assert with_widths(other)[1].extinction == pytest.approx(with_widths(one)[1].extinction)


def test_few_strands_take_as_much_light_as_many() -> None:
    taken = []
    for count in (2000, 20_000, 40_000):
        strands, widths = with_widths(head_of_hair(count))
        spacing = np.sqrt(AREA / count)
        wide = 2.0 * np.percentile(strands.radius, 95.0)  # some are isolated by chance
        assert wide <= 0.25 * spacing * 1.3, "a quarter of the spacing"
        taken.append(count * 2.0 * strands.radius.mean() * widths.extinction)
    np.testing.assert_allclose(taken, taken[-1], rtol=0.06)


def test_a_part_of_a_groom_is_as_wide_as_all_of_it_even_where_it_lies_deep() -> None:
    """A ponytail: strands from a disk that fill a volume, most of them deep inside."""
    rng, count = np.random.default_rng(2), 30_000
    root = np.sqrt(rng.random((count, 1))) * 0.02
    turn = rng.random((count, 1)) * 2.0 * np.pi
    root = np.concatenate([root * np.cos(turn), root * np.sin(turn), np.zeros((count, 1))], axis=1)
    tip = root * 2.0 + rng.random((count, 3)) * np.array([0.0, 0.0, 0.3])
    points = root[:, None] + np.linspace(0.0, 1.0, 4)[:, None] * (tip - root)[:, None]
    all_of_it = StrandSet(
        points.reshape(-1, 3),
        np.arange(count + 1) * 4,
        np.full(4 * count, 4e-5),
        np.zeros(count),
        has_widths=False,
    )
    part = all_of_it.take(np.sort(rng.permutation(count)[: count // 10]))
    taken = [each.strand_count * with_widths(each, "found")[1].median for each in (part, all_of_it)]
    np.testing.assert_allclose(taken[0], taken[1], rtol=0.15)


def test_hairs_fill_the_space_between_strands_that_are_found_to_stand_for_them() -> None:
    for factor in (1e-3, 1.0, 1e3):
        widths = with_widths(head_of_hair(5000, factor))[1]
        assert widths.spacing == pytest.approx(np.sqrt(AREA / 5000) * factor, rel=0.3)
    assert with_widths(head_of_hair(5000), "own")[1].spacing == 0.0
    assert Widths.of(np.array(widths.numbers), widths.reason) == widths
    of_old_bake = Widths.of(np.array(widths.numbers[:4]), widths.reason)
    assert of_old_bake == replace(widths, spacing=0.0)


def test_own_widths_are_kept_where_they_can_be_hair() -> None:
    strands = head_of_hair(20_000, has_widths=True)
    own = replace(strands, radius=np.full(strands.point_count, 1e-4))
    kept, widths = with_widths(own)
    assert kept is own and not widths.is_found and widths.extinction == 1.0
    assert "as the groom has them" in widths.line
    for method, is_found in (("own", False), ("found", True)):
        assert with_widths(own, method)[1].is_found == is_found


def test_own_widths_of_strands_that_are_pointed_at_both_ends_are_kept() -> None:
    strands = head_of_hair(20_000, has_widths=True)
    place = np.linspace(0.0, 1.0, strands.point_count // 20_000)
    spindle = np.tile(1e-4 * np.sin(np.pi * place), 20_000)
    own = clean(strands.points, strands.offsets, radius=spindle).strands
    kept, widths = with_widths(own)
    assert kept is own and not widths.is_found


@pytest.mark.alike
@pytest.mark.parametrize(("radius", "why"), [(4e-6, "bald"), (0.5, "bury"), (5e-3, "bury")])
def test_widths_that_cannot_be_hair_are_found(radius: float, why: str) -> None:
    strands = head_of_hair(10_000, has_widths=True)
    found, widths = with_widths(replace(strands, radius=np.full(strands.point_count, radius)))
    assert widths.is_found and why in widths.line
    assert np.median(found.radius) == pytest.approx(width(head_of_hair(10_000)) / 2.0)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_numbers_that_are_no_widths_are_not_known(bad: float) -> None:
    strands = head_of_hair(500)
    cleaned = clean(strands.points, strands.offsets, radius=np.full(strands.point_count, bad))
    assert not cleaned.strands.has_widths
    some = np.full((500, strands.point_count // 500), 2e-4)
    some[::2] = bad
    mixed = clean(strands.points, strands.offsets, radius=some.ravel()).strands
    assert mixed.has_widths and np.allclose(mixed.radius, 2e-4)


@pytest.mark.parametrize("count", [1, 2, 5, 300])
def test_without_any_spacing_the_length_decides(count: int) -> None:
    """One strand, or several in the same place."""
    one = head_of_hair(1)
    points = np.tile(one.points, (count, 1))
    strands = StrandSet(
        points, np.arange(count + 1) * 4, np.ones(4 * count), np.zeros(count), has_widths=False
    )
    assert 0.0 < width(strands) <= LENGTH / 15.0
    widths = with_widths(strands)[1]
    assert widths.extinction == 1.0 and "lengths alone" in widths.line


def test_tufts_have_widths() -> None:
    """Twenty strands from each of a few places, beside single ones."""
    one = head_of_hair(600)
    points = one.grid.copy()
    points[100:] -= points[100:, :1] - np.repeat(points[100::20, :1], 20, axis=0)
    points[:, 1:] += np.random.default_rng(1).normal(0.0, 0.02, points[:, 1:].shape)
    tufts = replace(one, points=points.reshape(-1, 3))
    found, widths = with_widths(tufts)
    assert np.isfinite(found.radius).all() and found.radius.min() > 0.0
    assert np.isfinite([widths.median, widths.hairs, widths.extinction]).all()


def test_no_strands_have_no_widths() -> None:
    none = head_of_hair(1).take(np.zeros(0, np.int64))
    assert with_widths(none) == (none, Widths())
