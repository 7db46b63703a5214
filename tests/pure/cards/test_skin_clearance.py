"""Where cards on a ball begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hair_ball import ball_mesh

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.skin_clearance import lift_roots, raise_between_rows
from hairloom.addon.cards.strip import CardFrames, Strips, UncutCards, strip_mesh
from hairloom.addon.strands import Surface

WIDTH = 0.2


def card(start: float, end: float, row_count: int = 7, column_count: int = 2):
    """A card over the top of a ball of radius 1, at these heights above its centre."""
    rows = np.linspace(0.0, 1.0, row_count)
    center = np.stack([0.6 * rows, 0.0 * rows, start + (end - start) * rows], axis=1)[None]
    side, normal = (
        np.broadcast_to(np.float32(way), center.shape) for way in ([0, 1, 0], [0, 0, 1])
    )
    tangent = np.broadcast_to(np.float32([1.0, 0.0, 0.0]), center.shape)
    frames = CardFrames(center.astype(np.float32), tangent, normal, -side)
    one = np.zeros(1, np.int32)
    strips = Strips(frames, np.full((1, row_count), WIDTH, np.float32))
    cards = UncutCards(strips, one + 20, one, one, one, AtlasGrid())
    return strip_mesh([(one, strips)], cards, column_count, CardSettings(bend=0.0))


def heights(mesh) -> np.ndarray:
    return np.linalg.norm(mesh.positions, axis=1) - 1.0


def test_roots_under_the_skin_are_lifted_onto_it() -> None:
    head, mesh = Surface(*ball_mesh(96)), card(0.95, 1.1)
    found = lift_roots(mesh, head, WIDTH)
    first = mesh.along < 0.1
    assert heights(mesh)[first].max() < -0.03
    # a ball of triangles is a little smaller than the ball
    assert np.abs(heights(found)[first]).max() < 0.008
    np.testing.assert_array_equal(
        found.positions[mesh.along > 0.3], mesh.positions[mesh.along > 0.3]
    )
    np.testing.assert_allclose(
        found.positions[first][:, :2], mesh.positions[first][:, :2], atol=0.02
    )


def test_roots_on_the_skin_or_far_inside_are_not_moved() -> None:
    head = Surface(*ball_mesh(48))
    for mesh in (card(1.05, 1.2), card(0.4, 0.5)):
        np.testing.assert_array_equal(lift_roots(mesh, head, WIDTH).positions, mesh.positions)
    mesh = card(0.95, 1.1)
    assert lift_roots(mesh, None, WIDTH) is mesh
    assert lift_roots(mesh, replace(head, triangles=head.triangles[:0]), WIDTH) is mesh


def test_a_card_of_few_rows_does_not_run_through_the_skin() -> None:
    """A card with one row at each end of a chord through the ball is raised in between as well."""
    head = Surface(*ball_mesh(96))
    mesh = card(1.0, 0.8, row_count=2, column_count=1)
    found = raise_between_rows(mesh, head, WIDTH)
    assert lowest_inside(mesh) < -0.04
    assert lowest_inside(found) > -0.01
    # raised no farther than it lay too low
    assert np.linalg.norm(found.positions - mesh.positions, axis=1).max() < 0.07


def test_rows_above_the_skin_or_far_inside_are_not_raised() -> None:
    head = Surface(*ball_mesh(48))
    for mesh in (card(1.1, 1.0), card(0.4, 0.3)):
        np.testing.assert_array_equal(
            raise_between_rows(mesh, head, WIDTH).positions, mesh.positions
        )
    mesh = card(1.0, 0.8)
    assert raise_between_rows(mesh, None, WIDTH) is mesh


def lowest_inside(mesh) -> float:
    """The lowest height of the triangles above the ball, sampled on edges and inside."""
    weights = np.array([[x, y, 4 - x - y] for x in range(5) for y in range(5 - x)]) / 4.0
    places = np.einsum("pk,tki->tpi", weights, mesh.positions[mesh.triangles])
    return float(np.linalg.norm(places, axis=-1).min()) - 1.0
