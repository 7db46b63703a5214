"""What holds cloth together: edges, folds, pins and the way to the nearest pinned vertex.

Distances are constraints with a compliance [s^2], the inverse of a spring's constant for a unit of
mass (XPBD, Macklin et al. 2016): how stiff the cloth is does not depend on the step.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats
from ..constraints import TINY
from .settings import FinSettings
from .state import Color, Fabric

#: Gravity [m/s^2] and height [m] of the hanging sheet that the `stretch` parameter speaks of.
_HANGING = 9.81 * 1.0


def keep_distances(position: Floats, color: Color, fraction: Floats) -> None:
    """Bring the pairs of one colour to their length, in place; position: (3, n) float32 [m].

    Args:
        fraction: (m,) of the error that each vertex takes: w_i / (w_i + w_j + compliance / dt^2),
            which is XPBD with one step of the solver in each step of time.
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


def hold_in_reach(position: Floats, fabric: Fabric) -> None:
    """No vertex farther from its pinned one than the way there along the edges, in place.

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


def pull_of(fabric: Fabric, settings: FinSettings, small: float) -> Floats:
    """Springs to where the animation carries the vertices, (n,) k / m times the step squared.

    The shape's spring, and with it the pin's: w / (1 - w) of the pull that a weight of one half
    has, so that it grows without bound where the pinned vertices begin.
    """
    loose = np.where(fabric.pinned, 0.0, fabric.pin.astype(np.float64))
    swings = settings.pin_pull * loose / (1.0 - loose)
    spring = (2.0 * math.pi) ** 2 * (swings**2 + settings.shape**2)
    pull: Floats = np.where(fabric.pinned, 0.0, spring * small**2).astype(np.float32)
    return pull


def edge_fractions(
    fabric: Fabric, mobility: Floats, settings: FinSettings, small: float
) -> tuple[Floats, ...]:
    """See `keep_distances`, for a small step [s]; mobility: (n,) inverse masses.

    A chain of unit masses at distances l with springs k is as stiff as a string of wave speed
    l sqrt(k), whatever l is: hanging, it stretches by g h / (l^2 k) at its upper end.
    """
    softness = settings.stretch / _HANGING / small**2
    return tuple(_fractions(edge, mobility, edge.length**2 * softness) for edge in fabric.edges)


def fold_fractions(fabric: Fabric, settings: FinSettings, dt: float) -> tuple[Floats, ...]:
    """Two unit masses that a spring of k brings back swing with w^2 = 2 k."""
    if not settings.bend:
        return ()
    mobility = np.where(fabric.pinned, 0.0, 1.0).astype(np.float32)
    stiffness = np.float32((2.0 * math.pi * settings.bend * dt) ** 2 / 2.0)
    return tuple(_fractions(fold, mobility * stiffness, 1.0) for fold in fabric.folds)


def _fractions(color: Color, mobility: Floats, compliance: Floats | float) -> Floats:
    """Share (m,) of the error that each vertex of a colour takes; see `keep_distances`."""
    own = mobility if color.vertices is None else mobility[color.vertices]
    other = mobility[color.mates]
    total = own + other + compliance
    result: Floats = np.divide(own, total, out=np.zeros_like(own), where=total > 0.0)
    return result
