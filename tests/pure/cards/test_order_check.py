"""Wrong pixels in pictures whose right answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sheets import VIEW, sheets

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.order_check import (
    check_views,
    visible_fragments,
    wrong_fraction,
    wrong_pixels,
)
from hairloom.addon.cards.order_views import SphereView
from hairloom.addon.strands import Surface


def wrong_fraction_of(
    mesh: CardMesh, cards: tuple[int, ...], alpha: float = 0.5, head: Surface | None = None
) -> float | None:
    """The fraction of wrong pixels if cards are drawn in this order; None if none is seen."""
    order = np.concatenate([np.flatnonzero(mesh.card == card) for card in cards])
    picture = np.full((4, 4), alpha)
    is_wrong = wrong_pixels(mesh, visible_fragments(mesh, head, VIEW, picture), order, order)
    assert len(is_wrong) in (0, 256)
    return float(is_wrong.mean()) if len(is_wrong) else None


def test_two_sheets_are_wrong_in_reversed_order_only() -> None:
    mesh = sheets((0.1, 0.2))
    assert wrong_fraction_of(mesh, (0, 1)) == 0.0
    assert wrong_fraction_of(mesh, (1, 0)) == 1.0


def test_back_faces_are_drawn_before_front_faces() -> None:
    behind, before = sheets((0.1, 0.2), (True, False)), sheets((0.1, 0.2), (False, True))
    for cards in ((0, 1), (1, 0)):
        assert wrong_fraction_of(behind, cards) == 0.0
        assert wrong_fraction_of(before, cards) == 1.0


def test_invisible_fragments_are_never_wrong() -> None:
    mesh = sheets((0.1, 0.2, 0.3))
    assert wrong_fraction_of(mesh, (2, 1, 0), alpha=1.0) == 0.0  # the nearest hides the others
    assert wrong_fraction_of(mesh, (2, 1, 0), alpha=0.003) is None
    assert wrong_fraction_of(mesh, (2, 1, 0), alpha=0.2) == 1.0
    wall = Surface(np.array([[-9, 0, -9], [9, 0, -9], [0, 0, 9]]) - [0, 0.15, 0], [[0, 1, 2]])
    assert wrong_fraction_of(mesh, (2, 1, 0), head=wall) == 1.0
    assert wrong_fraction_of(mesh, (1, 0, 2), head=wall) == 0.0  # the wrong one is behind the wall
    over = Surface(wall.positions - [0, 1.0, 0], wall.triangles)
    assert wrong_fraction_of(mesh, (2, 1, 0), head=over) is None


def test_front_faces_hide_farther_ones_that_are_drawn_later() -> None:
    """Two halves of one card have one colour, so any order of blending is right; but the depth test
    rejects the farther half after the nearer one, unless both are back faces or the farther one is
    opaque.
    """
    near_first = np.array([2, 3, 0, 1])
    picture = np.array([[1.0, 0.5]])  # along u

    def is_wrong(is_turned: bool, u_of_far: float) -> np.ndarray:
        mesh = sheets((0.1, 0.2), (is_turned, is_turned))
        u = np.repeat([u_of_far, 0.75], 4)
        mesh = replace(mesh, card=np.zeros(4), uv=np.stack([u, u], axis=1))
        seen = visible_fragments(mesh, None, VIEW, picture)
        return wrong_pixels(mesh, seen, near_first, near_first)

    assert is_wrong(False, 0.75).all()
    assert not is_wrong(True, 0.75).any()
    assert not is_wrong(False, 0.25).any()


def test_alpha_is_read_where_the_texture_says() -> None:
    """A texture whose left half is clear, its right half opaque below and 0.5 above."""
    picture = np.array([[0.0, 1.0], [0.0, 0.5]])
    mesh = sheets((0.1,))
    for distance in (np.inf, 3.0):
        view = SphereView(VIEW.middle, VIEW.radius, VIEW.direction, VIEW.size, distance)
        seen = visible_fragments(mesh, None, view, picture)
        row, column = np.divmod(seen.fragments.pixel, VIEW.size)
        assert column.min() >= VIEW.size // 2
        np.testing.assert_array_equal(seen.alpha, np.where(row < VIEW.size // 2, 1.0, 0.5))


@pytest.mark.parametrize("cards", [0, 1])
def test_nothing_to_sort_is_never_wrong(cards: int) -> None:
    mesh = sheets((0.1,) * cards) if cards else no_cards()
    assert wrong_fraction(mesh, None, view_count=3, size=32) == 0.0


def no_cards() -> CardMesh:
    none = np.zeros((0, 3))
    flat = np.zeros(0)
    return CardMesh(none, none, np.zeros((0, 2)), none, none, flat, flat, flat)


def test_views_are_from_outside_and_hold_all_cards() -> None:
    mesh = sheets((0.1, 0.9))
    for view in check_views(mesh, 9, 64):
        assert view.distance > view.radius
        x, y, _, scale = view.project(mesh.positions)
        assert (scale > 0.0).all()
        assert min(x.min(), y.min()) >= 0.0
        assert max(x.max(), y.max()) <= 64.0
