"""Light that hair receives off the skin: off the skin directly beneath, and off skin farther away,
such as a face beside hair.

For far skin each point of hair has four numbers: how much of the light from a direction w reaches
it off skin that is lit where it faces w, as q0 + q . w, fitted over all w (precomputed radiance
transfer: Sloan, Kautz and Snyder 2002). The hair becomes a coarse grid of optical depths, and the
skin the cells that its surface crosses. Light travels to these and back through the hair, cell by
cell, in the 26 directions of `ambient.sky_directions`. The four numbers hold for strands that
absorb the fraction ABSORBED_FRACTION of the light that they meet; a depth gives the factor for
other hair.

Hair within a cell lies in clumps, between which light passes: at a mean depth tau, the fraction
that comes through is not exp(-tau) but (1 + g tau)^(-1/g), the mean over depths of a gamma
distribution with a variance of g tau^2. A g of 0.4 comes closest to Cycles, see
docs/dev/shading.md: a curtain of hair has hardly any gaps, but cells thicker than the curtain act
as if it had.

Limitation: no light goes from skin to skin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.triangles import area_vectors
from .ambient import Step, add_shifted, depth_towards, moment_weights, sky_directions, unit_steps
from .density_grid import Field, Grid, hair_depth, subdivided_triangles

#: Cells along the longest side of the grid.
_CELLS = 44
#: Margin of the grid around the hair on each side, as a fraction of the hair's longest side.
_MARGIN = 0.25
#: Variance of the optical depth of hair within a cell, over its squared mean.
CLUMPING = 0.4
#: Fraction of light that strands absorb in the four numbers: blond hair absorbs a third.
ABSORBED_FRACTION = 0.25
#: Minimum fraction of light that passes.
_MIN_TRANSMITTANCE = 0.03
#: Minimum area of skin in a cell of skin, as a fraction of the area of a cell's side.
_MIN_SKIN = 0.1
_OPAQUE = 30.0
#: Part of a cell that light crosses to its middle.
_OWN_CELL_FRACTION = 0.5
_SMALLEST = 1.0e-9


@dataclass(frozen=True, eq=False)
class SkinSeen:
    """The skin seen from places of hair, world space.

    received: (..., 4), light off far skin through hair whose strands absorb ABSORBED_FRACTION: q0,
        the mean over directions, and q. 1 is light off white skin all around that faces its light.
    depth: (...), optical, of the hair on the way, see `through_hair`.
    beneath: (..., 3), the mean normal of the skin directly beneath; its length is how much there
        is.
    """

    received: Floats
    depth: Floats
    beneath: Floats


def skin_seen(strands: StrandSet, points: Floats, skin: Surface, extinction: float) -> SkinSeen:
    """The skin seen from points (n, 3) among strands, of the strands or of cards that replace them.

    Args: see skin_field.
    """
    return skin_seen_from(skin_field(strands, skin, extinction).at(points))


def skin_field(
    strands: StrandSet, skin: Surface, extinction: float, cell_count: int | None = None
) -> Field:
    """The field of values from which `skin_seen_from` derives the skin seen.

    Args:
        strands: with the widths with which they are drawn.
        extinction: factor on the light that a strand's width blocks.
        cell_count: along the longest side; None: `_CELLS`.
    """
    grid = _grid_with_margin(strands, cell_count or _CELLS)
    hair = np.float32(extinction) * hair_depth(strands, grid)
    cells_of_skin = skin.compute_if_changed(_SkinCells.of, grid.low, grid.cell, grid.shape)
    reflected = _reflected_light(hair, cells_of_skin)
    cells = np.concatenate(
        _propagated(hair, reflected, cells_of_skin.normal, cells_of_skin.is_skin)
    )
    # cells within the body hold no values; the sampling takes those of their neighbours
    known = ~cells_of_skin.is_inside
    return Field(grid, np.concatenate([cells * known, known[None]], dtype=np.float32))


def skin_seen_from(values: Floats) -> SkinSeen:
    """The skin seen from points with these values (k, n) of a `skin_field`."""
    values = values[:-1] / np.maximum(values[-1], 1.0e-3)
    transmittance = np.clip(values[0] / np.maximum(values[4], _SMALLEST), _MIN_TRANSMITTANCE, 1.0)
    depth = (transmittance**-CLUMPING - 1.0) / (CLUMPING * ABSORBED_FRACTION)
    return SkinSeen(values[:4].T, depth, values[5:].T)


def through_hair(depth: Floats, absorbed: Floats) -> Floats:
    """The light through hair with gaps whose strands absorb the fraction `absorbed` of what they
    meet, over that through hair whose strands absorb ABSORBED_FRACTION. Both (...)."""
    result: Floats = (
        (1.0 + CLUMPING * depth * absorbed) / (1.0 + CLUMPING * depth * ABSORBED_FRACTION)
    ) ** (-1.0 / CLUMPING)
    return result


def plane_beneath(normal: Floats) -> SkinSeen:
    """Skin directly beneath alone, as for hair on a plane. normal: (..., 3)."""
    count = normal.shape[:-1]
    return SkinSeen(np.zeros((*count, 4)), np.zeros(count), normal)


def far_skin_light(received: Floats, to_light: Floats) -> Floats:
    """The fraction of a light that arrives off far skin through hair that absorbs
    ABSORBED_FRACTION, (...): a part that depends on the angle between the light and `received`, and
    an even rest.

    Args:
        received: (..., 4) mean and vector of the light. to_light: (..., 3) unit vector.
    """
    mean, vector = received[..., 0], received[..., 1:]
    size = np.linalg.norm(vector, axis=-1)
    # max(cosine, 0) has a mean of 1/4 and a vector of length 1/2
    uniform_part = np.maximum(1.0 - 0.5 * size / np.maximum(mean, 1.0e-6), 0.0)
    facing = np.maximum(np.sum(vector * to_light, axis=-1), 0.0) / np.maximum(size, 1.0e-6)
    result: Floats = mean * (uniform_part + (1.0 - uniform_part) * 4.0 * facing)
    return result


def _grid_with_margin(strands: StrandSet, cell_count: int) -> Grid:
    low, high = (corner.astype(np.float64) for corner in strands.bounds())
    farthest = float(np.maximum(np.abs(low), np.abs(high)).max())
    side = max(float((high - low).max()), _SMALLEST, _SMALLEST * farthest)
    cell = side * (1.0 + 2.0 * _MARGIN) / cell_count
    first = np.floor((low - _MARGIN * side) / cell).astype(np.int64)
    last = np.floor((high + _MARGIN * side) / cell).astype(np.int64)
    return Grid.of_cells(first, last + 1 - first, cell)


@dataclass(frozen=True, eq=False)
class _SkinCells:
    """The skin in the cells of a grid, and the light that it reflects without hair.

    normal: (3, *shape), the mean of the skin in each cell. is_skin: which cells hold any.
    is_inside: which cells lie directly below it.
    facing: (26, skin_count), light that each cell of skin reflects, by the light's direction.
    clear: (skin_count,), the same over all directions, without the light that the body blocks.
    """

    normal: Floats
    is_skin: Bools
    is_inside: Bools
    facing: Floats
    clear: Floats

    @classmethod
    def of(cls, skin: Surface, low: Floats, cell: float, shape: tuple[int, int, int]) -> _SkinCells:
        """From the numbers of a grid, which hair keeps while it is combed."""
        normal, is_skin = _skin_normals(skin, Grid(low, cell, shape))
        is_inside = _cells_below_skin(normal, is_skin)
        steps, weights = zip(*sky_directions(0.0), strict=True)
        directions = unit_steps(steps).astype(np.float32)
        skin_cells = np.flatnonzero(is_skin)
        facing = np.maximum(directions.T @ normal.reshape(3, -1)[:, skin_cells], 0.0)
        facing *= np.array(weights, np.float32)[:, None]
        through = _transmittance(_body_depth(is_inside), steps, skin_cells)
        return cls(normal, is_skin, is_inside, facing, (facing * through).sum(axis=0))


def _body_depth(is_inside: Bools) -> Floats:
    """Optical depth of the body, (1, *shape)."""
    depth: Floats = np.float32(_OPAQUE) * is_inside[None]
    return depth


def _transmittance(depth: Floats, steps: Sequence[Step], skin_cells: Ints) -> Floats:
    """The transmittance from some cells out of the grid along each step, (step_count, k)."""
    towards = depth_towards(depth, steps, own_fraction=0.0)
    through: Floats = np.exp(-towards.reshape(len(steps), -1)[:, skin_cells])
    return through


def _skin_normals(skin: Surface, grid: Grid) -> tuple[Floats, Bools]:
    """The mean normal of the skin in each cell, (3, *shape), and which have any."""
    high = grid.low + grid.cell * np.array(grid.shape)
    corners = skin.positions[skin.triangles].astype(np.float64)
    small = subdivided_triangles(corners, 0.5 * grid.cell, grid.low, high)
    cells = np.floor((small.mean(axis=1) - grid.low) / grid.cell).astype(np.int64)
    is_near = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    area = area_vectors(small[is_near]) / grid.cell**2
    index = np.ravel_multi_index(tuple(cells[is_near].T), grid.shape)
    count = int(np.prod(grid.shape))
    total = np.bincount(index, np.linalg.norm(area, axis=1), count)
    normal = np.stack([np.bincount(index, part, count) for part in area.T])
    is_skin = total > _MIN_SKIN
    unit = normal * is_skin / np.maximum(np.linalg.norm(normal, axis=0), _SMALLEST)
    return unit.astype(np.float32).reshape(3, *grid.shape), is_skin.reshape(grid.shape)


def _cells_below_skin(normal: Floats, is_skin: Bools) -> Bools:
    """Which cells lie directly below the skin: they see more of its back than of its front."""
    back = np.zeros(is_skin.shape, np.float32)
    for step, weight in sky_directions(0.0):
        back += weight * _shifted(np.sign(np.tensordot(_unit(step), normal, 1)), step)
    result: Bools = (back > 0.0) & ~is_skin
    return result


def _reflected_light(hair: Floats, skin: _SkinCells) -> Floats:
    """Light from all around that skin reflects, (5, *shape): four numbers as in
    `SkinSeen.received`, and the mean without any hair in the way."""
    steps, _ = zip(*sky_directions(0.0), strict=True)
    directions = unit_steps(steps).astype(np.float32)
    skin_cells = np.flatnonzero(skin.is_skin)
    (body,) = _body_depth(skin.is_inside)
    depths = np.stack([body + _clumped_depth(hair, step) for step in steps])
    reflected = np.zeros((5, *hair.shape), np.float32)
    flat = reflected.reshape(5, -1)
    flat[:4, skin_cells] = moment_weights(directions) @ (
        skin.facing * _transmittance(depths, steps, skin_cells)
    )
    flat[4, skin_cells] = skin.clear
    return reflected


def _propagated(
    hair: Floats, reflected: Floats, normal: Floats, is_skin: Bools
) -> tuple[Floats, Floats]:
    """Light that reaches each cell off far skin, (5, *shape), and the mean normal of the skin
    directly beneath, (3, *shape).
    """
    far, beneath = np.zeros_like(reflected), np.zeros_like(normal)
    is_free = (~is_skin).astype(np.float32)
    for step, weight in sky_directions(0.0):
        # only skin that faces back along the step is seen
        is_seen = is_skin & (np.tensordot(_unit(step), normal, 1) < 0.0)
        depth = _length(step) * _clumped_depth(hair, step)
        through = np.stack([is_free * np.exp(-depth), is_free])
        arriving = _arriving(reflected * is_seen, through, step)
        arriving -= _shifted(reflected * is_seen, step)
        arriving[:4] *= np.exp(-_OWN_CELL_FRACTION * depth)
        far += np.float32(weight) * arriving * ~is_seen
        # half of all directions count as 1
        front = normal * is_seen
        beneath += np.float32(2.0 * weight) * np.where(is_seen, front, _shifted(front, step))
    return far, beneath


def _arriving(source: Floats, through: Floats, step: Step) -> Floats:
    """Light that reaches each cell from those along a step: the source of the next cell, and the
    light that reaches that cell and gets through it.

    Args:
        source: (5, *shape). through: (2, *shape), transmittance of the first four, and of the last.
    """
    axis = int(np.argmax(np.abs(step)))
    cross_step = [0, *(step[other] for other in range(3) if other != axis)]
    layers = np.moveaxis(source, axis + 1, 0), np.moveaxis(through, axis + 1, 0)
    if step[axis] > 0:
        layers = layers[0][::-1], layers[1][::-1]
    sources, transmittances = (np.ascontiguousarray(each) for each in layers)
    arriving = np.zeros_like(sources)
    for index in range(1, len(arriving)):
        before, transmitted = arriving[index - 1], transmittances[index - 1]
        reflected = sources[index - 1].copy()
        reflected[:4] += transmitted[0] * before[:4]
        reflected[4] += transmitted[1] * before[4]
        add_shifted(arriving[index], reflected, cross_step)
    return np.moveaxis(arriving[::-1] if step[axis] > 0 else arriving, 0, axis + 1)


def _clumped_depth(hair: Floats, step: Step) -> Floats:
    """Optical depth per cell's length of hair with gaps that absorbs ABSORBED_FRACTION, for light
    along a step."""
    clumping = np.float32(CLUMPING * _length(step))
    result: Floats = np.log1p(clumping * np.float32(ABSORBED_FRACTION) * hair) / clumping
    return result


def _length(step: Step) -> np.float32:
    return np.float32(np.linalg.norm(step))


def _unit(step: Step) -> Floats:
    result: Floats = np.array(step, np.float32) / _length(step)
    return result


def _shifted(values: Floats, step: Step) -> Floats:
    """For each cell (..., x, y, z) the value of the cell one step farther; 0 where there is
    none."""
    result = np.zeros_like(values)
    add_shifted(result, values, [0] * (values.ndim - 3) + list(step))
    return result
