"""Ambient occlusion of hair: how much of the sky's light reaches a point through hair and body.

Also by direction, for light that is not the same from everywhere: see `openness_field`.

The hair becomes a grid of extinction coefficients, light is attenuated in it by Beer and Lambert's
law, and the 26 directions to a cell's neighbours represent all directions, with the weights of
Lebedev's quadrature of degree 7 (Lebedev 1976). The optical depth along each direction is one
running sum over the whole grid, so that the cost does not grow with the number of points.

Limitations: nothing outside of the hair's bounding box shades; detail below a cell is lost.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet, Surface
from .ambient_settings import AmbientSettings
from .density_grid import Field, Grid, body_depth, grid_around, hair_depth

#: From a cell to one of its 26 neighbours.
type Step = tuple[int, int, int]
#: Lebedev's weights of 26 directions: 6 along axes, 12 across edges, 8 across corners; sum 1.
_DIRECTION_WEIGHTS = {1: 1 / 21, 2: 4 / 105, 3: 9 / 280}


#: Height above the skin at which its light is measured, so that it lies in the hair [cells].
_SKIN_CLEARANCE = 0.5


@dataclass(frozen=True, eq=False)
class HairCells:
    """What blocks light: the optical depth across each cell of hair, at an extinction of 1, and of
    the body, None without one."""

    grid: Grid
    hair: Floats
    body: Floats | None

    @classmethod
    def of(
        cls, strands: StrandSet, body: Surface | None, cell_count: int, max_cells: int | None = None
    ) -> Self:
        """Args: see ambient_occlusion and grid_around."""
        grid = grid_around(strands, cell_count, max_cells)
        hair = hair_depth(strands, grid)
        if body is None:
            return cls(grid, hair, None)
        whole = grid.aligned_to_blocks()
        of_body = body.compute_if_changed(_body_depth, whole.low, whole.cell, whole.shape)
        return cls(grid, hair, grid.crop(of_body, whole))

    def depth(self, extinction: float) -> Floats:
        """Optical depth of hair and body across each cell."""
        depth = self.hair * np.float32(extinction)
        return depth if self.body is None else np.maximum(depth, self.body)


def ambient_occlusion(
    strands: StrandSet,
    points: Floats,
    body: Surface | None,
    settings: AmbientSettings,
) -> Floats:
    """How open each point is, (n,) float32: 1 at the outside of the hair, 0 where no light arrives.

    Args:
        strands: the hair that shades, world space.
        points: (n, 3) [m], world space; CVs of the same hair or any others.
        body: what else shades, world space, or None.
    """
    if not strands.strand_count or not len(points):
        return np.ones(len(points), np.float32)
    cells = HairCells.of(strands, body, settings.cell_count)
    return occlusion_from_sky(sky_field(cells, settings).at(points)[0], settings)


def sky_field(cells: HairCells, settings: AmbientSettings) -> Field:
    """Openness to the sky, one value per cell."""
    open_sky = sky_openness(cells.depth(settings.extinction), settings.upper_fraction)
    return Field(cells.grid, open_sky[None])


def occlusion_from_sky(sky: Floats, settings: AmbientSettings) -> Floats:
    """As `ambient_occlusion`, from the openness of points to the sky, (n,)."""
    open_fraction = sky / np.float32(settings.ao_bias)
    found: Floats = (1.0 - settings.strength * (1.0 - np.minimum(open_fraction, 1.0))).astype(
        np.float32
    )
    return found


def openness_field(cells: HairCells, extinction: float) -> Field:
    """The fraction of the light from each direction w that reaches each cell unscattered, as
    q0 + q . w, 4 values: the mean over all directions, and a vector in world space.

    A point's own cell does not count: hair that is seen lies on the light's side of its cell.
    """
    steps, weights = zip(*sky_directions(0.0), strict=True)
    moments = np.array(weights) * moment_weights(unit_steps(steps))
    return Field(
        cells.grid, summed_light(cells.depth(extinction), steps, moments, own_fraction=0.0)
    )


def _body_depth(body: Surface, low: Floats, cell: float, shape: tuple[int, int, int]) -> Floats:
    """`body_depth` by the numbers of a grid, a key for `Surface.compute_if_changed`: combed hair
    keeps its blocks."""
    return body_depth(body, Grid(low, cell, shape))


def sky_openness(depth: Floats, upper_fraction: float) -> Floats:
    """Mean transmittance of the sky's light at the centre of each cell, of depth's shape."""
    steps, weights = zip(*sky_directions(upper_fraction), strict=True)
    (total,) = summed_light(depth, steps, np.array(weights)[None])
    return total


def sky_directions(upper_fraction: float) -> Iterator[tuple[Step, float]]:
    """Steps to the 26 neighbours of a cell and the fraction of light from there; their sum is 1."""
    steps: list[Step] = [
        step for step in itertools.product((-1, 0, 1), (-1, 0, 1), (-1, 0, 1)) if any(step)
    ]
    up = np.array([max(z, 0) / np.linalg.norm((x, y, z)) for x, y, z in steps])
    uniform = np.array([_DIRECTION_WEIGHTS[sum(map(abs, step))] for step in steps])
    # from above only: the lobe up^4 is about as wide as the directions lie apart
    above = uniform * up**4
    fraction = (1.0 - upper_fraction) * uniform + upper_fraction * above / above.sum()
    return ((step, float(weight)) for step, weight in zip(steps, fraction, strict=True) if weight)


def unit_steps(steps: Sequence[Step]) -> Floats:
    """Their directions, rows (3, step_count)."""
    rows = np.array(steps, np.float64).T
    result: Floats = rows / np.linalg.norm(rows, axis=0)
    return result


def moment_weights(directions: Floats) -> Floats:
    """Weights that sum light from directions, rows (3, n), to a mean q0 and a vector q, (4, n)."""
    return np.concatenate([np.ones((1, directions.shape[1])), 3.0 * directions])


def summed_light(
    depth: Floats, steps: Sequence[Step], weights: Floats, own_fraction: float = 0.5
) -> Floats:
    """Weighted sums, over some of the 26 directions, of the fraction of light that reaches each
    cell from there, (k, *depth.shape) float32.

    Args:
        weights: (k, step_count).
        own_fraction: see depth_towards.
    """
    total = np.zeros((len(weights), *depth.shape), np.float32)
    weights = weights.astype(np.float32)
    for numbers, layer, crossed in _layers(depth[None], steps, own_fraction):
        through = np.exp(np.negative(crossed, out=crossed), out=crossed)
        total[:, *layer] += np.tensordot(weights[:, numbers], through, axes=1)
    return total


def depth_towards(depth: Floats, steps: Sequence[Step], own_fraction: float = 0.5) -> Floats:
    """Optical depth from each cell out of the grid along some of the 26 directions,
    (step_count, *grid) float32: the fraction `own_fraction` of the cell itself, half from its
    centre, then every cell on the way, each crossed over the length of the step.

    Args:
        depth: of cells, (step_count, *grid), or (1, *grid) where all directions have the same.
    """
    found = np.empty((len(steps), *depth.shape[1:]), np.float32)
    for numbers, layer, crossed in _layers(depth, steps, own_fraction):
        found[numbers, *layer] = crossed
    return found


#: Index of one layer of a grid's cells.
type Layer = tuple[int | slice, ...]


def _layers(
    depth: Floats, steps: Sequence[Step], own_fraction: float
) -> Iterator[tuple[Ints, Layer, Floats]]:
    """For each layer of cells: numbers of k steps, the layer across their longest axis, and the
    optical depth along these steps from its cells, (k, cells, cells), see depth_towards. Layer by
    layer, since layers stay in the cache.
    """
    along = np.abs(steps).argmax(axis=1)
    for axis, side in itertools.product(range(3), (-1, 1)):
        numbers = np.flatnonzero((along == axis) & (np.array(steps)[:, axis] == side))
        cell_depth = depth if len(depth) == 1 else depth[numbers]
        layers = np.ascontiguousarray(np.moveaxis(cell_depth, axis + 1, 0))
        length = np.linalg.norm(np.take(steps, numbers, axis=0), axis=1)[:, None, None]
        cross_steps = np.delete(np.take(steps, numbers, axis=0), axis, axis=1).tolist()
        before, beyond = np.zeros((2, len(numbers), *layers.shape[2:]), np.float32)
        for number in range(len(layers))[::-side] if len(numbers) else ():
            crossed = before + np.float32(own_fraction) * layers[number]
            crossed *= length.astype(np.float32)
            yield numbers, (*[slice(None)] * axis, number), crossed
            before += layers[number]
            beyond[:] = 0.0
            for target, source, step in zip(beyond, before, cross_steps, strict=True):
                add_shifted(target, source, step)
            before, beyond = beyond, before


def add_shifted(target: Floats, source: Floats, step: list[int]) -> None:
    """target[i, j] += source[i + step[0], j + step[1]] where that exists."""
    target_slices, source_slices = [], []
    for size, shift in zip(target.shape, step, strict=True):
        target_slices.append(slice(max(0, -shift), size - max(0, shift)))
        source_slices.append(slice(max(0, shift), size - max(0, -shift)))
    target[tuple(target_slices)] += source[tuple(source_slices)]


def skin_occlusion(strands: StrandSet, skin: Surface, settings: AmbientSettings) -> Floats:
    """The light that the hair lets through to each vertex of the skin, (vertex_count,) float32."""
    if not strands.strand_count:
        return np.ones(len(skin.positions), np.float32)
    clearance = _SKIN_CLEARANCE * grid_around(strands, settings.cell_count).cell
    above = skin.positions + np.float32(clearance) * skin.vertex_normals()
    through = replace(settings, extinction=settings.scalp_extinction)
    return ambient_occlusion(strands, above, None, through)
