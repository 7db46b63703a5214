"""Which strands each tile of the atlas shows, and which tile each card.

Cards that look alike share a tile: k-medoids (Park and Jun 2009, here with the member nearest to
the mean as the medoid) over features of cards in their own frames. The strands of the medoid are
baked. Hair of two groups shares no tile, nor do single strands, cards along hairlines and partings,
and all others, as long as there are enough tiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints, means_by, piece_starts, sums_by
from ..errors import HairloomError
from ..strands.face import is_face_hair
from .atlas_grid import AtlasGrid
from .atlas_settings import SIZES, AtlasSettings
from .clusters import proportional_parts
from .strip import CardFrames, Strips

#: Minimum number of tiles that cards of brows, and of lashes, share: with one or two, the
#: repetition is visible.
_FACE_TILES = 6
#: Maximum number of strands in a tile, as a factor of its width in pixels.
_MAX_STRANDS_PER_PIXEL = 2
#: Range of the factor by which a card is widened to cover as much as its own strands.
_WIDTH_RANGE = (0.5, 2.0)
#: The same at hairlines and partings, where wider strands would be seen one by one.
_RIM_WIDTH_RANGE = (0.8, 1.25)
#: Sine of the angle between strands and card that counts as much as a factor of two in width.
_WAVE_SCALE = 0.2
#: Difference of perceived colour that counts as much: of square roots of linear colours.
_COLOR_SCALE = 0.15
#: Value beyond all colours, for strands without one of their own.
_NO_COLOR = 4.0
#: Tiles of an automatic atlas: texels across the median strand; length of a texel over its width,
#: since hair runs along it; minimum texels across and along.
_STRAND_TEXELS, _TEXEL_LENGTH, _MIN_TEXELS = 1.5, 2.0, (8.0, 48.0)
_ROUNDS = 12
_TINY = 1e-12


@dataclass(frozen=True)
class AtlasPlan:
    """What the bake needs beside the strands' points and radii.

    grid: how the atlas is divided. size: its width and height [pixels].
    tile: (card_count,) of each card; crossed cards share that of their pair.
    width_factor: (card_count,) factor on a card's width, with which it covers as much by its tile's
        strands as by its own; 1 where the tile shows its own.
    strips: the strip of each tile that is used, tiles 0, 1, 2 ...; at CV resolution.
    strands: which strands are baked, tile after tile; offsets: (used tiles + 1,) where each begins.
    thickness: (used tiles,) factor of the radii, larger where a tile cannot hold all its strands.
    notes: for the artist.
    root_slope: (used tiles,) slope of the root edge of each strip, see `strip.root_slants`; None:
        all are square.
    """

    grid: AtlasGrid
    size: int
    tile: Ints
    width_factor: Floats
    strips: Strips
    strands: Ints
    offsets: Ints
    thickness: Floats
    notes: tuple[str, ...] = ()
    root_slope: Floats | None = None

    @property
    def tile_of_strand(self) -> Ints:
        """The tile of each baked strand, (baked strands,)."""
        return np.repeat(np.arange(len(self.strips)), np.diff(self.offsets))


def plan_atlas(
    strips: Strips,
    grid: Floats,
    radius: Floats,
    cluster: Ints,
    group: Ints,
    settings: AtlasSettings,
    color: Floats | None = None,
    root_slope: Floats | None = None,
    is_rim: Bools | None = None,
) -> AtlasPlan:
    """Choose what the tiles show.

    Args:
        strips: one per cluster, with as many rows as there are CVs; from fit_strips, without the
            second strips of crossed pairs.
        grid: (strand_count, cv_count, 3) [m], root first.
        radius: (strand_count, cv_count) [m], as strands are drawn.
        cluster: (strand_count,) the card of each strand, from 0 without gaps.
        group: (strand_count,).
        color: (strand_count, cv_count, 3) that strands are drawn in; None: the look's.
        root_slope: (card_count,) slopes of the cards' root edges; None: all are square.
        is_rim: (card_count,) which cards lie along hairlines and partings, with bare skin before
            them; None: none.

    Raises:
        HairloomError: the atlas is too small for its tiles, or no strand has a width.
    """
    check_width(radius)
    settings = settings.fitted(len(strips), *_wanted_texels(strips, radius, cluster, settings))
    atlas = settings.grid
    shapes = _card_shapes(strips, grid, radius, cluster)
    is_rim = np.zeros(len(strips), bool) if is_rim is None else is_rim
    kind = _tile_kinds(cluster, group, shapes.strand_count, is_rim, atlas.tile_count)
    is_face = _is_face_card(cluster, group)
    random = np.random.default_rng(settings.seed)
    features = shapes.features
    if color is not None:
        features = np.concatenate([features, _card_colors(color, cluster, len(strips))], axis=1)
    tile, medoid = _assign_tiles(features, kind, is_face, atlas.tile_count, random)
    chosen = _of_cards(strips, medoid)
    strands, offsets, crowding = _choose_strands(cluster, medoid, settings, random)
    notes = (
        *_overflow_note(crowding),
        *_size_notes(chosen, grid[strands], radius[strands], offsets, settings),
    )
    return AtlasPlan(
        grid=atlas,
        size=settings.side,
        tile=tile,
        width_factor=_width_factors(shapes, strips.width, tile, medoid, is_rim),
        strips=chosen,
        strands=strands,
        offsets=offsets,
        # brows and lashes face the viewer, and before bare skin each strand is seen
        thickness=crowding * np.where((is_face | is_rim)[medoid], 1.0, settings.strand_width),
        notes=notes,
        root_slope=None if root_slope is None else root_slope[medoid],
    )


def check_width(radius: Floats) -> None:
    """Check that strands have a width. radius: of any shape [m].

    Raises:
        HairloomError: no strand has a width.
    """
    if not (radius > 0.0).any():
        raise HairloomError(
            "no strand has a width, so the atlas would be empty",
            place="strands",
            remedy="Give the strands a radius, or raise Fullness",
        )


def _wanted_texels(
    strips: Strips, radius: Floats, cluster: Ints, settings: AtlasSettings
) -> tuple[float, float]:
    """Size of a tile, across and along, at which the median strand is wide enough [texels]."""
    width = np.maximum(strips.width.mean(axis=1), _TINY)
    strand = settings.strand_width * 2.0 * radius.mean(axis=1) / width[cluster]
    across = max(_STRAND_TEXELS / max(float(np.median(strand)), _TINY), _MIN_TEXELS[0])
    lengths = np.linalg.norm(np.diff(strips.frames.center, axis=1), axis=-1).sum(axis=1)
    along = across * float(np.median(lengths / width)) / _TEXEL_LENGTH
    return across, max(along, _MIN_TEXELS[1])


@dataclass(frozen=True)
class _CardShapes:
    """Shapes of cards.

    strand_count: (n,).
    covered: (n, row_count) fraction of each row that its strands cover.
    spacing: (n, row_count) distance from row to row [m].
    features: (n, 6), each weighted by how visible it is.
    """

    strand_count: Ints
    covered: Floats
    spacing: Floats
    features: Floats


def _card_shapes(strips: Strips, grid: Floats, radius: Floats, cluster: Ints) -> _CardShapes:
    card_count = len(strips)
    count = np.bincount(cluster, minlength=card_count)
    width = np.maximum(strips.width, _TINY)
    fill = sums_by(cluster, 2.0 * radius, card_count) / width
    # n strands at random places across, each of which covers fill / n of the width
    covered = 1.0 - (1.0 - np.clip(fill / count[:, None], 0.0, 1.0)) ** count[:, None]
    spacing = np.gradient(strips.frames.center, axis=1)
    spacing = np.linalg.norm(spacing, axis=-1)
    # roots are seen, on strands that are as much wider as the card
    widths = width.mean(axis=1), width[:, 0]
    scales = (*widths, spacing.sum(axis=1), fill.mean(axis=1), count)
    octaves = [np.log2(np.maximum(scale / np.median(scale), _TINY)) for scale in scales]
    wave = np.bincount(cluster, _sines_to_card(strips.frames, grid, cluster), card_count) / count
    features = np.stack([*octaves, wave / _WAVE_SCALE], axis=1)
    return _CardShapes(count, covered, spacing, features)


def _card_colors(color: Floats, cluster: Ints, card_count: int) -> Floats:
    """Colour features of cards, (card_count, 9): the means at root, middle and tip."""
    stations = color[:, [0, color.shape[1] // 2, -1]].reshape(len(color), -1)
    perceived = np.sqrt(np.nan_to_num(stations, nan=_NO_COLOR))
    return means_by(cluster, perceived, card_count) / _COLOR_SCALE


def _sines_to_card(frames: CardFrames, grid: Floats, cluster: Ints) -> Floats:
    """Mean sine of the angle between each strand and its strip, (strand_count,)."""
    step = np.diff(grid, axis=1)
    ahead = np.einsum("sri,sri->sr", step, frames.tangent[cluster, :-1])
    length = np.linalg.norm(step, axis=-1)
    aside = np.sqrt(np.maximum(length**2 - ahead**2, 0.0))
    mean: Floats = aside.sum(axis=1) / np.maximum(length.sum(axis=1), _TINY)
    return mean


def _tile_kinds(
    cluster: Ints, group: Ints, strand_count: Ints, is_rim: Bools, tile_count: int
) -> Ints:
    """Cards of different kinds share no tile, (card_count,): groups, and in each of them single
    strands, cards at the rim, and the rest."""
    _, first = np.unique(cluster, return_index=True)
    _, groups = np.unique(group[first], return_inverse=True)
    within = np.where(strand_count == 1, 2, is_rim)
    pairs, kind = np.unique(3 * groups + within, return_inverse=True)
    return kind if len(pairs) <= tile_count else np.zeros_like(kind)


def _is_face_card(cluster: Ints, group: Ints) -> Bools:
    """Which cards are of brows or lashes, (card_count,)."""
    return is_face_hair(group[np.unique(cluster, return_index=True)[1]])


def _assign_tiles(
    features: Floats,
    kind: Ints,
    is_face: Bools,
    tile_count: int,
    random: np.random.Generator,
) -> tuple[Ints, Ints]:
    """The tile of each card, (card_count,), and the card that each tile shows, (used tiles,)."""
    sizes = np.bincount(kind)
    tile_counts = proportional_parts(min(tile_count, len(kind)), sizes)
    faces = np.bincount(kind, is_face) > 0.0
    tile_counts = np.maximum(tile_counts, np.where(faces, np.minimum(_FACE_TILES, sizes), 1))
    while tile_counts.sum() > tile_count:  # each kind keeps at least one
        tile_counts[tile_counts.argmax()] -= 1
    tile = np.zeros(len(kind), np.int32)
    shown = np.zeros(0, np.int64)
    for number, wanted in enumerate(tile_counts):
        cards = np.flatnonzero(kind == number)
        label, medoid = k_medoids(features[cards], int(wanted), random)
        tile[cards] = len(shown) + label
        shown = np.concatenate([shown, cards[medoid]])
    return tile, shown


def k_medoids(features: Floats, count: int, random: np.random.Generator) -> tuple[Ints, Ints]:
    """The group of each, (n,), and the member that represents each group, (count,)."""
    if count >= len(features):
        return np.arange(len(features)), np.arange(len(features))
    medoid = _initial_medoids(features, count, random)
    for _ in range(_ROUNDS):
        label = _squared_distances(features, features[medoid]).argmin(axis=1)
        label[medoid] = np.arange(count)
        size = np.bincount(label, minlength=count)
        mean = sums_by(label, features, count) / size[:, None]
        gap = ((features - mean[label]) ** 2).sum(axis=1)
        order = np.lexsort((gap, label))
        medoid = order[piece_starts(size)]
    label = _squared_distances(features, features[medoid]).argmin(axis=1)
    label[medoid] = np.arange(count)
    return label, medoid


def _initial_medoids(features: Floats, count: int, random: np.random.Generator) -> Ints:
    """k-means++: `count` different ones at random, far from each other."""
    chosen = [int(random.integers(len(features)))]
    gap = np.full(len(features), np.inf)
    for _ in range(1, count):
        gap = np.minimum(gap, ((features - features[chosen[-1]]) ** 2).sum(axis=1))
        chance = gap + 1e-9
        chance[chosen] = 0.0
        chosen.append(int(random.choice(len(features), p=chance / chance.sum())))
    return np.array(chosen)


def _squared_distances(features: Floats, medoids: Floats) -> Floats:
    """Squared distances, (n, count)."""
    gaps = np.zeros((len(features), len(medoids)))
    for one, other in zip(features.T, medoids.T, strict=True):
        gaps += (one[:, None] - other) ** 2
    return gaps


def _choose_strands(
    cluster: Ints, medoid: Ints, settings: AtlasSettings, random: np.random.Generator
) -> tuple[Ints, Ints, Floats]:
    """Strands, tile after tile; where each tile begins; and how many strands each baked one
    represents."""
    order = np.argsort(cluster, kind="stable")
    ends = np.cumsum(np.bincount(cluster))
    max_strands = max(int(_MAX_STRANDS_PER_PIXEL * settings.side / settings.columns), 1)
    tiles, crowding = [], []
    for card in medoid:
        strands = order[ends[card - 1] if card else 0 : ends[card]]
        chosen = (
            strands
            if len(strands) <= max_strands
            else np.sort(random.choice(strands, max_strands, replace=False))
        )
        crowding.append(len(strands) / len(chosen))
        tiles.append(chosen)
    offsets = np.cumsum([0, *map(len, tiles)])
    return np.concatenate(tiles), offsets, np.array(crowding)


def _width_factors(
    shapes: _CardShapes, width: Floats, tile: Ints, medoid: Ints, is_rim: Bools
) -> Floats:
    """How much wider each card must be to cover as much as with its own strands, (card_count,)."""
    area = width * shapes.spacing
    own_area = (shapes.covered * area).sum(axis=1)
    shown_area = (shapes.covered[medoid[tile]] * area).sum(axis=1)
    factor = np.where(shown_area > 0.0, own_area / np.maximum(shown_area, _TINY**2), 1.0)
    low, high = np.where(is_rim[:, None], _RIM_WIDTH_RANGE, _WIDTH_RANGE).T
    return np.clip(factor, low, high)


def _overflow_note(crowding: Floats) -> tuple[str, ...]:
    full = int((crowding > 1.0).sum())
    if not full:
        return ()
    return (
        f"the strands of {full} of {len(crowding)} tiles do not all fit; these show only some, up "
        f"to {crowding.max():.1f} times as wide",
    )


def _size_notes(
    strips: Strips, grid: Floats, radius: Floats, offsets: Ints, settings: AtlasSettings
) -> tuple[str, ...]:
    """Notes on strands thinner or shorter than a pixel of the atlas."""
    tile = np.repeat(np.arange(len(strips)), np.diff(offsets))
    across, along = settings.inner_tile
    spacing = np.linalg.norm(np.diff(strips.frames.center, axis=1), axis=-1).sum(axis=1)
    wide, high = strips.width.mean(axis=1)[tile] / across, spacing[tile] / along
    length = np.linalg.norm(np.diff(grid, axis=1), axis=-1).sum(axis=1)
    notes = []
    fraction = float(np.median(2.0 * radius.mean(axis=1) / np.maximum(wide, _TINY)))
    if fraction < 1.0:
        larger = settings.side / max(fraction, _TINY)
        fitting = next((f"an atlas of {size}" for size in SIZES if size >= larger), "fewer columns")
        notes.append(
            f"strands are {fraction:.2g} pixels of the atlas wide and show as fainter lines; "
            f"{fitting} would show them correctly"
        )
    short = int((length < high).sum())
    if short:
        notes.append(f"{short} strands are shorter than a pixel of the atlas and hardly show")
    return tuple(notes)


def _of_cards(strips: Strips, cards: Ints) -> Strips:
    frames = strips.frames
    names = ("center", "tangent", "normal", "side")
    return Strips(CardFrames(*(getattr(frames, n)[cards] for n in names)), strips.width[cards])
