"""The order in which cards are drawn: from the inside to the outside of the hair.

On a head this is nearly back to front from every side, so that blending needs no sorting at run
time (Scheuermann 2004, "Rendering with approximate depth sorting"). Scheuermann sorts by the
distance from the head. Here that order is the start of a search, which views the hair from many
sides and moves cards that are drawn in the wrong order, see order_pairs.py and order_search.py.

Front faces and back faces are drawn in separate passes, so each has its own order: front
faces from the inside to the outside, back faces, which are on the far side of the hair, the other
way round.

Limitations: one order cannot suit views that contradict each other; `wrong_fraction` measures how
often. Hair that swings far from its rest shape has to be sorted at run time, see `order_from_eye`,
or be a mesh of its own, such as a ponytail, see `card_orders`.
"""

from __future__ import annotations

from collections.abc import Collection, Generator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Floats, Ints, piece_starts
from ..strands import Surface
from ..strands.closest_point import closest_point
from .card_mesh import CARD_FIELDS, VERTEX_FIELDS, CardMesh
from .order_pairs import FragmentPairs, concatenated_pairs, pairs_by_view
from .order_search import Preferences, minimize_violations, net_preferences
from .steps import result_of

#: Number of a card's vertices whose distance from the head is measured; more hardly change the
#: order.
SAMPLE_COUNT = 7
#: Number of views from which pairs are collected, and pixels across.
VIEW_COUNT, VIEW_SIZE = 48, 96
#: Maximum number of pieces in the search; with more triangles, a piece has several.
MAX_PIECES = 30_000
#: Maximum number of triangles for the search; with more, only the distance counts.
MAX_TRIANGLES = 250_000
#: Views per step, and the fraction of the time that all views take.
_VIEWS_PER_STEP, _FRACTION_OF_VIEWS = 8, 0.6

#: A group dangles if its median card is this many times as far from the head as nearly all cards of
#: the nearer groups that do not dangle.
_DANGLING_RATIO = 1.25
#: Percentage that counts as nearly all.
_NEAR_PERCENTILE = 90.0

#: What is sorted: pieces of cards or whole cards, by views; or whole cards, by distance alone.
type SortBy = Literal["pieces", "cards", "distance"]


@dataclass(frozen=True)
class CardOrders:
    """All triangles of a mesh in the order in which they are drawn, (triangle_count,) each.

    front: for front faces, and where both are drawn at once. back: for back faces.
    """

    front: Ints
    back: Ints


def with_triangle_order(mesh: CardMesh, order: Ints) -> CardMesh:
    """The same cards with their triangles in this order, (triangle_count,)."""
    return replace(mesh, triangles=mesh.triangles[order], card=mesh.card[order])


def card_orders(
    mesh: CardMesh,
    head: Surface | None,
    sort_by: SortBy = "pieces",
    separate_groups: Collection[int] | None = None,
    view_count: int = VIEW_COUNT,
    alpha: Floats | None = None,
) -> CardOrders:
    """The best orders for all views around the head; the same for the same cards, whatever their
    order.

    Args:
        head: in the space of the mesh; without one distances are from the middle of the hair.
        sort_by: "cards" and "distance" keep the triangles of a card together, from root to tip;
            "pieces" sorts pieces of cards that cross each other separately, which halves the
            errors. Cards that are nowhere seen together keep their order by distance, and those at
            equal distance the order of their roots' places.
        separate_groups: groups that are drawn separately after all others, so that they can be left
            out or moved; None: those that dangle.
        view_count: number of views. A third is enough for coarser levels of detail.
        alpha: (height, width) of the texture, which determines what is visible of a card and behind
            it; None: cards that cover evenly.
    """
    return result_of(order_steps(mesh, head, sort_by, separate_groups, view_count, alpha))


def order_steps(
    mesh: CardMesh,
    head: Surface | None,
    sort_by: SortBy = "pieces",
    separate_groups: Collection[int] | None = None,
    view_count: int = VIEW_COUNT,
    alpha: Floats | None = None,
) -> Generator[float, None, CardOrders]:
    """As card_orders, some views per step; yields the fraction that is done."""
    numbered = to_canonical(mesh)
    orders = yield from _canonical_orders(
        numbered.mesh, head, sort_by, separate_groups, view_count, alpha
    )
    return CardOrders(numbered.source_triangle[orders.front], numbered.source_triangle[orders.back])


def _canonical_orders(
    mesh: CardMesh,
    head: Surface | None,
    sort_by: SortBy,
    separate_groups: Collection[int] | None,
    view_count: int,
    alpha: Floats | None,
) -> Generator[float, None, CardOrders]:
    """As order_steps, for a mesh that is numbered by `to_canonical`."""
    distance = card_distances(mesh, head)
    section = _section_of_cards(mesh, distance, separate_groups)
    inside_out = np.lexsort((distance, section))
    outside_in = np.lexsort((-distance, section))
    if sort_by == "distance" or len(mesh.triangles) > MAX_TRIANGLES:
        return CardOrders(_triangles_of(mesh, inside_out), _triangles_of(mesh, outside_in))
    found = []
    for seen in pairs_by_view(mesh, head, view_count, VIEW_SIZE, alpha):
        found.append(seen)
        if len(found) % _VIEWS_PER_STEP == 0:
            yield _FRACTION_OF_VIEWS * len(found) / view_count
    pairs = concatenated_pairs(found)
    section_of_triangle = section[mesh.card]
    pairs = pairs[section_of_triangle[pairs.farther] == section_of_triangle[pairs.nearer]]
    piece = piece_of_triangle(mesh) if sort_by == "pieces" else None
    yield _FRACTION_OF_VIEWS
    front = _learned_order(mesh, pairs[pairs.facing == 1], inside_out, piece)
    yield (1.0 + _FRACTION_OF_VIEWS) / 2.0
    back = _learned_order(mesh, pairs[pairs.facing == 0], outside_in, piece)
    # triangles moved to an end of their own section may have passed other sections
    front, back = (
        order[np.argsort(section_of_triangle[order], kind="stable")] for order in (front, back)
    )
    return CardOrders(front, back)


def _learned_order(mesh: CardMesh, pairs: FragmentPairs, cards: Ints, piece: Ints | None) -> Ints:
    """All triangles in the order that violates the least of the pairs, starting from whole
    cards."""
    preferences = net_preferences(len(mesh.triangles), pairs.farther, pairs.nearer, pairs.weight)
    triangles = _improved_order(preferences, mesh.card, cards)
    if piece is None:
        return triangles
    _, first = np.unique(piece[triangles], return_index=True)
    return _improved_order(preferences, piece, np.argsort(first))


def _improved_order(preferences: Preferences, owner: Ints, start: Ints) -> Ints:
    """All triangles in an order of the things that they belong to, (triangle_count,), better than
    `start`."""
    rank = minimize_violations(preferences.for_groups(owner, len(start)), start)
    return np.argsort(rank[owner], kind="stable")


def _triangles_of(mesh: CardMesh, cards: Ints) -> Ints:
    """All triangles, card after card."""
    place = np.empty(len(cards), np.int64)
    place[cards] = np.arange(len(cards))
    return np.argsort(place[mesh.card], kind="stable")


def _section_of_cards(
    mesh: CardMesh, distance: Floats, separate_groups: Collection[int] | None
) -> Ints:
    """The section of each card number that has a distance, see `section_of_groups`."""
    group = mesh.group[: len(distance)]
    if separate_groups is None:
        used = np.unique(mesh.card)
        separate_groups = dangling_groups(group[used], distance[used])
    return section_of_groups(group, separate_groups)


def dangling_groups(group: Ints, distance: Floats) -> list[int]:
    """Groups that hang far from the head, the nearest of them first.

    Args:
        group, distance: (card_count,) of each card; distance from the head [m].
    """
    names = np.unique(group).tolist()
    middle = {name: float(np.median(distance[group == name])) for name in names}
    ordered = sorted(names, key=lambda name: middle[name])
    near, dangling = ordered[:1], ordered[:0]
    for name in ordered[1:]:
        usual = float(np.percentile(distance[np.isin(group, near)], _NEAR_PERCENTILE))
        (dangling if middle[name] > _DANGLING_RATIO * usual else near).append(name)
    return dangling


def section_of_groups(group: Ints, separate_groups: Collection[int]) -> Ints:
    """Sections that are drawn separately, (len(group),): 0 for all groups but those of
    `separate_groups`, which follow as 1, 2 ...
    """
    section = np.zeros(len(group), np.int64)
    for number, name in enumerate(separate_groups, 1):
        section[group == name] = number
    return section


@dataclass(frozen=True)
class Canonical:
    """mesh: the same cards; the triangles of a card follow each other from root to tip.
    source_triangle: (triangle_count,) the source's triangle of each of its triangles.
    """

    mesh: CardMesh
    source_triangle: Ints


def to_canonical(mesh: CardMesh) -> Canonical:
    """The mesh numbered by the position from root to tip, then by place, then by UV.

    The result of the search depends on the order in which it starts. So cards are first numbered by
    where they are; sorting a mesh that is sorted changes nothing.

    Vertices that are equal in all of these keep their order.
    """
    vertices, rank = _by_place(mesh)
    number = np.empty(len(vertices), np.int32)
    number[vertices] = np.arange(len(vertices), dtype=np.int32)
    corners = _lowest_first(number[mesh.triangles])
    first, second, third = rank[corners].T
    root_to_tip = np.lexsort((corners[:, 0], third, second, first))  # the last counts most
    names, place = np.unique(mesh.card[root_to_tip], return_index=True)
    cards = names[np.argsort(place)]
    card = np.zeros(int(names.max(initial=-1)) + 1, np.int32)
    card[cards] = np.arange(len(cards), dtype=np.int32)
    order = root_to_tip[np.argsort(card[mesh.card[root_to_tip]], kind="stable")]
    numbered = replace(
        mesh,
        triangles=corners[order],
        card=card[mesh.card[order]],
        **{name: getattr(mesh, name)[vertices] for name in VERTEX_FIELDS},
        **{name: getattr(mesh, name)[cards] for name in CARD_FIELDS},
    )
    return Canonical(numbered, order)


def _by_place(mesh: CardMesh) -> tuple[Ints, Ints]:
    """Vertices from root to tip, and the rank of each, shared by equal ones; (vertex_count,)
    each."""
    keys = np.column_stack([mesh.along, mesh.positions, mesh.uv])
    vertices = np.lexsort(keys.T[::-1])
    keys = keys[vertices]
    is_other = np.ones(len(keys), bool)
    is_other[1:] = (keys[1:] != keys[:-1]).any(axis=1)
    return vertices, np.cumsum(is_other)


def _lowest_first(triangles: Ints) -> Ints:
    """The same triangles, each turned so that its lowest number comes first, (n, 3)."""
    turned = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, turned, axis=1)


def order_from_eye(mesh: CardMesh, eye: Floats) -> Ints:
    """All triangles from the farthest to the nearest, (triangle_count,): an order at run time.

    Triangles are sorted by their centres; by the centres of whole cards more pixels are wrong. At
    rest the orders of `card_orders` are better; where hair has swung far, this one is.

    Args:
        eye: (4,) homogeneous, world space; (x, y, z, 0) is a parallel view from this direction.
    """
    first, second, third = mesh.positions[mesh.triangles.T]
    place, weight = np.asarray(eye[:3], np.float32), float(eye[3])
    if weight:
        away = first + second + third - 3.0 * place / weight
        near = -np.einsum("ti,ti->t", away, away)
    else:
        near = (first + second + third) @ place
    return np.argsort(_quantized(near), kind="stable")


def _quantized(values: Floats) -> Ints:
    """Values in 65,536 equal steps, which sort in a tenth of the time."""
    if not len(values):
        return np.zeros(0, np.uint16)
    low, high = float(values.min()), float(values.max())
    return ((values - low) * (65_535.0 / max(high - low, 1e-30))).astype(np.uint16)


def piece_of_triangle(mesh: CardMesh) -> Ints:
    """The separately sorted piece of each triangle, (triangle_count,) from 0 without gaps.

    A piece is one triangle, or as many consecutive triangles of a card as keep the number of pieces
    below MAX_PIECES.
    """
    count = len(mesh.triangles)
    triangles_per_piece = -(-count // MAX_PIECES) if count else 1
    order = np.argsort(mesh.card, kind="stable")
    starts = np.flatnonzero(np.diff(mesh.card[order], prepend=-1))
    place = np.arange(count) - np.repeat(starts, np.diff(np.append(starts, count)))
    number = np.empty(count, np.int64)
    number[order] = np.cumsum(place % triangles_per_piece == 0) - 1
    return number


def sorted_by_key(mesh: CardMesh, key: Floats | Ints) -> CardMesh:
    """The same cards by ascending key, one key per card number; equal keys keep their order."""
    triangles = np.argsort(key[mesh.card], kind="stable")
    owner = card_of_vertex(mesh)
    vertices = np.argsort(key[owner], kind="stable")
    place = np.empty(len(vertices), np.int32)
    place[vertices] = np.arange(len(vertices), dtype=np.int32)
    moved = {name: getattr(mesh, name)[vertices] for name in VERTEX_FIELDS}
    return replace(
        mesh, triangles=place[mesh.triangles[triangles]], card=mesh.card[triangles], **moved
    )


def card_distances(mesh: CardMesh, head: Surface | None) -> Floats:
    """Median distance of each card from the head [m], (highest card number + 1,).

    From the head's surface; without a head from the middle of the mesh. A card number that no
    triangle has gets 0.
    """
    if not len(mesh.triangles):
        return np.zeros(0)
    owner = card_of_vertex(mesh)
    vertices = np.argsort(owner, kind="stable")
    counts = np.bincount(owner, minlength=int(mesh.card.max()) + 1)
    starts = piece_starts(counts)
    fraction = (np.arange(SAMPLE_COUNT) + 0.5) / SAMPLE_COUNT
    used = np.flatnonzero(counts)
    picks = vertices[starts[used, None] + (counts[used, None] * fraction).astype(np.int64)]
    points = mesh.positions[picks.ravel()]
    if head is None:
        distance: Floats = np.linalg.norm(points - mesh.positions.mean(axis=0), axis=1)
    else:
        distance = closest_point(points, head).distance
    distances = np.zeros(len(counts))
    distances[used] = np.median(distance.reshape(picks.shape), axis=1)
    return distances


def card_of_vertex(mesh: CardMesh) -> Ints:
    """The card that each vertex belongs to, (vertex_count,); 0 for a vertex without triangles."""
    card = np.zeros(len(mesh.positions), np.int64)
    card[mesh.triangles] = mesh.card[:, None]
    return card


def connected_components(triangles: Ints) -> Ints:
    """Which connected piece each triangle belongs to, (triangle_count,) int32.

    Pieces are numbered by their lowest vertex. Hooking and pointer jumping (Shiloach and Vishkin
    1982): across each edge the higher root is linked to the lower one, then all vertices are linked
    to their roots, and edges that became loops are dropped; few rounds, each over all edges.

    Args:
        triangles: (triangle_count, 3) vertex indices.
    """
    if not len(triangles):
        return np.zeros(0, np.int32)
    first, second, third = np.asarray(triangles, np.int32).T
    root = np.arange(int(triangles.max()) + 1, dtype=np.int32)
    one, two = np.concatenate([first, second]), np.concatenate([second, third])
    while len(one):
        root[np.maximum(one, two)] = np.minimum(one, two)
        _point_to_roots(root)
        one, two = root[one], root[two]
        is_open = one != two
        one, two = one[is_open], two[is_open]
    is_used = np.zeros(len(root), bool)
    is_used[root[first]] = True
    number = np.cumsum(is_used, dtype=np.int32) - 1
    return number[root[first]]


def _point_to_roots(root: Ints) -> None:
    """Pointer jumping in place: afterwards each vertex points to a vertex that points to itself."""
    while True:
        further = root[root]
        if (further == root).all():
            return
        root[:] = further
