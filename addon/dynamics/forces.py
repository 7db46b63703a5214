"""The forces that move hair before its constraints act: inertia, damping, drag, gravity."""

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
    """The effect of damping in a substep; numbers, or one for each guide (guide_count,).

    Style damping acts on the speed relative to the carried style, air damping on the speed relative
    to the air. With both, the speed becomes  v kept + v_style carried + v_air air.

    kept: remaining fraction of the speed.
    carried, air: fractions of the style's and of the air's speed that are added.
    """

    kept: Any
    carried: Any
    air: Any

    @classmethod
    def of(
        cls, settings: DynamicsSettings, dt: float, swing: Any = None, air: Any = None
    ) -> Damped:
        """Args:
        swing, air: the rates [1/s] of style and air damping; None: those of the settings.
        """
        swing = np.float64(settings.style_damping) if swing is None else swing
        air = settings.damping if air is None else air
        both = air + swing
        kept, whole = np.exp(-both * dt), np.where(both > 0.0, both, 1.0)
        return cls(kept, (1.0 - kept) * swing / whole, (1.0 - kept) * air / whole)


def brake(position: Floats, previous: Floats, drag: float, air_displacement: Floats | None) -> None:
    """Implicit quadratic drag: v_rel / (1 + drag |v_rel| dt), in place.

    Changes `previous`, which holds the speed.

    Args:
        drag: [1/m].
        air_displacement: (3, guide_count), how far the air moves in a substep [m]; None in still
            air.
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
    """Verlet step (Jakobsen 2001), all (3, cv_count, guide_count) [m].

    x' = x + (x - x_prev) kept + impulse, where `impulse` is a dt^2 plus what the carried style and
    the air add.
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
    weight that the lengths do not. That part is subtracted, turned with the head: so a groom at
    rest stays as it is, and hangs differently as soon as the head is tilted. It was combed in air:
    under water, where buoyancy carries the weight, the style lifts the hair, as real hair does.

    Args:
        turn: (3, 3) how the groom has turned since rest, see `turn.best_rotation`.
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
    """The gravity (3,) [m/s^2] that the style compensates, turned with it; see `felt_gravity`."""
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
    """Segments (3, n, guide_count) [m] beyond the pinned ones, and the tension in each that holds
    gravity (3,), over the segment's length, (n, guide_count) [1/s^2].
    """
    segment, squared = segments(carried[:, PINNED - 1 :])
    diagonal, beside = chain_matrix(segment, squared)
    tension = np.zeros_like(diagonal)  # J g: differs from 0 only at the segment of the pinned CV
    tension[0] = dot_rows(segment[:, 0], gravity[:, None])
    solve_tridiagonal(diagonal, beside, tension)
    return segment, tension
