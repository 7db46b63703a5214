"""Cards that ride are led out of colliders, and keep their lengths and widths."""

from __future__ import annotations

import numpy as np
import pytest
from guide_cards import build_cards

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.contacts import CardClearance, CardContacts
from hairloom.addon.cards.follow import CardBinding, bind_cards, carried_cards, follow_guides
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.refine.lead_out import TOLERANCE

RADIUS, LENGTH, CVS, KEPT = 0.1, 0.15, 16, 0.001
BALL = (PosedCollider(SphereCollider(np.zeros(3), RADIUS), np.eye(4), np.eye(4)),)


def cards_on_a_ball(count: int = 40, sink: float = 0.0) -> tuple[CardMesh, np.ndarray]:
    """Cards that stand on the upper half of a ball about the origin, and their guides.

    Args:
        sink: how deep their roots are in it [m].
    """
    number = np.arange(count) + 0.5
    height, angle = 1.0 - number / count, 2.4 * number
    round_ = np.sqrt(1.0 - height * height)
    out = np.stack([round_ * np.cos(angle), round_ * np.sin(angle), height], axis=1)
    along = RADIUS - sink + 1e-4 + np.linspace(0.0, LENGTH, CVS)
    guides = (out[:, None] * along[None, :, None]).astype(np.float32)
    across = np.cross(out, [0.3, 0.5, 0.1])
    mesh = build_cards(guides, across.astype(np.float32), CardSettings())
    return mesh, guides


def fallen(guides: np.ndarray, by: float) -> np.ndarray:
    """Guides turned about their roots and x."""
    turn = np.eye(3)
    turn[1:, 1:] = [[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]]
    roots = guides[:, :1]
    return ((guides - roots) @ turn.T + roots).astype(np.float32)


def bound(mesh: CardMesh, guides: np.ndarray) -> tuple[CardBinding, np.ndarray, CardContacts]:
    """The cards bound to their guides, the turns of roots (none), and their contacts with BALL."""
    count = len(guides)
    own, turns = np.arange(count)[:, None], np.tile(np.eye(3), (count, 1, 1))
    cards = bind_cards(mesh, guides, own, np.ones((count, 1), np.float32))
    carried = carried_cards(cards, guides, turns)
    clearance = CardClearance.measure(*carried, cards.row_of_vertex, cards.offsets, BALL, KEPT)
    return cards, turns, CardContacts(BALL, clearance)


def depths(points: np.ndarray) -> np.ndarray:
    """Depth in the ball, by formula [m]."""
    return RADIUS - np.linalg.norm(points.astype(np.float64), axis=1)


@pytest.mark.parametrize("by", [-2.6, -1.7, 1.9, 3.0])
def test_no_vertex_is_in_a_sphere_collider(by: float) -> None:
    mesh, guides = cards_on_a_ball()
    cards, turns, contacts = bound(mesh, guides)
    now = fallen(guides, by)
    assert depths(follow_guides(cards, now, turns).positions).max() > 0.05
    led = follow_guides(cards, now, turns, contacts)
    allowed = np.maximum(depths(mesh.positions), 0.0) + 0.01 * KEPT
    assert (depths(led.positions) <= allowed).all()


@pytest.mark.parametrize("by", [-2.6, 1.9])
def test_lengths_and_widths_are_kept(by: float) -> None:
    mesh, guides = cards_on_a_ball()
    cards, turns, contacts = bound(mesh, guides)
    led = follow_guides(cards, fallen(guides, by), turns, contacts)
    middle = ~cards.arms.any(axis=0)
    lines = (mesh.positions[middle], led.positions[middle])
    before, after = (np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines)
    within = np.diff(cards.card_of_row[cards.row_of_vertex[middle]]) == 0
    np.testing.assert_allclose(after[within], before[within], rtol=1e-4)
    middles = np.zeros_like(cards.spine)
    middles[cards.row_of_vertex[middle]] = led.positions[middle]
    arms = np.linalg.norm(led.positions - middles[cards.row_of_vertex], axis=1)
    np.testing.assert_allclose(arms, np.linalg.norm(cards.arms, axis=0), rtol=1e-4, atol=1e-8)


def test_rows_bend_by_a_right_angle_at_most() -> None:
    """The extreme is a row that falls on the ball edge first: half of it lies down, half stands
    up."""
    mesh, guides = cards_on_a_ball()
    cards, turns, contacts = bound(mesh, guides)
    led = follow_guides(cards, fallen(guides, 1.9), turns, contacts)
    order = np.lexsort((mesh.uv[:, 0], cards.row_of_vertex))
    bends = []
    for points in (mesh.positions, led.positions):
        rows = points[order].reshape(-1, CardSettings().column_count + 1, 3)
        halves = rows[:, 1] - rows[:, 0], rows[:, 2] - rows[:, 1]
        one, other = (half / np.linalg.norm(half, axis=1, keepdims=True) for half in halves)
        bends.append(np.arccos(np.clip((one * other).sum(axis=1), -1.0, 1.0)))
    assert (bends[1] - bends[0]).max() < 0.5 * np.pi
    assert np.quantile(bends[1] - bends[0], 0.5) < 0.1


def test_normals_and_tangents_turn_with_their_rows() -> None:
    mesh, guides = cards_on_a_ball()
    cards, turns, contacts = bound(mesh, guides)
    led = follow_guides(cards, fallen(guides, 1.9), turns, contacts)
    for vectors in (led.normal, led.tangent):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, atol=1e-5)
    order = np.lexsort((mesh.uv[:, 0], cards.row_of_vertex))
    rows = led.positions[order].reshape(-1, CardSettings().column_count + 1, 3)
    at_rest = mesh.positions[order].reshape(rows.shape)
    # the angle between a normal and the direction across the card stays as at rest
    for half, one, other in ((0, 0, 1), (2, 1, 2)):
        found = []
        for points, normal in ((rows, led.normal), (at_rest, mesh.normal)):
            across = points[:, other] - points[:, one]
            across /= np.linalg.norm(across, axis=1, keepdims=True)
            found.append((across * normal[order].reshape(rows.shape)[:, half]).sum(axis=1))
        np.testing.assert_allclose(found[0], found[1], atol=2e-3)


def test_vertices_that_began_inside_get_no_deeper() -> None:
    mesh, guides = cards_on_a_ball(sink=0.01)
    before = depths(mesh.positions)
    assert (before > 0.005).sum() == len(guides)
    cards, turns, contacts = bound(mesh, guides)
    for by in (-1.8, 0.6, 2.2):
        led = follow_guides(cards, fallen(guides, by), turns, contacts)
        assert (depths(led.positions) <= np.maximum(before, 0.0) + TOLERANCE * KEPT).all()


def test_cards_far_from_colliders_are_not_moved() -> None:
    mesh, guides = cards_on_a_ball()
    cards, turns, contacts = bound(mesh, guides)
    now = fallen(guides, 0.05)
    riding, led = (follow_guides(cards, now, turns, each) for each in (None, contacts))
    np.testing.assert_array_equal(riding.positions, led.positions)
    np.testing.assert_array_equal(riding.normal, led.normal)
    assert follow_guides(cards, guides, turns, contacts) is mesh


def test_cards_are_led_out_alike_in_any_order_of_frames() -> None:
    """Frames give the same in any order, as a bake needs: none depends on the one before."""
    mesh, guides = cards_on_a_ball()
    cards, turns, contacts = bound(mesh, guides)
    frames = [fallen(guides, by) for by in (0.4, 1.9, -2.0)]
    one, other = (
        [follow_guides(cards, now, turns, contacts).positions for now in order]
        for order in (frames, frames[::-1])
    )
    for here, there in zip(one, other[::-1], strict=True):
        np.testing.assert_array_equal(here, there)


def test_a_card_of_one_row_moves_with_its_root() -> None:
    """A mesh whose `along` is all 0 has one row per card: nothing is led out, and all is finite."""
    mesh, guides = cards_on_a_ball(3)
    flat = CardMesh(**{**vars(mesh), "along": np.zeros_like(mesh.along)})
    cards, turns, contacts = bound(flat, guides)
    led = follow_guides(cards, fallen(guides, 1.9), turns, contacts)
    assert np.isfinite(led.positions).all()
    assert len(cards.offsets) == 4 and (np.diff(cards.offsets) == 2).all()


def test_shells_are_led_out_like_cards() -> None:
    """A patch of skin on top of the ball with its layers, whose guide falls over."""
    side, layers = np.linspace(-0.01, 0.01, 3), 5
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    heights = np.sqrt(RADIUS**2 - x * x - y * y) + np.linspace(1e-4, 0.05, layers)[:, None]
    count = heights.size
    corners = np.array([0, 1, 3, 4])[:, None]
    squares = (corners[:, None] + [[0, 1, 4], [0, 4, 3]]).reshape(-1, 3)
    triangles = (squares[None] + 9 * np.arange(layers)[:, None, None]).reshape(-1, 3)
    patch = CardMesh(
        positions=np.stack([np.tile(x, layers), np.tile(y, layers), heights.ravel()], axis=1),
        triangles=triangles,
        uv=np.tile(np.stack([x, y], axis=1) * 50.0 + 0.5, (layers, 1)),
        normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
        tangent=np.tile([0.0, 0.0, 1.0], (count, 1)),
        occlusion=np.ones(count),
        card=np.zeros(len(triangles), int),
        along=np.repeat(np.linspace(0.0, 1.0, layers), 9),
    )
    guides = np.zeros((1, CVS, 3), np.float32)
    guides[0, :, 2] = RADIUS + np.linspace(1e-4, 0.05, CVS)
    cards, turns, contacts = bound(patch, guides)
    now = fallen(guides, 1.8)
    assert depths(follow_guides(cards, now, turns).positions).max() > 0.01
    led = follow_guides(cards, now, turns, contacts).positions
    assert depths(led).max() <= max(depths(patch.positions).max(), 0.0) + 0.01 * KEPT
    arms = np.linalg.norm((led.reshape(layers, 9, 3) - led.reshape(layers, 9, 3)[:, 4:5]), axis=2)
    np.testing.assert_allclose(arms.ravel(), np.linalg.norm(cards.arms, axis=0), rtol=1e-4)
