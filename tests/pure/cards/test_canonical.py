"""A canonical numbering, whatever the order of a mesh's cards, vertices and triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.cards.card_mesh import CARD_FIELDS, VERTEX_FIELDS, CardMesh
from hairloom.addon.cards.sort import to_canonical

#: a strip of two segments and one column
STRIP = np.array([[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]], np.int32)


def strips(places: np.ndarray) -> CardMesh:
    """A card at each place (n, 3) [m], 2 cm wide; all their values differ."""
    count, random = len(places), np.random.default_rng(3)
    across, along = np.tile([0.0, 1.0], 3), np.repeat([0.0, 0.5, 1.0], 2)
    shape = np.column_stack([0.02 * across, np.zeros(6), along])
    number = np.arange(count)
    of_vertex = random.normal(size=(count * 6, 3))
    of_vertex /= np.linalg.norm(of_vertex, axis=1, keepdims=True)
    return CardMesh(
        positions=(places[:, None] + shape).reshape(-1, 3),
        triangles=(6 * number[:, None, None] + STRIP).reshape(-1, 3),
        uv=np.tile(np.column_stack([across, along]), (count, 1)) * 0.5,
        normal=of_vertex,
        tangent=of_vertex[::-1],
        occlusion=random.random(count * 6),
        card=np.repeat(number, 4),
        along=np.tile(along, count),
        group=number % 3,
        layer=number % 2,
        tile=number + 5,
    )


def scattered(count: int = 30) -> CardMesh:
    return strips(np.random.default_rng(7).normal(size=(count, 3)))


def shuffled(mesh: CardMesh, seed: int) -> CardMesh:
    """The same cards renumbered, with gaps; triangles begin at other corners."""
    random = np.random.default_rng(seed)
    vertices = random.permutation(len(mesh.positions))
    triangles = np.argsort(vertices)[mesh.triangles]
    turned = (random.integers(3, size=(len(triangles), 1)) + np.arange(3)) % 3
    order = random.permutation(len(triangles))
    number = random.permutation(2 * len(mesh.group))[: len(mesh.group)]
    of_cards = {name: np.full(2 * len(mesh.group), -1) for name in CARD_FIELDS}
    for name, values in of_cards.items():
        values[number] = getattr(mesh, name)
    return replace(
        mesh,
        triangles=np.take_along_axis(triangles, turned, axis=1)[order],
        card=number[mesh.card][order],
        **{name: getattr(mesh, name)[vertices] for name in VERTEX_FIELDS},
        **of_cards,
    )


def check_same(one: CardMesh, other: CardMesh) -> None:
    for name in (*VERTEX_FIELDS, *CARD_FIELDS, "triangles", "card"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_numbering_depends_on_the_cards_alone(seed: int) -> None:
    mesh = scattered()
    check_same(to_canonical(shuffled(mesh, seed)).mesh, to_canonical(mesh).mesh)


def test_numbering_twice_changes_nothing() -> None:
    once = to_canonical(scattered()).mesh
    twice = to_canonical(once)
    check_same(twice.mesh, once)
    np.testing.assert_array_equal(twice.source_triangle, np.arange(len(once.triangles)))


def test_triangles_keep_all_their_attributes() -> None:
    mesh = shuffled(scattered(), 4)
    found = to_canonical(mesh)
    assert sorted(found.source_triangle) == list(range(len(mesh.triangles)))
    for name in VERTEX_FIELDS:
        one = getattr(found.mesh, name)[found.mesh.triangles]
        other = getattr(mesh, name)[mesh.triangles[found.source_triangle]]
        for corners, known in zip(one, other, strict=True):
            starts = [np.array_equal(corners, np.roll(known, turn, axis=0)) for turn in range(3)]
            assert any(starts), name
    for name in CARD_FIELDS:
        np.testing.assert_array_equal(
            getattr(found.mesh, name)[found.mesh.card],
            getattr(mesh, name)[mesh.card][found.source_triangle],
        )


def test_card_numbers_have_no_gaps_and_triangles_run_from_root_to_tip() -> None:
    mesh = to_canonical(shuffled(scattered(), 5)).mesh
    np.testing.assert_array_equal(mesh.card, np.repeat(np.arange(30), 4))
    along = mesh.along[mesh.triangles].mean(axis=1).reshape(30, 4)
    assert (np.diff(along, axis=1) > 0.0).all()
    assert (np.diff(mesh.along) >= 0.0).all(), "vertices too, of all cards"
    first = mesh.positions[mesh.triangles].reshape(30, 12, 3).min(axis=1)
    assert (np.diff(first[:, 0]) > 0.0).all(), "cards by place, where all begin at the root"


def test_the_position_along_the_card_counts_before_the_place() -> None:
    """Two cards in one place: the root of one is at the tip of the other."""
    mesh = strips(np.zeros((2, 3)))
    along = mesh.along.copy()
    along[6:] = 1.0 - along[6:]
    for each in (replace(mesh, along=along), shuffled(replace(mesh, along=along), 6)):
        found = to_canonical(each).mesh
        assert (np.diff(found.along) >= 0.0).all()
        np.testing.assert_allclose(found.positions[:4, 2], [0.0, 1.0, 0.0, 1.0])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_cards_in_one_place_are_distinguished_by_their_uvs(seed: int) -> None:
    mesh = strips(np.zeros((5, 3)))
    mesh = replace(mesh, uv=mesh.uv + np.repeat([0.4, 0.1, 0.3, 0.0, 0.2], 6)[:, None])
    found = to_canonical(shuffled(mesh, seed)).mesh
    check_same(found, to_canonical(mesh).mesh)
    np.testing.assert_array_equal(found.tile, np.array([3, 1, 4, 2, 0]) + 5)


def test_identical_cards_keep_their_order() -> None:
    """The order of their vertices counts, whatever the order of their triangles."""
    mesh = strips(np.zeros((4, 3)))
    order = np.random.default_rng(8).permutation(len(mesh.triangles))
    mixed = replace(mesh, triangles=mesh.triangles[order], card=mesh.card[order])
    for each in (mesh, mixed):
        found = to_canonical(each).mesh
        np.testing.assert_array_equal(found.tile, np.arange(4) + 5)
        np.testing.assert_array_equal(found.card, np.repeat(np.arange(4), 4))


def test_triangles_of_one_card_are_sorted_by_their_corners() -> None:
    """Against tuples sorted by Python; triangles between few places, all of one card."""
    random = np.random.default_rng(9)
    names = [tuple(random.permutation(12)[:3]) for _ in range(60)]
    triangles = np.array(list(dict.fromkeys(names)))
    along, zero = np.arange(12) % 3 / 2.0, np.zeros((12, 3))
    mesh = CardMesh(
        positions=random.normal(size=(12, 3)),
        triangles=triangles,
        uv=random.random((12, 2)),
        normal=zero,
        tangent=zero,
        occlusion=zero[:, 0],
        card=np.zeros(len(triangles)),
        along=along,
    )
    keys = [tuple(map(float, key)) for key in zip(mesh.along, *mesh.positions.T, strict=True)]
    expected = []
    for corners in triangles:
        places = [keys[corner] for corner in corners]
        lowest = places.index(min(places))
        expected.append((*places[lowest:], *places[:lowest]))
    found = to_canonical(mesh).mesh
    order = [tuple(map(float, key)) for key in zip(found.along, *found.positions.T, strict=True)]
    assert order == sorted(keys)
    assert [tuple(order[c] for c in corners) for corners in found.triangles] == sorted(expected)


def test_vertices_in_one_place_count_alike() -> None:
    """Vertices that engines have split do not change a card's order, also where the later triangle
    has the first of two coincident vertices."""
    whole = strips(np.zeros((1, 3)))
    split = replace(
        whole,
        triangles=np.array([[6, 1, 3], [0, 7, 2], [2, 3, 5], [2, 5, 4]]),
        **{name: getattr(whole, name)[[*range(6), 0, 3]] for name in VERTEX_FIELDS},
    )
    one, other = to_canonical(whole), to_canonical(split)
    np.testing.assert_array_equal(one.source_triangle, other.source_triangle)
    np.testing.assert_array_equal(
        one.mesh.positions[one.mesh.triangles], other.mesh.positions[other.mesh.triangles]
    )


def test_a_mesh_without_cards_is_numbered() -> None:
    found = to_canonical(strips(np.zeros((0, 3))))
    assert not len(found.source_triangle) and not found.mesh.card_count
