"""The constraints of cloth: edges, folds, pins and the distance to the nearest pinned vertex.

Distances are constraints with a compliance [s^2], the inverse of the spring constant per unit of
mass (XPBD, Macklin et al. 2016), so that stiffness does not depend on the time step.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats
from ..constraints import TINY
from .settings import FinSettings
from .state import Color, Fabric

#: Gravity [m/s^2] times height [m] of the hanging sheet that defines the `stretch` parameter.
_GRAVITY_TIMES_HEIGHT = 9.81 * 1.0


def keep_distances(position: Floats, color: Color, fraction: Floats) -> None:
    """Bring the pairs of one colour to their lengths, in place.

    Args:
        position: (3, n) float32 [m].
        fraction: (m,), the part of the error that each vertex corrects: w_i / (w_i + w_j +
            compliance / dt^2), which is XPBD with one solver iteration per time step.
    """
    vertices = color.vertices
    here = position if vertices is None else position.take(vertices, axis=1)
    displacement = position.take(color.mates, axis=1)
    displacement -= here
    part = np.einsum("ij,ij->j", displacement, displacement)
    np.sqrt(part, out=part)
    np.maximum(part, TINY, out=part)
    np.divide(color.length, part, out=part)
    np.subtract(np.float32(1.0), part, out=part)
    part *= fraction
    displacement *= part
    here += displacement
    if vertices is not None:
        position[:, vertices] = here


def apply_long_range_attachments(position: Floats, fabric: Fabric) -> None:
    """Limit the distance of each vertex from its anchor to that along the edges, in place.

    Kim, Chentanez and Mueller 2012, "Long Range Attachments".
    """
    anchor = position.take(fabric.anchor, axis=1)
    displacement = position - anchor
    part = np.einsum("ij,ij->j", displacement, displacement)
    np.sqrt(part, out=part)
    np.maximum(part, np.maximum(fabric.reach, TINY), out=part)
    np.divide(fabric.reach, part, out=part)
    displacement *= part
    np.add(anchor, displacement, out=position)


def animation_springs(fabric: Fabric, settings: FinSettings, small_step: float) -> Floats:
    """Springs to where the animation carries the vertices, (n,), k / m times the step squared.

    The sum of the shape's spring and the pin's. The frequency of the latter is that of a pin weight
    of one half times w / (1 - w), which grows without bound towards pinned vertices.
    """
    loose = np.where(fabric.pinned, 0.0, fabric.pin.astype(np.float64))
    swings = settings.pin_pull * loose / (1.0 - loose)
    spring = (2.0 * math.pi) ** 2 * (swings**2 + settings.shape**2)
    pull: Floats = np.where(fabric.pinned, 0.0, spring * small_step**2).astype(np.float32)
    return pull


def edge_fractions(
    fabric: Fabric, mobility: Floats, settings: FinSettings, small_step: float
) -> tuple[Floats, ...]:
    """The fractions of edges for `keep_distances` in a small step [s].

    A chain of unit masses at distances l with springs k is as stiff as a string of wave speed
    l sqrt(k), whatever l is: hanging, it stretches by g h / (l^2 k) at its upper end.

    Args:
        mobility: (n,) inverse masses.
    """
    softness = settings.stretch / _GRAVITY_TIMES_HEIGHT / small_step**2
    return tuple(_fractions(edge, mobility, edge.length**2 * softness) for edge in fabric.edges)


def fold_fractions(fabric: Fabric, settings: FinSettings, dt: float) -> tuple[Floats, ...]:
    """The fractions of folds for `keep_distances` in a substep [s].

    Two unit masses that a spring of constant k connects swing with w^2 = 2 k.
    """
    if not settings.bend:
        return ()
    mobility = np.where(fabric.pinned, 0.0, 1.0).astype(np.float32)
    stiffness = np.float32((2.0 * math.pi * settings.bend * dt) ** 2 / 2.0)
    return tuple(_fractions(fold, mobility * stiffness, 1.0) for fold in fabric.folds)


def _fractions(color: Color, mobility: Floats, compliance: Floats | float) -> Floats:
    """The part (m,) of the error that each vertex of a colour corrects, see `keep_distances`."""
    own = mobility if color.vertices is None else mobility[color.vertices]
    other = mobility[color.mates]
    total = own + other + compliance
    result: Floats = np.divide(own, total, out=np.zeros_like(own), where=total > 0.0)
    return result
