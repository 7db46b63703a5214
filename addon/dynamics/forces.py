"""The forces that move hair before its constraints act: inertia, damping, drag, gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from ..strands.vectors import dot_rows
from .banded import solve_tridiagonal
from .constraints import PINNED_COUNT, chain_matrix, minus_next, segments
from .settings import DynamicsSettings


@dataclass(frozen=True)
class DampingFactors:
    """The effect of damping in a substep; numbers, or one for each guide (guide_count,).

    Style damping acts on the speed relative to the carried style, air damping on the speed relative
    to the air. With both, the speed becomes  v kept + v_style carried + v_air air.

    velocity: remaining fraction of the speed.
    style, air: fractions of the style's and of the air's speed that are added.
    """

    velocity: Any
    style: Any
    air: Any

    @classmethod
    def of(
        cls, settings: DynamicsSettings, dt: float, style_rate: Any = None, air_rate: Any = None
    ) -> DampingFactors:
        """Args:
        style_rate, air_rate: the rates [1/s] of style and air damping; None: those of the settings.
        """
        style_rate = np.float64(settings.style_damping) if style_rate is None else style_rate
        air_rate = settings.damping if air_rate is None else air_rate
        total_rate = air_rate + style_rate
        velocity, divisor = np.exp(-total_rate * dt), np.where(total_rate > 0.0, total_rate, 1.0)
        return cls(
            velocity, (1.0 - velocity) * style_rate / divisor, (1.0 - velocity) * air_rate / divisor
        )


def apply_drag(
    position: Floats, previous: Floats, drag: float, air_displacement: Floats | None
) -> None:
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


def predict(
    position: Floats, previous: Floats, impulse: Floats, velocity_factor: Any, out: Floats
) -> None:
    """Verlet step (Jakobsen 2001), all (3, cv_count, guide_count) [m].

    x' = x + (x - x_prev) kept + impulse, where `impulse` is a dt^2 plus what the carried style and
    the air add.
    """
    np.subtract(position, previous, out=out)
    out *= np.float32(velocity_factor)
    out += position
    out += impulse


def effective_gravity(
    gravity: Floats, settings: DynamicsSettings, rotation: Floats, style: Floats
) -> Floats:
    """Acceleration [m/s^2] of each CV, (3, cv_count, guide_count), or (3, 1, 1) if all are alike.

    A groom is combed under gravity, so at rest its own stiffness already holds the part of the
    weight that the lengths do not. That part is subtracted, turned with the head: so a groom at
    rest stays as it is, and hangs differently as soon as the head is tilted. It was combed in air:
    under water, where buoyancy carries the weight, the style lifts the hair, as real hair does.

    Args:
        rotation: (3, 3) how the groom has turned since rest, see `groom_rotation.best_rotation`.
        style: (3, cv_count, guide_count) world [m], the style.
    """
    full = _scaled_gravity(gravity, settings)
    without_buoyancy = full * np.float32(1.0 - settings.buoyancy)
    if not settings.sag_compensation or not style.shape[1] > PINNED_COUNT or not style.shape[2]:
        return without_buoyancy[:, None, None]
    combed = _rotated(full, rotation)
    effective = np.empty_like(style)
    effective[:] = without_buoyancy[:, None, None]
    compensated = weight_across_style(combed, style)
    compensated *= np.float32(settings.sag_compensation)
    effective[:, PINNED_COUNT:] -= compensated
    return effective


def compensated_gravity(gravity: Floats, settings: DynamicsSettings, rotation: Floats) -> Floats:
    """The gravity (3,) [m/s^2] that the style compensates, turned with it; see
    `effective_gravity`."""
    return _rotated(_scaled_gravity(gravity, settings), rotation) * np.float32(
        settings.sag_compensation
    )


def _scaled_gravity(gravity: Floats, settings: DynamicsSettings) -> Floats:
    pull: Floats = np.asarray(gravity, np.float32) * np.float32(settings.gravity)
    return pull


def _rotated(vector: Floats, rotation: Floats) -> Floats:
    return (rotation @ vector.astype(np.float64)).astype(np.float32)


def weight_across_style(gravity: Floats, style: Floats) -> Floats:
    """The part of gravity (3,) that the segments' tension cannot hold, (3, n, guide_count).

    g - J^T (J J^T)^-1 J g with the length constraints J of the free CVs.
    """
    segment, tension = style_tension(gravity, style)
    segment *= tension
    return gravity[:, None, None] - minus_next(segment)


def style_tension(gravity: Floats, style: Floats) -> tuple[Floats, Floats]:
    """Segments (3, n, guide_count) [m] beyond the pinned ones, and the tension in each that holds
    gravity (3,), over the segment's length, (n, guide_count) [1/s^2].
    """
    segment, squared = segments(style[:, PINNED_COUNT - 1 :])
    diagonal, off_diagonal = chain_matrix(segment, squared)
    tension = np.zeros_like(diagonal)  # J g: differs from 0 only at the segment of the pinned CV
    tension[0] = dot_rows(segment[:, 0], gravity[:, None])
    solve_tridiagonal(diagonal, off_diagonal, tension)
    return segment, tension
