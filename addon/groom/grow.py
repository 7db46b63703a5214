"""Growing a groom on a head: out of the scalp, along the comb, down with gravity, around the head.

Growth along the normals with segments that lengthen towards the tip is Nguyen and Donnelly's
(2005, GPU Gems 2, chapter 23); the comb, the fall around the head and the locks are Hairloom's.

Limitations: the head is upright (Z up) and faces -Y, and strands do not push each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet, Surface
from .locks import assign_locks, style_locks
from .scalp import find_cranium, sample_roots, scalp_density
from .settings import GrowSettings
from .skin import Skin, unit

__all__ = ["grow", "scalp_density"]

_DOWN = np.array([0.0, 0.0, -1.0])
#: The step for which `GrowSettings.droop` says how much the hair turns [m].
_DROOP_STEP = 0.02


def grow(surface: Surface, settings: GrowSettings, density: Floats | None = None) -> StrandSet:
    """A groom on a head, bound to it, all strands of one CV count, in the surface's space.

    Args:
        surface: world space, upright, facing -Y.
        density: (vertex_count,), how densely hair grows, not negative; None: everywhere alike.

    Raises:
        HairloomError: the surface has no triangles, or nowhere to grow.
    """
    random = np.random.default_rng(settings.seed)
    triangle, barycentric = sample_roots(surface, settings.strand_count, density, random)
    corners = surface.corners[triangle].astype(np.float64)
    root = np.einsum("sk,skj->sj", barycentric, corners)
    lock = assign_locks(root, settings, random)
    plan = _plan(surface, lock, settings, random)

    normal = plan.skin.normal(triangle, barycentric)
    comb = _combed(surface, root, normal, settings)
    grid = _fallen(root, normal, comb, plan, settings)
    grid = _laid(style_locks(grid, lock, settings, random), plan)
    return _as_strands(grid, triangle, barycentric, surface, settings)


@dataclass(frozen=True)
class _Plan:
    """segment: (strand_count, cv_count - 1) [m], length of each segment.
    height: (strand_count, cv_count - 1) [m], how far from the skin each segment's end stays.
    """

    segment: Floats
    height: Floats
    skin: Skin

    def step(self, cv: int, start: Floats, direction: Floats) -> Floats:
        """Where the segment that leads to this CV ends, (strand_count, 3)."""
        return self.skin.step(start, direction, self.segment[:, cv - 1], self.height[:, cv - 1])


def _plan(
    surface: Surface, lock: Ints, settings: GrowSettings, random: np.random.Generator
) -> _Plan:
    segment = _segments(lock, settings, random)
    height = _heights(lock, settings, random)
    return _Plan(segment, height, Skin(surface, reach=float((segment + height).max(initial=0.0))))


def _segments(lock: Ints, settings: GrowSettings, random: np.random.Generator) -> Floats:
    """Length of each segment, (strand_count, cv_count - 1) [m]; the strands of a lock are alike."""
    count = len(lock)
    shorter = 0.6 * random.random(count)[lock] + 0.4 * random.random(count)
    length = settings.length * (1.0 - settings.length_variation * shorter)
    share = settings.segment_ratio ** np.arange(settings.cv_count - 1)
    return length[:, None] * (share / share.sum())


def _heights(lock: Ints, settings: GrowSettings, random: np.random.Generator) -> Floats:
    """How far from the skin each segment's end stays, (strand_count, cv_count - 1) [m]."""
    layer = 0.7 * random.random(len(lock))[lock] + 0.3 * random.random(len(lock))
    share = np.linspace(0.0, 1.0, settings.cv_count)[1:]
    rise = 1.0 - (1.0 - np.minimum(3.0 * share, 1.0)) ** 2
    clearance = settings.clearance * np.minimum(5.0 * share, 1.0)
    return clearance + settings.volume * rise * layer[:, None]


def _combed(surface: Surface, root: Floats, normal: Floats, settings: GrowSettings) -> Floats:
    """Unit directions in which the hair is combed, along the skin, (strand_count, 3)."""
    cranium = find_cranium(surface.positions)
    side = np.clip((root[:, 0] - cranium.center[0]) / (0.5 * cranium.half_depth), -1.0, 1.0)
    comb = np.empty_like(root)
    comb[:, 0] = (1.0 - settings.comb_back) * side
    comb[:, 1] = settings.comb_back
    comb[:, 2] = -0.35
    return unit(comb - normal * np.einsum("ij,ij->i", comb, normal)[:, None])


def _fallen(
    root: Floats, normal: Floats, comb: Floats, plan: _Plan, settings: GrowSettings
) -> Floats:
    """Grow segment by segment, turning from the comb to the fall, (strand_count, cv_count, 3)."""
    grid = np.repeat(root[:, None], settings.cv_count, axis=1)
    direction = unit(settings.lift * normal + (1.0 - settings.lift) * comb)
    for cv in range(1, settings.cv_count):
        share = cv / (settings.cv_count - 1)
        fall = min(share / settings.comb_share, 1.0) if settings.comb_share else 1.0
        aim = unit((1.0 - fall) * comb + fall * _DOWN)
        turn = 1.0 - (1.0 - settings.droop) ** (plan.segment[:, cv - 1] / _DROOP_STEP)
        direction = unit(direction + turn[:, None] * (aim - direction))
        grid[:, cv] = plan.step(cv, grid[:, cv - 1], direction)
        direction = unit(grid[:, cv] - grid[:, cv - 1])
    return grid


def _laid(styled: Floats, plan: _Plan) -> Floats:
    """The styled strands with their own segment lengths again, and outside of the skin."""
    grid = styled.copy()
    for cv in range(1, grid.shape[1]):
        grid[:, cv] = plan.step(cv, grid[:, cv - 1], styled[:, cv] - grid[:, cv - 1])
    # keeping the length may have drawn a point in again; half of its height is always kept
    free = plan.skin.outside(grid[:, 1:].reshape(-1, 3), 0.5 * plan.height.ravel())
    grid[:, 1:] = free.reshape(grid[:, 1:].shape)
    return grid


def _as_strands(
    grid: Floats, triangle: Ints, barycentric: Floats, surface: Surface, settings: GrowSettings
) -> StrandSet:
    strand_count, cv_count = grid.shape[:2]
    root_uv = None
    if surface.corner_uv is not None:
        root_uv = np.einsum("sk,skj->sj", barycentric, surface.corner_uv[triangle])
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(strand_count + 1) * cv_count,
        radius=np.full(strand_count * cv_count, settings.radius),
        group=np.zeros(strand_count, np.int32),
        root_uv=root_uv,
        root_triangle=triangle,
        root_barycentric=barycentric,
    )
