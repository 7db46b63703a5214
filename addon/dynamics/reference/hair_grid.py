"""Scalar reference of `hair_grid` without a grid: each CV sums over all others, in float64.

It shares with the fast form only the places of cells, and the constants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ..hair_grid import (
    COHESION,
    DENSITY_TOLERANCE,
    FRICTION_RATE,
    GRID_OFFSET,
    LOOK_AHEAD,
    MAX_MOTION,
    MAX_SHIFT,
    MIN_REST_DENSITY,
    MOTION_UNITS,
    PRESSED_FRICTION,
    PRESSURE,
    HairGrid,
)


@dataclass(frozen=True)
class NeighbourPoints:
    """CVs of other grooms.

    position: (m, 3) float64 world [m], where they are deposited.
    motion: (m, 3) [m] in a substep. mass: (m,), see `HairGrid`.
    """

    position: Floats
    motion: Floats
    mass: Floats


#: Number of cells that stands for a grid that does not wrap around.
UNBOUNDED_CELLS = 1_000_000
NO_NEIGHBOURS = NeighbourPoints(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


@dataclass(frozen=True)
class GroomPoints:
    """All CVs of a groom at one moment.

    position, motion: (n, 3) float64 world [m], places, and motion in a substep.
    rotation: (3, 3) of the groom since rest. middle: (3,) world [m], of its roots.
    neighbour_cvs: CVs of other grooms, none by default.
    """

    position: Floats
    motion: Floats
    rotation: Floats
    middle: Floats
    neighbour_cvs: NeighbourPoints = NO_NEIGHBOURS


def friction_and_push_reference(
    grid: HairGrid,
    rest: Floats,
    hair: GroomPoints,
    volume: Floats,
    dt: float,
    substeps: int,
    neighbours_at_rest: NeighbourPoints = NO_NEIGHBOURS,
) -> tuple[Floats, Floats]:
    """Reference of `hair_grid.friction_and_push`, with results (n, 3) [m].

    Args:
        rest: (n, 3), all CVs at rest. volume: (n,), the setting at each.
    """
    mass = np.tile(grid.mass.astype(np.float64)[:, None], (1, len(rest) // len(grid.mass))).ravel()
    still = GroomPoints(rest, np.zeros_like(rest), np.eye(3), grid.middle, neighbours_at_rest)
    at_rest = [_sample_others(grid, still, mass, cv, 0.0)[0] for cv in range(len(rest))]
    pressure_threshold = np.maximum(at_rest, MIN_REST_DENSITY * np.median(at_rest))
    slowed, push = np.zeros_like(rest), np.zeros_like(rest)
    for cv in range(len(rest)):
        density, gradient, mean = _sample_others(grid, hair, mass, cv, LOOK_AHEAD * substeps)
        if density == 0.0:
            continue
        ratio = density / pressure_threshold[cv]
        compression = min(max(ratio - 1.0 - DENSITY_TOLERANCE, 0.0), 1.0)
        expansion = min(
            max(at_rest[cv] / pressure_threshold[cv] - ratio - DENSITY_TOLERANCE, 0.0), 1.0
        )
        shift = gradient / density * (COHESION * expansion - PRESSURE * compression) * volume[cv]
        shift *= min(MAX_SHIFT / max(float(np.linalg.norm(shift)), 1e-30), 1.0)
        push[cv] = hair.rotation @ shift * grid.cell / substeps**2
        rate = FRICTION_RATE * volume[cv] * (min(ratio, 1.0) + PRESSED_FRICTION * compression)
        slowed[cv] = (hair.motion[cv] - mean) * (1.0 - math.exp(-rate * substeps * dt))
    return slowed, push


def _sample_others(
    grid: HairGrid, hair: GroomPoints, mass: Floats, cv: int, ahead: float
) -> tuple[float, Floats, Floats]:
    """Density, its gradient [1 / cell] and mean motion [m] of all others at a CV."""
    here = np.concatenate([hair.position + hair.motion * ahead, hair.neighbour_cvs.position])
    motion, mass = (
        np.concatenate(both)
        for both in ((hair.motion, hair.neighbour_cvs.motion), (mass, hair.neighbour_cvs.mass))
    )
    # with other grooms, a grid has enough cells not to wrap around
    counts = (UNBOUNDED_CELLS,) * 3 if len(hair.neighbour_cvs.mass) else grid.counts
    places = (here - hair.middle) @ hair.rotation / grid.cell + GRID_OFFSET
    steps = motion * MOTION_UNITS / grid.cell
    whole = (
        np.rint(np.clip(steps, -MAX_MOTION * MOTION_UNITS, MAX_MOTION * MOTION_UNITS))
        * grid.cell
        / MOTION_UNITS
    )
    density, gradient, moving = 0.0, np.zeros(3), np.zeros(3)
    for other in range(len(places)):
        if other == cv:
            continue
        nearest_middle = np.floor(places[other] + 0.5)
        near = [
            _along(float(apart), count)
            for apart, count in zip(places[cv] - nearest_middle, counts, strict=True)
        ]
        (x, slope_x), (y, slope_y), (z, slope_z) = near
        density += mass[other] * x * y * z
        gradient += mass[other] * np.array([slope_x * y * z, x * slope_y * z, x * y * slope_z])
        moving += mass[other] * x * y * z * whole[other]
    return density, gradient, moving / density if density else moving


def _along(apart: float, count: int) -> tuple[float, float]:
    """The weight of a cell whose middle is `apart` away, and its slope, along one axis of a grid
    that wraps around after `count` cells."""
    apart = math.remainder(apart, count)
    images = [apart - count, apart, apart + count]
    weight = sum(_tent(d + 1.0) / 4.0 + _tent(d) / 2.0 + _tent(d - 1.0) / 4.0 for d in images)
    slope = sum((_tent(d + 1.0) - _tent(d - 1.0)) / 2.0 for d in images)
    return weight, slope


def _tent(apart: float) -> float:
    return max(1.0 - abs(apart), 0.0)
