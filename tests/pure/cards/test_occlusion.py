"""Ambient occlusion against brute force, known values and formulas, and within its time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from guide_cards import build_cards
from spheres import globe

from hairloom.addon.cards.card_mesh import VERTEX_FIELDS, CardMesh
from hairloom.addon.cards.occlusion import (
    CardOccluder,
    diagonal_of,
    evenly_spread_axes,
    vertex_occlusion,
)
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.strands import Surface

RADIUS = 0.1


def hanging(count: int, seed: int = 1, layers: float = 0.02, **changed: object) -> CardMesh:
    """Cards that hang down the sides of a ball, some over others, up to `layers` [m] deep."""
    random = np.random.default_rng(seed)
    out = random.normal(size=(count, 3)) * [1.0, 1.0, 0.4]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, 9)[:, None]
    way = out[:, None] * (RADIUS + 0.003 + layers * random.random((count, 1, 1)))
    guides = way * (1.0 + 0.15 * np.sin(along * np.pi)) + along * [0.0, 0.0, -0.12]
    settings = CardSettings(**{"segment_count": 6, "column_count": 2, **changed})  # type: ignore[arg-type]
    return build_cards(guides.astype(np.float32), out.astype(np.float32), settings)


def sheet(
    height: float, size: float, card: int = 0, facing: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """A square of two triangles at this height, (4, 3) and (2, 3)."""
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size
    positions = np.concatenate([corner, np.full((4, 1), height)], axis=1)
    return positions.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32) + 4 * card


def stacked(heights: list[float], size: float = 1.0) -> CardMesh:
    """Squares over each other, a card each, that look upwards; uv runs from corner to corner."""
    parts = [sheet(height, size, card) for card, height in enumerate(heights)]
    count = 4 * len(heights)
    return CardMesh(
        positions=np.concatenate([part[0] for part in parts]),
        triangles=np.concatenate([part[1] for part in parts]),
        uv=np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (len(heights), 1)),
        along=np.tile([0, 0, 1, 1], len(heights)),
        normal=np.tile([0, 0, 1], (count, 1)),
        tangent=np.tile([0, 1, 0], (count, 1)),
        occlusion=np.ones(count),
        card=np.repeat(np.arange(len(heights)), 2),
    )


def plain(**changed: float) -> CardOcclusionSettings:
    """Settings with which cards let through exactly 1 - alpha."""
    return CardOcclusionSettings(**{"reach": 100.0, "extinction": 1.0, **changed})  # type: ignore[arg-type]


def brute_force(
    mesh: CardMesh,
    alpha: np.ndarray,
    head: Surface,
    chosen: np.ndarray,
    rays: int,
    own_distance: float,
) -> np.ndarray:
    """Occlusion by cosine-distributed random rays against every triangle, vertex by vertex (Moeller
    and Trumbore 1997)."""
    random = np.random.default_rng(0)
    corners = np.concatenate([mesh.positions[mesh.triangles], head.corners]).astype(np.float64)
    a, one, two = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    outwards = np.cross(one, two)
    is_head = np.arange(len(corners)) >= len(mesh.triangles)
    uv = np.concatenate([mesh.uv[mesh.triangles], np.zeros((len(head.triangles), 3, 2))])
    card = np.concatenate([mesh.card, np.full(len(head.triangles), -1)])
    owner = {int(v): int(c) for t, c in zip(mesh.triangles, mesh.card, strict=True) for v in t}
    open_fractions = []
    for vertex in chosen.tolist():
        direction = random.normal(size=(rays, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        direction += mesh.normal[vertex]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        p = np.cross(direction[:, None], two)
        det = np.einsum("rti,ti->rt", p, one)
        det = np.where(np.abs(det) < 1e-14, np.inf, det)
        away = mesh.positions[vertex] - a
        q = np.cross(away, one)
        u = np.einsum("rti,ti->rt", p, away) / det
        v = direction @ q.T / det
        t = np.einsum("ti,ti->t", q, two) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-4)
        hit &= ~((card == owner[vertex]) & (t < own_distance))
        hit &= ~(is_head & (direction @ outwards.T > 0))
        place = (
            uv[:, 0] + u[..., None] * (uv[:, 1] - uv[:, 0]) + v[..., None] * (uv[:, 2] - uv[:, 0])
        )
        pixel = (np.clip(place, 0, 0.99999) * alpha.shape[::-1]).astype(int)
        through = np.where(is_head, 0.0, 1.0 - alpha[pixel[..., 1], pixel[..., 0]])
        open_fractions.append(np.where(hit, through, 1.0).prod(axis=1).mean())
    return np.array(open_fractions)


def test_the_mean_error_against_brute_force_is_below_two_hundredths() -> None:
    mesh, head = hanging(40, width_factor=1.5, segment_count=4, column_count=1), globe(8)
    alpha = np.random.default_rng(4).random((64, 64)).astype(np.float32)
    alpha[:, 20:40] = 1.0
    settings = CardOcclusionSettings()
    occlusion = vertex_occlusion(mesh, [CardOccluder(mesh, alpha)], [head], settings)
    chosen = np.random.default_rng(2).choice(len(occlusion), 50, replace=False)
    through = (1.0 - alpha) ** settings.extinction
    own_distance = settings.self_occlusion_distance * diagonal_of(mesh)
    expected = brute_force(mesh, 1.0 - through, head, chosen, 512, own_distance)
    assert expected.min() < 0.3 and expected.max() > 0.95  # it is not all alike
    error = occlusion[chosen] - expected
    assert np.abs(error).mean() < 0.02
    assert abs(error.mean()) < 0.01


def test_a_card_alone_is_open() -> None:
    mesh = hanging(1)
    occlusion = vertex_occlusion(mesh, [CardOccluder(mesh)], [], plain())
    np.testing.assert_array_equal(occlusion, 1.0)
    nothing = vertex_occlusion(hanging(20), [], [], plain())
    np.testing.assert_array_equal(nothing, 1.0)


def test_a_card_that_lies_open_on_the_head_has_nearly_all_light() -> None:
    along = np.linspace(-0.04, 0.04, 9)
    top = np.stack([along, 0.0 * along, np.sqrt(0.105**2 - along**2)], axis=1)[None]
    mesh = build_cards(top.astype(np.float32), np.array([[0, 0, 1]], np.float32), CardSettings())
    occlusion = vertex_occlusion(mesh, [CardOccluder(mesh)], [globe(16)], plain())
    assert occlusion.min() > 0.97


@pytest.mark.slow(instead="test_the_mean_error_against_brute_force_is_below_two_hundredths")
def test_deep_inside_it_is_dark_and_outside_light() -> None:
    mesh, head = hanging(600, layers=0.04), globe(16)
    occlusion = vertex_occlusion(
        mesh, [CardOccluder(mesh)], [head], CardOcclusionSettings(rays=128)
    )
    from_middle = np.linalg.norm(mesh.positions[:, :2], axis=1)
    ring = (np.abs(mesh.positions[:, 2]) < 0.02) & (mesh.along > 0.05)
    inner = from_middle[ring] < np.quantile(from_middle[ring], 0.2)
    outer = from_middle[ring] > np.quantile(from_middle[ring], 0.95)
    assert np.median(occlusion[ring][inner]) < 0.2 < 0.6 < np.median(occlusion[ring][outer])


@pytest.mark.slow
def test_below_a_wide_square_only_the_light_past_its_edge_arrives() -> None:
    """Against the form factor of a square above its middle: Lambert's formula, four equal edges."""
    mesh = stacked([0.0, 1.0])
    middle = stacked([0.0], size=1e-3)
    occlusion = vertex_occlusion(middle, [CardOccluder(mesh)], [], plain(rays=4096))
    # the first square lies in the plane of the vertices and blocks nothing
    slant = 1.0 / np.sqrt(2.0)
    blocked = 4.0 / (np.pi) * slant * np.arctan(slant)
    np.testing.assert_allclose(occlusion, 1.0 - blocked, atol=0.005)


@pytest.mark.parametrize("extinction", [1.0, 2.5])
@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_cards_let_one_minus_alpha_through_and_several_multiply(
    alpha: float, extinction: float
) -> None:
    shades = stacked([0.01, 0.02, 0.03], size=50.0)
    below = stacked([0.0], size=0.01)
    picture = np.full((4, 4), alpha, np.float32)
    settings = plain(extinction=extinction)
    occlusion = vertex_occlusion(below, [CardOccluder(shades, picture)], [], settings)
    np.testing.assert_allclose(occlusion, (1.0 - alpha) ** (3.0 * extinction), atol=0.01)


def test_alpha_is_read_at_the_place_that_is_hit() -> None:
    """A texture that is opaque on its right half and clear on its left."""
    shades, below = stacked([0.01], size=1.0), stacked([0.0], size=1e-4)
    half = np.zeros((2, 8), np.float32)
    half[:, 4:] = 1.0
    for shift, expected in ((-0.5, 1.0), (0.5, 0.0), (0.0, 0.5)):
        moved = replace(below, positions=below.positions + np.array([shift, 0.0, 0.0], np.float32))
        occlusion = vertex_occlusion(moved, [CardOccluder(shades, half)], [], plain())
        np.testing.assert_allclose(occlusion, expected, atol=0.06)


def test_both_sides_of_a_card_shade_and_what_is_behind_does_not() -> None:
    below = stacked([0.0], size=0.01)
    for height, expected in ((0.01, 0.0), (-0.01, 1.0)):
        shades = stacked([height], size=50.0)
        for turned in (shades.triangles, shades.triangles[:, ::-1]):
            card = replace(shades, triangles=turned)
            occlusion = vertex_occlusion(below, [CardOccluder(card)], [], plain())
            np.testing.assert_allclose(occlusion, expected, atol=0.01)


def test_roots_below_the_skin_are_not_dark() -> None:
    out = np.array([[0, 0, 1]], np.float32)
    along = np.linspace(RADIUS - 0.004, RADIUS + 0.05, 9)[:, None] * out
    leaning = along + np.linspace(0.0, 0.01, 9)[:, None] * [1.0, 0.0, 0.0]
    mesh = build_cards(
        leaning[None].astype(np.float32), np.array([[1, 0, 0]], np.float32), CardSettings()
    )
    occlusion = vertex_occlusion(mesh, [CardOccluder(mesh)], [globe(16)], plain())
    assert occlusion[mesh.along == 0.0].min() > 0.4  # half its sky is below the horizon


def test_a_card_that_curls_over_itself_shades_itself_beyond_its_own_reach() -> None:
    turn = np.linspace(0.0, 2.2 * np.pi, 40)
    curl = np.stack([0.0 * turn, np.sin(turn), -np.cos(turn)], axis=1) * 0.05
    mesh = build_cards(
        curl[None].astype(np.float32),
        np.array([[0, 0, 1]], np.float32),
        CardSettings(segment_count=40, width_factor=6.0, bend=0.0, roundness=0.0),
    )
    inside = vertex_occlusion(mesh, [CardOccluder(mesh)], [], plain(self_occlusion_distance=0.1))
    never = vertex_occlusion(mesh, [CardOccluder(mesh)], [], plain(self_occlusion_distance=5.0))
    assert inside.max() < 0.8
    np.testing.assert_array_equal(never, 1.0)


def test_other_grooms_and_bodies_shade_as_well_and_only_within_the_reach() -> None:
    mesh, other = stacked([0.0], size=0.01), stacked([0.2], size=50.0)
    body = Surface(*sheet(0.2, 50.0))
    below = Surface(body.positions, body.triangles[:, ::-1])
    far = plain()
    for shades, bodies in (([CardOccluder(other)], []), ([], [below])):
        near = plain(reach=0.1 / diagonal_of(mesh, *(each.mesh for each in shades)))
        np.testing.assert_array_equal(vertex_occlusion(mesh, shades, bodies, near), 1.0)
        assert vertex_occlusion(mesh, shades, bodies, far).max() < 0.02


@pytest.mark.parametrize("factor", [2.0**-10, 2.0**10])
def test_occlusion_is_the_same_at_any_scale(factor: float) -> None:
    def at_scale(scale: float) -> np.ndarray:
        mesh, head = hanging(40), globe(16)
        mesh = replace(mesh, positions=mesh.positions * np.float32(scale))
        head = replace(head, positions=head.positions * np.float32(scale))
        return vertex_occlusion(mesh, [CardOccluder(mesh)], [head], CardOcclusionSettings(rays=64))

    one = at_scale(1.0)
    assert one.min() < 0.5
    np.testing.assert_allclose(at_scale(factor), one, atol=1e-4)


def test_a_mesh_of_other_cards_shades_as_the_cards_themselves() -> None:
    first, other = hanging(40), hanging(40, seed=2)
    alpha = np.random.default_rng(2).random((16, 16)).astype(np.float32)
    mesh = Surface(other.positions, other.triangles, other.uv[other.triangles])
    shades = CardOccluder(other, alpha), CardOccluder.of_surface(mesh, alpha)
    occlusion = [
        vertex_occlusion(first, [CardOccluder(first), each], [], plain()) for each in shades
    ]
    np.testing.assert_allclose(occlusion[0], occlusion[1], atol=1e-5)
    assert (
        occlusion[0].mean()
        < vertex_occlusion(first, [CardOccluder(first)], [], plain()).mean() - 0.02
    )


def test_strength_mixes_in_and_the_same_input_gives_the_same_bits() -> None:
    mesh = hanging(40)
    full = vertex_occlusion(mesh, [CardOccluder(mesh)], [globe(16)], CardOcclusionSettings(rays=32))
    half = vertex_occlusion(
        mesh, [CardOccluder(mesh)], [globe(16)], CardOcclusionSettings(rays=32, strength=0.5)
    )
    np.testing.assert_allclose(half, 0.5 + 0.5 * full, atol=1e-6)
    again = vertex_occlusion(
        mesh, [CardOccluder(mesh)], [globe(16)], CardOcclusionSettings(rays=32)
    )
    np.testing.assert_array_equal(full, again)
    assert full.dtype == np.float32


def test_empty_meshes_and_triangles_without_area_occlude_nothing() -> None:
    one = stacked([0.0])
    empty = replace(
        one,
        triangles=one.triangles[:0],
        card=one.card[:0],
        **{name: getattr(one, name)[:0] for name in VERTEX_FIELDS},
    )
    assert vertex_occlusion(empty, [CardOccluder(empty)], [globe(16)], plain()).shape == (0,)
    mesh = stacked([0.0, 1.0])
    assert vertex_occlusion(mesh, [CardOccluder(empty)], [], plain()).min() == 1.0
    flat = replace(mesh, positions=np.zeros_like(mesh.positions))
    np.testing.assert_array_equal(vertex_occlusion(flat, [CardOccluder(flat)], [], plain()), 1.0)


def test_axes_are_even_over_the_sphere() -> None:
    axes = evenly_spread_axes(500)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-12)
    assert (axes[:, 2] > 0.0).all()
    np.testing.assert_allclose(axes.T @ axes / 500, np.eye(3) / 3.0, atol=0.005)
    apart = axes @ axes.T - 2.0 * np.eye(500)
    assert np.degrees(np.arccos(apart.max())) > 2.5
