"""How much hair a card stands for in opacity maps.

Strands that cover a place at random, tau times over, leave exp(-tau) of it open (Poisson). A card
whose texture covers alpha of a place leaves 1 - alpha open, so it stands for -log(1 - alpha)
strands, one behind the other. That is more than a groom has, because cards are opaque where they
stand for few strands too, so cards of a groom count by a thickness at which all of them together
throw as much shadow as its strands.

Cards of baked strands have view-compensated alpha and count as strands do from all sides: turned
about its strands a card gets narrower, they do not. And its strands fill a depth: the one that is
seen lies near the front of it, so light from the front meets few of the others before it, and light
from behind most of them.

Twin of gpu_shaders/lib_card_opacity.glsl and lib_card_shadows.glsl.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...strands import StrandSet
from ...strands.arc_length import along, steps
from ...strands.triangles import areas_of
from ..settings import StrandSettings

#: a card lets at least as much light through as this leaves: four strands are as good as a wall
MAX_ALPHA = 0.98
#: mean of |cos| over all turns of a card about its strands
MEAN_TURN = 2.0 / np.pi
#: where a card is nearly on edge, it counts as this far turned to the eye, or to the light
MIN_FACING = 0.1
#: how much of an upright piece's length a layer of shells shows, squared
UPRIGHT_SHOWN = 0.5
#: of fewer strands than that any may be the one that is seen, and more are as good as a wall [1]
MIN_SEEN, MAX_SEEN = 0.05, 60.0
#: depth of strands below which they lie in a plane [m]
MIN_DEPTH = 1.0e-5
#: how fast what is before a strand changes with the side that light comes from, over |cos|
SIDEDNESS = 2.0
#: counts of strands are at least this part of them apart
APART = 1.0e-3


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


def seen_depth(seen: Floats) -> Floats:
    """How far behind the front of a card's strands lies the one that is seen on the mean, (...), as
    a fraction of their depth: an eye meets the first of strands at random.

    Args:
        seen: how many strands of the card an eye meets, tau.
    """
    few = np.clip(seen, MIN_SEEN, MAX_SEEN)
    depth: Floats = 1.0 / few - 1.0 / np.expm1(few)
    return depth


def own_strands(seen: Floats, own: Floats, near: Floats, front: Floats) -> tuple[Floats, Floats]:
    """tau of the other strands of a card before the one that is seen, and beyond it, (...) each.

    Eye and light come different ways, so what is clear to the one is as full as the rest to the
    other. The strand that is seen has a depth s with p(s) = seen exp(-seen s) / (1 - exp(-seen)).
    The light that comes to it is the integral of p(s) exp(-own max(s - near, 0)), and from behind
    of p(s) exp(-own max(1 - s - near, 0)).

    Args:
        seen, own: how many strands of the card an eye meets, and the light, tau.
        near: how near to the one that is seen they do not count, as a fraction of their depth.
        front: 1 where light comes from the eye's side of the card, 0 where from behind.
    """
    a, b = np.clip(seen, MIN_SEEN, MAX_SEEN), np.clip(own, 0.0, MAX_SEEN)
    b = np.where(np.abs(b - a) < APART * a, (1.0 + APART) * a, b)
    near = np.minimum(near, 1.0)
    left = 1.0 - near
    before, behind, end = np.exp(-a * near), np.exp(-a * left), np.exp(-a)
    ahead = 1.0 - before + a / (a + b) * (before - end * np.exp(-b * left))
    back = a / (a - b) * (np.exp(-b * left) - behind) + behind - end
    met = np.maximum(-np.log((back + (ahead - back) * front) / (1.0 - end)), 0.0)
    return met, np.maximum(own - met, 0.0)


def own_tips(own: Floats, tau: Floats, front: Floats) -> tuple[Floats, Floats]:
    """The same of short hair, of which one sees a tip, with the others beside it.

    Where tau strands lie at random and one at least, it has tau / (1 - exp(-tau)) - 1 beside it.

    Args:
        own: how much of the card light meets. tau: of the card.
        front: fraction of its other strands that the light meets later.
    """
    few = np.maximum(tau, MIN_SEEN)
    others = own * (1.0 / -np.expm1(-few) - 1.0 / few)
    return others * (1.0 - front), others * front


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


#: Of a layer of shells, which shows pieces of strands and no locks (measured: the short coat).
SHELL_LIT_LEVEL = 2
#: Levels by which a light's map is coarser than an atlas, about; and texels across a tile at least.
_COARSER, _ACROSS = 3, 8


def lit_level(shape: tuple[int, ...], columns: int, rows: int) -> int:
    """The level of a card's alpha from which its tau is taken for any light.

    It is the same everywhere: of a coarser level, in which strands and gaps are mixed, tau is less.

    Args:
        shape: of the alpha, (height, width). columns, rows: of its tiles.
    """
    across = min(shape[0] // max(rows, 1), shape[1] // max(columns, 1))
    return min(max((across // _ACROSS).bit_length() - 1, 0), _COARSER)


def card_shadow_area(
    positions: Floats, triangles: Ints, uv: Floats, alpha: Floats, level: int = 0
) -> float:
    """What cards of thickness 1 would take of light from everywhere [m^2]: half of their area,
    as flat things, times tau.

    Args:
        positions: (vertex_count, 3) [m]. uv: (vertex_count, 2). alpha: (height, width).
        level: see lit_level.
    """
    area = areas_of(positions[triangles])
    at = np.einsum("pk,tkj->ptj", _PLACES, uv[triangles])
    alpha = _coarser(_coarser(alpha, 0, level), 1, level)
    size = np.array(alpha.shape)
    column, row = np.clip((at * size[::-1]).astype(np.int64), 0, size[::-1] - 1).transpose(2, 0, 1)
    tau = card_optical_depth(alpha[row, column]).mean(axis=0)
    return 0.5 * float((area * tau).sum(dtype=np.float64))


def _coarser(alpha: Floats, axis: int, level: int) -> Floats:
    """A level along an axis, as mip maps have it."""
    starts = np.arange(0, alpha.shape[axis], 1 << level)
    texels = np.diff(np.append(starts, alpha.shape[axis]))
    sums = np.add.reduceat(alpha, starts, axis=axis, dtype=np.float32)
    means: Floats = sums / (texels[:, None] if axis == 0 else texels)
    return means
