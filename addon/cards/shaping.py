"""Edits of cards: widening, twisting, another tile; and a card along a drawn line.

A row is the vertices of a card at one place from root to tip. Its middle is halfway between its
outermost vertices; it is widened and twisted about that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..strands import Surface
from ..strands.closest_point import closest_point
from ..strands.vectors import unit_or
from .atlas_grid import AtlasGrid
from .card_mesh import CardMesh
from .settings import CardSettings
from .strip import Strips, UncutCards, card_frames, strip_mesh, taper

#: Places along a card that are nearer to each other than this part of it are one row.
_SAME_ROW = 1.0e-3
#: A line that begins farther from the skin than this part of its length is not moved.
_NEAR_SKIN = 0.25
_SHORTEST = 1.0e-12


@dataclass(frozen=True)
class CardVertices:
    """Vertices of some cards, in one space.

    positions: (vertex_count, 3) [m]. uv: (vertex_count, 2). card: (vertex_count,) from 0.
    """

    positions: Floats
    uv: Floats
    card: Ints

    @property
    def along(self) -> Floats:
        """Places from 0 at the root of each card to 1 at its tip, (vertex_count,)."""
        count = int(self.card.max(initial=-1)) + 1
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        np.minimum.at(low, self.card, self.uv[:, 1])
        np.maximum.at(high, self.card, self.uv[:, 1])
        size = np.maximum(high - low, _SHORTEST)[self.card]
        along: Floats = (self.uv[:, 1] - low[self.card]) / size
        return along

    def widened(self, root: float, tip: float) -> Floats:
        """Positions, (vertex_count, 3) [m], with rows widened by factors that change linearly from
        root to tip."""
        along = self.along
        middle, _ = self._middles(along)
        factor = root + (tip - root) * along
        wider: Floats = middle + (self.positions - middle) * factor[:, None]
        return wider

    def twisted(self, angle: float) -> Floats:
        """Positions with rows turned about the card's axis: by 0 at the root to `angle` [rad] at
        the tip.

        Rodrigues' formula.
        """
        along = self.along
        middle, axis = self._middles(along)
        arm, turn = self.positions - middle, (angle * along)[:, None]
        ahead = np.einsum("vi,vi->v", arm, axis)[:, None]
        turned = arm * np.cos(turn) + np.cross(axis, arm) * np.sin(turn)
        twisted: Floats = middle + turned + axis * ahead * (1.0 - np.cos(turn))
        return twisted

    def _middles(self, along: Floats) -> tuple[Floats, Floats]:
        """The middle of the row of each vertex, and the direction of its card there."""
        step = np.round(along / _SAME_ROW).astype(np.int64)
        key = self.card.astype(np.int64) * (round(1.0 / _SAME_ROW) + 2) + step
        order = np.lexsort((self.uv[:, 0], key))
        rows, first = np.unique(key[order], return_index=True)
        last = np.append(first[1:], len(order)) - 1
        ends = self.positions[order[first]], self.positions[order[last]]
        middle = (ends[0].astype(np.float64) + ends[1]) / 2.0
        owner = self.card[order[first]]
        before = np.maximum(np.arange(len(rows)) - 1, 0)
        after = np.minimum(np.arange(len(rows)) + 1, len(rows) - 1)
        before = np.where(owner[before] == owner, before, np.arange(len(rows)))
        after = np.where(owner[after] == owner, after, np.arange(len(rows)))
        axis = unit_or(middle[after] - middle[before], (0.0, 0.0, 1.0), _SHORTEST)
        row = np.searchsorted(rows, key)
        return middle[row], axis[row]


def tile_offset(grid: AtlasGrid, tile: Ints, wanted: Ints) -> Floats:
    """Offset of UVs from tiles to wanted ones, (n, 2)."""
    nothing = np.zeros(1)
    return grid.uv(wanted, nothing, nothing) - grid.uv(tile, nothing, nothing)


def card_along_line(
    line: Floats,
    outwards: Floats,
    settings: CardSettings,
    *,
    width: float,
    tile: int,
    grid: AtlasGrid,
) -> CardMesh:
    """A card along a line from root to tip.

    Args:
        line, outwards: see `line_from_root`.
        width: at the root [m].
    """
    frames = card_frames(line[None].astype(np.float32), outwards[None], settings.segment_count)
    along = np.linspace(0.0, 1.0, settings.segment_count + 1, dtype=np.float32)
    strips = Strips(frames, (width * taper(along, settings.tip_width))[None].astype(np.float32))
    one = np.zeros(1, np.int32)
    cards = UncutCards(strips, one + 1, one, one, one + tile, grid)
    return strip_mesh([(one, strips)], cards, settings.column_count, settings)


def line_from_root(line: Floats, head: Surface | None) -> tuple[Floats, Floats]:
    """A line that starts at its root, and the normal of the skin there.

    The end nearer to the skin is the root. If it is near enough, it is moved onto the skin, and the
    line with it, ever less towards the tip. Without a skin the higher end is the root.

    Args:
        line: (point_count, 3) [m], in the space of the head.
    """
    line = line.astype(np.float64)
    if head is None or not len(head.triangles):
        higher = line if line[0, 2] >= line[-1, 2] else line[::-1]
        return higher, np.array([0.0, 0.0, 1.0])
    found = closest_point(line[[0, -1]], head)
    end = int(found.distance[1] < found.distance[0])
    line = line[::-1] if end else line
    lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
    arc_length = np.concatenate([[0.0], np.cumsum(lengths)])
    if found.distance[end] <= _NEAR_SKIN * arc_length[-1]:
        remaining = 1.0 - arc_length / arc_length[-1]
        line = line + (found.point[end] - line[0]) * (remaining**2)[:, None]
    return line, head.triangle_normals()[found.triangle[end]]
