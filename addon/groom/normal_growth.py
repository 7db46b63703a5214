"""Strands that stand on a mesh, or lie on it as fur does.

From vertices, or lifted fully, they stand straight, the guides of the Nalu demo: "The control hairs
are grown from a dedicated mesh, one from each vertex, along the normal; the segments get longer
towards the tip" (Nguyen and Donnelly 2005, GPU Gems 2, chapter 23). Here they may also grow from
any number of points, spread over the mesh by area and density. Less lifted they lean back and down,
increasingly from root to tip, in tufts that each lean a little their own way.

Limitations: fur leans by world space, for an upright animal that faces -Y, and does not keep out of
folds of the mesh.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet, Surface
from ..strands.vectors import unit
from .bound_strands import bound_strands, checked_weights, interpolate_weights, segment_fractions
from .clumps import assign_clumps
from .scalp import sample_roots
from .settings import GrowSettings

#: A mean of normals shorter than this points nowhere, as on two faces back to back.
_NO_DIRECTION = 1.0e-3
#: The direction in which fur leans on an animal: back and down.
_LEANING = np.array([0.0, 0.55, -0.65])
#: Fraction by which an unlifted strand's angle from the skin shrinks from root to tip.
_BEND = 0.7
#: Standard deviations: directions of tufts and of single strands [rad], and the strands' lift.
_TUFTS_STRAY, _STRANDS_STRAY, _LIFT_VARIES = 0.3, 0.2, 0.18


def grow_along_normals(
    surface: Surface,
    settings: GrowSettings,
    density: Floats | None = None,
    length: Floats | None = None,
) -> StrandSet:
    """Strands along the normals, bound, all of one CV count, in the surface's space.

    They grow from `settings.strand_count` points, or with `settings.per_vertex` from each vertex
    whose density is above `settings.threshold`. From vertices, or with a `settings.lift` of 1, they
    are straight. The same input and seed give the same strands.

    Args:
        surface: world space.
        density: (vertex_count,), how densely hair grows, not negative; None: everywhere alike.
        length: (vertex_count,), factor on the length, usually 0 to 1; None: 1 everywhere. No hair
            grows where it is 0.

    Raises:
        HairloomError: the surface has no triangles, weights that do not fit it or are not finite,
            or nowhere to grow.
    """
    density = checked_weights(density, surface, "density")
    length = checked_weights(length, surface, "length")
    random = np.random.default_rng(settings.seed)
    if settings.per_vertex:
        triangle, barycentric = _vertex_roots(surface, _grows(surface, settings, density, length))
    else:
        where = density_with_length(density, length)
        triangle, barycentric = sample_roots(surface, settings.strand_count, where, random)
    root = np.einsum("nk,nkj->nj", barycentric, surface.corners[triangle].astype(np.float64))
    strand_length = settings.length * (
        1.0 - settings.length_variation * random.random(len(triangle))
    )
    if length is not None:
        strand_length *= interpolate_weights(length, surface, triangle, barycentric)
    normal = _normals(surface, triangle, barycentric)
    direction = _directions(root, normal, settings, random)
    segment = strand_length[:, None] * segment_fractions(settings.cv_count, settings.segment_ratio)
    grid = np.repeat(root[:, None], settings.cv_count, axis=1)
    grid[:, 1:] += (segment[..., None] * direction).cumsum(axis=1)
    return bound_strands(grid, triangle, barycentric, surface)


def _directions(
    root: Floats, normal: Floats, settings: GrowSettings, random: np.random.Generator
) -> Floats:
    """Unit direction of each segment, (strand_count, cv_count - 1, 3)."""
    shape = len(root), settings.cv_count - 1, 3
    if settings.per_vertex or settings.lift >= 1.0 or not len(root):
        return np.broadcast_to(normal[:, None], shape)
    tuft = assign_clumps(root, settings, random)
    across = _LEANING - normal * (normal @ _LEANING)[:, None]
    # it stands where the lean has no direction along the skin, as on the breast
    lean = np.linalg.norm(across, axis=1)
    aside = unit(across)
    turn = _TUFTS_STRAY * random.standard_normal(len(root))[tuft]
    turn = (turn + _STRANDS_STRAY * random.standard_normal(len(root)))[:, None]
    aside = np.cos(turn) * aside + np.sin(turn) * np.cross(normal, aside)
    lift = settings.lift * (1.0 + _LIFT_VARIES * random.standard_normal(len(root)))
    lift = 1.0 - np.minimum(1.5 * lean, 1.0) * (1.0 - np.clip(lift, 0.0, 1.0))
    along = np.linspace(0.0, 1.0, settings.cv_count - 1)
    angle = 0.5 * np.pi * lift[:, None] * (1.0 - _BEND * along * (1.0 - lift[:, None]))
    return np.sin(angle)[..., None] * normal[:, None] + np.cos(angle)[..., None] * aside[:, None]


def density_with_length(density: Floats | None, length: Floats | None) -> Floats | None:
    """The density, set to 0 where hair would have no length; both (vertex_count,), None: not
    painted.
    """
    if length is None:
        return density
    grows = (length > 0.0).astype(np.float64)
    return grows if density is None else density * grows


def _grows(
    surface: Surface, settings: GrowSettings, density: Floats | None, length: Floats | None
) -> Bools:
    """Whether a strand grows from each vertex, (vertex_count,)."""
    grows = np.ones(len(surface.positions), bool)
    if density is not None:
        grows &= density > settings.threshold
    if length is not None:
        grows &= length > 0.0
    return grows


def _vertex_roots(surface: Surface, grows: Bools) -> tuple[Ints, Floats]:
    """Roots on the vertices, in their order: triangle (n,) and barycentric (n, 3).

    Each is held by its largest triangle. A vertex of no triangle, or only of ones without area,
    has no normal and grows no hair.
    """
    edge = np.diff(surface.corners.astype(np.float64), axis=1)
    area = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    order = np.argsort(area, kind="stable")
    order = order[area[order] > 0.0]
    holder = np.full(len(surface.positions), -1, np.int64)
    holder[surface.triangles[order]] = order[:, None]  # the last one written, the largest, stays
    vertex = np.flatnonzero(grows & (holder >= 0))
    if not len(vertex):
        raise HairloomError(
            "there is no vertex on which hair may grow",
            place="mesh",
            remedy="Choose a mesh with faces, and lower the threshold below the density",
        )
    corner = (surface.triangles[holder[vertex]] == vertex[:, None]).argmax(axis=1)
    return holder[vertex], np.eye(3)[corner]


def _normals(surface: Surface, triangle: Ints, barycentric: Floats) -> Floats:
    """Smooth unit normals at points of the surface, (n, 3); the triangle's own where they cancel
    each other."""
    corner_normals = surface.vertex_normals()[surface.triangles[triangle]].astype(np.float64)
    normal = np.einsum("nk,nkj->nj", barycentric, corner_normals)
    a, b, c = np.moveaxis(surface.corners[triangle].astype(np.float64), 1, 0)
    flat = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    chosen = np.where(size > _NO_DIRECTION, normal, flat)
    result: Floats = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return result
