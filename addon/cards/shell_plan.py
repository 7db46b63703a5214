"""The plan of the atlas of shells: patterns, each with a tile for every layer.

A unique texture for all skin would need more than 4,096 texels a side on any head: strands are a
tenth of a millimetre wide, and there is a layer for each slab. So a few patches of skin represent
all: k-medoids over the length, uprightness and colour of the hair there. A pattern's tiles show the
strands that grow on and around such a patch, each layer's tile their pieces within its slab, seen
from straight above. A strand's pieces continue from layer to layer, so that from above the layers
show the strands themselves. At the hairline patches show patterns with fewer strands.

In sparse hair few strands grow on a patch, and their number varies by chance. So a pattern gets as
many strands as grow on the same area of all patches that show it, with the width at which they
cover as much there.

An upright piece is a dot from above and a line from the side. A layer shows it with a length
between the two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints, means_by
from ..strands import StrandSet, Surface
from ..strands.closest_point import search_of
from ..strands.vectors import unit, unit_or
from .atlas import check_width, k_medoids
from .atlas_grid import AtlasGrid
from .atlas_settings import AtlasSettings
from .bake_strands import FlatStrands, strand_ids
from .shell_hair import ShortHair, interpolated_along
from .shell_skin import ShellSkin

#: Number of patterns of full hair; fractions of the usual density of strands below which a patch
#: shows one of the thinner patterns, which are as dense as such patches.
_PATTERNS, _THIN_DENSITIES = 4, (0.8, 0.45)
#: A patch counts as thin if it lacks more strands than this many standard deviations of the
#: expected number.
_CHANCE_DEVIATIONS = 2.0
#: Margin around a patch from which strands are taken, as a fraction of its tile; maximum strands of
#: a tile.
_MARGIN, _MAX_STRANDS = 0.15, 2500
#: Cells along each side of a tile for counting how much of it patches show; and sample points along
#: each side of a triangle.
_SEEN_CELLS, _SEEN_POINTS = 8, 4
#: Maximum number of cells along each side of a tile, of which empty ones are filled from others;
#: and strands that a cell should hold, so that none is empty by chance.
_MAX_CELLS, _STRANDS_PER_CELL = 5, 16.0
#: Texels across a strand's width.
_STRAND_TEXELS = 1.5
#: Factor on the strand width of cards.
_WIDTH_FACTOR = 0.9
#: Hair lies flat where the sine of its angle to the skin is below this.
_MAX_FLAT_SINE = 0.6
#: Difference of perceived colour that counts as much as hair twice as long: of square roots of
#: linear colours.
_COLOR_SCALE = 0.15
_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class Patches:
    """Pieces of skin. Each array has one row per patch.

    center: (n, 3) [m]. axes: (n, 3, 3) unit vectors: across hair, along it within the skin, and
    the normal; right-handed. extent: its reach from the center [m]. area: [m^2].
    features: (n, k) of the hair, which measure similarity. surface: all patches, and of_triangle
        the patch of each of its triangles.
    """

    center: Floats
    axes: Floats
    extent: Floats
    area: Floats
    features: Floats
    surface: Surface
    of_triangle: Ints

    @classmethod
    def of(
        cls, skin: ShellSkin, of_triangle: Ints, hair: ShortHair, vertex: Ints, patch: Ints
    ) -> tuple[Patches, Floats]:
        """The patches, and the places of their vertices in the patches' planes, (len(vertex), 2)
        [m]."""
        count = int(of_triangle.max()) + 1

        def mean(values: Floats) -> Floats:
            return means_by(patch, values[vertex].reshape(len(vertex), -1), count)

        across = np.zeros((count, 3))
        np.add.at(across, of_triangle, skin.area_vectors)
        normal = unit(across)
        lean = mean(hair.shift[:, -1])
        upright = np.einsum("pi,pi->p", lean, normal)
        flat = lean - upright[:, None] * normal
        any_side = np.eye(3)[np.abs(normal).argmin(axis=1)]
        side = unit(np.cross(unit_or(flat, any_side, 1e-9), normal))
        axes = np.stack([side, np.cross(normal, side), normal], axis=1)
        center = mean(skin.positions)
        away = np.einsum("vi,vai->va", skin.positions[vertex] - center[patch], axes[patch, :2])
        high, low = np.full((count, 2), -np.inf), np.full((count, 2), np.inf)
        np.maximum.at(high, patch, away)
        np.minimum.at(low, patch, away)
        middle = (high + low) / 2.0
        center = center + np.einsum("pa,pai->pi", middle, axes[:, :2])
        reach = np.maximum(mean(hair.reach[:, None])[:, 0], _TINY)
        leaning = upright / np.maximum(np.linalg.norm(lean, axis=1), _TINY)
        shape = np.stack([np.log2(reach), 2.0 * leaning], axis=1)
        features = np.concatenate([shape, mean(hair.hue) / _COLOR_SCALE], axis=1)
        area = np.bincount(of_triangle, skin.areas, count)
        extent = (high - low).max(axis=1) / 2.0
        surface = Surface(skin.positions, skin.triangles)
        made = cls(center, axes, extent, area, features, surface, of_triangle)
        return made, away - middle[patch]

    def nearest_patch(self, points: Floats) -> Ints:
        """The patch nearest to each point, (len(points),)."""
        return np.asarray(self.of_triangle[search_of(self.surface).closest(points).triangle])


@dataclass(frozen=True, eq=False)
class ShellPlan:
    """What the bake needs beside the strands' points and radii.

    grid: how the atlas is divided; a pattern's layers are tiles one after another. size: of the
    atlas [pixels]. half_side: half of the side of the square that a tile shows [m].
    features: (pattern_count, k) of whole patterns, see `Patches`; thinned_pattern: the pattern that
        the thinner patterns derive from, or None.
    center: (pattern_count, 3), axes: (pattern_count, 3, 3), reach: (pattern_count,) [m] length of
        the hair there.
    strands, pattern: (n,) strands and the patterns that show them. shift: (n, 2) within the tile
        [m].
    thickness: (pattern_count,) factor of the radii.
    density: median density of roots on patches [1/m^2]. roots: (m, 3) [m], which give the density
        on other patches.
    is_flat: whether hair lies rather than stands.
    notes: for the artist.
    """

    grid: AtlasGrid
    size: int
    layers: int
    half_side: float
    features: Floats
    thinned_pattern: int | None
    center: Floats
    axes: Floats
    reach: Floats
    strands: Ints
    pattern: Ints
    shift: Floats
    thickness: Floats
    density: float
    roots: Floats
    is_flat: bool
    notes: tuple[str, ...] = ()

    def pattern_of(self, patches: Patches) -> Ints:
        """The pattern that each patch shows, (patch_count,) int32."""
        step = np.zeros(len(patches.area), int)
        if self.thinned_pattern is not None:
            step = _thin_steps(patches, patches.nearest_patch(self.roots), self.density)
        return _pattern_of(patches, self.features, step)


def _pattern_of(patches: Patches, features: Floats, step: Ints) -> Ints:
    gap = ((patches.features[:, None] - features) ** 2).sum(axis=2)
    return np.where(step > 0, len(features) - 1 + step, gap.argmin(axis=1)).astype(np.int32)


def _thin_steps(patches: Patches, patch_of_root: Ints, density: float) -> Ints:
    """Number of _THIN_DENSITIES that each patch's density is below, (patch_count,)."""
    count = np.bincount(patch_of_root, minlength=len(patches.area))
    expected = density * patches.area
    is_thin = count < expected - _CHANCE_DEVIATIONS * expected**0.5
    steps = np.digitize(
        -count / np.maximum(expected, _TINY), -np.array(_THIN_DENSITIES), right=True
    )
    return np.where(is_thin, steps, 0)


def plan_shells(
    patches: Patches,
    strands: StrandSet,
    radius: Floats,
    root_normal: Floats,
    layers: int,
    settings: AtlasSettings,
) -> ShellPlan:
    """Choose what the tiles show.

    Args:
        strands: uniform. radius: (strand_count, cv_count) [m]. root_normal: (strand_count, 3).

    Raises:
        HairloomError: the atlas is too small for its tiles, or no strand has a width.
    """
    check_width(radius)
    roots = strands.roots.astype(np.float64)
    random = np.random.default_rng(settings.seed)
    patch_of_root = patches.nearest_patch(roots)
    density = _median_density(patches, patch_of_root)
    step = _thin_steps(patches, patch_of_root, density)
    features, source, thinned_pattern = _chosen_patches(patches, step, random)
    half_side = 1.02 * float(np.quantile(patches.extent, 0.95))
    length = strands.lengths()
    covers = 2.0 * radius.mean(axis=1) * length
    pattern_of_patch = _pattern_of(patches, features, step)
    pattern_hair = _PatternHair.of(patches, pattern_of_patch, patch_of_root, covers, len(source))
    tile_strands = [
        _tile_strands(
            patches, patch, half_side, density, pattern_hair.density[p], roots, root_normal, random
        )
        for p, patch in enumerate(source)
    ]
    used = np.concatenate([each.strand for each in tile_strands])
    pattern = np.repeat(np.arange(len(source)), [len(each.strand) for each in tile_strands])
    visible_cover = [
        _visible_cover(patches, np.flatnonzero(pattern_of_patch == p), half_side, each, covers)
        for p, each in enumerate(tile_strands)
    ]
    thickness = _WIDTH_FACTOR * settings.strand_width * (pattern_hair.cover / visible_cover)
    texel = 2.0 * float(np.median(radius[used].mean(axis=1))) * thickness[0] / _STRAND_TEXELS
    fitted = _fitted_settings(settings, layers * len(source), 2.0 * half_side / texel)
    texels = _STRAND_TEXELS * fitted.inner_tile[0] * texel / (2.0 * half_side)
    return ShellPlan(
        grid=fitted.grid,
        size=fitted.side,
        layers=layers,
        half_side=half_side,
        features=features,
        thinned_pattern=thinned_pattern,
        center=patches.center[source],
        axes=patches.axes[source],
        reach=np.array([np.quantile(length[used][pattern == p], 0.9) for p in range(len(source))]),
        strands=used,
        pattern=pattern,
        shift=np.concatenate([each.shift for each in tile_strands]),
        thickness=thickness,
        density=density,
        roots=roots,
        is_flat=float(np.median(patches.features[:, 1])) < 2.0 * _MAX_FLAT_SINE,
        notes=_notes(texels),
    )


def _chosen_patches(
    patches: Patches, step: Ints, random: np.random.Generator
) -> tuple[Floats, list[int], int | None]:
    """What the patterns show.

    Args:
        step: see `_thin_steps`.

    Returns:
        the features of the patterns of full hair; the patch that each pattern shows, those of the
        thinner ones last; and the pattern that these derive from, or None.
    """
    whole = np.flatnonzero(step == 0)
    whole = whole if len(whole) else np.arange(len(step))
    _, chosen = k_medoids(patches.features[whole], min(_PATTERNS, len(whole)), random)
    features, source = patches.features[whole[chosen]], list(whole[chosen])
    if not (step > 0).any():
        return features, source, None
    gap = ((patches.features[step > 0][:, None] - features) ** 2).sum(axis=2)
    thinned_pattern = int(np.bincount(gap.argmin(axis=1)).argmax())
    return features, source + [source[thinned_pattern]] * len(_THIN_DENSITIES), thinned_pattern


def _median_density(patches: Patches, patch_of_root: Ints) -> float:
    count = np.bincount(patch_of_root, minlength=len(patches.area))
    return float(np.median((count / np.maximum(patches.area, _TINY))[count > 0]))


@dataclass(frozen=True, eq=False)
class _PatternHair:
    """Hair on all patches that show a pattern, (pattern_count,) each.

    density: of roots [1/m^2]. cover: area of strands, laid flat, over that of skin.
    """

    density: Floats
    cover: Floats

    @classmethod
    def of(
        cls,
        patches: Patches,
        pattern_of_patch: Ints,
        patch_of_root: Ints,
        covers: Floats,
        count: int,
    ) -> _PatternHair:
        skin = np.bincount(pattern_of_patch, patches.area, count)
        pattern = pattern_of_patch[patch_of_root]
        roots, area = np.bincount(pattern, minlength=count), np.bincount(pattern, covers, count)
        # a pattern that no patch of this level shows, or without a root, gets the density of the
        # last border
        thin = len(covers) / patches.area.sum() * _THIN_DENSITIES[-1]
        has_any = (skin > 0.0) & (roots > 0)
        skin = np.where(has_any, skin, 1.0)
        return cls(
            np.where(has_any, roots / skin, thin),
            np.where(has_any, area / skin, thin * covers.mean()),
        )


@dataclass(frozen=True, eq=False)
class _TileStrands:
    """The strands of a tile, (n,): their number, root and shift (n, 2) [m] in its plane."""

    strand: Ints
    root: Floats
    shift: Floats


def _tile_strands(
    patches: Patches,
    patch: int,
    half: float,
    full_density: float,
    density: float,
    roots: Floats,
    root_normal: Floats,
    random: np.random.Generator,
) -> _TileStrands:
    """Strands around a patch, as many as the density gives; full_density: density of full hair."""
    axes, away = patches.axes[patch], roots - patches.center[patch]
    place, reach = away @ axes[:2].T, (1.0 + _MARGIN) * half
    is_near = (np.abs(place) <= reach).all(axis=1)
    is_near &= (np.abs(away @ axes[2]) <= half) & (root_normal @ axes[2] > 0.3)
    own = np.flatnonzero(is_near)
    own = own if len(own) else np.linalg.norm(away, axis=1).argmin(keepdims=True)
    every, shift = _with_filled_cells(
        own, place[own], half, full_density * (2.0 * reach) ** 2, random
    )
    wanted = int(np.clip(round(density * (2.0 * reach) ** 2), 1, _MAX_STRANDS))
    kept = np.sort(random.permutation(len(every))[:wanted])
    again = random.choice(every, wanted - len(kept))
    moved = random.uniform(-reach, reach, (len(again), 2)) - place[again]
    strand = np.concatenate([every[kept], again])
    shift = np.concatenate([shift[kept], moved])
    return _TileStrands(strand, place[strand] + shift, shift)


def _visible_cover(
    patches: Patches, chosen: Ints, half: float, shown: _TileStrands, covers: Floats
) -> float:
    """Area of a tile's strands over that of the skin, where these patches show the tile."""
    reach = (1.0 + _MARGIN) * half
    if not len(chosen):
        return float(covers[shown.strand].sum() / (2.0 * reach) ** 2)
    is_seen = np.isin(patches.of_triangle, chosen)
    patch = patches.of_triangle[is_seen]
    corners = patches.surface.positions[patches.surface.triangles[is_seen]].astype(np.float64)
    edge_a, edge_b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    step = (np.arange(_SEEN_POINTS) + 0.5) / _SEEN_POINTS
    a, b = (each.ravel() for each in np.meshgrid(step, step))
    a, b = np.where(a + b > 1.0, 1.0 - a, a), np.where(a + b > 1.0, 1.0 - b, b)
    points = corners[:, :1] + a[:, None] * edge_a[:, None] + b[:, None] * edge_b[:, None]
    place = np.einsum("tpi,tai->tpa", points - patches.center[patch, None], patches.axes[patch, :2])
    place /= np.maximum(half, patches.extent[patch])[:, None, None]
    area = np.repeat(np.linalg.norm(np.cross(edge_a, edge_b), axis=1), len(a))
    seen = _sums_in_cells(place.reshape(-1, 2), area)
    cover = _sums_in_cells(shown.root / half, covers[shown.strand])
    cell = (2.0 * half / _SEEN_CELLS) ** 2
    found = float((seen * cover).sum() / (seen.sum() * cell))
    return found if found > 0.0 else float(covers[shown.strand].sum() / (2.0 * reach) ** 2)


def _sums_in_cells(place: Floats, values: Floats) -> Floats:
    """Sums of values in the cells of a tile; places from -1 to 1 along both sides."""
    cell = np.floor((place + 1.0) * (0.5 * _SEEN_CELLS)).astype(int)
    is_inside = ((cell >= 0) & (cell < _SEEN_CELLS)).all(axis=1)
    number = cell[is_inside] @ [_SEEN_CELLS, 1]
    return np.bincount(number, values[is_inside], _SEEN_CELLS**2)


def _with_filled_cells(
    strands: Ints,
    place: Floats,
    half: float,
    expected: float,
    random: np.random.Generator,
) -> tuple[Ints, Floats]:
    """The strands, with copies in cells of the tile without hair, as at a rim, since patches
    elsewhere show the tile too."""
    reach = (1.0 + _MARGIN) * half
    cells = int(np.clip((expected / _STRANDS_PER_CELL) ** 0.5, 1.0, _MAX_CELLS))
    cell = np.clip(((place / reach + 1.0) * 0.5 * cells).astype(int), 0, cells - 1)
    number = cell[:, 0] * cells + cell[:, 1]
    count = np.bincount(number, minlength=cells**2)
    usual = expected / cells**2
    is_full = count >= min(usual - _CHANCE_DEVIATIONS * usual**0.5, float(count.max()))
    full = np.flatnonzero(is_full)
    all_own = [strands[is_full[number]]]
    all_shift = [np.zeros((len(all_own[0]), 2))]
    for empty in np.flatnonzero(~is_full):
        donor = random.choice(full)
        copied = number == donor
        step = np.array(divmod(int(empty), cells)) - divmod(int(donor), cells)
        all_own.append(strands[copied])
        moved = step * 2.0 * reach / cells
        all_shift.append(np.tile(moved, (int(copied.sum()), 1)))
    return np.concatenate(all_own), np.concatenate(all_shift)


def _fitted_settings(settings: AtlasSettings, tile_count: int, texels: float) -> AtlasSettings:
    """The settings with square tiles, as many as are needed."""
    columns = 1 << round(np.log2(tile_count) / 2.0)
    square = replace(settings, columns=columns, rows=-(-tile_count // columns))
    return square.fitted(tile_count, texels, texels)


def _notes(texels: float) -> tuple[str, ...]:
    if texels >= 1.0:
        return ()
    return (
        f"strands are {texels:.2g} pixels of the atlas wide and show as fainter lines; a larger "
        "atlas, fewer Shell Layers or a higher Max Triangles would show them correctly",
    )


def shell_strands(
    plan: ShellPlan,
    grid: Floats,
    radius: Floats,
    visible_upright: float,
    base: Floats | None = None,
) -> FlatStrands:
    """The pieces of the strands of the plan in its tiles, tile after tile.

    Args:
        visible_upright: squared fraction of an upright piece's length that shows.
        grid, radius, base: as of `bake_strands.flat_strands`.
    """
    layers, pattern = plan.layers, plan.pattern
    points = grid[plan.strands].astype(np.float64)
    length = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    slab = (plan.reach[pattern] / np.maximum(length, _TINY))[:, None] * (
        np.linspace(0.0, 1.0, layers + 1)
    )
    start, end = slab[:, :-1], np.minimum(slab[:, 1:], 1.0)
    mean = _mean_shifts(plan, points, slab)
    strand, layer = np.nonzero(start < 1.0)
    order = np.argsort(pattern[strand] * layers + layer, kind="stable")
    strand, layer = strand[order], layer[order]
    own = pattern[strand]
    along = np.stack([start[strand, layer], end[strand, layer]], axis=1)
    ends = interpolated_along(points[strand], along)
    axes = plan.axes[own]
    away = ends - (plan.center[own] + mean[own, layer])[:, None]
    away = np.einsum("nei,nai->nea", away, axes)
    away[..., :2] += plan.shift[strand][:, None]
    step = away[:, 1] - away[:, 0]
    flat, whole = np.linalg.norm(step[:, :2], axis=1), np.linalg.norm(step, axis=1)
    shown = np.sqrt(flat**2 + visible_upright * np.maximum(whole**2 - flat**2, 0.0))
    heading = unit_or(np.pad(step[:, :2], ((0, 0), (0, 1))), (0.0, 1.0, 0.0), 1e-9)[:, :2]
    middle = away[..., :2].mean(axis=1)
    thick = interpolated_along(radius[plan.strands][..., None].astype(np.float64)[strand], along)[
        ..., 0
    ]
    thick = thick * plan.thickness[own, None]
    side = 2.0 * plan.half_side
    place = middle[:, None] + np.array([[-0.5], [0.5]]) * (shown[:, None] * heading)[:, None]
    place = 0.5 + place / side
    aside = np.stack([heading[:, 1], -heading[:, 0]], axis=1)[:, None] * thick[..., None] / side
    room = np.array([free / (1.0 - 2.0 * free) for free in plan.grid.padding])
    inside = (np.abs(0.5 - place.mean(axis=1)) < 0.5 + room).all(axis=1)
    place = np.clip(place, np.abs(aside) - room, 1.0 + room - np.abs(aside))
    tile = (own * layers + layer)[:, None]
    on_atlas = plan.grid.uv(tile, place[..., 0], place[..., 1])
    edge = plan.grid.uv(tile, place[..., 0] + aside[..., 0], place[..., 1] + aside[..., 1])
    area = np.bincount(tile[:, 0], 2.0 * thick.mean(axis=1) * shown, len(plan.reach) * layers)
    shade = np.ones((len(points), 2, 3)) if base is None else base[plan.strands]
    gain = max(float(shade.max(initial=0.0)), 1.0)
    parts = {
        "place": on_atlas,
        "half_width": edge - on_atlas,
        "along": along,
        "depth": np.clip(0.5 + away[..., 2] / side, 0.0, 1.0),
        "tangent": np.repeat(_directions(step, mean, own, layer, axes)[:, None], 2, axis=1),
        "base": interpolated_along(shade[strand], along) / gain,
        "occlusion": np.repeat(_light_below_layers(area, side**2, layers)[tile], 2, axis=1),
        "strand_id": strand_ids(len(points))[strand],
    }
    single = {name: part[inside].astype(np.float32) for name, part in parts.items()}
    return FlatStrands(**single, base_gain=gain)


def _mean_shifts(plan: ShellPlan, points: Floats, slab: Floats) -> Floats:
    """Mean vectors from roots to the middle of each slab, (pattern_count, layers, 3) [m]."""
    middle = (slab[:, :-1] + slab[:, 1:]) / 2.0
    shift = interpolated_along(points, np.minimum(middle, 2.0)) - points[:, :1]
    means = [shift[plan.pattern == pattern].mean(axis=0) for pattern in range(len(plan.reach))]
    return np.stack(means)


def _directions(step: Floats, mean: Floats, own: Ints, layer: Ints, axes: Floats) -> Floats:
    """Directions of the pieces in frames where the mean direction is up the picture, (n, 3) unit
    vectors."""
    course = np.gradient(np.pad(mean, ((0, 0), (1, 0), (0, 0))), axis=1)[:, 1:]
    along = unit(np.einsum("ni,nai->na", course[own, layer], axes))
    right = unit_or(np.cross(along, (0.0, 0.0, 1.0)), (1.0, 0.0, 0.0))
    frame = np.stack([right, along, np.cross(right, along)], axis=1)
    return unit_or(np.einsum("ni,nai->na", step, frame), (0.0, 1.0, 0.0), 1e-12)


def _light_below_layers(area: Floats, side: float, layers: int) -> Floats:
    """Light from the front that the layers above each tile let through: exp(-tau)."""
    tau = (area / side).reshape(-1, layers)
    above = tau[:, ::-1].cumsum(axis=1)[:, ::-1] - tau
    open_: Floats = np.exp(-above).ravel()
    return open_
