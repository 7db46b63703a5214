"""Sorting against a flood fill, a brute-force order, and the geometry of shells."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from guide_cards import build_cards
from spheres import globe
from tiers import few_in_commits

from hairloom.addon.cards.card_mesh import CARD_FIELDS, VERTEX_FIELDS, CardMesh, join_meshes
from hairloom.addon.cards.order_check import wrong_fraction
from hairloom.addon.cards.order_pairs import concatenated_pairs, pairs_by_view
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import (
    MAX_PIECES,
    VIEW_SIZE,
    SortBy,
    card_distances,
    card_of_vertex,
    card_orders,
    connected_components,
    order_from_eye,
    piece_of_triangle,
    sorted_by_key,
    with_triangle_order,
)
from hairloom.addon.strands import Surface


def flood_fill(triangles: np.ndarray) -> list[int]:
    """The component of each triangle, by walking over shared vertices."""
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
    """One component with randomly numbered vertices: the worst case for label propagation."""
    random = np.random.default_rng(0)
    strip = np.arange(5000)[:, None] + np.arange(3)
    shuffled = random.permutation(5002)[strip][random.permutation(5000)]
    assert connected_components(shuffled).max() == 0
    assert len(connected_components(np.zeros((0, 3), np.int32))) == 0


def shells(count: int = 60) -> tuple[CardMesh, np.ndarray]:
    """Cards that hang around a sphere in random order, in opposite pairs at the same distance."""
    random = np.random.default_rng(3)
    distance = np.repeat(random.permutation(np.linspace(0.11, 0.2, count // 2)), 2)
    angle = np.repeat(random.uniform(0.0, np.pi, count // 2), 2) + np.tile([0, np.pi], count // 2)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=-1)
    height = np.linspace(0.05, -0.05, 8)[:, None] * [0.0, 0.0, 1.0]
    guides = out[:, None] * distance[:, None, None] + height
    settings = CardSettings(bend=0.0, width_factor=0.2)
    return build_cards(guides.astype(np.float32), out.astype(np.float32), settings), distance


WAYS: tuple[SortBy, ...] = ("pieces", "cards", "distance")


@pytest.mark.parametrize("by", WAYS)
@pytest.mark.parametrize("head", [None, globe(24)])
def test_shells_are_drawn_from_the_inside_to_the_outside(head: Surface | None, by: SortBy) -> None:
    mesh, distance = shells()
    ordered = with_triangle_order(mesh, card_orders(mesh, head, by).front)
    drawn = ordered.card[np.flatnonzero(np.diff(ordered.card, prepend=-1))]
    assert sorted(drawn) == list(range(mesh.card_count))
    np.testing.assert_array_equal(distance[drawn], np.sort(distance))


@pytest.mark.parametrize("by", ["cards", "distance"])
def test_triangles_of_a_card_stay_together_from_root_to_tip(by: SortBy) -> None:
    mesh = crossing_cards()
    orders = card_orders(mesh, globe(24), by)
    lowest = mesh.along[mesh.triangles].min(axis=1)
    for order in (orders.front, orders.back):
        np.testing.assert_array_equal(np.sort(order), np.arange(len(order)))
        drawn = mesh.card[order]
        is_next = np.diff(drawn) != 0
        assert is_next.sum() == mesh.card_count - 1
        assert (np.diff(lowest[order])[~is_next] >= 0.0).all()


def shuffled(mesh: CardMesh, seed: int) -> CardMesh:
    """The same cards with vertices, triangles, corners and card numbers permuted at random."""
    random = np.random.default_rng(seed)
    vertices = random.permutation(len(mesh.positions))
    cards = random.permutation(len(mesh.group))
    order = random.permutation(len(mesh.triangles))
    turned = (random.integers(0, 3, (len(order), 1)) + np.arange(3)) % 3
    corners = np.argsort(vertices)[np.take_along_axis(mesh.triangles[order], turned, axis=1)]
    of_vertices = {name: getattr(mesh, name)[vertices] for name in VERTEX_FIELDS}
    of_cards = {name: getattr(mesh, name)[cards] for name in CARD_FIELDS}
    return replace(
        mesh, triangles=corners, card=np.argsort(cards)[mesh.card[order]], **of_vertices, **of_cards
    )


def as_drawn(mesh: CardMesh, order: np.ndarray) -> np.ndarray:
    """The corners of each triangle, the smallest position first, (triangle_count, 9)."""
    corners = mesh.positions[mesh.triangles[order]]
    first = np.lexsort(corners.transpose(2, 0, 1)[::-1], axis=1)[:, :1]
    turned = (first + np.arange(3)) % 3
    return np.take_along_axis(corners, turned[..., None], axis=1).reshape(-1, 9)


@pytest.mark.parametrize("by", WAYS)
@pytest.mark.parametrize("head", [None, globe(24)])
def test_the_order_depends_on_the_places_of_cards_alone(head: Surface | None, by: SortBy) -> None:
    group = np.arange(40) % 3
    mesh = replace(crossing_cards(), group=group)
    expected = card_orders(mesh, head, by, separate_groups=(2,), view_count=8)
    for seed in range(2):
        other = shuffled(mesh, seed)
        found = card_orders(other, head, by, separate_groups=(2,), view_count=8)
        for one, two in ((expected.front, found.front), (expected.back, found.back)):
            np.testing.assert_array_equal(as_drawn(mesh, one), as_drawn(other, two))


@pytest.mark.parametrize("by", WAYS)
def test_cards_that_are_sorted_stay_as_they_are(by: SortBy) -> None:
    mesh = replace(crossing_cards(), **{name: np.zeros(80) for name in CARD_FIELDS})
    twice = join_meshes(
        [mesh, replace(mesh, card=mesh.card + 40)]
    )  # each card coincides with another
    once = with_triangle_order(twice, card_orders(twice, globe(24), by, view_count=8).front)
    again = card_orders(once, globe(24), by, view_count=8)
    np.testing.assert_array_equal(again.front, np.arange(len(once.triangles)))


def test_triangles_and_vertices_keep_all_their_attributes() -> None:
    mesh = crossing_cards()
    mesh = mesh.with_occlusion(np.random.default_rng(0).random(len(mesh.positions)))

    def table(one: CardMesh) -> np.ndarray:
        values = [one.positions, one.uv, one.normal, one.tangent]
        values += [one.occlusion[:, None], one.along[:, None]]
        corners = np.concatenate(values, axis=1)[one.triangles].reshape(len(one.triangles), -1)
        return np.unique(np.column_stack([one.card, corners]), axis=0)

    orders = card_orders(mesh, None)
    ordered, back = with_triangle_order(mesh, orders.front), mesh.triangles[orders.back]
    assert not np.array_equal(ordered.triangles, mesh.triangles)
    np.testing.assert_array_equal(table(ordered), table(mesh))
    np.testing.assert_array_equal(np.unique(back, axis=0), np.unique(mesh.triangles, axis=0))
    again = sorted_by_key(mesh, np.arange(mesh.card_count)[::-1])
    np.testing.assert_array_equal(table(again), table(mesh))
    assert (np.diff(again.triangles.min(axis=1)) >= 0).all()  # vertices follow their cards
    assert again.atlas == mesh.atlas


def crossing_cards(count: int = 40) -> CardMesh:
    """Cards around a sphere at random distances, which lean and cross each other."""
    random = np.random.default_rng(5)
    out = random.standard_normal((count, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    way = np.cross(out, random.standard_normal((count, 3)))
    way += random.uniform(-0.5, 0.5, (count, 1)) * out
    along = np.linspace(-0.08, 0.08, 8)[:, None]
    guides = out[:, None] * random.uniform(0.12, 0.2, (count, 1, 1)) + way[:, None] * along
    settings = CardSettings(width_factor=1.5, segment_count=4)
    return build_cards(guides.astype(np.float32), out.astype(np.float32), settings)


def nested_cubes(sizes: tuple[float, ...]) -> CardMesh:
    """Cubes around each other, each face a card; the inner ones have higher numbers."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(-1.0, 1.0, 5)] * 2))
    index = np.arange(25).reshape(5, 5)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    quads = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    faces = [
        np.roll(np.stack([sign * x, y, np.full_like(x, sign)], axis=1), axis, 1)
        for axis in range(3)
        for sign in (1.0, -1.0)
    ]
    points = np.concatenate([size * face for size in sorted(sizes)[::-1] for face in faces])
    count = len(points) // 25
    ones = np.ones(len(points))
    return CardMesh(
        positions=points,
        triangles=np.concatenate([quads + 25 * card for card in range(count)]),
        uv=np.zeros((len(points), 2)),
        normal=points,
        tangent=points,
        occlusion=ones,
        card=np.repeat(np.arange(count), len(quads)),
        along=ones,
    )


@pytest.mark.parametrize("by", few_in_commits(["cards", "pieces", "distance"]))
def test_nested_cubes_are_exactly_right_from_everywhere(by: SortBy) -> None:
    """Against the known order: front faces from the inside out, back faces from the outside in."""
    mesh = nested_cubes((1.0, 1.3, 1.6, 1.9))
    orders = card_orders(mesh, None, by)
    if by != "pieces":  # some pieces are never seen together
        cube = mesh.card // 6
        np.testing.assert_array_equal(cube[orders.front], np.sort(cube)[::-1])
        np.testing.assert_array_equal(cube[orders.back], np.sort(cube))

    def share(front: np.ndarray, back: np.ndarray) -> float:
        return wrong_fraction(mesh, None, front=front, back=back, view_count=12, size=96)

    assert share(orders.front, orders.back) < 1e-3  # pixels at an edge belong to both sides
    assert share(orders.front, orders.front) > 0.6  # the order is wrong for one side
    assert share(orders.back, orders.back) > 0.6


def test_what_is_learnt_is_better_than_the_distance() -> None:
    mesh = crossing_cards()
    share = {}
    for by in WAYS:
        orders = card_orders(mesh, globe(24), by)
        share[by] = wrong_fraction(
            mesh, globe(24), front=orders.front, back=orders.back, view_count=12
        )
    assert 0.0 < share["pieces"] < 0.7 * share["cards"]
    assert (
        share["cards"]
        < 0.8 * share["distance"]
        < 0.8 * wrong_fraction(mesh, globe(24), view_count=12)
    )


def test_cards_side_by_side_go_by_their_place() -> None:
    """No view sees one before another, so the distance decides, and then the position."""
    along = np.linspace(0.0, 0.1, 4)[:, None] * [0.0, 0.0, 1.0]
    places = np.array([[0.03, 0.0, 0.0], [0.0, 0.0, 0.0], [-0.03, 0.0, 0.0]])
    guides = (places[:, None] + along).astype(np.float32)
    up = np.broadcast_to(np.float32([0.0, 1.0, 0.0]), (3, 3))
    mesh = build_cards(guides, up, CardSettings(width_factor=0.2, bend=0.0))
    wall = np.float32([[-9, -1, -9], [9, -1, -9], [0, -1, 9]])
    for by in WAYS:
        orders = card_orders(mesh, Surface(wall, np.array([[0, 1, 2]])), by, separate_groups=())
        for order in (orders.front, orders.back):
            np.testing.assert_array_equal(np.sort(order), np.arange(len(mesh.triangles)))
            if by != "pieces":
                np.testing.assert_array_equal(mesh.card[order], np.repeat([2, 1, 0], 48))


@pytest.mark.parametrize("by", WAYS)
def test_a_ponytail_is_drawn_on_its_own_after_the_rest(by: SortBy) -> None:
    mesh = crossing_cards()
    positions, group = mesh.positions.copy(), np.zeros(mesh.card_count, np.int32)
    group[10:15], group[20:23] = 7, 3
    owner = card_of_vertex(mesh)
    positions[np.isin(owner, np.arange(10, 15))] *= 2.5
    mesh = replace(mesh, positions=positions, group=group)
    found = card_orders(mesh, globe(24), by)
    for order in (found.front, found.back):
        drawn = group[mesh.card[order]]
        assert (drawn[-5 * 16 :] == 7).all()
        assert set(drawn[: -5 * 16]) == {0, 3}
    named = card_orders(mesh, globe(24), by, separate_groups=(3, 7))
    runs = group[mesh.card[named.front]]
    np.testing.assert_array_equal(runs, np.repeat([0, 3, 7], 16 * np.array([32, 3, 5])))
    together = group[mesh.card[card_orders(mesh, globe(24), by, separate_groups=()).back]]
    assert (together[-5 * 16 :] != 7).any()


@pytest.mark.parametrize("by", WAYS)
def test_groups_that_lie_among_each_other_are_drawn_apart(by: SortBy) -> None:
    mesh = crossing_cards()
    group = np.random.default_rng(1).integers(0, 4, mesh.card_count)
    orders = card_orders(
        replace(mesh, group=group), None, by, separate_groups=(1, 2, 3), view_count=8
    )
    for order in (orders.front, orders.back):
        drawn = group[mesh.card[order]]
        np.testing.assert_array_equal(drawn, np.sort(drawn))


def test_coinciding_cards_keep_their_order_and_sorting_repeats_itself() -> None:
    mesh = crossing_cards(3)
    count = len(mesh.triangles)
    six = {"group": np.zeros(6), "layer": np.zeros(6), "tile": np.zeros(6)}
    mesh = replace(mesh, **six)
    twice = join_meshes([mesh, replace(mesh, card=mesh.card + 3)])
    one, two = (card_orders(twice, globe(24)) for _ in range(2))
    np.testing.assert_array_equal(one.front, two.front)
    np.testing.assert_array_equal(one.back, two.back)
    for order in (one.front, one.back):
        place = np.argsort(order)
        assert (place[:count] < place[count:]).all()


@pytest.mark.parametrize("by", WAYS)
@pytest.mark.parametrize("count", [0, 1])
def test_none_and_one_card(by: SortBy, count: int) -> None:
    mesh = crossing_cards(count) if count else empty_mesh()
    for head in (None, globe(24)):
        orders = card_orders(mesh, head, by)
        for order in (
            orders.front,
            orders.back,
            order_from_eye(mesh, np.array([1.0, 0.0, 0.0, 1.0])),
        ):
            np.testing.assert_array_equal(np.sort(order), np.arange(len(mesh.triangles)))
        assert wrong_fraction(mesh, head, view_count=2) <= 1.0


def test_cards_without_area_and_with_gaps_in_their_numbers() -> None:
    mesh = crossing_cards(6)
    positions = mesh.positions.copy()
    positions[card_of_vertex(mesh) == 2] = 0.15
    keep = mesh.card != 4
    mesh = replace(mesh, positions=positions, triangles=mesh.triangles[keep], card=mesh.card[keep])
    for by in WAYS:
        orders = card_orders(mesh, globe(24), by)
        for order in (orders.front, orders.back):
            np.testing.assert_array_equal(np.sort(order), np.arange(len(mesh.triangles)))


def test_cards_that_share_all_their_vertices() -> None:
    mesh = crossing_cards(1)
    mesh = replace(mesh, group=np.zeros(2), layer=np.zeros(2), tile=np.zeros(2))
    mesh = join_meshes([replace(mesh, card=mesh.card + 1), mesh])
    half = len(mesh.triangles) // 2
    mesh = replace(mesh, triangles=np.tile(mesh.triangles[:half], (2, 1)))
    for by in WAYS:
        order = card_orders(mesh, globe(24), by).front
        np.testing.assert_array_equal(np.sort(order), np.arange(2 * half))


def test_pieces_are_triangles_unless_there_are_too_many() -> None:
    mesh = crossing_cards(5)
    np.testing.assert_array_equal(piece_of_triangle(mesh), np.arange(len(mesh.triangles)))
    random = np.random.default_rng(0)
    card = random.integers(0, 9_000, 2 * MAX_PIECES + 5)
    known = {name: np.zeros(9_000) for name in ("group", "layer", "tile")}
    piece = piece_of_triangle(replace(mesh, triangles=np.zeros((len(card), 3)), card=card, **known))
    assert piece.max() + 1 == len(np.unique(piece)) < MAX_PIECES
    for number in random.integers(0, piece.max(), 50).tolist():
        own = np.flatnonzero(piece == number)
        assert len(np.unique(card[own])) == 1
        assert len(own) <= 3
        inside = np.flatnonzero(card == card[own[0]])
        assert np.ptp(np.searchsorted(inside, own)) == len(own) - 1  # they are consecutive


@pytest.mark.parametrize("eye", [(0.4, -0.5, 0.3, 1.0), (0.8, -1.0, 0.6, 2.0), (0.1, 0.9, 0.2, 0)])
def test_order_from_an_eye_is_that_of_the_middles(eye: tuple[float, ...]) -> None:
    mesh = crossing_cards()
    middle = mesh.positions[mesh.triangles].astype(np.float64).mean(axis=1)
    if eye[3]:
        near = -np.linalg.norm(middle - np.array(eye[:3]) / eye[3], axis=1)
    else:
        near = middle @ np.array(eye[:3])
    drawn = near[order_from_eye(mesh, np.array(eye))]
    assert (np.diff(drawn) > -2e-5 * np.ptp(near) * 2).all()
    assert np.ptp(near) > 0.1


def test_cards_at_equal_distance_keep_their_order() -> None:
    mesh, _ = shells()
    ordered = sorted_by_key(mesh, np.zeros(mesh.card_count))
    np.testing.assert_array_equal(ordered.triangles, mesh.triangles)
    np.testing.assert_array_equal(ordered.positions, mesh.positions)


def test_distance_is_the_median_from_the_surface() -> None:
    mesh, distance = shells()
    measured = card_distances(mesh, globe(48))
    height = np.linspace(0.05, -0.05, 13)
    expected = [np.median(np.hypot(d, height)) - 0.1 for d in distance]
    np.testing.assert_allclose(measured, expected, atol=3e-3)


def empty_mesh() -> CardMesh:
    return build_cards(np.zeros((0, 16, 3)), np.zeros((0, 3)), CardSettings())


def test_five_thousand_cards_are_sorted() -> None:
    mesh, _ = shells(5000)
    key = np.random.default_rng(0).random(mesh.card_count)
    assert connected_components(mesh.triangles).max() == 4999
    assert (np.diff(key[sorted_by_key(mesh, key).card]) >= 0.0).all()


def test_the_order_of_few_cards_is_the_best_of_all_orders() -> None:
    """Brute force over all orders of six crossing cards, judged by the pairs that are seen."""
    mesh = crossing_cards(6)
    orders = card_orders(mesh, None, "cards", view_count=24)
    pairs = concatenated_pairs(list(pairs_by_view(mesh, None, 24, VIEW_SIZE)))
    for facing, order in ((1, orders.front), (0, orders.back)):
        own = pairs[pairs.facing == facing]
        table = np.zeros((6, 6), np.int64)
        np.add.at(table, (mesh.card[own.farther], mesh.card[own.nearer]), own.weight)
        table -= table.T

        def broken(cards: tuple[int, ...], table: np.ndarray = table) -> int:
            inside = np.ix_(cards, cards)
            return int(np.maximum(np.tril(table[inside]), 0).sum())

        drawn = tuple(mesh.card[order][:: len(mesh.triangles) // 6].tolist())
        worst = max(broken(each) for each in itertools.permutations(range(6)))
        assert broken(drawn) == min(broken(each) for each in itertools.permutations(range(6)))
        assert broken(drawn) < 0.2 * worst
