"""Growing a groom on a head: out of the scalp, along the comb, down with gravity, around the head.

Hair of some centimetres is combed. Hair too short for that lies as it grows: away from a whorl at
the crown, around which it swirls.

Segments that lengthen towards the tip are Nguyen and Donnelly's (2005, GPU Gems 2, chapter 23), as
is growth along the normals (`normal_growth`); the comb, the fall around the head and the clumps are
Hairloom's.

Limitations: the head is upright (Z up) and faces -Y, and strands do not push each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.vectors import unit
from .bound_strands import bound_strands, checked_weights, interpolate_weights, segment_fractions
from .clumps import assign_clumps, style_clumps
from .growth_surface import GrowthSurface
from .normal_growth import density_with_length, grow_along_normals
from .scalp import Cranium, find_cranium, sample_roots, smooth_step
from .settings import GrowSettings

_DOWN = np.array([0.0, 0.0, -1.0])
#: The length of hair that `GrowSettings.droop` refers to [m].
_DROOP_STEP = 0.02
#: How much the hair at the parting is combed aside, as a fraction of that at the sides; and where
#: the parting ends, behind the cranium's middle, in units of half its depth.
_PARTED, _CROWN = 0.5, 0.7
#: Hair up to the first length is not combed, and from the second one on it is combed fully; in
#: units of half the cranium's depth.
_UNCOMBED, _COMBED = 0.45, 1.4
#: The whorl in the same units, from the cranium's middle; how far its swirl reaches, and how much
#: it turns the hair in its middle [rad], seen from above clockwise.
_WHORL, _SWIRL_REACH, _SWIRL = (0.12, 0.55, 0.85), 0.45, np.radians(75.0)
#: Standard deviations in uncombed hair: of the direction, by clump and by strand, and of the lift.
_CLUMPS_STRAY, _STRANDS_STRAY, _LIFT_VARIES = np.radians(9.0), np.radians(11.0), 0.14
#: Maximum height to which hair piles up, and maximum clearance, as fractions of its length.
_MAX_PILE, _MAX_CLEARANCE = 0.12, 0.06
#: Hair has its full height at 1 / _RISEN of its length. When it rose within some centimetres, hair
#: beside the parting stood in loops against the light.
_RISEN = 1.6
#: Hair shorter than this droops over shorter distances, but less than in proportion, as a shorter
#: beam is stiffer; in units of half the cranium's depth. On the built-in head it is 5 cm.
_STIFF = 0.48
#: How often hair is drawn out of hollows, how far towards the middle of its neighbours each time,
#: and how often the normals along a strand are averaged with their neighbours.
_PULLS, _PULL, _NORMALS_BLURRED = 40, 0.9, 6
#: The side of the cells in which the skin is looked up, in units of half the cranium's depth.
_CELL = 0.04
#: The sharpest turn from one segment to the next that a clump or a wave may make [rad].
_SHARPEST_TURN = np.radians(60.0)


def grow(
    surface: Surface,
    settings: GrowSettings,
    density: Floats | None = None,
    length: Floats | None = None,
) -> StrandSet:
    """A groom, bound to its surface, all strands of one CV count, in the surface's space.

    Args:
        surface: world space; to be combed it must be upright and face -Y.
        density: (vertex_count,), how densely hair grows, not negative; None: everywhere alike.
        length: (vertex_count,), factor on the length, usually 0 to 1; None: 1 everywhere. No hair
            grows where it is 0.

    Raises:
        HairloomError: the surface has no triangles, weights that do not fit it or are not finite,
            or nowhere to grow.
    """
    if settings.method == "normals":
        return grow_along_normals(surface, settings, density, length)
    return _grow_combed(
        surface,
        settings,
        checked_weights(density, surface, "density"),
        checked_weights(length, surface, "length"),
    )


def _grow_combed(
    surface: Surface, settings: GrowSettings, density: Floats | None, length: Floats | None
) -> StrandSet:
    """`grow` on a head, with weights that have been checked."""
    random = np.random.default_rng(settings.seed)
    where = density_with_length(density, length)
    triangle, barycentric = sample_roots(surface, settings.strand_count, where, random)
    corners = surface.corners[triangle].astype(np.float64)
    root = np.einsum("sk,skj->sj", barycentric, corners)
    cranium = find_cranium(surface.positions)
    clump = assign_clumps(root, settings, random, np.where(root[:, 0] < cranium.center[0], -1, 1))
    factor = None if length is None else interpolate_weights(length, surface, triangle, barycentric)
    plan = _plan(surface, cranium, clump, factor, settings, random)

    normal = plan.skin.normal(triangle, barycentric)
    uncombed = settings.whorl * _uncombed_fraction(plan.length, cranium)
    grown = _natural_directions(cranium, root, normal, clump, random)
    comb = _comb_directions(cranium, root, normal, settings)
    comb = unit(comb + uncombed[:, None] * (grown - comb))
    lift = settings.lift * (1.0 + uncombed * random.normal(0.0, _LIFT_VARIES, len(root)))
    stiff = _STIFF * cranium.half_depth
    grid = _grow_segments(root, normal, comb, np.clip(lift, 0.0, 1.0), plan, stiff, settings)
    grid = _with_restored_lengths(
        _stretched_over_hollows(style_clumps(grid, clump, settings, random), plan), plan
    )
    return bound_strands(grid, triangle, barycentric, surface)


@dataclass(frozen=True)
class _Plan:
    """segment: (strand_count, cv_count - 1) [m], length of each segment.
    height: (strand_count, cv_count - 1) [m], how far from the skin each segment's end stays.
    """

    segment: Floats
    height: Floats
    skin: GrowthSurface

    @property
    def length(self) -> Floats:
        """The length of each strand, (strand_count,) [m]."""
        total: Floats = self.segment.sum(axis=1)
        return total

    def step(self, cv: int, start: Floats, direction: Floats) -> Floats:
        """Where the segment that leads to this CV ends, (strand_count, 3)."""
        return self.skin.step(start, direction, self.segment[:, cv - 1], self.height[:, cv - 1])


def _plan(
    surface: Surface,
    cranium: Cranium,
    clump: Ints,
    factor: Floats | None,
    settings: GrowSettings,
    random: np.random.Generator,
) -> _Plan:
    segment = _segments(clump, settings, random)
    if factor is not None:
        segment *= factor[:, None]
    height = _heights(clump, segment.sum(axis=1), settings, random)
    reach = float((segment + height).max(initial=0.0))
    return _Plan(segment, height, GrowthSurface(surface, reach, _CELL * cranium.half_depth))


def _segments(clump: Ints, settings: GrowSettings, random: np.random.Generator) -> Floats:
    """Length of each segment, (strand_count, cv_count - 1) [m]; a clump's strands are alike."""
    count = len(clump)
    shorter = 0.6 * random.random(count)[clump] + 0.4 * random.random(count)
    length = settings.length * (1.0 - settings.length_variation * shorter)
    return length[:, None] * segment_fractions(settings.cv_count, settings.segment_ratio)


def _heights(
    clump: Ints, length: Floats, settings: GrowSettings, random: np.random.Generator
) -> Floats:
    """How far from the skin each segment's end stays, (strand_count, cv_count - 1) [m].

    Args:
        length: (strand_count,) of the strands [m].
    """
    layer = 0.7 * random.random(len(clump))[clump] + 0.3 * random.random(len(clump))
    fraction = np.linspace(0.0, 1.0, settings.cv_count)[1:]
    # hair leaves the skin flat and rises farther out, or it would stand up at a parting
    rise = smooth_step(_RISEN * fraction)
    clearance = np.minimum(settings.clearance, _MAX_CLEARANCE * length)
    pile = layer * np.minimum(settings.volume, _MAX_PILE * length)
    return clearance[:, None] * np.minimum(5.0 * fraction, 1.0) + pile[:, None] * rise


def _uncombed_fraction(length: Floats, cranium: Cranium) -> Floats:
    """How far hair is too short to be combed, (strand_count,) from 0 to 1."""
    short = (_COMBED - length / cranium.half_depth) / (_COMBED - _UNCOMBED)
    return smooth_step(short)


def _natural_directions(
    cranium: Cranium, root: Floats, normal: Floats, clump: Ints, random: np.random.Generator
) -> Floats:
    """Unit directions in which hair grows by itself, along the skin, (strand_count, 3)."""
    away = (root - cranium.center) / cranium.half_depth - _WHORL
    reach = np.linalg.norm(away, axis=1)
    stray = _CLUMPS_STRAY * random.standard_normal(len(root))[clump]
    stray += _STRANDS_STRAY * random.standard_normal(len(root))
    turn = (stray - _SWIRL * np.exp(-((reach / _SWIRL_REACH) ** 2)))[:, None]
    out = unit(_along_skin(away, normal))
    return np.cos(turn) * out + np.sin(turn) * np.cross(normal, out)


def _along_skin(direction: Floats, normal: Floats) -> Floats:
    return direction - normal * np.einsum("ij,ij->i", direction, normal)[:, None]


def _comb_directions(
    cranium: Cranium, root: Floats, normal: Floats, settings: GrowSettings
) -> Floats:
    """Unit directions in which the hair is combed, along the skin, (strand_count, 3)."""
    side = np.clip((root[:, 0] - cranium.center[0]) / (0.5 * cranium.half_depth), -1.0, 1.0)
    # away from the parting from the root on, or hair at the forehead would fall over the face
    parted = _PARTED * smooth_step((cranium.center[1] - root[:, 1]) / cranium.half_depth + _CROWN)
    is_right = settings.each_side & (side < 0.0)
    side = np.where(side < 0.0, -1.0, 1.0) * (parted + (1.0 - parted) * np.abs(side))
    back = np.where(is_right, settings.right_back, settings.comb_back)
    aside = np.where(is_right, settings.right_aside, settings.comb_aside)
    comb = np.empty_like(root)
    comb[:, 0] = (1.0 - np.abs(back)) * aside * side
    comb[:, 1] = back
    comb[:, 2] = -0.35
    return unit(_along_skin(comb, normal))


def _grow_segments(
    root: Floats,
    normal: Floats,
    comb: Floats,
    lift: Floats,
    plan: _Plan,
    stiff: float,
    settings: GrowSettings,
) -> Floats:
    """Grow segment by segment, turning from the comb to the fall, (strand_count, cv_count, 3).

    Args:
        stiff: the length [m] below which hair is stiffer.
    """
    grid = np.repeat(root[:, None], settings.cv_count, axis=1)
    direction = unit(lift[:, None] * normal + (1.0 - lift[:, None]) * comb)
    step = _DROOP_STEP * np.sqrt(np.minimum(plan.length / stiff, 1.0))
    step = np.maximum(step, 1e-30)
    for cv in range(1, settings.cv_count):
        fraction = cv / (settings.cv_count - 1)
        fall = min(fraction / settings.comb_fraction, 1.0) if settings.comb_fraction else 1.0
        aim = unit((1.0 - fall) * comb + fall * _DOWN)
        turn = 1.0 - (1.0 - settings.droop) ** (plan.segment[:, cv - 1] / step)
        direction = unit(direction + turn[:, None] * (aim - direction))
        grid[:, cv] = plan.step(cv, grid[:, cv - 1], direction)
        direction = unit(grid[:, cv] - grid[:, cv - 1])
    return grid


def _stretched_over_hollows(grid: Floats, plan: _Plan) -> Floats:
    """The strands stretched over hollows of the skin, which hair bridges, as around an ear.

    Points only move away from the skin; `_with_restored_lengths` restores the lengths.
    """
    grid = grid.copy()
    normal = plan.skin.nearest_normal(grid[:, 1:].reshape(-1, 3)).reshape(grid[:, 1:].shape)
    # averaged along the hair: the rim of an ear by itself faces along the hair that crosses it
    for _ in range(_NORMALS_BLURRED):
        normal[:, 1:-1] = (normal[:, :-2] + normal[:, 1:-1] + normal[:, 2:]) / 3.0
    away = unit(normal[:, 1:-1])
    for _ in range(_PULLS):
        hollow = 0.5 * (grid[:, 1:-2] + grid[:, 3:]) - grid[:, 2:-1]
        depth = np.maximum(np.einsum("scj,scj->sc", hollow, away), 0.0)
        grid[:, 2:-1] += _PULL * depth[..., None] * away
    return grid


def _with_restored_lengths(styled: Floats, plan: _Plan) -> Floats:
    """The styled strands with their own segment lengths again, unfolded, and outside of the skin.

    A strand that its clump draws to the other side of the head would otherwise turn back on itself.
    """
    grid = styled.copy()
    for cv in range(1, grid.shape[1]):
        direction = unit(styled[:, cv] - styled[:, cv - 1])
        if cv > 1:
            direction = _turn_limited(unit(grid[:, cv - 1] - grid[:, cv - 2]), direction)
        grid[:, cv] = plan.step(cv, grid[:, cv - 1], direction)
    # keeping the length may have drawn a point in again; half of its height is always kept
    free = plan.skin.outside(grid[:, 1:].reshape(-1, 3), 0.5 * plan.height.ravel())
    grid[:, 1:] = free.reshape(grid[:, 1:].shape)
    return grid


def _turn_limited(before: Floats, direction: Floats) -> Floats:
    """Unit directions (n, 3), limited to a turn of _SHARPEST_TURN from the ones before."""
    cosine = np.einsum("ij,ij->i", before, direction)[:, None]
    beside = unit(direction - before * cosine)
    sharpest = before * np.cos(_SHARPEST_TURN) + beside * np.sin(_SHARPEST_TURN)
    return np.where(cosine < np.cos(_SHARPEST_TURN), sharpest, direction)
