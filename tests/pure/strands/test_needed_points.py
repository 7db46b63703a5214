"""As many points as strands need: shapes are kept, tested by brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.needed_points import (
    MAX_DEVIATION,
    MAX_LENGTH_LOSS,
    MAX_POINTS,
    with_needed_points,
)


def coil(turns: float, count: int) -> Floats:
    """A coil of 25 cm along -Z with a radius of 8 mm."""
    along = np.linspace(0.0, 1.0, count)
    angle = 2.0 * np.pi * turns * along
    return np.stack([0.008 * np.cos(angle), 0.008 * np.sin(angle), -0.25 * along], axis=1)


def ragged(*strands: Floats) -> StrandSet:
    offsets = np.concatenate([[0], np.cumsum([len(strand) for strand in strands])])
    count = int(offsets[-1])
    return StrandSet(
        np.concatenate(strands),
        offsets,
        np.linspace(1e-4, 2e-4, count),
        np.arange(len(strands)),
        color=np.linspace(0.0, 1.0, 3 * count).reshape(-1, 3),
    )


def away_from(points: Floats, line: Floats) -> Floats:
    """The distance of each point from a polyline, by brute force."""
    start, step = line[:-1], np.diff(line, axis=0)
    part = ((points[:, None] - start) * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-30)
    closest = start + np.clip(part, 0.0, 1.0)[..., None] * step
    return np.linalg.norm(points[:, None] - closest, axis=2).min(axis=1)


def test_no_strand_loses_length_or_strays() -> None:
    strands = ragged(*(coil(turns, 2000) for turns in (0, 0.3, 1, 2, 4, 6, 8)))
    found = with_needed_points(strands, 16)
    stray = MAX_DEVIATION * float(np.median(strands.lengths()))
    assert (found.lengths() >= (1.0 - MAX_LENGTH_LOSS) * strands.lengths()).all()
    for before, after in zip(strands.iter_strands(), found.iter_strands(), strict=True):
        assert away_from(before[::10].astype(np.float64), after.astype(np.float64)).max() <= stray
        assert np.array_equal(before[[0, -1]], after[[0, -1]])
    counts = found.point_counts
    assert counts[0] == 16 and counts[-1] > 100 and (np.diff(counts) >= 0).all()
    assert np.array_equal(found.group, strands.group), "in their order"


def test_points_are_hardly_more_than_a_circle_needs() -> None:
    """A chord over the angle a of a circle strays by 1 - cos(a / 2) of the radius, and is shorter
    by a^2 / 24."""
    strand = ragged(coil(6, 4000))
    (count,) = with_needed_points(strand, 16).point_counts.tolist()
    length = float(strand.lengths()[0])
    radius = (length / (2.0 * np.pi * 6.0)) ** 2 / 0.008
    turned = min(
        2.0 * np.arccos(1.0 - MAX_DEVIATION * length / radius), np.sqrt(24.0 * MAX_LENGTH_LOSS)
    )
    min_count = length / radius / turned
    assert min_count < count < 1.3 * min_count + 1


def test_few_points_stay_and_get_more_between_them() -> None:
    random = np.random.default_rng(1)
    walks = [random.normal(size=(count, 3)).cumsum(axis=0) for count in (2, 3, 4, 7, 15)]
    strands = ragged(*walks)
    found = with_needed_points(strands, 16)
    assert (found.point_counts == 16).all()
    assert found.lengths() == pytest.approx(strands.lengths(), rel=1e-5)
    for before, after in zip(strands.iter_strands(), found.iter_strands(), strict=True):
        gap = np.linalg.norm(before[:, None] - after[None], axis=2).min(axis=1)
        assert (gap == 0.0).all()
    assert found.color is not None and found.color.shape == (80, 3)
    assert found.radius[::16] == pytest.approx(strands.radius[strands.offsets[:-1]])


def test_kinks_that_even_points_would_miss_keep_their_points() -> None:
    zigzag = np.zeros((40, 3))
    zigzag[:, 2] = np.linspace(0.0, 0.25, 40) ** 1.5
    zigzag[:, 0] = 0.01 * (np.arange(40) % 2)
    strands = ragged(zigzag)
    found = with_needed_points(strands, 16)
    assert np.array_equal(found.points, strands.points)


def test_a_coil_of_twenty_turns_keeps_its_length() -> None:
    """With any number of input points; resampling a polyline of few points would put new ones on
    its chords, inside the curve."""
    for count in (400, 1000, 5000):
        strands = ragged(coil(20, count))
        kept = with_needed_points(strands, 16).lengths() / strands.lengths()
        assert kept.min() >= 1.0 - MAX_LENGTH_LOSS


def test_no_strand_has_more_than_the_most() -> None:
    found = with_needed_points(ragged(coil(60, 5000), coil(0, 30)), 16)
    assert found.point_counts.tolist() == [MAX_POINTS, 16]


def test_sixteen_points_are_the_same_object() -> None:
    strands = ragged(coil(1, 16), coil(3, 16))
    assert with_needed_points(strands, 16) is strands


def test_points_that_coincide_and_no_strands() -> None:
    still = np.zeros((3, 3))
    doubled = coil(1, 30)
    doubled[5] = doubled[4]
    found = with_needed_points(ragged(still, doubled, np.zeros((40, 3))), 16)
    assert np.isfinite(found.points).all()
    assert found.point_counts.min() >= 16
    none = ragged(coil(0, 2)).take(np.zeros(0, np.int64))
    assert with_needed_points(replace(none), 16).strand_count == 0
