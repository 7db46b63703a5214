"""How much hair a card stands for in opacity maps.

Strands that cover a place at random, tau times over, leave exp(-tau) of it open (Poisson). A card
whose texture covers alpha of a place leaves 1 - alpha open, so it stands for -log(1 - alpha)
strands, one behind the other. That is more than a groom has, because cards are opaque where they
stand for few strands too, so cards of a groom count by a thickness at which all of them together
throw as much shadow as its strands.

Cards of baked strands have view-compensated alpha and count as strands do from all sides: turned
about its strands a card gets narrower, they do not. And the strand that is seen is the foremost one
of its card, so light from the front meets the others behind it, and light from behind before it.

Twin of gpu_shaders/lib_card_opacity.glsl and lib_card_shadows.glsl.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...strands import StrandSet
from ...strands.arc_length import along, steps
from ..settings import StrandSettings

#: a card lets at least as much light through as this leaves: four strands are as good as a wall
MAX_ALPHA = 0.98
#: mean of |cos| over all turns of a card about its strands
MEAN_TURN = 2.0 / np.pi
#: where a card is nearly on edge, it counts as this far turned to the eye, or to the light
MIN_FACING = 0.1
#: how much of an upright piece's length a layer of shells shows, squared
UPRIGHT_SHOWN = 0.5
#: fewer strands than that are as good as none [1]
MIN_TAU = 1.0e-3


def card_optical_depth(alpha: Floats) -> Floats:
    """tau that light meets in a card of thickness 1, (...)."""
    return -np.log1p(-np.minimum(alpha, MAX_ALPHA))


def turned_facing(across: Floats, tangent: Floats, direction: Floats) -> Floats:
    """|cos| of the turn about its strands by which a card faces a direction, (...).

    Args:
        across: (..., 3) normal of its plane, of any length.
        tangent, direction: (..., 3) unit vectors.
    """
    turned = direction - np.sum(direction * tangent, axis=-1, keepdims=True) * tangent
    size = np.linalg.norm(across, axis=-1) * np.linalg.norm(turned, axis=-1)
    facing = np.abs(np.sum(across * turned, axis=-1)) / np.maximum(size, 1.0e-30)
    return np.where(size > 0.0, facing, 1.0)


def layer_facing(across: Floats, tangent: Floats, direction: Floats) -> Floats:
    """How much denser a layer of shells is as it was baked than from a direction, (...).

    A slab of hair, in which strands run along the tangent, covers sin(tangent, direction) / |cos|
    of the slant; baked it covers what is seen from straight above, and of upright strands a part
    of their length. Arguments of `turned_facing`, but the tangent may stand out of the plane.
    """
    front = across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1.0e-30)
    upright = np.sum(tangent * front, axis=-1)
    along = np.sum(tangent * direction, axis=-1)
    baked = np.sqrt(1.0 - (1.0 - UPRIGHT_SHOWN) * upright**2)
    sine = np.sqrt(np.maximum(1.0 - along**2, 1.0e-4))
    facing: Floats = np.abs(np.sum(front * direction, axis=-1)) * baked / sine
    return facing


def view_compensated_depth(across: Floats, tangent: Floats, direction: Floats) -> Floats:
    """Factor of the tau that light from a direction meets in a card of view-compensated alpha,
    (...): its mean over all turns of the card, times |cos|, is that of a flat card; arguments of
    `turned_facing`."""
    factor: Floats = MEAN_TURN / np.maximum(turned_facing(across, tangent, direction), MIN_FACING)
    return factor


def among_strands(
    before: Floats, beyond: Floats, scale: Floats, tau: Floats, fraction: Floats, front: Floats
) -> tuple[Floats, Floats]:
    """How much hair lies before and beyond the strand that is seen of such a card, (...) each.

    Where tau strands lie at random and one at least, it has tau / (1 - exp(-tau)) - 1 behind it.

    Args:
        before, beyond: the plane of the card by the map, the card itself in them.
        scale: what one strand of the card counts there. tau: of the card.
        fraction: see own_fraction. front: fraction of its other strands that the light meets later.
    """
    few = np.maximum(tau, MIN_TAU)
    others = scale * (few / -np.expm1(-few) - 1.0)
    met = np.maximum(before - scale * tau * fraction, 0.0) + others * (1.0 - front)
    left = np.maximum(beyond - scale * tau * (1.0 - fraction), 0.0) + others * front
    return met, left


@dataclass(frozen=True)
class StrandArea:
    """Areas of all strands [m^2], the sums of their lengths times widths.

    whole: as wide as they are everywhere. weighted: each place counts by how far it is from the
        root, 0 to 1.
    """

    whole: float
    weighted: float

    @classmethod
    def of(cls, strands: StrandSet) -> StrandArea:
        points, offsets, radius = strands.points, strands.offsets, strands.radius
        # of the segment that ends at each point but the first
        area = steps(points, offsets)[1:] * (radius[1:] + radius[:-1])
        ends = along(points, offsets)
        middle = 0.5 * (ends[1:] + ends[:-1])
        return cls(float(area.sum()), float((area * middle).sum()))

    def shadow_area(self, strands: StrandSettings) -> float:
        """What they take of light from everywhere [m^2]: pi / 4 of their area, as cylinders."""
        tapered = self.whole + (strands.tip_width - 1.0) * self.weighted
        return 0.25 * np.pi * strands.fullness * strands.as_drawn.opacity * tapered


#: places in a triangle, barycentric, where its alpha is looked up
_PLACES = (np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6.0).astype(np.float32)


#: Texels that are one for a light, along each side: its map is about so much coarser than an atlas.
_LIT_TEXELS = 4


def card_shadow_area(positions: Floats, triangles: Ints, uv: Floats, alpha: Floats) -> float:
    """What cards of thickness 1 would take of light from everywhere [m^2]: half of their area,
    as flat things, times tau.

    Args:
        positions: (vertex_count, 3) [m]. uv: (vertex_count, 2). alpha: (height, width).
    """
    a, b, c = (positions[triangles[:, corner]] for corner in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    at = np.einsum("pk,tkj->ptj", _PLACES, uv[triangles])
    alpha = _coarser(_coarser(alpha, 0), 1)
    size = np.array(alpha.shape)
    column, row = np.clip((at * size[::-1]).astype(np.int64), 0, size[::-1] - 1).transpose(2, 0, 1)
    tau = card_optical_depth(alpha[row, column]).mean(axis=0)
    return 0.5 * float((area * tau).sum(dtype=np.float64))


def _coarser(alpha: Floats, axis: int) -> Floats:
    """Means of this many texels along an axis, as mip maps have them."""
    starts = np.arange(0, alpha.shape[axis], _LIT_TEXELS)
    texels = np.diff(np.append(starts, alpha.shape[axis]))
    sums = np.add.reduceat(alpha, starts, axis=axis, dtype=np.float32)
    means: Floats = sums / (texels[:, None] if axis == 0 else texels)
    return means
