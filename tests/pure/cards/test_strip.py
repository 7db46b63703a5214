"""Cards against their guides and the documented conventions."""

from __future__ import annotations

import numpy as np
import pytest
from guide_cards import build_cards

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.strip import (
    UncutCards,
    card_frames,
    guide_strips,
    mean_spacing,
    strip_mesh,
)
from hairloom.addon.errors import HairloomError


def hanging_guides(count: int = 40, cv_count: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Guides that leave a sphere along its normal and then fall; their root normals."""
    random = np.random.default_rng(1)
    normal = random.normal(size=(count, 3))
    normal[:, 2] = np.abs(normal[:, 2]) * 0.3
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, cv_count)[:, None]
    out = 0.1 + 0.06 * np.sin(np.minimum(along * np.pi, np.pi / 2))
    drop = np.array([0.0, 0.0, -0.2]) * along**2
    return (normal[:, None] * out + drop).astype(np.float32), normal.astype(np.float32)


def rows(mesh: CardMesh, values: np.ndarray, settings: CardSettings) -> np.ndarray:
    shape = (-1, settings.segment_count + 1, settings.column_count + 1, values.shape[-1])
    return values.reshape(shape)


def test_a_straight_card_is_the_rectangle_one_computes_by_hand() -> None:
    guides = np.array([[[0, 0, 0], [0, 0, -1]], [[0.1, 0, 0], [0.1, 0, -1]]], np.float32)
    outwards = np.array([[0, -1, 0], [0, -1, 0]], np.float32)
    settings = CardSettings(
        segment_count=1, column_count=1, width_factor=2.0, tip_width=0.5, bend=0.0, roundness=0.0
    )
    mesh = build_cards(guides, outwards, settings)
    # spacing 0.1, so 0.2 wide at the root and 0.1 at the tip; side = tangent x normal = -x
    expected = [[0.1, 0, 0], [-0.1, 0, 0], [0.05, 0, -1], [-0.05, 0, -1]]
    np.testing.assert_allclose(mesh.positions[:4], expected, atol=1e-6)
    np.testing.assert_array_equal(mesh.triangles[:2], [[0, 1, 3], [0, 3, 2]])
    np.testing.assert_allclose(mesh.normal[:4], np.tile([0, -1, 0], (4, 1)), atol=1e-6)
    np.testing.assert_allclose(mesh.tangent[:4], np.tile([0, 0, -1], (4, 1)), atol=1e-6)
    np.testing.assert_array_equal(mesh.card, [0, 0, 1, 1])


def test_triangles_are_seen_counter_clockwise_from_outside() -> None:
    guides, normals = hanging_guides()
    mesh = build_cards(guides, normals, CardSettings(width_factor=0.5))  # no folds in the bend
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    facing = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", facing, mesh.normal[mesh.triangles].mean(axis=1)) > 0.0).all()


def test_cards_face_away_from_the_head_where_they_hang() -> None:
    guides, normals = hanging_guides()
    settings = CardSettings()
    mesh = build_cards(guides, normals, settings)
    middle = rows(mesh, mesh.normal, settings)[:, :, 1]
    outwards = normals[:, None] * [1.0, 1.0, 0.0]
    outwards /= np.linalg.norm(outwards, axis=-1, keepdims=True)
    hanging = (middle * outwards).sum(axis=-1)[:, settings.segment_count // 2 :]
    assert hanging.min() > 0.8


def test_no_turn_of_a_whole_card_lets_it_face_the_roots_normal_more() -> None:
    """Where hair leaves the head along the normal, the rest of the card decides."""
    random = np.random.default_rng(4)
    normal = random.normal(size=(30, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, 16)[:, None]
    bent = random.normal(size=(30, 1, 3)) * np.maximum(along - 0.25, 0.0) ** 2
    guides = (normal[:, None] * (0.1 + 0.1 * along) + 0.3 * bent).astype(np.float32)
    frames = card_frames(guides, normal.astype(np.float32), 12)
    ahead, aside = (np.einsum("gri,gi->g", each, normal) for each in (frames.normal, frames.side))
    turns = np.radians(np.arange(0.0, 360.0, 5.0))[:, None]
    assert (ahead >= ahead * np.cos(turns) + aside * np.sin(turns) - 1e-4).all()
    assert ahead.min() > 0.0


def test_frames_do_not_twist() -> None:
    """Along a helix, a parallel frame turns no more between rows than the tangent does."""
    turn = np.linspace(0.0, 6.0 * np.pi, 64)
    helix = np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), -0.02 * turn], axis=-1)
    settings = CardSettings(segment_count=63, roundness=0.0, bend=0.0)
    mesh = build_cards(helix[None].astype(np.float32), np.array([[1.0, 0.0, 0.0]]), settings)
    normal = rows(mesh, mesh.normal, settings)[0, :, 1]
    tangent = rows(mesh, mesh.tangent, settings)[0, :, 1]

    def step(vectors: np.ndarray) -> np.ndarray:
        return np.arccos(np.clip((vectors[1:] * vectors[:-1]).sum(axis=-1), -1.0, 1.0))

    assert (step(normal) <= step(tangent) + 1e-4).all()
    np.testing.assert_allclose((normal * tangent).sum(axis=-1), 0.0, atol=1e-5)


def test_the_guide_runs_through_the_middle_and_the_edges_fall_back() -> None:
    guides, normals = hanging_guides()
    settings = CardSettings(segment_count=15, bend=0.25, tip_width=1.0, width_factor=3.0)
    mesh = build_cards(guides, normals, settings)
    grid = rows(mesh, mesh.positions, settings)
    np.testing.assert_allclose(grid[:, [0, -1], 1], guides[:, [0, -1]], atol=1e-6)
    chord = grid[:, :, 2] - grid[:, :, 0]
    width = 3.0 * mean_spacing(guides[:, 0])
    np.testing.assert_allclose(np.linalg.norm(chord, axis=-1), width, rtol=1e-4)
    sagitta = grid[:, :, 1] - (grid[:, :, 0] + grid[:, :, 2]) / 2.0
    np.testing.assert_allclose(np.linalg.norm(sagitta, axis=-1), 0.25 * width, rtol=1e-4)


def test_roundness_leans_normals_of_the_volume_outwards_at_the_edges() -> None:
    """By atan(roundness), towards the side of the edge."""
    guides, normals = hanging_guides()

    def of_volume(roundness: float) -> CardMesh:
        settings = CardSettings(roundness=roundness, bend=0.0, width_factor=0.5)
        strips, none = guide_strips(guides, normals, settings), np.zeros(len(guides), np.int32)
        cards = UncutCards(strips, none + 1, none, none, none, AtlasGrid(), np.zeros(3))
        return strip_mesh([(np.arange(len(strips)), strips)], cards, 2, settings)

    settings = CardSettings()
    flat, round_ = of_volume(0.0), of_volume(0.5)
    places = rows(round_, round_.positions, settings)
    across = places[:, :, 2] - places[:, :, 0]
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    one, other = (rows(each, each.normal, settings) for each in (flat, round_))
    np.testing.assert_allclose(other[:, :, 1], one[:, :, 1], atol=1e-6)
    for edge, sign in ((0, -1.0), (2, 1.0)):
        turn = np.arccos(np.clip((one[:, :, edge] * other[:, :, edge]).sum(axis=-1), -1.0, 1.0))
        is_front = (one[:, :, edge] * one[:, :, 1]).sum(axis=-1) > 0.9
        is_usual = np.isclose(turn, np.arctan(0.5), atol=1e-4)
        assert is_usual[is_front].mean() > 0.95  # the others keep the card's own normal
        leaning = ((other - one)[:, :, edge] * across).sum(axis=-1) * sign
        assert leaning[is_usual].min() > 0.0


def test_uv_runs_from_root_to_tip_within_one_column() -> None:
    guides, normals = hanging_guides(count=200)
    settings = CardSettings(atlas_columns=4, seed=7)
    mesh = build_cards(guides, normals, settings)
    uv = rows(mesh, mesh.uv, settings)
    np.testing.assert_array_equal(uv[:, 0, :, 1], 0.0)
    np.testing.assert_array_equal(uv[:, -1, :, 1], 1.0)
    assert (np.diff(uv[..., 1], axis=1) > 0.0).all()
    column = np.floor(uv[:, 0, 1, 0] * 4)
    np.testing.assert_allclose(uv[:, :, 0, 0], np.tile(column[:, None] / 4, (1, 13)), atol=1e-6)
    np.testing.assert_allclose(uv[:, :, 2, 0], uv[:, :, 0, 0] + 0.25, atol=1e-6)
    assert set(column) == {0.0, 1.0, 2.0, 3.0}
    again = build_cards(guides, normals, settings)
    np.testing.assert_array_equal(again.uv, mesh.uv)


def test_mean_spacing_on_a_lattice_and_without_neighbours() -> None:
    lattice = np.stack(np.meshgrid(*[np.arange(12.0)] * 2, [0.0]), axis=-1).reshape(-1, 3) * 0.007
    assert mean_spacing(lattice) == pytest.approx(0.007)
    assert mean_spacing(np.concatenate([lattice, lattice])) == pytest.approx(0.007)
    assert mean_spacing(np.zeros((1, 3))) == 0.0
    assert mean_spacing(np.zeros((5, 3))) == 0.0
    alone = np.linspace(0.0, 1.0, 9)[None, :, None] * np.float32([0.0, 0.0, 0.2])
    assert guide_strips(alone, np.float32([[0.0, 0.0, 1.0]]), CardSettings()).width.min() > 0.0


def test_no_guides_give_no_cards() -> None:
    mesh = build_cards(np.zeros((0, 16, 3)), np.zeros((0, 3)), CardSettings())
    assert len(mesh.triangles) == 0
    assert mesh.card_count == 0


def test_a_guide_that_is_not_finite_is_refused() -> None:
    guides, normals = hanging_guides()
    guides[3, 2] = np.nan
    with pytest.raises(HairloomError, match="not finite"):
        build_cards(guides, normals, CardSettings())


def test_straight_along_the_normal_and_folded_back_guides_survive() -> None:
    straight = np.linspace([0, 0, 0], [0, 0, 0.1], 16)
    folded = np.concatenate([straight[:8], straight[:8][::-1]])
    guides = np.stack([straight, folded]).astype(np.float32)
    mesh = build_cards(guides, np.tile([0.0, 0.0, 1.0], (2, 1)), CardSettings())
    np.testing.assert_allclose(np.linalg.norm(mesh.normal, axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(mesh.tangent, axis=1), 1.0, atol=1e-5)
