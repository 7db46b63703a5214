"""From which side hair is best seen, found from where it grows.

A candidate direction of view is as good as much hair is seen from there, and as much of the face:
what of the body is bare amidst the hair. Their product is largest between the front and the side of
a head, in front of a patch of fur, and beside a beast with its head towards the eye. It is never
large from the edge of a sheet, nor from behind a face.

Where no face is seen, as of a beast in fur all over, the coat tells: it lies from the nose to the
tail. Seen from behind it also shows the ends of its strands. These send little light to the eye,
whatever lights there are in front, since light leaves a strand in a cone around it.

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

#: directions around the hair that are tried
_AROUND = 16
#: how far above the hair the eye may be, as z of a direction of unit length across; and how good
#: it is to look from there
_HEIGHTS = ((0.16, 1.0), (0.4, 0.92), (0.7, 0.8), (1.7, 0.6))
#: one looks at a head from no higher than this many of these, if this much of its face is seen from
#: its own height
_LOW_HEIGHTS, _LEVEL_FACE = 2, 0.5
#: a three-quarter view is turned by this from the front [rad], and one nearly from the side, which
#: is so much less good, by this: a crest and a braid are seen from there
_THREE_QUARTER, _ASIDE = float(np.radians(29.0)), float(np.radians(67.0))
_TURNS = ((_THREE_QUARTER, 1.0), (_ASIDE, 0.74))
#: what counts where no face is seen, as a fraction of the whole face
_WITHOUT_FACE = 0.35
#: a face is seen at least as large as this, as a fraction of the hair
_MIN_FACE = 0.02
#: there is a front where the directions' goodness leans to one side by this fraction
_MIN_LEAN = 0.06
#: and where the directions from which a face is seen do by this
_MIN_FACE_LEAN = 0.2
#: a coat lies to one side where its strands lead there by this fraction of their lengths; and it is
#: seen against its lie if that shows this fraction of the hair that the other way round does
_MIN_LIE, _MIN_AGAINST = 0.2, 0.5
#: how much better the front in Blender's sense, towards -Y, is than the back, and one three-quarter
#: view than the other, where all else is equal
_PREFERENCE = 0.04
#: bare is what is farther from all roots than these neighbours are apart, times this; and than
#: this fraction of the roots' extent
_BARE_SPACINGS, _BARE_FRACTION = 4.0, 0.12
#: a face lies within the roots' extent, times this
_FACE_REACH = 1.35
#: and higher than this fraction of the roots
_LOWEST = 0.03
#: points that stand for hair, roots and body, and cells across what is seen
_HAIR, _ROOTS, _BODY, _CELLS = 20_000, 3_000, 16_000, 56
#: and of each strand whose points are where its shape needs them
_CVS = 16


@dataclass(frozen=True)
class GoodSide:
    """Directions from the hair towards an eye, (3,) each.

    front: level, of unit length. three_quarter: where it is best seen.
    """

    front: Floats
    three_quarter: Floats

    def turned(self, degrees: float, height: float) -> Floats:
        """The front turned to the side on which the three-quarter view is; height: its z."""
        left = self.front[0] * self.three_quarter[1] - self.front[1] * self.three_quarter[0]
        turned = _turned(self.front, np.copysign(np.radians(degrees), left))
        return np.array([turned[0], turned[1], height])


def good_side(strands: StrandSet, body: Surface | None) -> GoodSide:
    """Of hair at rest on its body, world space."""
    seen = _Seen.of(strands, body)
    angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    level = np.stack([np.sin(angles), -np.cos(angles), np.zeros(_AROUND)], axis=1)
    areas = np.array([seen.areas(_raised(each, _HEIGHTS[0][0])) for each in level])
    whole = areas.max(axis=0)
    is_face = whole[1] > _MIN_FACE * whole[0]
    good = _goodness(areas, whole) * (1.0 - 0.5 * _PREFERENCE * level[:, 1])
    front = None if is_face else seen.against_lie()
    # beside a coat one looks at ends again
    turns = ((_THREE_QUARTER, 1.0),) if front is not None else _TURNS
    # short hair is seen as well from behind, but a face only from its front
    if front is None:
        front = _leaning(good, level, _MIN_LEAN)
    face = _leaning(areas[:, 1], level, _MIN_FACE_LEAN) if is_face else None
    if face is not None and (front is None or front @ face < 0.0):
        front = face
    if front is None:  # the best is the three-quarter view
        front = _turned(level[good.argmax()], _THREE_QUARTER)
    # in this order, so that of equals the first wins
    candidates = [
        (_raised(_turned(front, turn), height), factor * preferred * aside)
        for height, factor in _HEIGHTS
        for away, aside in turns
        for turn, preferred in ((-away, 1.0 + _PREFERENCE), (away, 1.0))
    ]
    asked = np.array([seen.areas(direction) for direction, _ in candidates])
    if is_face and asked[:2, 1].max() > _LEVEL_FACE * whole[1]:
        low = 2 * len(turns) * _LOW_HEIGHTS  # to both sides
        candidates, asked = candidates[:low], asked[:low]
    factors = np.array([factor for _, factor in candidates])
    best = (_goodness(asked, np.maximum(whole, asked.max(axis=0))) * factors).argmax()
    return GoodSide(front, candidates[best][0])


def _leaning(good: Floats, level: Floats, least: float) -> Floats | None:
    """The unit direction to which the directions' goodness leans; None where by too little."""
    lean: Floats = (good[:, None] * level).sum(axis=0)
    length = np.linalg.norm(lean)
    return lean / length if length > least * good.sum() else None


def _goodness(areas: Floats, whole: Floats) -> Floats:
    """Of areas (n, 2) of hair and face, where the largest of them are `whole`."""
    hair, face = areas[:, 0] / max(whole[0], 1.0), areas[:, 1] / max(whole[1], 1.0)
    return hair * (_WITHOUT_FACE + face) if whole[1] > _MIN_FACE * whole[0] else hair


def _raised(level: Floats, height: float) -> Floats:
    return np.array([level[0], level[1], height])


def _turned(direction: Floats, angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = direction
    return np.array([cosine * x - sine * y, sine * x + cosine * y, z])


@dataclass(frozen=True)
class _Seen:
    """Points that stand for hair and body, as a picture of few cells sees them.

    points: (n, 3) [m] from the middle. kind: (n,) 0 body, 1 hair, 2 face. cell: its side [m].
    lie: (3,) mean chord from root to tip, level, as a fraction of the strands' lengths.
    """

    points: Floats
    kind: Ints
    cell: float
    lie: Floats

    @classmethod
    def of(cls, strands: StrandSet, body: Surface | None) -> _Seen:
        # without roots, which are seen from both sides of a sheet
        grid = _evenly_spaced(strands).grid
        hair: Floats = _some(grid[:, 1:].reshape(-1, 3), _HAIR).astype(np.float64)
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
        """The level unit direction from which hair lies away; None where it lies to no side, or is
        seen from the other side alone, as in front of a wall."""
        length = float(np.linalg.norm(self.lie))
        if length < _MIN_LIE:
            return None
        front = -self.lie / length
        against, along = (self.areas(_raised(each, _HEIGHTS[0][0]))[0] for each in (front, -front))
        return front if against > _MIN_AGAINST * along else None

    def areas(self, direction: Floats) -> tuple[int, int]:
        """In how many cells hair is seen, and in how many the face."""
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
    """The same hair in points that say how long it is; few strands will do."""
    if strands.is_uniform:
        return strands
    few = strands.take(_some(np.arange(strands.strand_count), -(-_HAIR // _CVS)))
    return resample(few, _CVS)


def _lie(grid: Floats) -> Floats:
    """Of strands (n, cv_count, 3): see `_Seen.lie`."""
    chord = grid[:, -1].astype(np.float64) - grid[:, 0]
    whole = float(np.linalg.norm(chord, axis=1).sum())
    return chord.sum(axis=0) * (1.0, 1.0, 0.0) / max(whole, 1e-30)


def _some[Array: (Floats, Ints)](points: Array, count: int) -> Array:
    """Evenly many of the points, or all."""
    return points[:: -(-len(points) // count)]


def _places_on(body: Surface, middle: Floats, reach: float) -> Floats:
    """Points (n, 3) spread over what of the body is within reach of the hair's middle."""
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
    """Which of the places are bare, with the hair around them."""
    roots = _some(roots, _ROOTS)
    middle = roots.mean(axis=0)
    extent = float(np.linalg.norm(roots - middle, axis=1).max())
    spacing = float(np.median(nearest_points(roots, roots, 2)[1][:, -1]))
    reach = max(_BARE_SPACINGS * spacing, _BARE_FRACTION * extent)
    is_near = np.linalg.norm(places - middle, axis=1) < _FACE_REACH * extent
    # a neck is seen from all sides and says nothing
    is_near &= places[:, 2] > np.quantile(roots[:, 2], _LOWEST)
    found = np.zeros(len(places), bool)
    found[is_near] = nearest_points(places[is_near], roots, 1)[1][:, 0] > reach
    return found
