"""Sorting against a flood fill, a brute-force order, and the geometry of shells."""

from __future__ import annotations

import time

import numpy as np
import pytest

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import (
    card_distances,
    connected_components,
    inside_out_order,
    reordered,
)
from hairloom.addon.cards.strip import build_cards
from hairloom.addon.strands import Surface


def flood_fill(triangles: np.ndarray) -> list[int]:
    """The plain way: walk from triangle to triangle over shared vertices."""
    at_vertex: dict[int, list[int]] = {}
    for index, triangle in enumerate(triangles.tolist()):
        for vertex in triangle:
            at_vertex.setdefault(vertex, []).append(index)
    piece = [-1] * len(triangles)
    for vertex in sorted(at_vertex):  # pieces are numbered by their lowest vertex
        todo = [index for index in at_vertex[vertex] if piece[index] < 0]
        number = max(piece) + 1
        while todo:
            index = todo.pop()
            if piece[index] < 0:
                piece[index] = number
                todo += [n for v in triangles[index].tolist() for n in at_vertex[v]]
    return piece


@pytest.mark.parametrize("seed", range(8))
def test_components_agree_with_a_flood_fill(seed: int) -> None:
    random = np.random.default_rng(seed)
    triangles = random.integers(0, 300, (random.integers(1, 160), 3))
    assert connected_components(triangles).tolist() == flood_fill(triangles)


def test_components_of_a_long_shuffled_strip() -> None:
    """One piece whose vertices are numbered at random: the worst case for label propagation."""
    random = np.random.default_rng(0)
    strip = np.arange(5000)[:, None] + np.arange(3)
    shuffled = random.permutation(5002)[strip][random.permutation(5000)]
    assert connected_components(shuffled).max() == 0
    assert len(connected_components(np.zeros((0, 3), np.int32))) == 0


def shells(count: int = 60) -> tuple[CardMesh, np.ndarray]:
    """Cards that hang around a sphere, pairs face to face at one distance, in random order."""
    random = np.random.default_rng(3)
    distance = np.repeat(random.permutation(np.linspace(0.11, 0.2, count // 2)), 2)
    angle = np.repeat(random.uniform(0.0, np.pi, count // 2), 2) + np.tile([0, np.pi], count // 2)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=-1)
    height = np.linspace(0.05, -0.05, 8)[:, None] * [0.0, 0.0, 1.0]
    guides = out[:, None] * distance[:, None, None] + height
    settings = CardSettings(bend=0.0, width_factor=0.2)
    return build_cards(guides.astype(np.float32), out.astype(np.float32), settings), distance


def sphere(radius: float = 0.1, rings: int = 24) -> Surface:
    polar, around = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings))
    points = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1
    )
    index = np.arange(2 * rings * rings).reshape(2 * rings, rings)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    quads = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], axis=2)
    return Surface(points.reshape(-1, 3) * radius, quads.reshape(-1, 3))


def triangle_corners(mesh: CardMesh) -> np.ndarray:
    return mesh.positions[mesh.triangles]


@pytest.mark.parametrize("head", [None, sphere()])
def test_shells_are_drawn_from_the_inside_to_the_outside(head: Surface | None) -> None:
    mesh, distance = shells()
    ordered = inside_out_order(mesh, head)
    drawn = ordered.card[np.flatnonzero(np.diff(ordered.card, prepend=-1))]
    assert sorted(drawn) == list(range(mesh.card_count))
    np.testing.assert_array_equal(distance[drawn], np.sort(distance))


def test_triangles_of_a_card_stay_together_and_in_order() -> None:
    mesh, _ = shells()
    ordered = inside_out_order(mesh, sphere())
    starts = np.flatnonzero(np.diff(ordered.card, prepend=-1))
    assert len(starts) == mesh.card_count
    expected = [triangle_corners(mesh)[mesh.card == card] for card in ordered.card[starts].tolist()]
    np.testing.assert_array_equal(triangle_corners(ordered), np.concatenate(expected))


def test_everything_of_a_vertex_travels_with_it() -> None:
    mesh, _ = shells()
    mesh = mesh.with_occlusion(np.random.default_rng(0).random(len(mesh.positions)))
    ordered = inside_out_order(mesh, None)

    def table(one: CardMesh) -> np.ndarray:
        values = [one.positions, one.uv, one.normal, one.tangent]
        values += [one.occlusion[:, None], one.along[:, None]]
        return np.unique(np.concatenate(values, axis=1), axis=0)

    np.testing.assert_array_equal(table(ordered), table(mesh))
    assert (np.diff(ordered.triangles.min(axis=1)) >= 0).all()  # vertices follow their cards
    assert ordered.atlas == mesh.atlas


def test_cards_at_equal_distance_keep_their_order() -> None:
    mesh, _ = shells()
    ordered = reordered(mesh, np.zeros(mesh.card_count))
    np.testing.assert_array_equal(ordered.triangles, mesh.triangles)
    np.testing.assert_array_equal(ordered.positions, mesh.positions)


def test_distance_is_the_median_from_the_surface() -> None:
    mesh, distance = shells()
    measured = card_distances(mesh, sphere(rings=48))
    height = np.linspace(0.05, -0.05, 13)
    expected = [np.median(np.hypot(d, height)) - 0.1 for d in distance]
    np.testing.assert_allclose(measured, expected, atol=3e-3)


def test_an_empty_mesh_stays_empty() -> None:
    mesh = build_cards(np.zeros((0, 16, 3)), np.zeros((0, 3)), CardSettings())
    assert len(inside_out_order(mesh, sphere()).triangles) == 0


def test_five_thousand_cards_are_sorted_in_a_blink() -> None:
    """29 ms measured with pieces found and vertices moved; the limit leaves room for slow CI."""
    mesh, _ = shells(5000)
    key = np.random.default_rng(0).random(mesh.card_count)

    def seconds() -> float:
        begin = time.perf_counter()
        assert connected_components(mesh.triangles).max() == 4999
        reordered(mesh, key)
        return time.perf_counter() - begin

    assert min(seconds() for _ in range(5)) < 0.25
