"""Cards on a ball: where they begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hair_ball import ball_mesh

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.on_skin import on_skin
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.strip import CardFrames, Strips, UncutCards, strip_mesh
from hairloom.addon.strands import Surface

WIDTH = 0.2


def card(start: float, end: float):
    """A card over the top of a ball of radius 1, at these heights above its centre."""
    rows = np.linspace(0.0, 1.0, 7)
    center = np.stack([0.6 * rows, 0.0 * rows, start + (end - start) * rows], axis=1)[None]
    side, normal = (
        np.broadcast_to(np.float32(way), center.shape) for way in ([0, 1, 0], [0, 0, 1])
    )
    tangent = np.broadcast_to(np.float32([1.0, 0.0, 0.0]), center.shape)
    frames = CardFrames(center.astype(np.float32), tangent, normal, -side)
    one = np.zeros(1, np.int32)
    strips = Strips(frames, np.full((1, 7), WIDTH, np.float32))
    cards = UncutCards(strips, one + 20, one, one, one, AtlasGrid())
    return strip_mesh([(one, strips)], cards, 2, CardSettings(bend=0.0))


def heights(mesh) -> np.ndarray:
    return np.linalg.norm(mesh.positions, axis=1) - 1.0


def test_what_begins_under_the_skin_is_put_onto_it() -> None:
    head, mesh = Surface(*ball_mesh(96)), card(0.95, 1.1)
    found = on_skin(mesh, head, WIDTH)
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


def test_what_lies_on_the_skin_or_far_within_stays() -> None:
    head = Surface(*ball_mesh(48))
    for mesh in (card(1.05, 1.2), card(0.4, 0.5)):
        np.testing.assert_array_equal(on_skin(mesh, head, WIDTH).positions, mesh.positions)
    mesh = card(0.95, 1.1)
    assert on_skin(mesh, None, WIDTH) is mesh
    assert on_skin(mesh, replace(head, triangles=head.triangles[:0]), WIDTH) is mesh
