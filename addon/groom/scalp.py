"""The scalp: where on a head hair grows, and roots spread over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import Surface
from ..strands.morton import morton_code
from ..strands.triangles import areas_of, uniform_barycentrics

#: The hairline in the cranium's own units (half its depth; y to the back, z up, from its middle):
#: hair grows above the line from the forehead down to the nape, and between the ears.
_FOREHEAD = (-0.8, 0.58)
_NAPE = (0.75, -0.85)
_EARS = 1.05
#: How much thinner hair grows on the back half than at the front.
_THINNER_BACK = 0.4
#: Width of the soft edge of the hair, in the same units.
_SOFTNESS = 0.14


@dataclass(frozen=True)
class Cranium:
    """The skull inside a head or bust: center (3,) [m], and half its depth, front to back [m]."""

    center: Floats
    half_depth: float


def find_cranium(positions: Floats) -> Cranium:
    """The skull of a head that is upright (Z up): as deep as it is high, measured from the top.

    Depth and height depend on each other; from a thin slice at the top they grow until they are
    equal, so that a neck or shoulders below do not count.
    """
    top = float(positions[:, 2].max())
    depth = 0.15 * (top - float(positions[:, 2].min()))
    inside = positions
    for _ in range(12):
        inside = positions[positions[:, 2] >= top - depth]
        depth = max(float(np.ptp(inside[:, 1])), 0.5 * depth, 1e-6)
    middle = (inside.min(axis=0) + inside.max(axis=0)) / 2.0
    return Cranium(np.array([middle[0], middle[1], top - depth / 2.0]), depth / 2.0)


def scalp_density(surface: Surface) -> Floats:
    """How densely hair grows on an upright head that faces -Y, (vertex_count,), 0 to 1.

    A smooth hairline from the forehead over the temples to the nape; none on ears and face.
    """
    if not len(surface.positions):
        return np.zeros(0, np.float32)
    cranium = find_cranium(surface.positions)
    x, y, z = ((surface.positions - cranium.center) / cranium.half_depth).T
    slope = (_NAPE[1] - _FOREHEAD[1]) / (_NAPE[0] - _FOREHEAD[0])
    above_hairline = z - (_FOREHEAD[1] + slope * (y - _FOREHEAD[0]))
    # what faces forwards and down below the top is face, not scalp
    normal = surface.vertex_normals()
    facing = 0.9 + normal[:, 1] + 0.6 * normal[:, 2] + np.maximum(z - 0.5, 0.0)
    edges = (above_hairline, _EARS - np.abs(x), facing)
    hair = np.prod([smooth_step(edge / _SOFTNESS) for edge in edges], axis=0)
    # hair at the front is combed away from there, and no other hair falls over it
    return (hair * (1.0 - _THINNER_BACK * smooth_step(0.5 + y))).astype(np.float32)


def sample_roots(
    surface: Surface, count: int, density: Floats | None, random: np.random.Generator
) -> tuple[Ints, Floats]:
    """Roots spread by area x density: triangle (count,) and barycentric (count, 3).

    Stratified along a space-filling curve through the triangles (Morton order), so that roots
    keep their distance as blue noise does, for any count. Density is linear within a triangle.

    Raises:
        HairloomError: the surface has no area on which hair may grow.
    """
    corners = surface.corners.astype(np.float64)
    area = areas_of(corners)
    if density is not None:
        area = area * np.maximum(density, 0.0)[surface.triangles].mean(axis=1)
    if not area.sum() > 0.0:
        raise HairloomError(
            "there is no area on which hair may grow",
            place="head",
            remedy="Choose a mesh with faces, and a density above 0 on some of them",
        )
    order = np.argsort(morton_code(corners.mean(axis=1)), kind="stable")
    along = np.cumsum(area[order])
    stratum = (np.arange(count) + random.random(count)) / count * along[-1]
    last = np.flatnonzero(area[order])[-1]  # rounding must not lead to a triangle without area
    place = np.minimum(np.searchsorted(along, stratum, side="right"), last)
    triangle = order[place]
    barycentric = uniform_barycentrics(random.random(count), random.random(count))
    if density is None:
        return triangle, barycentric
    fraction = np.clip((along[place] - stratum) / area[triangle], 0.0, 1.0)  # left of the triangle
    return triangle, _towards_density(
        barycentric, np.maximum(density, 0.0)[surface.triangles[triangle]], fraction
    )


def _towards_density(barycentric: Floats, density: Floats, chance: Floats) -> Floats:
    """Uniform points of triangles turned to ones that follow a density linear between corners.

    A uniform point's three cyclic turns are uniform too, and their densities always add up to that
    of the corners; taking one by its density therefore gives exactly that density.

    Args:
        barycentric, density: (count, 3), of the points, and at the corners of their triangles.
        chance: (count,) uniform from 0 to 1.
    """
    turns = np.stack([np.roll(barycentric, turn, axis=1) for turn in range(3)], axis=1)
    reached = np.einsum("ntk,nk->nt", turns, density).cumsum(axis=1)
    taken = (reached[:, :2] < (chance * reached[:, 2])[:, None]).sum(axis=1)
    return turns[np.arange(len(turns)), taken]


def smooth_step(value: Floats) -> Floats:
    """0 below 0, 1 above 1, and a smooth rise between them; of any shape."""
    x = np.clip(value, 0.0, 1.0)
    smooth: Floats = x * x * (3.0 - 2.0 * x)
    return smooth
