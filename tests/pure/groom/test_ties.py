"""Holds of rings, balls and surfaces, against known places."""

import numpy as np
import pytest

from hairloom.addon.groom.holds import anchors_of
from hairloom.addon.groom.ties import Holders, Tie, TipSurface, find_holds, unused_holder_notes
from hairloom.addon.strands import StrandSet, Surface


def strands(*lines: list[tuple[float, float, float]]) -> StrandSet:
    counts = [len(line) for line in lines]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    points = np.concatenate([np.array(line, float) for line in lines])
    return StrandSet(points, offsets, np.full(len(points), 1e-4), np.zeros(len(lines)))


def straight(x: float = 0.0, count: int = 11) -> list[tuple[float, float, float]]:
    """A strand from z = 1 to z = 0 in equal steps."""
    return [(x, 0.0, 1.0 - z) for z in np.linspace(0.0, 1.0, count)]


def ring(z: float, radius: float = 0.5, *, ball: bool = False) -> Tie:
    shape = np.diag([radius, radius, radius, 1.0])
    shape[2, 3] = z
    return Tie("Ring", shape, ball)


def ground(size: float = 1.0, z: float = 0.0) -> Surface:
    corners = [(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)]
    return Surface(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("ball", [False, True])
def test_a_tie_holds_what_passes_through_it(ball: bool) -> None:
    """Held are a strand through the middle and one inside, not one outside or one that ends before
    it."""
    hair = strands(straight(), straight(0.4, 6), straight(0.6), straight()[:3])
    holds = find_holds(hair, Holders((ring(0.27, 0.5 if not ball else 0.45, ball=ball),)))
    assert holds is not None
    assert holds.strand.tolist() == [0, 1]
    np.testing.assert_allclose(holds.place, [7.3, 3.65], atol=1e-3)
    assert holds.anchor.tolist() == [0, 0]


def test_a_strand_is_held_where_it_passes_first() -> None:
    there = straight()
    hair = strands([*there, *[(0.1, 0.0, z) for z in (0.0, 0.5, 1.0)]])
    holds = find_holds(hair, Holders((ring(0.27),)))
    assert holds is not None
    np.testing.assert_allclose(holds.place, [7.3], atol=1e-3)


def test_no_place_is_before_the_third_point() -> None:
    """The root sets the first two points, so strands of two points are never held."""
    hair = strands(straight(), [(0.0, 0.0, 1.0), (0.0, 0.0, 0.0)], straight(count=3))
    holds = find_holds(hair, Holders((ring(0.96),)))
    assert holds is not None
    assert holds.strand.tolist() == [0, 2]
    np.testing.assert_array_equal(holds.place, [2.0, 2.0])


def test_ties_that_share_a_point_do_not_both_hold_it() -> None:
    holds = find_holds(strands(straight()), Holders((ring(0.41), ring(0.55), ring(0.12))))
    assert holds is not None
    np.testing.assert_allclose(holds.place, [4.5, 8.8], atol=1e-3)
    assert holds.anchor.tolist() == [1, 2]


def test_tips_on_a_surface_are_held() -> None:
    hair = strands(straight(), straight(0.3), straight()[:9], straight(3.0))
    surface = TipSurface("Bun", ground(z=-0.02))
    holds = find_holds(hair, Holders((ring(0.55, 0.1),), surface), 0.05)
    assert holds is not None and holds.tip_triangle is not None
    assert holds.strand.tolist() == [0, 0, 1, 2]
    np.testing.assert_allclose(holds.place, [4.5, 10.0, 10.0, 4.5], atol=1e-3)
    assert holds.anchor.tolist() == [0, 1, 2, 0]
    assert holds.held_cvs(4, 11)[0].nonzero()[0].tolist() == [4, 5, 10]


def test_strands_that_the_same_holds_are_of_one_kind() -> None:
    hair = strands(straight(), straight(0.3), straight(0.4), straight(3.0), straight(0.01))
    holds = find_holds(hair, Holders((ring(0.55, 0.1), ring(0.2, 0.35))))
    assert holds is not None
    kind = holds.kinds(5)
    assert kind[2] == kind[3] == 0
    assert kind[0] == kind[4] != 0
    assert kind[1] not in (0, kind[0])


def test_what_holds_nothing_is_named() -> None:
    hair = strands(straight())
    holders = Holders((ring(0.5), ring(5.0)), TipSurface("Bun", ground(z=-9.0)))
    holds = find_holds(hair, holders, 0.05)
    assert holds is not None
    notes = unused_holder_notes(holds, holders)
    assert len(notes) == 2
    assert "No hair passes through the tie Ring" in notes[0]
    assert "Bun" in notes[1] and "Tip Distance" in notes[1]
    assert find_holds(hair, Holders()) is None


@pytest.mark.parametrize("ball", [False, True])
def test_strange_strands_do_no_harm(ball: bool) -> None:
    """Strands of no length, folded back on themselves, and with coincident points, also at the
    tip."""
    there = straight()
    hair = strands(
        [(0.0, 0.0, 0.5)] * 5, [*there[:7], *there[6:3:-1]], [*there[:5], there[4], *there[5:]],
        [*there, there[-1]],
    )  # fmt: skip
    holds = find_holds(hair, Holders((ring(0.5, ball=ball),), TipSurface("Bun", ground())), 0.1)
    assert holds is not None
    assert np.isfinite(holds.place).all()
    assert (holds.place >= 2.0).all()
    assert (holds.place <= hair.point_counts[holds.strand] - 1.0).all()


def test_anchors_are_the_motions_of_ties_and_of_places_on_the_surface() -> None:
    hair = strands(straight(), straight(0.3))
    surface = TipSurface("Bun", ground())
    holds = find_holds(hair, Holders((ring(0.55, 0.1),), surface), 0.05)
    assert holds is not None
    tie = np.eye(4)
    tie[0, 3] = 2.0
    turned = surface.surface.positions @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + 1.0
    anchors = anchors_of(holds, tie[None], turned.astype(np.float32))
    np.testing.assert_array_equal(anchors[0], tie)
    tips = np.array([[0.0, 0.0, 0.0, 1.0], [0.3, 0.0, 0.0, 1.0]])
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", anchors[1:], tips)[:, :3], [[1, 1, 1], [1, 1.3, 1]], atol=1e-6
    )
    at_rest = anchors_of(holds, np.eye(4)[None], surface.surface.positions)
    np.testing.assert_array_equal(at_rest, np.broadcast_to(np.eye(4), (3, 4, 4)))


def test_an_anchor_that_is_gone_holds_nothing() -> None:
    hair = strands(straight(), straight(0.3))
    holds = find_holds(hair, Holders((ring(0.55, 0.1),), TipSurface("Bun", ground())), 0.1)
    assert holds is not None
    gone = anchors_of(holds, np.full((1, 4, 4), np.nan), ground().positions)
    assert holds.where(gone).strand.tolist() == [0, 1]
    assert holds.where(anchors_of(holds, np.eye(4)[None], None)).place.tolist() == [4.5]
    assert len(holds.where(None).strand) == 0
