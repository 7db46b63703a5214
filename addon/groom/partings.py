"""Partings: lines on the scalp across which no strand follows a guide.

A parting is a curtain that stands on the scalp along its line. Two roots are on different sides of
it where the straight line between them crosses the curtain. So a parting may end in the middle of
the hair: beyond its end, roots beside each other are not parted.

Limitation: roots are compared along a straight line, so roots that are far apart, as on both sides
of a head, are not parted by a line that runs around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats
from ..strands import StrandSet, Surface
from ..strands.arc_length import length_fractions
from ..strands.closest_point import search_of
from ..strands.nearest import nearest_points
from ..strands.vectors import dot, unit, unit_or
from .parting_settings import PartingSettings

#: Pieces of a line are extended by this fraction of their length, which leaves no gap between them
#: where the line bends.
_OVERLAP = 0.05
#: Height of a parting's curtain above and below its line, as a fraction of the roots' distance.
_HEIGHT = 0.5
#: Crossings nearer to a root than this fraction of the line between two roots do not count: a root
#: on a parting is on both sides of it.
_END = 1.0e-6
_CHUNK = 512


@dataclass(frozen=True, eq=False)
class Partings:
    """Pieces of all lines, in the space of the roots.

    begin, end: (piece_count, 3) [m], on the surface. normal: (piece_count, 3), unit.
    """

    begin: Floats
    end: Floats
    normal: Floats

    @classmethod
    def of(cls, pieces: Floats, surface: Surface) -> Partings:
        """Partings from lines that were drawn near the surface.

        Args:
            pieces: (piece_count, 2, 3) [m], the straight pieces of all lines.
        """
        found = search_of(surface).closest(pieces.reshape(-1, 3))
        ends = found.point.reshape(-1, 2, 3)
        corners = surface.triangles[found.triangle]
        normals = surface.vertex_normals()[corners]
        normal = np.einsum("nk,nkj->nj", found.barycentric, normals).reshape(-1, 2, 3)
        return cls(ends[:, 0], ends[:, 1], unit(normal.mean(axis=1)))

    def crossed(self, root: Floats, other: Floats) -> Bools:
        """Whether a parting is between roots (n, 3) and others (n, k, 3), (n, k)."""
        is_crossed = np.zeros(other.shape[:2], bool)
        if not len(self.begin) or not other.size:
            return is_crossed
        gap = np.linalg.norm(other - root[:, None], axis=2)
        middle = (self.begin + self.end) / 2.0
        half = float(np.linalg.norm(self.end - self.begin, axis=1).max()) * (0.5 + _OVERLAP)
        _, away = nearest_points(root, middle, 1)
        # the curtain leans where the scalp is curved, so that what passes above is farther away
        reach = (1.0 + _HEIGHT) * gap.max(axis=1) + half
        near = np.flatnonzero(away[:, 0] <= reach)
        for start in range(0, len(near), _CHUNK):
            some = near[start : start + _CHUNK]
            is_crossed[some] = self._crossed(root[some], other[some])
        return is_crossed

    def _crossed(self, root: Floats, other: Floats) -> Bools:
        """`crossed`, tested with every piece."""
        along = self.end - self.begin
        across = np.cross(self.normal, along)
        from_root = _offsets_across(root, self.begin, across)[:, None]  # (n, 1, m)
        from_other = _offsets_across(other, self.begin, across)  # (n, k, m)
        row, column, piece = np.nonzero(from_root * from_other < 0.0)
        one, two = from_root[row, 0, piece], from_other[row, column, piece]
        part = one / (one - two)
        start = root[row].astype(np.float64)
        line = other[row, column] - start
        meets = start + part[:, None] * line - self.begin[piece]
        size = np.maximum(dot(along, along), 1e-30)
        place = dot(meets, along[piece]) / size[piece]
        height = np.abs(dot(meets, self.normal[piece]))
        meets_piece = (
            (part > _END)
            & (part < 1.0 - _END)
            & (place >= -_OVERLAP)
            & (place <= 1.0 + _OVERLAP)
            & (height <= _HEIGHT * np.linalg.norm(line, axis=1))
        )
        is_crossed = np.zeros(other.shape[:2], bool)
        is_crossed[row[meets_piece], column[meets_piece]] = True
        return is_crossed

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        """How far points (n, 3) are from the nearest line [m], and the place on it, (n, 3)."""
        best, place = np.full(len(points), np.inf), np.zeros((len(points), 3))
        along = self.end - self.begin
        for begin, piece in zip(self.begin, along, strict=True):
            part = dot(points - begin, piece) / max(float(dot(piece, piece)), 1e-30)
            there = begin + np.clip(part, 0.0, 1.0)[:, None] * piece
            away = np.linalg.norm(points - there, axis=1)
            is_nearer = away < best
            best[is_nearer], place[is_nearer] = away[is_nearer], there[is_nearer]
        return best, place


def _offsets_across(points: Floats, begin: Floats, across: Floats) -> Floats:
    """(points - begin) . across of points (..., 3) and pieces (m, 3), (..., m)."""
    middle = begin.mean(axis=0)
    found: Floats = np.zeros((*points.shape[:-1], 1)) - dot(begin - middle, across)
    for axis in range(3):
        found += (points[..., axis, None] - middle[axis]) * across[:, axis]
    return found


def comb_from_partings(
    strands: StrandSet, partings: Partings, surface: Surface, settings: PartingSettings
) -> Floats:
    """Points of strands whose roots lean away from partings, (point_count, 3) float32 [m].

    Segments keep their lengths; they turn less with distance from a parting and along their strand.

    Args:
        strands: bound to the surface.
    """
    assert strands.root_triangle is not None and strands.root_barycentric is not None
    offsets, counts, length = strands.offsets, strands.point_counts, strands.lengths()
    roots = strands.roots.astype(np.float64)
    away, place = partings.distance(roots)
    width = max(settings.width * float(np.median(length)), 1e-30)
    corners = surface.vertex_normals()[surface.triangles[strands.root_triangle]]
    normal = unit(np.einsum("nk,nkj->nj", strands.root_barycentric, corners))
    beside: Floats = roots - place
    beside = unit(beside - normal * dot(beside, normal)[:, None])
    target = unit(beside + settings.lift * normal)
    pull = settings.amount * _fading(away / width)
    # a root on the parting itself has no side
    pull[~beside.any(axis=1)] = 0.0
    fade = _fading(length_fractions(strands.points, offsets) / settings.along)
    weight = (np.repeat(pull, counts) * fade)[:, None]
    step = np.diff(strands.points.astype(np.float64), axis=0, prepend=strands.points[:1])
    size = np.linalg.norm(step, axis=1, keepdims=True)
    aim = np.repeat(target, counts, axis=0)
    turned = unit_or((1.0 - weight) * unit(step) + weight * aim, aim) * size
    turned[offsets[:-1]] = roots
    reached = np.cumsum(turned, axis=0)
    before = reached[offsets[:-1]] - roots
    points: Floats = (reached - np.repeat(before, counts, axis=0)).astype(np.float32)
    is_far = np.repeat(pull == 0.0, counts)
    points[is_far] = strands.points[is_far]
    return points


def _fading(x: Floats) -> Floats:
    """1 at 0, 0 from 1 on, smooth between."""
    x = np.clip(x, 0.0, 1.0)
    return 1.0 - x * x * (3.0 - 2.0 * x)
