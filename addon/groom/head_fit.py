"""The built-in head fitted to another one, so that its hair can grow there.

First a similarity, found by matching skulls and then closest points both ways; then smooth bends
that bring landmarks together, and then the skin around them. Landmarks are guessed by the same
means where nobody has placed them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import HairloomError
from ..strands import Surface
from ..strands.affine import mean_scale
from ..strands.closest_point import ClosestPointSearch, search_of
from ..strands.nearest import nearest_points
from ..strands.vectors import unit
from .scalp import find_cranium

#: name -> title and place on the built-in head [m]; left is the head's own left
LANDMARKS: dict[str, tuple[str, tuple[float, float, float]]] = {
    "crown": ("Crown", (0.0, 0.02, 0.114)),
    "hairline": ("Hairline", (0.0, -0.0815, 0.064)),
    "left_ear": ("Left Ear", (0.0879, 0.0225, -0.011)),
    "right_ear": ("Right Ear", (-0.0879, 0.0225, -0.011)),
    "nape": ("Nape", (0.0, 0.075, -0.078)),
    "left_eye": ("Left Eye", (0.0465, -0.068, -0.008)),
    "right_eye": ("Right Eye", (-0.0465, -0.068, -0.008)),
    "nose": ("Nose", (0.0, -0.1081, -0.0441)),
    "mouth": ("Mouth", (0.0, -0.0966, -0.0765)),
    "chin": ("Chin", (0.0, -0.0885, -0.108)),
}
_REMEDY = "Press Place Landmarks, drag them to their places and add the hairstyle again"

# All lengths below are [m] on the built-in head.
#: height below which neck and shoulders begin, which other heads may lack
_CHIN = -0.115
#: spacing of the points that are matched, for the similarity and for bends
_COARSE, _FINE = 0.022, 0.018
#: rounds of matching that find a similarity, from each start and from the best one
_FIRST_ROUNDS, _ROUNDS = 6, 15
#: fraction of the matches that counts, the nearest ones: hats, hair and holes have no match
_TRIMMED = 0.75
#: sizes that are tried, relative to the skull's, and number of directions tried for the face
_SIZES, _TURNS = (0.85, 1.0, 1.18), 4
#: minimum cosine between the normals of a match, and its maximum distance
_FACING, _FAR = 0.3, 0.035
#: spacing of a mesh's own points, as a fraction of its extent; half the side of a box around a head
_CENTERS, _AROUND = 0.035, 0.2
#: minimum number of matches; what the mean distance would be if no point had a match
_FEW, _LOST = 30, 0.02
#: how many times nearer another direction of the face must be; maximum mean distance of a head
_CLEARLY, _UNLIKE = 1.25, 0.0175
#: reach of bends, around landmarks and around skin, the latter in successive rounds
_LANDMARK_REACH, _SKIN_REACHES = 0.30, (0.16, 0.11, 0.07)
#: how far a bend is smooth rather than exact, for landmarks and for skin
_EXACT, _SMOOTH = 1e-6, 0.08
#: landmarks nearer to each other than this lie on top of each other
_APART = 0.006
#: landmarks farther than this from where they would be on any head are mistaken
_MISTAKEN = 0.06
#: radius around a guess in which the tips of nose and ears are searched, and their directions
_FEATURE = 0.018
_TIPS = {"nose": (0.0, -1.0, 0.0), "left_ear": (1.0, 0.0, 0.0), "right_ear": (-1.0, 0.0, 0.0)}


@dataclass(frozen=True, eq=False)
class Bends:
    """Smooth displacements around centres: Wendland's C2 function, which is 0 from `reach` on.

    centers, weights: (count, 3) [m].
    """

    centers: Floats
    weights: Floats
    reach: float

    def at(self, points: Floats) -> Floats:
        """The displacement at each of the points (n, 3)."""
        moved = np.zeros((len(points), 3))
        for first in range(0, len(points), 4096):
            part = slice(first, first + 4096)
            moved[part] = _wendland(points[part], self.centers, self.reach) @ self.weights
        return moved


@dataclass(frozen=True, eq=False)
class Warp:
    """From the built-in head's own space to that of another one: bent, then moved by a similarity.

    matrix: (4, 4). bends: each after the one before.
    """

    matrix: Floats
    bends: tuple[Bends, ...] = ()

    def bent(self, points: Floats) -> Floats:
        """Points (n, 3) after all bends, without the similarity."""
        points = np.asarray(points, np.float64)
        for bend in self.bends:
            points = points + bend.at(points)
        return points

    def __call__(self, points: Floats) -> Floats:
        return _moved(self.bent(points), self.matrix)

    @property
    def scale(self) -> float:
        return mean_scale(self.matrix)

    def with_bend(self, source: Floats, target: Floats, reach: float, smooth: float) -> Warp:
        """The warp with one more bend, which moves points (n, 3) to others, both in the built-in
        head's space after the bends so far."""
        table = _wendland(source, source, reach)
        table[np.diag_indices(len(source))] += smooth
        bend = Bends(source, np.linalg.solve(table, target - source), reach)
        return replace(self, bends=(*self.bends, bend))


@dataclass(frozen=True, eq=False)
class FitModel:
    """The parts of the built-in head that are fitted to others.

    skin: without the eyes and the faces that close the cut.
    is_open: (vertex_count,) whether a vertex lies outside of folds, mouth and sockets.
    """

    skin: Surface
    is_open: Bools


@dataclass(frozen=True, eq=False)
class HeadFit:
    """landmarks: name -> place (3,) in the other head's space.
    away: mean distance of the warped skin from the other head [m on the built-in head].
    """

    warp: Warp
    landmarks: dict[str, Floats]
    away: float


def fit_head(
    model: FitModel, target: Surface, landmarks: Mapping[str, Floats] | None, place: str
) -> HeadFit:
    """Fit the built-in head to a mesh, by landmarks where somebody has placed them.

    Args:
        target: with Z up where nobody has placed landmarks.

    Raises:
        HairloomError: landmarks that lie on top of each other, or not as on a head; a mesh on
            which nothing like a head is found.
    """
    if landmarks is None:
        landmarks, is_sure = guess_landmarks(model, target)
        if not is_sure:
            raise HairloomError("no shape of a head was found on it", place=place, remedy=_REMEDY)
    names = [name for name in LANDMARKS if name in landmarks]
    own = _own_landmarks(model)
    source = np.array([own[name] for name in names])
    wanted = np.array([landmarks[name] for name in names], np.float64)
    matrix = _landmark_similarity(names, source, wanted, place)
    back = np.linalg.inv(matrix)
    warp = Warp(matrix).with_bend(source, _moved(wanted, back), _LANDMARK_REACH, _EXACT)
    seen = _PlacedTarget.of(target, matrix)
    warp, away = _skin_bent(warp, model, seen, source)
    return HeadFit(warp, {name: np.asarray(landmarks[name]) for name in names}, away)


def fit_by_vertices(source: Floats, target: Floats, is_head: Bools) -> Warp:
    """A smooth warp that brings vertices (n, 3) of the built-in head to the same ones of a mesh
    with its topology.

    Args:
        is_head: (n,) which vertices decide position, rotation and scale; others may be posed.
    """
    matrix = _similarity(source[is_head], target[is_head])
    kept = first_per_cell(source, _COARSE)
    wanted = _moved(target[kept], np.linalg.inv(matrix))
    return Warp(matrix).with_bend(source[kept], wanted, _LANDMARK_REACH, _EXACT)


def guess_landmarks(model: FitModel, target: Surface) -> tuple[dict[str, Floats], bool]:
    """Guessed landmarks by name, (3,) [m] each, on a mesh that stands upright, Z up; and whether it
    is like a head.
    """
    matrix, away = _guessed_similarity(model, target)
    own = np.array(list(_own_landmarks(model).values()))
    if away < _UNLIKE:
        seen = _PlacedTarget.of(target, matrix)
        warp, _ = _skin_bent(Warp(matrix), model, seen, np.zeros((0, 3)))
        guess = dict(zip(LANDMARKS, seen.closest(warp.bent(own)), strict=True))
        for name, along in _TIPS.items():
            guess[name] = seen.farthest(guess[name], np.array(along))
        points = np.array(list(guess.values()))
        if np.linalg.norm(points - own, axis=1).max() < _MISTAKEN:
            return dict(zip(LANDMARKS, _moved(points, matrix), strict=True)), True
    return dict(zip(LANDMARKS, _moved(own, matrix), strict=True)), False


@dataclass(frozen=True, eq=False)
class _PlacedTarget:
    """A mesh in the built-in head's space, without parts that are far from a head.

    facing: (triangle_count, 3) normals.
    """

    surface: Surface
    search: ClosestPointSearch
    facing: Floats

    @classmethod
    def of(cls, target: Surface, matrix: Floats) -> _PlacedTarget:
        placed = Surface(_moved(target.positions, np.linalg.inv(matrix)), target.triangles)
        surface = _around(placed, np.zeros(3), 2.0 * _AROUND)
        return cls(surface, ClosestPointSearch(surface), surface.triangle_normals())

    def closest(self, points: Floats) -> Floats:
        return self.search.closest(points).point

    def matches(self, points: Floats, normals: Floats) -> tuple[Floats, Bools]:
        """The closest points (n, 3), and which of them are valid matches, (n,)."""
        found = self.search.closest(points)
        facing = np.einsum("nj,nj->n", normals, self.facing[found.triangle])
        return found.point, (facing > _FACING) & (found.distance < _FAR)

    def farthest(self, point: Floats, along: Floats) -> Floats:
        """The vertex around a point that lies farthest along a direction."""
        positions = self.surface.positions
        near = positions[np.linalg.norm(positions - point, axis=1) < _FEATURE]
        return near[(near @ along).argmax()].astype(np.float64) if len(near) else point


def _skin_bent(
    warp: Warp, model: FitModel, seen: _PlacedTarget, held: Floats
) -> tuple[Warp, float]:
    """A warp that brings the skin to the mesh as well, but leaves points (n, 3) of the built-in
    head where they are; and how far the skin is from the mesh then, on average [m]."""
    skin, chosen = model.skin, np.flatnonzero(model.is_open)
    chosen = chosen[first_per_cell(skin.positions[chosen], _FINE)]
    away = np.inf
    for reach in _SKIN_REACHES:
        bent = warp.bent(skin.positions)
        normals = replace(skin, positions=bent).vertex_normals()[chosen]
        here = bent[chosen]
        point, is_match = seen.matches(here, normals)
        fixed = warp.bent(held)
        free = is_match & _far_from(here, fixed, 0.5 * _FINE)
        if not free.any():
            break
        source = np.concatenate([fixed, here[free]])
        wanted = np.concatenate([fixed, point[free]])
        warp = warp.with_bend(source, wanted, reach, _SMOOTH)
        away = float(np.linalg.norm(point[free] - here[free], axis=1).mean())
    return warp, away


def _guessed_similarity(model: FitModel, target: Surface) -> tuple[Floats, float]:
    """(4, 4), from the built-in head to a mesh, the best of several starts; and how far matches
    are then [m]."""
    own, other = find_cranium(model.skin.positions), find_cranium(target.positions)
    up = np.array([0.0, 0.0, 1.0])
    matching = _Matching.of(model, _around(target, other.center, 5.0 * other.half_depth))
    found = []
    for turn in range(_TURNS):
        for size in _SIZES:
            matrix: Floats = np.eye(4)
            matrix[:3, :3] = size * other.half_depth / own.half_depth * _turned(turn / _TURNS)
            tops = [one.center + one.half_depth * up for one in (other, own)]
            matrix[:3, 3] = tops[0] - matrix[:3, :3] @ tops[1]
            found.append(matching.improved(matrix, _FIRST_ROUNDS))
    # a head is expected to face -Y: another direction must be clearly better
    away = np.array([one[1] for one in found])
    expected, best = int(away[: len(_SIZES)].argmin()), int(away.argmin())
    best = expected if away[expected] < _CLEARLY * away[best] else best
    return matching.improved(found[best][0], _ROUNDS)


@dataclass(frozen=True, eq=False)
class _Matching:
    """Closest points both ways, between the built-in head and a mesh in its own space.

    points, normals: of the built-in head. head, own_facing: its triangles and their normals.
    search, facing: the same of the mesh.
    centers: (n, 3) middles of some of the mesh's triangles.
    """

    points: Floats
    normals: Floats
    head: ClosestPointSearch
    own_facing: Floats
    search: ClosestPointSearch
    facing: Floats
    centers: Floats

    @classmethod
    def of(cls, model: FitModel, target: Surface) -> _Matching:
        skin = model.skin
        chosen = np.flatnonzero(model.is_open & (skin.positions[:, 2] > _CHIN))
        chosen = chosen[first_per_cell(skin.positions[chosen], _COARSE)]
        points, normals = skin.positions[chosen], skin.vertex_normals()[chosen]
        centers = target.corners.mean(axis=1).astype(np.float64)
        extent = float(np.ptp(target.positions, axis=0).max())
        centers = centers[first_per_cell(centers, _CENTERS * extent)]
        own = search_of(skin), skin.triangle_normals()
        other = ClosestPointSearch(target), target.triangle_normals()
        return cls(points, normals, *own, *other, centers)

    def improved(self, matrix: Floats, rounds: int) -> tuple[Floats, float]:
        """A similarity improved by rounds of matching, and how far matches are then [m]."""
        away = np.inf
        for _ in range(rounds):
            source, wanted, normal, matched = self._pairs(matrix)
            gap = np.linalg.norm(source - wanted, axis=1)
            if len(gap) < _FEW:
                return matrix, np.inf
            kept = gap <= np.quantile(gap, _TRIMMED)
            away = float(gap[kept].mean()) + _LOST * (1.0 - matched)
            matrix = matrix @ _step(source[kept], wanted[kept], normal[kept])
        return matrix, away

    def _pairs(self, matrix: Floats) -> tuple[Floats, Floats, Floats, float]:
        """Points of the built-in head, where they should be in its space, normals at the points,
        and the fraction of `points` that found a match."""
        back = np.linalg.inv(matrix)
        there = self.search.closest(_moved(self.points, matrix))
        point = _moved(there.point, back)
        normal = unit(self.facing[there.triangle] @ matrix[:3, :3])
        facing = np.einsum("nj,nj->n", self.normals, normal)
        is_match = facing > _FACING
        is_match &= np.linalg.norm(point - self.points, axis=1) < _FAR
        others = _moved(self.centers, back)
        others = others[(others[:, 2] > _CHIN) & (np.abs(others) < _AROUND).all(axis=1)]
        here = self.head.closest(others)
        near = here.distance < _FAR
        source = np.concatenate([self.points[is_match], here.point[near]])
        wanted = np.concatenate([point[is_match], others[near]])
        normals = self.normals[is_match], self.own_facing[here.triangle[near]]
        return source, wanted, np.concatenate(normals), float(is_match.mean())


def _around(target: Surface, center: Floats, reach: float) -> Surface:
    """The part of a mesh around a place, or all of it where that part is empty."""
    near = (np.abs(target.positions - center) < reach).all(axis=1)[target.triangles].any(axis=1)
    triangles = target.triangles[near] if near.any() else target.triangles
    used, index = np.unique(triangles, return_inverse=True)
    return Surface(target.positions[used], index.reshape(-1, 3))


def _own_landmarks(model: FitModel) -> dict[str, Floats]:
    """The landmarks on the skin of the built-in head."""
    places = np.array([point for _, point in LANDMARKS.values()])
    return dict(zip(LANDMARKS, search_of(model.skin).closest(places).point, strict=True))


def _landmark_similarity(names: list[str], source: Floats, wanted: Floats, place: str) -> Floats:
    """The similarity (4, 4) from the built-in head to placed landmarks.

    Raises:
        HairloomError: they are too few, lie on top of each other, or not as on a head.
    """
    matrix = None
    if len(names) >= 4 and np.isfinite(wanted).all():
        matrix = _similarity(source, wanted)
    size = np.linalg.norm(np.ptp(wanted, axis=0)) / np.linalg.norm(np.ptp(source, axis=0))
    for one, other in combinations(range(len(names)), 2):
        if not np.linalg.norm(wanted[one] - wanted[other]) > _APART * size:
            raise HairloomError(
                f"the landmarks {_title(names[one])} and {_title(names[other])} lie on top of "
                "each other",
                place=place,
                remedy="Drag them apart, or delete both to have them guessed again",
            )
    if matrix is None or mean_scale(matrix) < 1e-9:
        raise HairloomError(
            "it has too few landmarks",
            place=place,
            remedy="Delete them all to have them guessed again",
        )
    gap = np.linalg.norm(_moved(wanted, np.linalg.inv(matrix)) - source, axis=1)
    worst = int(gap.argmax())
    if gap[worst] > _MISTAKEN:
        raise HairloomError(
            f"the landmarks do not match a head; {_title(names[worst])} is "
            f"{1000.0 * gap[worst] * mean_scale(matrix):.0f} mm from where it should be",
            place=place,
            remedy="Drag it to its place, or delete all landmarks to have them guessed again",
        )
    return matrix


def _similarity(source: Floats, target: Floats) -> Floats:
    """The similarity (4, 4) that best brings points (n, 3) to others (Umeyama 1991)."""
    middle, other = source.mean(axis=0), target.mean(axis=0)
    here, there = source - middle, target - other
    left, spread, right = np.linalg.svd(there.T @ here)
    signs = np.ones(3)
    if np.linalg.det(left) * np.linalg.det(right) < 0.0:
        signs[2] = -1.0
    turn = left @ np.diag(signs) @ right
    size = (spread * signs).sum() / max(float((here**2).sum()), 1e-300)
    matrix = np.eye(4)
    matrix[:3, :3] = size * turn
    matrix[:3, 3] = other - size * turn @ middle
    return matrix


def _step(source: Floats, target: Floats, normals: Floats) -> Floats:
    """(4, 4), a small similarity that brings points (n, 3) to planes through others (Chen and
    Medioni 1992): unlike points, planes let a round head turn."""
    columns = [np.cross(source, normals), np.einsum("nj,nj->n", source, normals)[:, None], normals]
    table, gap = np.hstack(columns), np.einsum("nj,nj->n", normals, target - source)
    damping = 1e-4 * np.diag(np.einsum("ni,ni->i", table, table))
    found = np.linalg.solve(table.T @ table + damping, table.T @ gap)
    turn, size, shift = found[:3], 1.0 + np.clip(found[3], -0.2, 0.2), found[4:]
    angle = float(np.linalg.norm(turn))
    x, y, z = turn / max(angle, 1e-12)
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = min(angle, 0.5)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
    matrix[:3, :3] *= size
    matrix[:3, 3] = shift
    return matrix


def first_per_cell(points: Floats, apart: float) -> Ints:
    """The index of the first point in each cube of this size."""
    cell = np.floor(points / apart).astype(np.int64)
    return np.sort(np.unique(cell, axis=0, return_index=True)[1])


def _far_from(points: Floats, others: Floats, min_distance: float) -> Bools:
    if not len(others):
        return np.ones(len(points), bool)
    return np.asarray(nearest_points(points, others, 1)[1][:, 0] > min_distance)


def _wendland(points: Floats, centers: Floats, reach: float) -> Floats:
    """Wendland's function of the distances between points (n, 3) and centres (m, 3), (n, m)."""
    squared = (points**2).sum(axis=1)[:, None] + (centers**2).sum(axis=1) - 2.0 * points @ centers.T
    ratio = np.sqrt(np.clip(squared / reach**2, 0.0, 1.0))
    left = 1.0 - ratio
    left *= left
    left *= left
    ratio *= 4.0
    ratio += 1.0
    ratio *= left
    return ratio


def _turned(part: float) -> Floats:
    """The rotation (3, 3) around Z by a fraction of a whole turn."""
    c, s = np.cos(2.0 * np.pi * part), np.sin(2.0 * np.pi * part)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _moved(points: Floats, matrix: Floats) -> Floats:
    """Points transformed in double precision, unlike `affine.transform_points`."""
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])


def _title(name: str) -> str:
    return f"'{LANDMARKS[name][0]}'"
