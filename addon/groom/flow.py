"""Flow: hair follows strokes that are drawn on its surface.

Strokes give a field of directions around them. A strand is traced through this field from its root
by the midpoint rule, and keeps its own directions where no stroke is near. A stroke's direction is
relative to the surface: a direction along it, and how much the stroke rises from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats
from ..strands import StrandSet, Surface
from ..strands.arc_length import segment_lengths
from ..strands.closest_point import search_of
from ..strands.nearest import nearest_points
from ..strands.vectors import dot, unit, unit_or
from .flow_settings import FlowSettings

#: Strokes are sampled in steps of at most this fraction of the reach.
_STEP = 1.0 / 24.0
#: Maximum steps of one stroke, which bounds the time if the reach is tiny.
_MAX_STEPS = 4096
#: A stroke has no effect where the cosine between the normals of both places is below this.
_FACING = -0.9


@dataclass(frozen=True, eq=False)
class _Stroke:
    """points: (n, 3) [m], close together. along: (n, 3), its direction along the surface there.
    rise: (n,), the cosine between its direction and the surface's normal. normal: (n, 3).
    length: [m].
    """

    points: Floats
    along: Floats
    rise: Floats
    normal: Floats
    length: float

    @classmethod
    def of(cls, line: Floats, surface: Surface, step: float) -> _Stroke:
        """A stroke along a line (m, 3), from its first point to its last."""
        size = np.linalg.norm(np.diff(line, axis=0), axis=1)
        reached = np.concatenate([[0.0], np.cumsum(size)])
        count = int(np.clip(np.ceil(reached[-1] / step), 2, _MAX_STEPS)) + 1
        places = np.linspace(0.0, reached[-1], count)
        points = np.stack([np.interp(places, reached, axis) for axis in line.T], axis=1)
        direction, normal = unit(np.gradient(points, axis=0)), _normals(points, surface)
        rise = dot(direction, normal)
        along = direction - rise[:, None] * normal
        return cls(points, along, rise, normal, float(reached[-1]))


@dataclass(frozen=True, eq=False)
class Flow:
    """All strokes on one surface, and how hair follows them.

    reach: [m].
    """

    strokes: tuple[_Stroke, ...]
    surface: Surface
    reach: float
    settings: FlowSettings

    def at(self, places: Floats) -> tuple[Floats, Floats, Floats]:
        """At places (n, 3): the unit direction of hair, (n, 3), 0 where no stroke is near; how far
        hair turns to it, (n,), 0 to 1; and the mean length of the strokes near, (n,) [m]."""
        aim, pull = np.zeros((len(places), 3)), np.zeros(len(places))
        length, total = np.zeros(len(places)), np.zeros(len(places))
        normal = _normals(places, self.surface)
        for stroke in self.strokes:
            index, away = nearest_points(places, stroke.points, 1)
            near = index[:, 0]
            facing = dot(stroke.normal[near], normal)
            weight = self._fading(away[:, 0]) * (facing > _FACING)
            both = stroke.normal[near] + normal
            along = stroke.along[near]
            lean = dot(normal, along) / np.maximum(1.0 + facing, 1.0 + _FACING)
            along = along - lean[:, None] * both  # turned as the surface turns in between
            rise = stroke.rise[near] + self.settings.lift
            aim += weight[:, None] * unit(along + rise[:, None] * normal)
            pull = np.maximum(pull, weight)
            length += weight * stroke.length
            total += weight
        length = np.divide(length, total, out=length, where=total > 0.0)
        return unit(aim), self.settings.amount * pull, length

    def _fading(self, away: Floats) -> Floats:
        """1 at a stroke, 0 beyond the reach."""
        width = max(self.settings.falloff, 1e-6)
        x = np.clip((away / self.reach - (1.0 - width)) / width, 0.0, 1.0)
        fading: Floats = 1.0 - x * x * (3.0 - 2.0 * x)
        return fading


def comb_along_strokes(
    strands: StrandSet, lines: tuple[Floats, ...], surface: Surface, settings: FlowSettings
) -> Floats:
    """Points of strands that follow strokes, (point_count, 3) float32 [m]; strands out of reach
    stay as they are.

    Args:
        lines: (m, 3) [m] each, from where hair comes to where it goes.
    """
    reach = max(settings.reach * float(np.median(strands.lengths())), 1e-30)
    strokes = tuple(_Stroke.of(line, surface, _STEP * reach) for line in lines)
    flow = Flow(strokes, surface, reach, settings)
    points, first = strands.points.astype(np.float64), strands.offsets[:-1]
    size = segment_lengths(strands.points, strands.offsets)
    own = unit(np.diff(points, axis=0, prepend=points[:1]))
    _, pull, length = flow.at(points[first])
    was = np.maximum(strands.lengths().astype(np.float64), 1e-30)
    factor = 1.0 + settings.length * pull * (length / was - 1.0)
    size *= np.repeat(factor, strands.point_counts)
    is_changed: Bools = np.abs(factor - 1.0) > 1e-9
    for number in range(1, int(strands.point_counts.max(initial=1))):
        which = np.flatnonzero(strands.point_counts > number)
        end = first[which] + number
        start, step = points[end - 1].copy(), size[end, None]
        towards, turned = _direction(flow, start, own[end])
        towards, there = _direction(flow, start + 0.5 * step * towards, own[end])
        is_changed[which] |= turned | there
        points[end] = start + step * towards
    kept = np.repeat(~is_changed, strands.point_counts)
    points[kept] = strands.points[kept]
    return points.astype(np.float32)


def _direction(flow: Flow, places: Floats, own: Floats) -> tuple[Floats, Bools]:
    """The unit direction of hair, and whether strokes turn it.

    Args:
        own: (n, 3), its direction without strokes.
    """
    aim, pull, _ = flow.at(places)
    return unit_or((1.0 - pull)[:, None] * own + pull[:, None] * aim, own), pull > 0.0


def _normals(points: Floats, surface: Surface) -> Floats:
    """Normals of the surface at its points closest to these, (n, 3)."""
    found = search_of(surface).closest(points)
    corners = surface.vertex_normals()[surface.triangles[found.triangle]]
    return unit(np.einsum("nk,nkj->nj", found.barycentric, corners))
