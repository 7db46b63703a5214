"""Cards that ride on guides stay connected strips, wherever the guides go."""

from __future__ import annotations

import numpy as np
import pytest
from guide_cards import build_cards

from hairloom.addon import card_flow, motion_flow, rig_flow
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.follow import (
    CardBinding,
    bind_cards,
    card_lines,
    follow_guides,
)
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import card_of_vertex
from hairloom.addon.cards.steps import result_of
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.rig_flow import Pose
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.frames import tangents

LENGTH, CVS = 0.3, 25


def straight(count: int = 1) -> np.ndarray:
    """Guides along x; guide i begins at (0, i / 100, 0)."""
    guides = np.zeros((count, CVS, 3), np.float32)
    guides[..., 0] = np.linspace(0.0, LENGTH, CVS)
    guides[..., 1] = 0.01 * np.arange(count)[:, None]
    return guides


def flat_card(segments: int = 24, width: float = 0.02) -> CardMesh:
    """A strip along the first of these guides, its normal up."""
    along = np.repeat(np.linspace(0.0, 1.0, segments + 1), 2)
    side = np.tile([-0.5, 0.5], segments + 1) * width
    first = 2 * np.arange(segments)[:, None]
    return CardMesh(
        positions=np.stack([along * LENGTH, side, np.zeros_like(along)], axis=1),
        triangles=np.concatenate([first + [0, 2, 3], first + [0, 3, 1]]),
        uv=np.stack([np.tile([0.0, 1.0], segments + 1), along], axis=1),
        normal=np.tile([0.0, 0.0, 1.0], (len(along), 1)),
        tangent=np.tile([1.0, 0.0, 0.0], (len(along), 1)),
        occlusion=np.ones(len(along)),
        card=np.zeros(2 * segments, int),
        along=along,
    )


def bound(mesh: CardMesh, guides: np.ndarray) -> CardBinding:
    count = len(card_lines(mesh)[0])
    return bind_cards(mesh, guides, np.zeros((count, 1), int), np.ones((count, 1), np.float32))


def hair(seed: int = 3) -> tuple[CardMesh, np.ndarray, CardBinding]:
    """Curly cards with three guides each."""
    random = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 16)
    curls = np.stack([0.02 * np.cos(9 * t), 0.02 * np.sin(9 * t), 0.3 * t], axis=1)
    guides = (curls + random.normal(0.0, 0.05, (30, 1, 3))).astype(np.float32)
    outward = random.normal(size=(30, 3)).astype(np.float32)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    mesh = build_cards(guides + np.float32(0.003), outward, CardSettings())
    guide = random.integers(0, 30, (30, 3))
    weight = random.dirichlet(np.ones(3), 30).astype(np.float32)
    return mesh, guides, bind_cards(mesh, guides, guide, weight)


def turn_about(axis: str, angle: float) -> np.ndarray:
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
    return turn


def test_guides_at_rest_move_nothing() -> None:
    mesh, guides, binding = hair()
    assert follow_guides(binding, guides, np.tile(np.eye(3), (30, 1, 1))) is mesh
    # a shift too small to matter goes through the formulas
    now = follow_guides(binding, guides + np.float32(1e-8), np.tile(np.eye(3), (30, 1, 1)))
    np.testing.assert_allclose(now.positions, mesh.positions, atol=2e-7)
    np.testing.assert_allclose(now.normal, mesh.normal, atol=1e-5)
    np.testing.assert_allclose(now.tangent, mesh.tangent, atol=1e-5)
    assert now.triangles is mesh.triangles and now.uv is mesh.uv


@pytest.mark.parametrize("angle", [0.4, 2.0, np.pi])
def test_a_rigid_motion_is_exact(angle: float) -> None:
    mesh, guides, binding = hair()
    turn = turn_about("x", angle) @ turn_about("z", 0.7)
    move = np.array([0.3, -0.2, 0.1])
    now = follow_guides(binding, guides @ turn.T + move, np.tile(turn, (30, 1, 1)))
    np.testing.assert_allclose(now.positions, mesh.positions @ turn.T + move, atol=2e-6)
    np.testing.assert_allclose(now.normal, mesh.normal @ turn.T, atol=2e-4)
    np.testing.assert_allclose(now.tangent, mesh.tangent @ turn.T, atol=2e-4)


def test_a_mirrored_and_scaled_body_takes_its_cards_along() -> None:
    mesh, guides, binding = hair()
    mirror = np.diag([-2.0, 2.0, 2.0])
    now = follow_guides(binding, guides @ mirror, np.tile(mirror, (30, 1, 1)))
    np.testing.assert_allclose(now.positions, mesh.positions @ mirror, atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(now.normal, axis=1), 1.0, atol=1e-5)


@pytest.mark.parametrize("bend", [0.5 * np.pi, np.pi, 1.5 * np.pi])
def test_a_bent_guide_bends_its_card_and_shears_nothing(bend: float) -> None:
    """Against the cylinder that a card becomes when its guide is laid on a circle about y."""
    mesh, binding = flat_card(), bound(flat_card(), straight())
    radius = LENGTH / bend
    angle = np.linspace(0.0, bend, CVS)
    arc = np.stack([np.sin(angle), np.zeros(CVS), 1.0 - np.cos(angle)], axis=1) * radius
    now = follow_guides(binding, arc[None], np.eye(3)[None])
    pairs = now.positions.reshape(-1, 2, 3)
    across = pairs[:, 1] - pairs[:, 0]
    np.testing.assert_allclose(across, np.tile([0.0, 0.02, 0.0], (len(across), 1)), atol=1e-6)
    at = mesh.along * bend
    # at the ends, directions are those of chords, half a step off
    inside = (mesh.along > 0.0) & (mesh.along < 1.0)
    expected = np.stack([-np.sin(at), np.zeros_like(at), np.cos(at)], axis=1)
    np.testing.assert_allclose(now.normal[inside], expected[inside], atol=1e-3)
    tangent = np.stack([np.cos(at), np.zeros_like(at), np.sin(at)], axis=1)
    np.testing.assert_allclose(now.tangent[inside], tangent[inside], atol=1e-3)


def test_a_turned_root_twists_the_whole_card_alike() -> None:
    """The guide stays in place while its root turns about it."""
    mesh, binding = flat_card(), bound(flat_card(), straight())
    turn = turn_about("x", 1.1)
    now = follow_guides(binding, straight(), turn[None])
    np.testing.assert_allclose(now.positions, mesh.positions @ turn.T, atol=1e-6)


def test_a_helix_does_not_twist_its_card() -> None:
    """From row to row a card turns no more than its bone: nothing twists about it."""
    binding = bound(flat_card(), straight())
    t = np.linspace(0.0, 1.0, CVS)
    helix = np.stack([0.2 * t, 0.03 * np.cos(12 * t) - 0.03, 0.03 * np.sin(12 * t)], axis=1)
    now = follow_guides(binding, helix[None].astype(np.float32), np.eye(3)[None])
    pairs = now.positions.reshape(-1, 2, 3)
    across = (pairs[:, 1] - pairs[:, 0]) / 0.02
    way = tangents(helix[None])[0]
    np.testing.assert_allclose((across * way).sum(axis=1), 0.0, atol=1e-4)
    steps = np.arccos(np.clip((across[1:] * across[:-1]).sum(axis=1), -1.0, 1.0))
    bends = np.arccos(np.clip((way[1:] * way[:-1]).sum(axis=1), -1.0, 1.0))
    assert (steps <= bends + 1e-3).all()


@pytest.mark.parametrize("kind", ["a point", "folded back", "reversed"])
def test_cards_stay_finite_for_any_motion_of_guides(kind: str) -> None:
    mesh, binding = flat_card(), bound(flat_card(), straight())
    now = straight()
    if kind == "a point":
        now[:] = 0.0
    elif kind == "folded back":
        now[..., 0] = np.abs(np.linspace(-0.5, 0.5, CVS)) * LENGTH
    else:
        now[..., 0] *= -1.0
    moved = follow_guides(binding, now, np.eye(3)[None])
    for name in ("positions", "normal", "tangent"):
        assert np.isfinite(getattr(moved, name)).all()
    pairs = moved.positions.reshape(-1, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1), 0.02, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(moved.normal, axis=1), 1.0, atol=1e-5)
    assert mesh.card_count == 1


def test_cards_follow_guides_by_their_weights() -> None:
    mesh, guides = flat_card(), straight(2)
    binding = bind_cards(mesh, guides, np.array([[0, 1]]), np.float32([[0.75, 0.25]]))
    now = guides.copy()
    now[1, :, 2] += 0.04
    moved = follow_guides(binding, now, np.tile(np.eye(3), (2, 1, 1)))
    np.testing.assert_allclose(moved.positions - mesh.positions, [[0, 0, 0.01]] * 50, atol=1e-6)


def test_cards_of_a_rig_ride_as_its_strands_do() -> None:
    """Groups are independent: the cards of one stay while the guides of the other move."""
    random = np.random.default_rng(0)
    roots = np.concatenate([random.normal(0.0, 0.02, (60, 3)) + [x, 0.0, 0.0] for x in (0.0, 0.1)])
    grid = roots[:, None] + np.linspace(0.0, 0.2, 12)[None, :, None] * np.array([0.0, 0.0, -1.0])
    strands = StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(121) * 12,
        radius=np.full(120 * 12, 5e-5),
        group=np.repeat([3, 7], 60),
    )
    rig = rig_flow.prepare(strands, None, GuideSettings(guide_count=24), place="hair")
    settings = CardSettings(source="clusters", card_count=10)
    made, occlusion = AtlasSettings(source="made"), CardOcclusionSettings(rays=16)
    steps = card_flow.card_build_steps(rig, SettingsMap(settings, made, occlusion))
    mesh = result_of(steps).finest
    binding = card_flow.bound_cards(rig, mesh)
    pose = Pose(None, np.eye(4))
    guides = motion_flow.carried_guides(rig, pose)
    far = rig.strands.group[rig.guides] == 7
    guides[far, :, 1] += np.linspace(0.0, 0.05, guides.shape[1], dtype=np.float32)
    moved = card_flow.cards_at(rig, binding, pose, guides)
    owner = card_of_vertex(mesh)
    step = np.linalg.norm(moved.positions - mesh.positions, axis=1)
    assert step[mesh.group[owner] == 3].max() < 1e-6
    # straight guides turn about their roots, by this angle about x, and so do spines
    angle, middle = np.arctan2(0.05, 0.2), ~binding.arms.any(axis=0)
    roots = binding.spine[binding.offsets[:-1]][binding.card_of_row[binding.row_of_vertex]]
    turned = 2.0 * np.sin(0.5 * angle) * np.linalg.norm((mesh.positions - roots)[:, 1:], axis=1)
    moving = middle & (mesh.group[owner] == 7)
    assert step[moving] == pytest.approx(turned[moving], abs=1e-5)
    assert step[moving].max() > 0.045


def test_a_card_between_diverging_guides_keeps_its_length() -> None:
    """Two guides swing by 60 degrees to either side: their mean would be half as long."""
    mesh, guides = flat_card(), straight(2)
    binding = bind_cards(mesh, guides, np.array([[0, 1]]), np.float32([[0.5, 0.5]]))
    now = guides.copy()
    for guide, angle in enumerate((np.pi / 3, -np.pi / 3)):
        now[guide] = (guides[guide] - guides[guide, 0]) @ turn_about("y", angle).T
        now[guide] += guides[guide, 0]
    moved = follow_guides(binding, now, np.tile(np.eye(3), (2, 1, 1)))
    np.testing.assert_allclose(moved.positions, mesh.positions, atol=1e-6)


def test_a_card_of_curls_gets_longer_with_its_guide_and_stays_as_wide() -> None:
    mesh, guides = flat_card(), straight()
    room = np.full((1, guides.shape[1] - 1), 2.0, np.float32)
    one = np.zeros((1, 1), int), np.ones((1, 1), np.float32)
    longer = guides[:, :1] + (guides - guides[:, :1]) * np.float32(1.3)
    turns = np.eye(3)[None]
    stiff = follow_guides(bind_cards(mesh, guides, *one), longer, turns).positions
    curled = follow_guides(bind_cards(mesh, guides, *one, room), longer, turns).positions
    np.testing.assert_allclose(np.ptp(stiff, axis=0), np.ptp(mesh.positions, axis=0), atol=1e-6)
    expected = np.sort(np.ptp(mesh.positions, axis=0)) * [1.0, 1.0, 1.3]
    np.testing.assert_allclose(np.sort(np.ptp(curled, axis=0)), expected, atol=1e-6)


def test_vertices_without_triangles_change_no_card() -> None:
    """They belong to no card, whatever their values of `along` and UV."""
    mesh = flat_card()
    more = {
        name: np.concatenate([getattr(mesh, name), getattr(mesh, name)[20:25] + np.float32(0.2)])
        for name in ("positions", "uv", "along", "normal", "tangent", "occlusion")
    }
    more["along"] = np.concatenate([mesh.along, np.full(5, mesh.along[4])])
    loose = CardMesh(**{**vars(mesh), **more})
    now = straight() + np.linspace(0.0, 0.1, CVS, dtype=np.float32)[None, :, None]
    turns = np.eye(3)[None]
    found = follow_guides(bound(loose, straight()), now, turns).positions[: len(mesh.positions)]
    expected = follow_guides(bound(mesh, straight()), now, turns).positions
    np.testing.assert_array_equal(found, expected)


def test_a_mesh_without_cards_follows() -> None:
    mesh = flat_card()
    empty = CardMesh(**{**vars(mesh), "triangles": mesh.triangles[:0], "card": mesh.card[:0]})
    binding = bind_cards(empty, straight(), np.zeros((0, 1), int), np.zeros((0, 1), np.float32))
    assert follow_guides(binding, straight() + np.float32(0.1), np.eye(3)[None]) is empty
