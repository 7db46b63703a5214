"""Optical depth of hair cards in opacity maps.

Strands that lie at random and cover a place tau times over leave exp(-tau) of it open (Poisson). A
card whose texture covers alpha of a place leaves 1 - alpha open, so it counts as -log(1 - alpha)
strands, one behind the other. That is more than a groom has, because cards are opaque even where
they represent few strands. So a groom's cards are scaled by a thickness at which all of them
together cast as much shadow as its strands.

Cards of baked strands have view-compensated alpha and block light as strands do from all sides:
turned about its strands, a card gets narrower, but its strands do not. These strands also fill a
depth: the visible one lies near the front, so light from the front passes few of the others before
it, and light from behind most of them.

Twin of gpu_shaders/lib_card_opacity.glsl and lib_card_shadows.glsl.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...strands import StrandSet
from ...strands.arc_length import length_fractions, segment_lengths
from ...strands.triangles import areas_of
from ..settings import StrandSettings

#: highest alpha a card counts with: it blocks as much light as four strands
MAX_ALPHA = 0.98
#: mean of |cos| over all turns of a card about its strands
MEAN_TURN = 2.0 / np.pi
#: minimum |cos| of the turn of a card, when it is nearly on edge to the eye or to the light
MIN_FACING = 0.1
#: fraction of an upright piece's length that a layer of shells shows, squared
VISIBLE_UPRIGHT = 0.5
#: range to which the number of strands on a ray of the eye is clamped [1]
MIN_EYE_TAU, MAX_EYE_TAU = 0.05, 60.0
#: depth of strands below which they lie in a plane [m]
MIN_DEPTH = 1.0e-5
#: slope, over |cos|, of the blend between light from the front and from behind
SIDEDNESS = 2.0
#: minimum relative difference between counts of strands, whose difference is a divisor
MIN_TAU_DIFFERENCE = 1.0e-3


def card_optical_depth(alpha: Floats) -> Floats:
    """tau that light meets in a card of thickness 1 and this alpha, (...)."""
    return -np.log1p(-np.minimum(alpha, MAX_ALPHA))


def turned_facing(across: Floats, tangent: Floats, direction: Floats) -> Floats:
    """|cos| of a card's turn, about its strands, away from facing a direction, (...).

    Args:
        across: (..., 3) normal of its plane, of any length.
        tangent, direction: (..., 3) unit vectors.
    """
    turned = direction - np.sum(direction * tangent, axis=-1, keepdims=True) * tangent
    size = np.linalg.norm(across, axis=-1) * np.linalg.norm(turned, axis=-1)
    facing = np.abs(np.sum(across * turned, axis=-1)) / np.maximum(size, 1.0e-30)
    return np.where(size > 0.0, facing, 1.0)


def layer_facing(across: Floats, tangent: Floats, direction: Floats) -> Floats:
    """Optical depth of a layer of shells as baked, over that from a direction, (...).

    A slab of hair whose strands run along the tangent covers sin(tangent, direction) / |cos| of the
    slant. As baked, it covers what is seen from straight above, and a part of the length of upright
    strands. Arguments of `turned_facing`, but the tangent may stand out of the plane.
    """
    front = across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1.0e-30)
    upright = np.sum(tangent * front, axis=-1)
    along = np.sum(tangent * direction, axis=-1)
    baked = np.sqrt(1.0 - (1.0 - VISIBLE_UPRIGHT) * upright**2)
    sine = np.sqrt(np.maximum(1.0 - along**2, 1.0e-4))
    facing: Floats = np.abs(np.sum(front * direction, axis=-1)) * baked / sine
    return facing


def view_compensated_depth(across: Floats, tangent: Floats, direction: Floats) -> Floats:
    """Factor on tau, for light from a direction, of a card of view-compensated alpha, (...): times
    |cos|, its mean over all turns is that of a flat card. Arguments of `turned_facing`."""
    factor: Floats = MEAN_TURN / np.maximum(turned_facing(across, tangent, direction), MIN_FACING)
    return factor


def visible_depth(eye_tau: Floats) -> Floats:
    """Mean depth of the visible strand behind the front of a card's strands, (...), as a fraction
    of their depth: the eye meets the first of strands that lie at random.

    Args:
        eye_tau: number of the card's strands on a ray of the eye, tau.
    """
    clamped = np.clip(eye_tau, MIN_EYE_TAU, MAX_EYE_TAU)
    depth: Floats = 1.0 / clamped - 1.0 / np.expm1(clamped)
    return depth


def tau_within_card(
    eye_tau: Floats, light_tau: Floats, near: Floats, front: Floats
) -> tuple[Floats, Floats]:
    """tau of a card's other strands between the light and the visible one, and beyond it, (...)
    each.

    Eye and light look along different rays, so what is clear for the eye is as full as the rest for
    the light. The visible strand lies at a depth s with the density
    p(s) = a exp(-a s) / (1 - exp(-a)), a = eye_tau. The light that reaches it is the integral of
    p(s) exp(-b max(s - near, 0)), b = light_tau, from the front, and of
    p(s) exp(-b max(1 - s - near, 0)) from behind.

    Args:
        eye_tau, light_tau: number of the card's strands on a ray of the eye, and of the light, tau.
        near: distance from the visible strand within which others do not count, as a fraction of
            their depth.
        front: 1 for light from the eye's side of the card, 0 for light from behind.
    """
    a, b = np.clip(eye_tau, MIN_EYE_TAU, MAX_EYE_TAU), np.clip(light_tau, 0.0, MAX_EYE_TAU)
    b = np.where(np.abs(b - a) < MIN_TAU_DIFFERENCE * a, (1.0 + MIN_TAU_DIFFERENCE) * a, b)
    near = np.minimum(near, 1.0)
    remaining = 1.0 - near
    before, behind, end = np.exp(-a * near), np.exp(-a * remaining), np.exp(-a)
    ahead = 1.0 - before + a / (a + b) * (before - end * np.exp(-b * remaining))
    back = a / (a - b) * (np.exp(-b * remaining) - behind) + behind - end
    tau_before = np.maximum(-np.log((back + (ahead - back) * front) / (1.0 - end)), 0.0)
    return tau_before, np.maximum(light_tau - tau_before, 0.0)


def tau_within_card_at_depth(
    strands: tuple[Floats, Floats], deeper: Floats, front: Floats
) -> tuple[Floats, Floats]:
    """`tau_within_card` of a visible strand whose depth is known: tau grows evenly with the depth.

    Args:
        strands: result of `tau_within_card`.
        deeper: than visible strands lie on average, as a fraction of the strands' depth.
    """
    light_tau = strands[0] + strands[1]
    tau_before = np.clip(strands[0] + light_tau * deeper * (2.0 * front - 1.0), 0.0, light_tau)
    return tau_before, light_tau - tau_before


def tau_within_short_hair(
    light_tau: Floats, card_tau: Floats, front: Floats
) -> tuple[Floats, Floats]:
    """As `tau_within_card`, for short hair, whose visible tip has the others beside it.

    Among strands that lie at random, tau on average and at least one, a strand has
    tau / (1 - exp(-tau)) - 1 others beside it.

    Args:
        light_tau: tau of the card for the light. card_tau: of the card.
        front: fraction of its other strands that the light meets later.
    """
    clamped = np.maximum(card_tau, MIN_EYE_TAU)
    others = light_tau * (1.0 / -np.expm1(-clamped) - 1.0 / clamped)
    return others * (1.0 - front), others * front


@dataclass(frozen=True)
class StrandArea:
    """Areas of all strands [m^2], the sums of their lengths times widths.

    total: with their own widths. weighted_by_position: each place weighted by its position from the
        root, 0 to 1.
    """

    total: float
    weighted_by_position: float

    @classmethod
    def of(cls, strands: StrandSet) -> StrandArea:
        points, offsets, radius = strands.points, strands.offsets, strands.radius
        # of the segment that ends at each point but the first
        area = segment_lengths(points, offsets)[1:] * (radius[1:] + radius[:-1])
        ends = length_fractions(points, offsets)
        middle = 0.5 * (ends[1:] + ends[:-1])
        return cls(float(area.sum()), float((area * middle).sum()))

    def shadow_area(self, strands: StrandSettings) -> float:
        """Area that blocks light from everywhere [m^2]: pi / 4 of the strands' area, as
        cylinders."""
        tapered = self.total + (strands.tip_width - 1.0) * self.weighted_by_position
        return 0.25 * np.pi * strands.fullness * strands.as_drawn.opacity * tapered


#: places in a triangle, barycentric, where its alpha is looked up
_PLACES = (np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6.0).astype(np.float32)


#: `lit_level` of layers of shells, which show pieces of strands and no clumps (measured: the short
#: coat).
SHELL_LIT_LEVEL = 2
#: Levels by which a light's map is coarser than an atlas, roughly; minimum of texels across a tile.
_MAX_LIT_LEVEL, _ACROSS = 3, 8


def lit_level(shape: tuple[int, ...], columns: int, rows: int) -> int:
    """The level of a card's alpha from which its tau is taken for any light.

    The same one everywhere, because tau is lower in coarser levels, which mix strands and gaps.

    Args:
        shape: of the alpha, (height, width). columns, rows: of its tiles.
    """
    across = min(shape[0] // max(rows, 1), shape[1] // max(columns, 1))
    return min(max((across // _ACROSS).bit_length() - 1, 0), _MAX_LIT_LEVEL)


def card_shadow_area(
    positions: Floats, triangles: Ints, uv: Floats, alpha: Floats, level: int = 0
) -> float:
    """Area of cards of thickness 1 that blocks light from everywhere [m^2]: half of their area, as
    they are flat, times tau.

    Args:
        positions: (vertex_count, 3) [m]. uv: (vertex_count, 2). alpha: (height, width).
        level: see lit_level.
    """
    area = areas_of(positions[triangles])
    at = np.einsum("pk,tkj->ptj", _PLACES, uv[triangles])
    alpha = _downsampled(_downsampled(alpha, 0, level), 1, level)
    size = np.array(alpha.shape)
    column, row = np.clip((at * size[::-1]).astype(np.int64), 0, size[::-1] - 1).transpose(2, 0, 1)
    tau = card_optical_depth(alpha[row, column]).mean(axis=0)
    return 0.5 * float((area * tau).sum(dtype=np.float64))


def _downsampled(alpha: Floats, axis: int, level: int) -> Floats:
    """A mip level along one axis."""
    starts = np.arange(0, alpha.shape[axis], 1 << level)
    texels = np.diff(np.append(starts, alpha.shape[axis]))
    sums = np.add.reduceat(alpha, starts, axis=axis, dtype=np.float32)
    means: Floats = sums / (texels[:, None] if axis == 0 else texels)
    return means
