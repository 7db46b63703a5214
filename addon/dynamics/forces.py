"""What moves hair before its constraints act: inertia, damping, gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from ..strands.vectors import dot_rows
from .banded import solve_tridiagonal
from .constraints import PINNED, chain_matrix, less_next, segments
from .settings import DynamicsSettings


@dataclass(frozen=True)
class Damped:
    """What damping does in a substep; numbers, or of each guide (guide_count,).

    Swing damping acts on the speed against the carried style, air damping on the speed in the
    world; both together leave  v kept + v_style (1 - kept) style_damping / (sum of both), and the
    same of the air.

    kept: fraction of the speed that it leaves.
    carried, air: fraction of the head's own speed, and of the air's, that it gives to the hair.
    """

    kept: Any
    carried: Any
    air: Any

    @classmethod
    def of(
        cls, settings: DynamicsSettings, dt: float, swing: Any = None, air: Any = None
    ) -> Damped:
        """Args:
        swing, air: the rates of swing and air damping; None: those of the settings.
        """
        swing = np.float64(settings.style_damping) if swing is None else swing
        air = settings.damping if air is None else air
        both = air + swing
        kept, whole = np.exp(-both * dt), np.where(both > 0.0, both, 1.0)
        return cls(kept, (1.0 - kept) * swing / whole, (1.0 - kept) * air / whole)


def brake(position: Floats, previous: Floats, drag: float, air_displacement: Floats | None) -> None:
    """Drag by the square of the speed, implicitly: v_rel / (1 + drag |v_rel| dt), in place.

    Changes `previous`, which holds the speed.

    Args:
        air_displacement: (3, guide_count), how far the air moves in a substep [m];
            None when it stands still.
    """
    displacement = position - previous
    if air_displacement is not None:
        displacement -= air_displacement[:, None]
    length = np.sqrt(dot_rows(displacement, displacement))
    length *= np.float32(drag)
    length += np.float32(1.0)
    displacement /= length
    if air_displacement is not None:
        displacement += air_displacement[:, None]
    np.subtract(position, displacement, out=previous)


def predict(position: Floats, previous: Floats, impulse: Floats, kept: Any, out: Floats) -> None:
    """Verlet step with time correction (Jakobsen 2001), all (3, cv_count, guide_count) [m].

    x' = x + (x - x_prev) kept + impulse, where `kept` holds damping and dt / dt_prev, and
    `impulse` is a dt^2 and what the carried style adds.
    """
    np.subtract(position, previous, out=out)
    out *= np.float32(kept)
    out += position
    out += impulse


def felt_gravity(
    gravity: Floats, settings: DynamicsSettings, turn: Floats, carried: Floats
) -> Floats:
    """Acceleration [m/s^2] of each CV, (3, cv_count, guide_count), or (3, 1, 1) if all are alike.

    A groom is combed under gravity, so at rest its own stiffness already holds the part of the
    weight that the lengths do not. That part is taken off, and it turns with the head: a groom at
    rest stays as it is, and hangs otherwise as soon as the head is tilted. It is combed in air:
    under water, where buoyancy carries the weight, the style lifts the hair, as hair does there.

    Args:
        turn: (3, 3) how the groom has turned since, see `turn.best_rotation`.
        carried: (3, cv_count, guide_count) world [m], the style.
    """
    pull = _pull(gravity, settings)
    left = pull * np.float32(1.0 - settings.buoyancy)
    if not settings.sag_compensation or not carried.shape[1] > PINNED or not carried.shape[2]:
        return left[:, None, None]
    combed = _turned(pull, turn)
    felt = np.empty_like(carried)
    felt[:] = left[:, None, None]
    held = weight_on_style(combed, carried)
    held *= np.float32(settings.sag_compensation)
    felt[:, PINNED:] -= held
    return felt


def combed_gravity(gravity: Floats, settings: DynamicsSettings, turn: Floats) -> Floats:
    """The gravity (3,) [m/s^2] that the style carries, turned with it; arguments as above."""
    return _turned(_pull(gravity, settings), turn) * np.float32(settings.sag_compensation)


def _pull(gravity: Floats, settings: DynamicsSettings) -> Floats:
    pull: Floats = np.asarray(gravity, np.float32) * np.float32(settings.gravity)
    return pull


def _turned(pull: Floats, turn: Floats) -> Floats:
    return (turn @ pull.astype(np.float64)).astype(np.float32)


def weight_on_style(gravity: Floats, carried: Floats) -> Floats:
    """The part of gravity (3,) that the segments' tension cannot hold, (3, n, guide_count).

    g - J^T (J J^T)^-1 J g with the length constraints J of the free CVs.
    """
    segment, tension = tension_on_style(gravity, carried)
    segment *= tension
    return gravity[:, None, None] - less_next(segment)


def tension_on_style(gravity: Floats, carried: Floats) -> tuple[Floats, Floats]:
    """Segments (3, n, guide_count) [m] beyond the pinned ones, and the tension in each by which
    they hold gravity (3,), over the segment's length, (n, guide_count) [1/s^2].
    """
    segment, squared = segments(carried[:, PINNED - 1 :])
    diagonal, beside = chain_matrix(segment, squared)
    tension = np.zeros_like(diagonal)  # J g: only the segment at the pinned CV feels a difference
    tension[0] = dot_rows(segment[:, 0], gravity[:, None])
    solve_tridiagonal(diagonal, beside, tension)
    return segment, tension
