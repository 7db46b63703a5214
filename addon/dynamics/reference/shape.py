"""Geometry of one guide for the scalar reference: frames, kinks, and the Jacobian of lengths.

All float64; x is (cv_count, 3) world [m].
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...arrays import Floats
from ..constraints import PINNED_COUNT
from ..style import GENTLE_BEND, SHARP_KINK


def turning_fraction(rest_second: Floats, length: float) -> float:
    """1 for gentle bends, 0 for sharp kinks, linear in between.

    Args:
        rest_second: (3,) [m], a segment minus the one before it. length: of a segment [m].
    """
    sharpness = float(np.linalg.norm(rest_second)) / length if length else 2.0
    return min(max((SHARP_KINK - sharpness) / (SHARP_KINK - GENTLE_BEND), 0.0), 1.0)


def jacobian_of(x: Floats) -> Floats:
    """The Jacobian of the lengths of segments beyond the pinned ones by the free CVs, (n, 3 n)."""
    free = len(x) - PINNED_COUNT
    jacobian = np.zeros((free, 3 * free))
    for row in range(free):
        displacement = x[row + PINNED_COUNT] - x[row + PINNED_COUNT - 1]
        unit = displacement / np.linalg.norm(displacement)
        jacobian[row, 3 * row : 3 * row + 3] = unit
        if row:
            jacobian[row, 3 * row - 3 : 3 * row] = -unit
    return jacobian


def segment_rotations(x: Floats, style: Floats, twist_cv: int) -> list[Floats]:
    """The rotation of each segment, with tangent, normal and binormal as columns, carried without
    twist."""
    tangents = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(x)]
    beside = style[twist_cv] - style[0]
    beside = beside - tangents[0] * (tangents[0] @ beside)
    normal = beside / max(float(np.linalg.norm(beside)), 1.0e-9)
    turns = [np.stack([tangents[0], normal, np.cross(tangents[0], normal)], axis=1)]
    for one, other in pairwise(tangents):
        turns.append(smallest_rotation(one, other) @ turns[-1])
    return turns


def smallest_rotation(one: Floats, other: Floats) -> Floats:
    """The rotation (3, 3) that turns one unit vector into another (Rodrigues)."""
    x, y, z = np.cross(one, other)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Floats = np.eye(3) + cross + cross @ cross / (1.0 + one @ other)
    return rotation
