"""Scalar reference of `among` without a grid: each CV sums over all others, in float64.

It shares with the fast form only the places of cells, and the constants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ..among import (
    AHEAD,
    BEGIN,
    FARTHEST,
    FASTEST,
    MOTION,
    PRESSED,
    PULL,
    PUSH,
    RUBBING,
    SLACK,
    THIN,
    HairGrid,
)


@dataclass(frozen=True)
class Beside:
    """CVs of other grooms.

    here: (m, 3) float64 world [m], where they are deposited.
    motion: (m, 3) [m] in a substep. mass: (m,), see `HairGrid`.
    """

    here: Floats
    motion: Floats
    mass: Floats


#: Number of cells that stands for a grid that does not wrap around.
NO_END = 1_000_000
NONE_BESIDE = Beside(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


@dataclass(frozen=True)
class Hair:
    """All CVs of a groom at one moment.

    here, motion: (n, 3) float64 world [m], places, and motion in a substep.
    turn: (3, 3) of the groom since rest. middle: (3,) world [m], of its roots.
    others: CVs of other grooms, none by default.
    """

    here: Floats
    motion: Floats
    turn: Floats
    middle: Floats
    others: Beside = NONE_BESIDE


def feel_slowly(
    grid: HairGrid,
    rest: Floats,
    hair: Hair,
    volume: Floats,
    dt: float,
    substeps: int,
    others_at_rest: Beside = NONE_BESIDE,
) -> tuple[Floats, Floats]:
    """Reference of `among.feel`, with results (n, 3) [m].

    Args:
        rest: (n, 3), all CVs at rest. volume: (n,), the setting at each.
    """
    mass = np.tile(grid.mass.astype(np.float64)[:, None], (1, len(rest) // len(grid.mass))).ravel()
    still = Hair(rest, np.zeros_like(rest), np.eye(3), grid.middle, others_at_rest)
    at_rest = [_others(grid, still, mass, cv, 0.0)[0] for cv in range(len(rest))]
    crowded = np.maximum(at_rest, THIN * np.median(at_rest))
    taken, push = np.zeros_like(rest), np.zeros_like(rest)
    for cv in range(len(rest)):
        density, gradient, mean = _others(grid, hair, mass, cv, AHEAD * substeps)
        if density == 0.0:
            continue
        ratio = density / crowded[cv]
        over = min(max(ratio - 1.0 - SLACK, 0.0), 1.0)
        under = min(max(at_rest[cv] / crowded[cv] - ratio - SLACK, 0.0), 1.0)
        shift = gradient / density * (PULL * under - PUSH * over) * volume[cv]
        shift *= min(FARTHEST / max(float(np.linalg.norm(shift)), 1e-30), 1.0)
        push[cv] = hair.turn @ shift * grid.cell / substeps**2
        rate = RUBBING * volume[cv] * (min(ratio, 1.0) + PRESSED * over)
        taken[cv] = (hair.motion[cv] - mean) * (1.0 - math.exp(-rate * substeps * dt))
    return taken, push


def _others(
    grid: HairGrid, hair: Hair, mass: Floats, cv: int, ahead: float
) -> tuple[float, Floats, Floats]:
    """Density, its gradient [1 / cell] and mean motion [m] of all others at a CV."""
    here = np.concatenate([hair.here + hair.motion * ahead, hair.others.here])
    motion, mass = (
        np.concatenate(both)
        for both in ((hair.motion, hair.others.motion), (mass, hair.others.mass))
    )
    # with other grooms, a grid has enough cells not to wrap around
    counts = (NO_END,) * 3 if len(hair.others.mass) else grid.counts
    places = (here - hair.middle) @ hair.turn / grid.cell + BEGIN
    steps = motion * MOTION / grid.cell
    whole = np.rint(np.clip(steps, -FASTEST * MOTION, FASTEST * MOTION)) * grid.cell / MOTION
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
