"""What moves hair before its constraints act: inertia, damping, gravity."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Floats
from .banded import solve_tridiagonal
from .constraints import PINNED, chain_matrix, directions, dot
from .settings import DynamicsSettings


def speed_kept(settings: DynamicsSettings, dt: float) -> float:
    """Share of the speed that damping leaves after `dt` seconds."""
    return math.exp(-(settings.damping + settings.style_damping) * dt)


def carried_share(settings: DynamicsSettings, dt: float) -> float:
    """Share of the head's own speed that swing damping gives to the hair in `dt` seconds.

    Swing damping acts on the speed against the carried style, air damping on the speed in the
    world; both together leave  v kept + v_style (1 - kept) style_damping / (sum of both).
    """
    both = settings.damping + settings.style_damping
    return (1.0 - speed_kept(settings, dt)) * settings.style_damping / both if both else 0.0


def predict(position: Floats, previous: Floats, impulse: Floats, kept: float, out: Floats) -> None:
    """Verlet step with time correction (Jakobsen 2001), all (3, cv_count, guide_count) [m].

    x' = x + (x - x_prev) kept + impulse, where `kept` holds damping and dt / dt_prev, and
    `impulse` is a dt^2 and what the carried style adds.
    """
    np.subtract(position, previous, out=out)
    out *= np.float32(kept)
    out += position
    out += impulse


def felt_gravity(
    gravity: Floats, settings: DynamicsSettings, rest: Floats, carried: Floats
) -> Floats:
    """Acceleration [m/s^2] of each CV, (3, cv_count, guide_count), or (3, 1, 1) if all are alike.

    A groom is combed under gravity, so at rest its own stiffness already holds the part of the
    weight that the lengths do not. That part is taken off, and it turns with the head: a groom at
    rest stays as it is, and hangs otherwise as soon as the head is tilted.
    """
    pull = np.asarray(gravity, np.float32) * np.float32(settings.gravity)
    if not settings.weight_held or not rest.shape[1] > PINNED or not rest.shape[2]:
        return pull[:, None, None]
    combed = (best_rotation(rest, carried) @ pull.astype(np.float64)).astype(np.float32)
    felt = np.empty_like(carried)
    felt[:] = pull[:, None, None]
    felt[:, PINNED:] -= np.float32(settings.weight_held) * weight_on_style(combed, carried)
    return felt


def weight_on_style(gravity: Floats, carried: Floats) -> Floats:
    """The part of gravity (3,) that the segments' tension cannot hold, (3, n, guide_count).

    g - J^T (J J^T)^-1 J g with the length constraints J of the free CVs.
    """
    direction, _ = directions(carried[:, PINNED - 1 :])
    diagonal, beside = chain_matrix(direction)
    tension = np.zeros_like(diagonal)  # J g: only the segment at the pinned CV feels a difference
    tension[0] = dot(direction[:, 0], gravity[:, None])
    solve_tridiagonal(diagonal, beside, tension)
    direction *= tension
    direction[:, :-1] -= direction[:, 1:]
    return gravity[:, None, None] - direction


def best_rotation(rest: Floats, carried: Floats) -> Floats:
    """The one rotation (3, 3) float64 that turns the whole groom from rest to where it is carried.

    Kabsch 1976, from the pinned CVs and the tips. A small share of the identity picks the smallest
    rotation where the groom leaves one free, as a single straight guide does.

    Limitation: fur on several limbs feels their mean rotation.
    """
    cvs = np.r_[: min(PINNED, rest.shape[1]), rest.shape[1] - 1]
    before = rest[:, cvs].reshape(3, -1).astype(np.float64)
    now = carried[:, cvs].reshape(3, -1).astype(np.float64)
    before -= before.mean(axis=1, keepdims=True)
    now -= now.mean(axis=1, keepdims=True)
    spread = now @ before.T
    spread += np.eye(3) * (1.0e-6 * math.sqrt((before**2).sum() * (now**2).sum()) + 1.0e-12)
    left, _, right = np.linalg.svd(spread)
    handed = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    rotation: Floats = left @ handed @ right
    return rotation
