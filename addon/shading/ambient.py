"""Ambient occlusion of hair: how much of the sky's light reaches a point through hair and body.

Also by direction, for light that is not the same from everywhere: see `openness`.

The hair becomes a grid of extinction coefficients, light dies in it by Beer and Lambert's law,
and the 26 directions to a cell's neighbours stand for all directions with the weights of
Lebedev's quadrature of degree 7 (Lebedev 1976). The optical depth along each direction is one
running sum over the whole grid, so that the cost does not grow with the number of points.

Limitations: nothing outside of the hair's bounding box shades; detail below a cell is lost.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..arrays import Floats
from ..strands import StrandSet, Surface
from .ambient_settings import AmbientSettings
from .density_grid import Grid, body_depth, grid_around, hair_depth, sample

#: From a cell to one of its 26 neighbours.
type Step = tuple[int, int, int]
#: Lebedev's weights of 26 directions: 6 along axes, 12 across edges, 8 across corners; sum 1.
_DIRECTION_WEIGHTS = {1: 1 / 21, 2: 4 / 105, 3: 9 / 280}


#: Where light on the skin is measured, above it, so that it lies in the hair [cells].
_SKIN_CLEARANCE = 0.5


def ambient_occlusion(
    strands: StrandSet, points: Floats, body: Surface | None, settings: AmbientSettings
) -> Floats:
    """How open each point is, (n,) float32: 1 at the outside of the hair, 0 where no light comes.

    Args:
        strands: the hair that shades, world space.
        points: (n, 3) [m], world space; CVs of the same hair or any others.
        body: what else shades, world space, or None.
    """
    if not strands.strand_count or not len(points):
        return np.ones(len(points), np.float32)
    grid = grid_around(strands, settings.cell_count)
    depth = _depth(strands, body, grid, settings.extinction)
    open_sky = sky_openness(depth, settings.upper_fraction)
    (seen,) = sample(open_sky[None], grid.coordinates(points)) / settings.ao_bias
    return (1.0 - settings.strength * (1.0 - np.minimum(seen, 1.0))).astype(np.float32)


def openness(
    strands: StrandSet, points: Floats, body: Surface | None, extinction: float, cell_count: int
) -> Floats:
    """The fraction of the light from each direction w that comes straight to each point, as
    q0 + q . w, (n, 4) float32: the mean over all directions, and a vector in world space.

    Points lie on the light's side of their cells, as what is seen of hair does.

    Args: see ambient_occlusion.
    """
    if not strands.strand_count or not len(points):
        return np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (len(points), 1))
    grid = grid_around(strands, cell_count)
    depth = _depth(strands, body, grid, extinction)
    moments = np.zeros((4, *depth.shape), np.float32)
    for step, weight in sky_directions(0.0):
        through = weight * np.exp(-depth_towards(depth, step, own=0.0))
        moments[0] += through
        direction = 3.0 * np.array(step) / np.linalg.norm(step)
        for moment, part in zip(moments[1:], direction, strict=True):
            moment += np.float32(part) * through
    return np.ascontiguousarray(sample(moments, grid.coordinates(points)).T)


def _depth(strands: StrandSet, body: Surface | None, grid: Grid, extinction: float) -> Floats:
    """Optical depth of hair and body across each cell."""
    depth = hair_depth(strands, grid) * np.float32(extinction)
    if body is None:
        return depth
    whole = grid.in_blocks()
    of_body = body.latest(_body_depth, whole.low, whole.cell, whole.shape)
    return np.maximum(depth, grid.part(of_body, whole))


def _body_depth(body: Surface, low: Floats, cell: float, shape: tuple[int, int, int]) -> Floats:
    """See `body_depth`; of the numbers of a grid, since hair that is combed keeps its blocks."""
    return body_depth(body, Grid(low, cell, shape))


def sky_openness(depth: Floats, upper_fraction: float) -> Floats:
    """Mean transmittance of the sky's light at the centre of each cell, of depth's shape."""
    total = np.zeros_like(depth)
    for direction, weight in sky_directions(upper_fraction):
        total += weight * np.exp(-depth_towards(depth, direction))
    return total


def sky_directions(upper_fraction: float) -> Iterator[tuple[Step, float]]:
    """Steps to the 26 neighbours of a cell and the fraction of light from there; their sum is 1."""
    steps: list[Step] = [
        step for step in itertools.product((-1, 0, 1), (-1, 0, 1), (-1, 0, 1)) if any(step)
    ]
    up = np.array([max(z, 0) / np.linalg.norm((x, y, z)) for x, y, z in steps])
    even = np.array([_DIRECTION_WEIGHTS[sum(map(abs, step))] for step in steps])
    # from above only: the lobe up^4 is about as wide as the directions lie apart
    above = even * up**4
    fraction = (1.0 - upper_fraction) * even + upper_fraction * above / above.sum()
    return ((step, float(weight)) for step, weight in zip(steps, fraction, strict=True) if weight)


def depth_towards(depth: Floats, step: Step, own: float = 0.5) -> Floats:
    """Optical depth from each cell out of the grid along one of 26 directions.

    A part of the own cell, from its centre half, then every cell on the way, each crossed over the
    length of the step.
    """
    axis = int(np.argmax(np.abs(step)))
    others = [step[other] for other in range(3) if other != axis]
    layers = np.moveaxis(depth, axis, 0)
    if step[axis] > 0:
        layers = layers[::-1]
    beyond = np.zeros(layers.shape, np.float32)
    for index in range(1, len(layers)):
        add_shifted(beyond[index], beyond[index - 1] + layers[index - 1], others)
    crossed = (beyond + np.float32(own) * layers) * np.float32(np.linalg.norm(step))
    return np.moveaxis(crossed[::-1] if step[axis] > 0 else crossed, 0, axis)


def add_shifted(target: Floats, source: Floats, step: list[int]) -> None:
    """target[i, j] += source[i + step[0], j + step[1]] where that exists."""
    to, at = [], []
    for size, shift in zip(target.shape, step, strict=True):
        to.append(slice(max(0, -shift), size - max(0, shift)))
        at.append(slice(max(0, shift), size - max(0, -shift)))
    target[tuple(to)] += source[tuple(at)]


def skin_occlusion(strands: StrandSet, skin: Surface, settings: AmbientSettings) -> Floats:
    """The light that the hair lets through to each vertex of the skin, (vertex_count,) float32."""
    if not strands.strand_count:
        return np.ones(len(skin.positions), np.float32)
    clearance = _SKIN_CLEARANCE * grid_around(strands, settings.cell_count).cell
    above = skin.positions + np.float32(clearance) * skin.vertex_normals()
    through = replace(settings, extinction=settings.scalp_extinction)
    return ambient_occlusion(strands, above, None, through)
