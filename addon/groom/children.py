"""Children: strands grown between guides, once, at rest; from then on they are strands like others.

Tariq (2008, Real-time hair rendering on the GPU) has two patterns: multi strand, mixed from three
guides (Nguyen and Donnelly 2005, GPU Gems 2, chapter 23), and single strand, around one guide.

Children are progressive: those of a smaller number are exactly the first of a larger number. For
this, roots come in a fixed order (`blue_noise`), a child's random numbers depend on the key of its
root alone, and nothing is measured over all children.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet, Surface
from ..strands.arc_length import typical_length
from ..strands.catmull_rom import even_parameters
from ..strands.nearest import nearest_points
from ..strands.needed_points import MAX_POINTS
from ..strands.result_cache import NO_CACHE, ResultCache
from .child_clumps import Clumps, clump_as_before, clump_children
from .child_roots import ChildRoots, child_roots
from .child_shape import (
    add_fly_aways,
    add_frizz,
    are_baby_hair,
    curl_points,
    curl_strands,
    mix_guides,
    shorten,
)
from .children_settings import ChildrenSettings
from .counter_random import key_of, normal
from .hairline import nearness_to_border
from .masks import NO_MASKS, Factors, Masks, Places
from .partings import Partings
from .weights import GUIDES_PER_STRAND, GuideWeights, child_weights, nearest_on_same_side

#: Maximum points of all children together, and minimum points of each.
CHILD_POINTS, FEWEST_CHILD_POINTS = 12_000_000, 16
#: The spacing of guides is the median distance to this neighbour.
_NEIGHBOUR = 3
#: Stream of random numbers of the place that a child takes its shape from; `child_shape` has those
#: of its shape.
_PLACE = 0
#: Width of baby hair over that of the hair around it, and the lowest factor that may be painted.
_BABY_WIDTH, _FINEST = 0.5, 0.001
#: Painted parameters that shape children after clumping.
_SHAPING = ("length", "fly_aways", "curl", "frizz")


@dataclass(frozen=True)
class Children:
    """strands: bound, of the guides' CV count, in the space of the surface.
    weights: guide (child_count, 3), indices into the guides.
    notes: what the artist should know, each with a remedy; empty if all is well.
    growth: how they were made.
    """

    strands: StrandSet
    weights: GuideWeights
    notes: tuple[str, ...]
    growth: Growth


@dataclass(frozen=True, eq=False)
class Growth:
    """What children keep when their guides are combed; with the guides it gives their shapes.

    root: (child_count, 3) float32 [m]. key: (child_count,) of their random numbers.
    clumps: as they were found. size: the median length of the guides [m].
    partings: across which no child is mixed; None: none.
    cv_count: of the children, more than their guides' where they curl.
    masks, factors: what was painted, and its value at each child.
    guide_border, border: (guide_count,) and (child_count,), how near each is to where guides end.
    """

    root: Floats
    key: Ints
    weights: GuideWeights
    clumps: Clumps
    settings: ChildrenSettings
    size: float
    partings: Partings | None
    cv_count: int
    masks: Masks
    factors: Factors
    guide_border: Floats
    border: Floats

    def varied(self, grid: Floats, chosen: Ints) -> Floats:
        """Children with their own lengths, strays, curls and frizz, (n, cv_count, 3) float32 [m].

        Args:
            grid: (n, guides' cv_count, 3) float32 [m], clumped, which is changed. chosen: (n,).
        """
        key, settings, factors = self.key[chosen], self.settings, self.factors.take(chosen)
        is_baby = are_baby_hair(key, settings, self.border[chosen])
        shorten(grid, key, settings, factors["length"], is_baby)
        add_fly_aways(grid, key, settings, factors["fly_aways"], is_baby)
        if settings.curl:
            lock = self.key[self.clumps.outermost()[chosen]]
            grid = curl_strands(grid, lock, settings, self.size, self.cv_count, factors["curl"])
        add_frizz(grid, key, settings, self.size, factors["frizz"])
        return grid

    @property
    def fineness(self) -> Floats:
        """The width of each child over that of the hair around it, (child_count,)."""
        painted = np.maximum(self.factors["width"], _FINEST).astype(np.float32)
        return np.where(self.is_baby, np.float32(_BABY_WIDTH), np.float32(1.0)) * painted

    @property
    def is_baby(self) -> Bools:
        """Which children are baby hair, (child_count,)."""
        return are_baby_hair(self.key, self.settings, self.border)

    def touched(self, guides: Bools) -> Bools:
        """Children (child_count,) whose shapes depend on these guides (guide_count,)."""
        weights = self.weights
        is_mixed = (guides[weights.guide] & (weights.weight > 0.0)).any(axis=1)
        return self.clumps.with_members(is_mixed)

    def shapes(self, guide_grid: Floats, chosen: Ints) -> Floats:
        """Some children as these guides shape them, (n, cv_count, 3) float32 [m].

        Args:
            guide_grid: (guide_count, cv_count, 3) float32 [m].
            chosen: (n,) ascending.
        """
        number = self.clumps.with_middles(chosen)
        weights = GuideWeights(self.weights.guide[number], self.weights.weight[number])
        grid = mix_guides(self.root[number], guide_grid, weights)
        clump_as_before(grid, number, self.clumps, self.settings, self.factors["clump"][number])
        return self.varied(grid[np.searchsorted(number, chosen)], chosen)

    def with_more(
        self, roots: ChildRoots, surface: Surface, guides: StrandSet, beside: Ints
    ) -> Growth:
        """The growth with children at more roots, numbered after the others. They mix guides as
        all do, and join the clumps of their neighbours.

        Args:
            guides: the ones that the children grow between.
            beside: indices of the children that may be their neighbours in clumps.
        """
        weights = _weights(roots, guides, self.settings, self.partings, self.masks, NO_CACHE)
        more = self.clumps.joined(
            roots.point,
            guides.group[weights.guide[:, 0]],
            self.root[beside],
            guides.group[self.weights.guide[beside, 0]],
            beside,
            self.partings,
        )
        return replace(
            self,
            root=np.concatenate([self.root, roots.point]),
            key=np.concatenate([self.key, roots.key]),
            weights=GuideWeights(
                np.concatenate([self.weights.guide, weights.guide]),
                np.concatenate([self.weights.weight, weights.weight]),
            ),
            clumps=more,
            factors=self.factors.concatenated(self.masks.at(_places(roots, weights))),
            border=np.concatenate([self.border, _border(self.guide_border, weights)]),
        )


def make_children(
    guides: StrandSet,
    surface: Surface,
    settings: ChildrenSettings,
    density: Floats | None = None,
    partings: Partings | None = None,
    masks: Masks = NO_MASKS,
    *,
    place: str,
    cache: ResultCache = NO_CACHE,
) -> Children:
    """Strands between guides or around them, at rest; none mixes guides of two groups, or across a
    parting.

    Args:
        guides: of one CV count, bound, at rest in the surface's space.
        density: (vertex_count,), how densely children grow, not negative; None: wherever guides
            are near.
        partings: lines that the artist has drawn; None: there are none.
        masks: what the artist has painted; masks of strands are those of the guides.
        place: names the groom in error messages.
        cache: results of the last call.

    Raises:
        HairloomError: there are no guides, the surface has no area on which hair may grow, or the
            density does not fit it, is not finite or nowhere above zero.
    """
    if not guides.strand_count:
        raise HairloomError(
            "it has no guides to grow children from", place=place, remedy="Draw some strands"
        )
    roots = child_roots(guides, surface, settings.strand_count, density, settings.seed)
    weights = _weights(roots, guides, settings, partings, masks, cache)
    group = guides.group[weights.guide[:, 0]]
    grid = mix_guides(roots.point, guides.grid, weights)
    factors = masks.at(_places(roots, weights))
    clumps = clump_children(grid, group, settings, factors["clump"], partings, cache)
    size = typical_length(guides.lengths())
    needed = max(curl_points(float(guides.lengths().max()), settings, size), grid.shape[1])
    cv_count = max(min(needed, _room(settings)), grid.shape[1])
    guide_border = nearness_to_border(guides.roots, guides.roots, cache, "border")
    growth = Growth(
        roots.point,
        roots.key,
        weights,
        clumps,
        settings,
        size,
        partings,
        cv_count,
        masks,
        factors,
        guide_border,
        _border(guide_border, weights),
    )

    def varied(some: Ints) -> tuple[Floats]:
        return (growth.varied(grid[some], some),)

    fixed = replace(settings, strand_count=ChildrenSettings().strand_count), size, cv_count
    lock = roots.key[clumps.outermost()] if settings.curl else roots.key
    (shaped,) = cache.rows(
        "varied", fixed, (grid, roots.key, lock, growth.border, *factors.rows(_SHAPING)), varied
    )
    strands = StrandSet(
        points=shaped.reshape(-1, 3),
        offsets=np.arange(len(shaped) + 1) * cv_count,
        radius=_by_points(_radius(guides, growth), cv_count).ravel(),
        group=group,
        root_uv=_root_uv(roots, surface),
        root_triangle=roots.triangle,
        root_barycentric=roots.barycentric,
        has_widths=guides.has_widths,
        color=_color(guides, weights, cv_count),
    )
    notes = roots.notes + _notes(guides, settings, needed, cv_count)
    return Children(strands, weights, notes, growth)


def _room(settings: ChildrenSettings) -> int:
    """The maximum number of points of each child."""
    room = max(CHILD_POINTS // max(settings.strand_count, 1), FEWEST_CHILD_POINTS)
    return min(room, MAX_POINTS)


def _by_points(values: Floats, count: int) -> Floats:
    """Values of CVs (n, cv_count, ...) at `count` points, spaced evenly from first to last CV."""
    if values.shape[1] == count:
        return values
    left, part = even_parameters(values.shape[1], count)
    part = part.reshape(-1, *(1 for _ in values.shape[2:]))
    found: Floats = values[:, left] * (1.0 - part) + values[:, left + 1] * part
    return found


def _weights(
    roots: ChildRoots,
    guides: StrandSet,
    settings: ChildrenSettings,
    partings: Partings | None,
    masks: Masks,
    cache: ResultCache,
) -> GuideWeights:
    if settings.method != "single":
        place = _scattered(roots, guides.roots, settings, masks)
        return child_weights(
            place,
            guides.roots,
            guides.group,
            guides.grid,
            settings.parting,
            partings,
            roots.point,
            cache,
        )
    nearest, _, _ = nearest_on_same_side(partings, roots.point, guides.roots, 1, roots.point)
    weight = np.zeros((len(nearest), GUIDES_PER_STRAND), np.float32)
    weight[:, 0] = 1.0
    return GuideWeights(np.repeat(nearest, GUIDES_PER_STRAND, axis=1).astype(np.int32), weight)


def _places(roots: ChildRoots, weights: GuideWeights) -> Places:
    return Places(roots.triangle, roots.barycentric, weights.guide, weights.weight)


def _scattered(
    roots: ChildRoots, guide_root: Floats, settings: ChildrenSettings, masks: Masks
) -> Floats:
    """The places that children take their shapes from, (child_count, 3) [m]: random ones nearby."""
    if not settings.scatter or len(guide_root) < 2:
        return roots.point
    _, gap = nearest_points(guide_root, guide_root, min(_NEIGHBOUR + 1, len(guide_root)))
    reach = np.float32(settings.scatter * float(np.median(gap[:, -1])))
    away = reach * normal(key_of(roots.key[:, None], np.arange(3)), _PLACE)
    mask = masks.masks.get("scatter")
    if mask is not None:
        nearest, _ = nearest_points(roots.point, guide_root, 1)
        places = Places(roots.triangle, roots.barycentric, nearest, np.ones(nearest.shape))
        away *= mask.at(places).astype(np.float32)[:, None]
    return roots.point + away


def _border(guide_border: Floats, weights: GuideWeights) -> Floats:
    """How near children are to the border, mixed from their guides, (child_count,) float32."""
    border: Floats = (guide_border[weights.guide] * weights.weight).sum(axis=1, dtype=np.float32)
    return border


def _radius(guides: StrandSet, growth: Growth) -> Floats:
    """Radii, mixed as points are, (child_count, guides' cv_count) [m]; baby hair is finer."""
    settings, weights = growth.settings, growth.weights
    own = guides.radius.reshape(guides.strand_count, -1) * np.float32(settings.width)
    total = np.zeros((len(weights.guide), own.shape[1]), np.float32)
    for guide, weight in zip(weights.guide.T, weights.weight.T, strict=True):
        total += own[guide] * weight[:, None]
    return total * growth.fineness[:, None]


def _color(guides: StrandSet, weights: GuideWeights, cv_count: int) -> Floats | None:
    """Colours, mixed as points are from guides that have one, (child_count x cv_count, 3)."""
    if guides.color is None:
        return None
    own = guides.color.reshape(guides.strand_count, -1, 3)
    is_colored = ~np.isnan(own[:, 0, 0])
    own = np.where(is_colored[:, None, None], own, np.float32(0.0))
    known = weights.weight * is_colored[weights.guide]
    total = np.zeros((len(known), *own.shape[1:]), np.float32)
    for guide, weight in zip(weights.guide.T, known.T, strict=True):
        total += own[guide] * weight[:, None, None]
    whole = known.sum(axis=1)[:, None, None]
    none = np.full_like(total, np.nan)
    mixed_colors = np.divide(total, whole, out=none, where=whole > 0.0)
    return _by_points(mixed_colors, cv_count).reshape(-1, 3)


def _root_uv(roots: ChildRoots, surface: Surface) -> Floats | None:
    if surface.corner_uv is None:
        return None
    return np.einsum("nk,nkj->nj", roots.barycentric, surface.corner_uv[roots.triangle])


def _notes(
    guides: StrandSet, settings: ChildrenSettings, needed: int, cv_count: int
) -> tuple[str, ...]:
    notes: tuple[str, ...] = ()
    if guides.strand_count < GUIDES_PER_STRAND and settings.method != "single":
        notes += (
            "There are fewer than three guides, so children are all alike. Draw more guides.",
        )
    if needed > cv_count:
        notes += (
            f"Curls need {needed:,} points per child and have {cv_count:,}, so they are coarse or "
            "longer than Curl Length. Raise Curl Length, or use fewer children.",
        )
    return notes
