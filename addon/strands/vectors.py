"""Unit vectors, dot and cross products.

Functions of *rows* take (3, n), with x, y and z in a row each. That is several times faster in the
loops of the dynamics and of moving cards.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..arrays import Floats

#: Angle between successive points of an even spiral [rad].
GOLDEN_ANGLE = float(np.pi * (3.0 - np.sqrt(5.0)))


def triple(values: Iterable[float]) -> tuple[float, float, float]:
    """Three numbers as Python floats."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) of length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


def unit_or(
    vectors: Floats, fallback: Floats | tuple[float, float, float], shortest: float = 1.0e-6
) -> Floats:
    """Vectors (..., 3) of length 1; `fallback` where they are no longer than `shortest`."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > shortest, vectors / np.maximum(length, shortest), fallback)


def even_directions(count: int) -> Floats:
    """Unit vectors spread evenly over the sphere, (count, 3): a Fibonacci spiral from its top."""
    number = np.arange(count)
    height = 1.0 - (2.0 * number + 1.0) / count
    angle, across = GOLDEN_ANGLE * number, np.sqrt(1.0 - height * height)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)


def perpendicular_axes(along: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (3,) perpendicular to a unit vector and to each other."""
    side = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    side /= np.linalg.norm(side)
    return side, np.cross(along, side)


def dot(one: Floats, two: Floats) -> Floats:
    """Dot products of vectors (..., 3)."""
    return np.asarray(np.einsum("...i,...i->...", one, two))


def unit_rows(rows: Floats) -> Floats:
    """Rows (3, ...) of length 1; zero stays zero."""
    length = np.sqrt(dot_rows(rows, rows))
    return np.divide(rows, length, out=np.zeros_like(rows), where=length > 0.0)


def dot_rows(one: Floats, two: Floats) -> Floats:
    """Dot products of rows (3, ...)."""
    product = one * two
    total: Floats = product[0]
    total += product[1]
    total += product[2]
    return total


def cross_rows(one: Floats, two: Floats) -> Floats:
    """Cross products of rows (3, ...) of one dtype."""
    result = np.empty_like(one)
    scratch = np.empty_like(one[0])
    for axis, (y, z) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(one[y], two[z], out=result[axis])
        np.multiply(one[z], two[y], out=scratch)
        result[axis] -= scratch
    return result
