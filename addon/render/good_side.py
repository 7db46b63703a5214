"""The side from which hair is best seen, found from where it grows, and from the mesh of its body.

The front is where the body's mesh is finest, as that of a face is, however much hair covers it.
Where the mesh is as fine on all sides, the front is found from the hair:

A candidate direction of view is rated by the product of how much hair and how much of the face is
visible from there. The face is the bare part of the body amidst the hair. The product is largest
between the front and the side of a head, in front of a patch of fur, and beside an animal with its
head towards the eye. It is small from the edge of a sheet, and from behind a face.

If no face is visible, as on an animal with fur all over, the lie of the coat decides: it runs from
the nose to the tail. From behind one would also see the ends of its strands, which look dark under
lights in front, since light leaves a strand in a cone around it. Where all of this says little, the
front is Blender's, -Y.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.nearest import nearest_points
from ..strands.resample import resample
from ..strands.triangles import areas_of

#: number of directions around the hair that are tried
_AROUND = 16
#: the convention for models in Blender
_BLENDERS_FRONT = np.array([0.0, -1.0, 0.0])
#: heights of the eye, as z of a direction whose horizontal part has unit length, and their ratings
_HEIGHTS = ((0.16, 1.0), (0.4, 0.92), (0.7, 0.8), (1.7, 0.6))
#: only this many of the lowest heights are tried for a head, if at least this fraction of the whole
#: face is visible from its own height
_LOW_HEIGHTS, _LEVEL_FACE = 2, 0.5
#: angles from the front [rad], with ratings: a three-quarter view, and one nearly from the side,
#: which shows a crest or a braid
_THREE_QUARTER, _ASIDE = float(np.radians(29.0)), float(np.radians(67.0))
_TURNS = ((_THREE_QUARTER, 1.0), (_ASIDE, 0.74))
#: added to the visible fraction of the face, so that views without a face count too
_WITHOUT_FACE = 0.35
#: smallest visible area of a face, as a fraction of that of the hair
_MIN_FACE = 0.02
#: there is a front if the ratings of the directions lean to one side by this fraction; if the hair
#: hides the face of its body, by this one, since hair on one side is no sign of a face
_MIN_LENGTH, _MIN_HIDDEN_LENGTH = 0.06, 0.3
#: the middle of the triangles of a mesh with a face lies this far from that of their areas, as a
#: fraction of their extent; a mesh is flat, as a wall is, if its horizontal extents differ more
_MIN_FINENESS, _MIN_THICKNESS = 0.25, 0.25
#: there is a front if the directions from which the face is visible lean by this
_MIN_FACE_LENGTH = 0.2
#: smallest length of `_PointCloud.lie` for a coat to have a lie; and the smallest visible area
#: against the lie, as a fraction of that from the opposite side
_MIN_LIE, _MIN_AGAINST = 0.2, 0.5
#: preference for Blender's front, towards -Y, over the back, and for one three-quarter view over
#: the other, where all else is equal
_PREFERENCE = 0.04
#: a place is bare if it is farther from all roots than this many spacings of the roots, and than
#: this fraction of their extent
_BARE_SPACINGS, _BARE_FRACTION = 4.0, 0.12
#: a face lies within the roots' extent times this
_FACE_REACH = 1.35
#: and above this quantile of the roots' heights
_LOWEST = 0.03
#: numbers of points that represent hair, roots and body, and of cells across the hair
_HAIR, _ROOTS, _BODY, _CELLS = 20_000, 3_000, 16_000, 56
#: points of each resampled strand, where points are not evenly spaced
_CVS = 16


@dataclass(frozen=True)
class GoodSide:
    """Directions from the hair towards an eye, (3,) each.

    front: horizontal, of unit length. three_quarter: the best direction of view.
    """

    front: Floats
    three_quarter: Floats

    def turned(self, degrees: float, height: float) -> Floats:
        """The front, turned towards the three-quarter view, (3,); height: z of the result."""
        left = self.front[0] * self.three_quarter[1] - self.front[1] * self.three_quarter[0]
        turned = _turned(self.front, np.copysign(np.radians(degrees), left))
        return np.array([turned[0], turned[1], height])


def good_side(strands: StrandSet, body: Surface | None) -> GoodSide:
    """The best directions for hair at rest on its body, world space."""
    cloud = _PointCloud.of(strands, body)
    angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    level = np.stack([np.sin(angles), -np.cos(angles), np.zeros(_AROUND)], axis=1)
    areas = np.array([cloud.areas(_raised(each, _HEIGHTS[0][0])) for each in level])
    whole = areas.max(axis=0)
    is_face = whole[1] > _MIN_FACE * whole[0]
    ratings = _ratings(areas, whole) * (1.0 - 0.5 * _PREFERENCE * level[:, 1])
    of_mesh = None if body is None else _front_of_mesh(body, strands.roots)
    front = None if is_face else cloud.against_lie()
    # from nearly beside a coat the ends of its strands are visible again
    turns = ((_THREE_QUARTER, 1.0),) if front is not None else _TURNS
    # short hair is visible from behind too, but a face only from the front
    if front is None:
        is_hidden = body is not None and not is_face
        min_length = _MIN_HIDDEN_LENGTH if is_hidden else _MIN_LENGTH
        front = _mean_direction(ratings, level, min_length)
    face = _mean_direction(areas[:, 1], level, _MIN_FACE_LENGTH) if is_face else None
    if face is not None and (front is None or front @ face < 0.0):
        front = face
    if of_mesh is not None:
        front = of_mesh
    if front is None:
        front = _raised(_BLENDERS_FRONT, 0.0)
    # in this order, so that of equals the first wins
    candidates = [
        (_raised(_turned(front, turn), height), factor * preferred * aside)
        for height, factor in _HEIGHTS
        for away, aside in turns
        for turn, preferred in ((-away, 1.0 + _PREFERENCE), (away, 1.0))
    ]
    tried = np.array([cloud.areas(direction) for direction, _ in candidates])
    if is_face and tried[:2, 1].max() > _LEVEL_FACE * whole[1]:
        low = 2 * len(turns) * _LOW_HEIGHTS  # to both sides
        candidates, tried = candidates[:low], tried[:low]
    factors = np.array([factor for _, factor in candidates])
    best = (_ratings(tried, np.maximum(whole, tried.max(axis=0))) * factors).argmax()
    return GoodSide(front, candidates[best][0])


def _front_of_mesh(body: Surface, roots: Floats) -> Floats | None:
    """The horizontal unit direction in which the mesh is finest, above the lowest roots; None if it
    is as fine on all sides, or flat."""
    corners = body.corners.astype(np.float64)
    places, areas = corners.mean(axis=1), areas_of(corners)
    is_used = (places[:, 2] > np.quantile(roots[:, 2], _LOWEST)) & (areas > 0.0)
    if not is_used.any():
        return None
    places, areas = places[is_used, :2], areas[is_used] / areas[is_used].sum()
    places -= areas @ places
    spread = np.sqrt(np.linalg.eigvalsh(places.T @ (areas[:, None] * places)).clip(min=0.0))
    finest: Floats = places.mean(axis=0)
    length = float(np.linalg.norm(finest))
    if length < _MIN_FINENESS * np.linalg.norm(spread) or spread[0] <= _MIN_THICKNESS * spread[1]:
        return None
    return _raised(finest / length, 0.0)


def _mean_direction(ratings: Floats, level: Floats, min_length: float) -> Floats | None:
    """The unit direction to which the ratings of directions lean; None if by too little."""
    lean: Floats = (ratings[:, None] * level).sum(axis=0)
    length = np.linalg.norm(lean)
    return lean / length if length > min_length * ratings.sum() else None


def _ratings(areas: Floats, whole: Floats) -> Floats:
    """Ratings (n,) of visible areas (n, 2) of hair and face, of which `whole` are the largest."""
    hair, face = areas[:, 0] / max(whole[0], 1.0), areas[:, 1] / max(whole[1], 1.0)
    return hair * (_WITHOUT_FACE + face) if whole[1] > _MIN_FACE * whole[0] else hair


def _raised(level: Floats, height: float) -> Floats:
    return np.array([level[0], level[1], height])


def _turned(direction: Floats, angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = direction
    return np.array([cosine * x - sine * y, sine * x + cosine * y, z])


@dataclass(frozen=True)
class _PointCloud:
    """Points that represent hair and body, for pictures of few cells.

    points: (n, 3) [m] from the middle. kind: (n,) 0 body, 1 hair, 2 face. cell: side of a cell [m].
    lie: (3,) the horizontal part of the mean direction from root to tip.
    """

    points: Floats
    kind: Ints
    cell: float
    lie: Floats

    @classmethod
    def of(cls, strands: StrandSet, body: Surface | None) -> _PointCloud:
        # without roots, which are visible from both sides of a sheet
        grid = _evenly_spaced(strands).grid
        hair: Floats = _subset(grid[:, 1:].reshape(-1, 3), _HAIR).astype(np.float64)
        middle = 0.5 * (hair.min(axis=0) + hair.max(axis=0))
        radius = max(float(np.linalg.norm(hair - middle, axis=1).max()), 1e-30)
        points: list[Floats] = [hair]
        kind = [np.ones(len(hair), int)]
        if body is not None and len(body.triangles):
            places = _places_on(body, middle, 2.0 * radius)
            points.append(places)
            kind.append(np.where(_is_face(places, strands.roots.astype(np.float64)), 2, 0))
        cell = 2.0 * radius / _CELLS
        return cls(np.concatenate(points) - middle, np.concatenate(kind), cell, _lie(grid))

    def against_lie(self) -> Floats | None:
        """The horizontal unit direction towards an eye that looks along the lie of the hair; None
        if it has no lie, or is visible mainly from the other side, as in front of a wall."""
        length = float(np.linalg.norm(self.lie))
        if length < _MIN_LIE:
            return None
        front = -self.lie / length
        against, along = (self.areas(_raised(each, _HEIGHTS[0][0]))[0] for each in (front, -front))
        return front if against > _MIN_AGAINST * along else None

    def areas(self, direction: Floats) -> tuple[int, int]:
        """The number of cells that show hair, and of those that show the face."""
        towards = direction / np.linalg.norm(direction)
        right = np.cross([0.0, 0.0, 1.0], towards)
        right /= np.linalg.norm(right)
        across = np.stack([right, np.cross(towards, right)], axis=1)
        column, row = np.clip(self.points @ across // self.cell, -_CELLS, _CELLS - 1).astype(int).T
        order = np.argsort(self.points @ towards, kind="stable")
        nearest = np.zeros((2 * _CELLS) ** 2, int)
        nearest[(row * 2 * _CELLS + column)[order]] = self.kind[order]  # the last one stays
        return int((nearest == 1).sum()), int((nearest == 2).sum())


def _evenly_spaced(strands: StrandSet) -> StrandSet:
    """The hair with evenly spaced points; a sample of strands where it is resampled."""
    if strands.is_uniform:
        return strands
    few = strands.take(_subset(np.arange(strands.strand_count), -(-_HAIR // _CVS)))
    return resample(few, _CVS)


def _lie(grid: Floats) -> Floats:
    """`_PointCloud.lie` of strands (n, cv_count, 3)."""
    chord = grid[:, -1].astype(np.float64) - grid[:, 0]
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    # each strand counts the same: a tail at one side is no lie of the coat
    mean: Floats = (chord / np.maximum(length, 1e-30)).mean(axis=0) * (1.0, 1.0, 0.0)
    return mean


def _subset[Array: (Floats, Ints)](points: Array, count: int) -> Array:
    """An even subset of at most `count` points."""
    return points[:: -(-len(points) // count)]


def _places_on(body: Surface, middle: Floats, reach: float) -> Floats:
    """Points (n, 3) spread over the part of the body within reach of the hair's middle."""
    corners = body.corners.astype(np.float64)
    near = np.linalg.norm(corners - middle, axis=2).min(axis=1) < reach
    corners = corners[near] if near.any() else corners
    a, b, c = corners.transpose(1, 0, 2)
    random = np.random.default_rng(0)
    ends = np.cumsum(areas_of(corners))
    chosen = np.searchsorted(ends, random.random(_BODY) * ends[-1]).clip(0, len(ends) - 1)
    u, v = np.sort(random.random((2, _BODY)), axis=0)[:, :, None]
    return u * a[chosen] + (v - u) * b[chosen] + (1.0 - v) * c[chosen]


def _is_face(places: Floats, roots: Floats) -> Bools:
    """Which of the places are bare skin amidst the hair."""
    roots = _subset(roots, _ROOTS)
    middle = roots.mean(axis=0)
    extent = float(np.linalg.norm(roots - middle, axis=1).max())
    spacing = float(np.median(nearest_points(roots, roots, 2)[1][:, -1]))
    reach = max(_BARE_SPACINGS * spacing, _BARE_FRACTION * extent)
    is_near = np.linalg.norm(places - middle, axis=1) < _FACE_REACH * extent
    # a neck is visible from all sides, so it does not help
    is_near &= places[:, 2] > np.quantile(roots[:, 2], _LOWEST)
    found = np.zeros(len(places), bool)
    found[is_near] = nearest_points(places[is_near], roots, 1)[1][:, 0] > reach
    return found
