"""Strips of textured triangles, and those that run along guides; see fit.py for clusters.

side ->            u runs along `side`, v along the guide, so that side x tangent = normal and
3---4---5  tip     the strip is seen counter-clockwise from outside. Each quad is cut into two
| / | / |          triangles here, root first, not later in files or engines, because that
0---1---2  root    would lose the order in which the cards must be drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet
from ..strands.frames import tangents, transported_normals, volume_normals
from ..strands.resample import resample
from .atlas_grid import AtlasGrid
from .card_mesh import CardMesh, join_meshes
from .settings import CardSettings
from .sort import sorted_by_key

#: Roots whose distance to their neighbours is measured.
_SPACING_SAMPLES = 512
#: Largest slope of a root edge, along over across the card; and the part of a card, from its root,
#: within which a slanted edge becomes square.
MAX_ROOT_SLOPE, _SLANTED_PART = 2.0, 0.25
#: Spacing of a single guide, which has no neighbour, as a fraction of its length.
_SINGLE_GUIDE_SPACING = 0.04


@dataclass(frozen=True)
class CardFrames:
    """Position and orientation of each row of each card.

    center, tangent, normal, side: (card_count, row_count, 3) float32, right-handed in the order
    side, tangent, normal; center in [m], the others unit vectors.
    """

    center: Floats
    tangent: Floats
    normal: Floats
    side: Floats


@dataclass(frozen=True)
class Strips:
    """Strips with the same number of rows.

    width: (card_count, row_count) [m].
    along: (card_count, row_count) place of each row, 0 at the root and 1 at the tip; None: evenly
        spaced.
    """

    frames: CardFrames
    width: Floats
    along: Floats | None = None

    def __len__(self) -> int:
        return len(self.width)

    def select(self, cards: Ints) -> Strips:
        """The strips of cards with these indices, (n,)."""
        frames = self.frames
        parts = (frames.center, frames.tangent, frames.normal, frames.side)
        along = None if self.along is None else self.along[cards]
        return Strips(CardFrames(*(part[cards] for part in parts)), self.width[cards], along)

    @property
    def places(self) -> Floats:
        """Place of each row, (card_count, row_count) float32, or (1, row_count) where all strips
        are evenly cut."""
        if self.along is not None:
            return self.along
        return np.linspace(0.0, 1.0, self.width.shape[1], dtype=np.float32)[None]


@dataclass(frozen=True)
class UncutCards:
    """All cards of a groom before they are cut into triangles; a card's number is its place here.

    strand_count, group, layer, tile: (card_count,) int32 of each card: the number of strands that
        it represents, its group of hair, its layer, 0 next to the head, and its tile of the atlas.
    atlas: how the texture is divided into tiles.
    center: (3,) [m], from which normals point away, as those of strands do; None: each card has the
        normals of its own surface.
    root_slope: (card_count,) slope of the root edge, along over across the card, see `root_slants`;
        None: all are square.
    is_absent: (card_count,) cards that are not made; None: all are made.
    """

    strips: Strips
    strand_count: Ints
    group: Ints
    layer: Ints
    tile: Ints
    atlas: AtlasGrid
    center: Floats | None = None
    root_slope: Floats | None = None
    is_absent: Bools | None = None

    def __len__(self) -> int:
        return len(self.strips)


def guide_strips(guides: Floats, root_normal: Floats, settings: CardSettings) -> Strips:
    """One strip along each guide, in the order of the guides.

    Args:
        guides: (guide_count, cv_count, 3) [m], finite, root first.
        root_normal: (guide_count, 3) unit normals of the head under the roots.

    Raises:
        HairloomError: a guide is not finite or has fewer than two CVs.
    """
    frames = card_frames(guides, root_normal, settings.segment_count)
    along = np.linspace(0.0, 1.0, settings.segment_count + 1, dtype=np.float32)
    spacing = mean_spacing(guides[:, 0]) or _SINGLE_GUIDE_SPACING * _length(guides)
    width = settings.width_factor * spacing * taper(along, settings.tip_width)
    return Strips(frames, np.broadcast_to(width, (len(guides), len(along))))


def strip_mesh(
    parts: Sequence[tuple[Ints, Strips]],
    cards: UncutCards,
    column_count: int,
    settings: CardSettings,
) -> CardMesh:
    """Strips as triangles, card after card; occlusion is 1 until it is computed.

    Args:
        parts: strips with the numbers of their cards, each number at most once.
        cards: all cards; their own strips are not used.
        column_count: number of columns across a card.
    """
    meshes = [
        _mesh_of_part(strips, numbers, cards, column_count, settings) for numbers, strips in parts
    ]
    return sorted_by_key(join_meshes(meshes), np.arange(len(cards)))


def random_tiles(card_count: int, atlas: AtlasGrid, seed: int) -> Ints:
    """A tile for each card, at random, (card_count,)."""
    return np.random.default_rng(seed).integers(atlas.tile_count, size=card_count)


def _mesh_of_part(
    strips: Strips,
    numbers: Ints,
    cards: UncutCards,
    column_count: int,
    settings: CardSettings,
) -> CardMesh:
    frames = strips.frames
    card_count, row_count = strips.width.shape
    across = np.linspace(0.0, 1.0, column_count + 1, dtype=np.float32)
    along = strips.places[..., None]
    triangles = strip_triangles(row_count, column_count)
    vertices_per_card = row_count * len(across)
    first = np.arange(card_count, dtype=np.int32) * vertices_per_card
    positions = _positions(frames, strips.width, across, settings)
    if cards.root_slope is not None:
        positions += _slanted(strips, cards.root_slope[numbers], across)
    normals = _normals(frames, across, settings)
    if cards.center is not None:
        volume = _normals_of_volume(positions, frames.tangent, cards.center, across, settings)
        # engines flip normals for back faces, so normals must be on the card's front
        is_front = np.einsum("crai,crai->cra", volume, normals) > 0.0
        normals = np.where(is_front[..., None], volume, normals)
    return CardMesh(
        positions=positions.reshape(-1, 3),
        triangles=(first[:, None, None] + triangles).reshape(-1, 3),
        uv=cards.atlas.uv(cards.tile[numbers, None, None], across, along).reshape(-1, 2),
        along=np.broadcast_to(along, (card_count, row_count, len(across))).reshape(-1),
        normal=normals.reshape(-1, 3),
        tangent=np.repeat(frames.tangent.reshape(-1, 3), len(across), axis=0),
        occlusion=np.ones(card_count * vertices_per_card, np.float32),
        card=np.repeat(numbers.astype(np.int32), len(triangles)),
        group=cards.group,
        layer=cards.layer,
        tile=cards.tile,
        atlas=cards.atlas,
    )


def card_frames(guides: Floats, root_normal: Floats, segment_count: int) -> CardFrames:
    """Rows at equal arc length along each guide, without twist, facing away from the head."""
    center = _resampled(guides, segment_count + 1)
    tangent = tangents(center)
    normal = transported_normals(tangent, root_normal)
    side = np.cross(tangent, normal)
    turn = _facing_turn(normal, side, root_normal)[:, None, None]
    facing = normal * np.cos(turn) + side * np.sin(turn)
    return CardFrames(center, tangent, facing, np.cross(tangent, facing))


def _facing_turn(normal: Floats, side: Floats, root_normal: Floats) -> Floats:
    """The turn of each whole card about its guide with which it best faces the root's normal.

    The root alone would give an arbitrary turn, since hair often starts along the normal r. This
    angle [rad] maximises the sum over the rows of cos(turn) normal.r + sin(turn) side.r.
    """
    ahead = np.einsum("gri,gi->g", normal, root_normal)
    aside = np.einsum("gri,gi->g", side, root_normal)
    return np.arctan2(aside, ahead).astype(np.float32)


def mean_spacing(roots: Floats) -> float:
    """Mean distance from a root to its nearest neighbour [m], without coinciding roots; 0 if there
    is none.

    Estimated from at most `_SPACING_SAMPLES` roots, each measured against all.
    """
    points = np.asarray(roots, np.float64)
    chosen = np.linspace(0, len(points) - 1, min(len(points), _SPACING_SAMPLES)).astype(np.int64)
    squared = sum((points[chosen, None, axis] - points[:, axis]) ** 2 for axis in range(3))
    squared = np.where(squared > 0.0, squared, np.inf)
    nearest = squared.min(axis=1, initial=np.inf)
    found = np.isfinite(nearest)
    return float(np.sqrt(nearest[found]).mean()) if found.any() else 0.0


def _length(guides: Floats) -> float:
    """Median length of guides (guide_count, cv_count, 3) [m]; 0 without any."""
    if not len(guides):
        return 0.0
    return float(np.median(np.linalg.norm(np.diff(guides, axis=1), axis=2).sum(axis=1)))


def taper(along: Floats, tip_width: float) -> Floats:
    """Width as a fraction of the root's, (...), at places along the card (...), 0 at the root and 1
    at the tip: full at the root, `tip_width` at the tip, smooth between."""
    return 1.0 + (tip_width - 1.0) * along * along * (3.0 - 2.0 * along)


def strip_triangles(row_count: int, column_count: int) -> Ints:
    """Triangles of one card, row by row from the root, ((row_count - 1) * column_count * 2, 3)."""
    row, column = np.mgrid[0 : row_count - 1, 0:column_count].astype(np.int32)
    low = row * (column_count + 1) + column
    high = low + column_count + 1
    lower_half = np.stack([low, low + 1, high + 1], axis=-1)
    upper_half = np.stack([low, high + 1, high], axis=-1)
    return np.stack([lower_half, upper_half], axis=2).reshape(-1, 3)


def _positions(frames: CardFrames, width: Floats, across: Floats, settings: CardSettings) -> Floats:
    """Positions of vertices: the guide runs through the middle, and the edges fall back by a
    parabola of height `bend`. A card of one column is flat, at the parabola's mean height."""
    aside = (across - 0.5) * width[..., None]
    parabola = (2.0 * across - 1.0) ** 2 if len(across) > 2 else np.full_like(across, 1.0 / 3.0)
    behind = -settings.bend * width[..., None] * parabola
    return (
        frames.center[:, :, None]
        + frames.side[:, :, None] * aside[..., None]
        + frames.normal[:, :, None] * behind[..., None]
    )


def root_slants(along: Floats) -> Floats:
    """How much of the slope of its root edge a card has at places along it, (...) float32.

    Where hair leaves a hairline or a parting at an angle, the roots of a card lie on a slanted
    line. Its first rows follow them: 1 at the root, 0 from a quarter of the card on.
    """
    return np.maximum(np.float32(1.0) - along / np.float32(_SLANTED_PART), np.float32(0.0))


def _slanted(strips: Strips, slope: Floats, across: Floats) -> Floats:
    """How far vertices move along cards whose root edges have this slope, (cards, rows, columns,
    3) [m]."""
    aside = (across - 0.5) * strips.width[..., None]
    ahead = aside * (slope[:, None] * root_slants(strips.places))[..., None]
    moved: Floats = strips.frames.tangent[:, :, None] * ahead[..., None]
    return moved


def _normals(frames: CardFrames, across: Floats, settings: CardSettings) -> Floats:
    """Normals perpendicular to the bent card, leaning further outwards by `roundness`."""
    edge = 2.0 * across - 1.0
    lean = (4.0 * settings.bend + settings.roundness) * edge  # the parabola's slope is 4 bend edge
    normals = frames.normal[:, :, None] + frames.side[:, :, None] * lean[:, None]
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def _normals_of_volume(
    positions: Floats, tangent: Floats, center: Floats, across: Floats, settings: CardSettings
) -> Floats:
    """Normals of strands at the same places, leaning further outwards by `roundness`."""
    along = np.broadcast_to(tangent[:, :, None], positions.shape)
    normal = volume_normals(positions, along, center)
    lean = settings.roundness * (2.0 * across - 1.0)
    normals = normal + np.cross(along, normal) * lean[:, None]
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def _resampled(guides: Floats, row_count: int) -> Floats:
    guide_count, cv_count = guides.shape[:2]
    strands = StrandSet(
        points=guides.reshape(-1, 3),
        offsets=np.arange(guide_count + 1) * cv_count,
        radius=np.zeros(guide_count * cv_count),
        group=np.zeros(guide_count, np.int32),
    )
    return resample(strands, row_count).points.reshape(guide_count, row_count, 3)
