"""Places along strands that something else than the root carries: a hair tie, or a surface.

They are carried by *anchors*: each hair tie is one, and each tip that lies on a surface has one of
its own. An anchor's pose is a matrix from the world at rest to the world now.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.arc_length import length_fractions
from ..strands.strand_set import ROOT_POINTS
from .roots import root_frames


@dataclass(frozen=True, eq=False)
class Holds:
    """Which strands are held, where, and by what.

    strand: (n,) indices of strands, ascending; those of one strand from root to tip.
    place: (n,) float32, along the strand in its own points: 5.25 is a quarter of the way from point
        5 to the next one. The points beside it are held, or the tip alone.
    anchor: (n,) indices of anchors: ties first, then one for each held tip.
    tie_count: how many ties there are, whether or not hair passes through them.
    surface: world space at rest, that holds tips; None where none does.
    tip_triangle, tip_barycentric: (m,), (m, 3), where the held tips are on it.
    """

    strand: Ints
    place: Floats
    anchor: Ints
    tie_count: int
    surface: Surface | None = None
    tip_triangle: Ints | None = None
    tip_barycentric: Floats | None = None

    @property
    def anchor_count(self) -> int:
        return self.tie_count + (0 if self.tip_triangle is None else len(self.tip_triangle))

    def for_strands(self, chosen: Ints) -> Holds:
        """The holds of some strands, (k,) ascending, renumbered among these strands."""
        place = np.searchsorted(chosen, self.strand)
        kept = np.flatnonzero(np.take(chosen, place, mode="clip") == self.strand)
        return self._some(kept, place[kept])

    def on_lines(self, strands: StrandSet, cv_count: int) -> Holds:
        """The same places on centre lines of `cv_count` CVs, see `strands.center_lines`."""
        fraction, first = (
            length_fractions(strands.points, strands.offsets),
            self.place.astype(np.int64),
        )
        before = strands.offsets[self.strand] + first
        after = np.minimum(before + 1, strands.offsets[self.strand + 1] - 1)
        here = fraction[before] + (self.place - first) * (fraction[after] - fraction[before])
        place = np.maximum(here * (cv_count - 1), ROOT_POINTS).astype(np.float32)
        return replace(self, place=place)

    def where(self, anchors: Floats | None) -> Holds:
        """The holds whose anchors exist: an object that is gone holds nothing.

        Args:
            anchors: see `anchors_of`; None: there are none.
        """
        if anchors is None:
            return self._some(np.zeros(0, np.int64), self.strand[:0])
        is_there = np.isfinite(anchors).all(axis=(1, 2))[self.anchor]
        if is_there.all():
            return self
        kept = np.flatnonzero(is_there)
        return self._some(kept, self.strand[kept])

    def _some(self, kept: Ints, strand: Ints) -> Holds:
        return replace(self, strand=strand, place=self.place[kept], anchor=self.anchor[kept])

    def kinds(self, strand_count: int) -> Ints:
        """The kind of each strand, (strand_count,): equal for strands that the same anchors hold, 0
        for strands that are not held. The anchors of tips all count as one."""
        held_by = np.zeros((strand_count, self.tie_count + 1), bool)
        held_by[self.strand, np.minimum(self.anchor, self.tie_count)] = True
        packed = np.packbits(held_by, axis=1)
        kinds, kind = np.unique(packed, axis=0, return_inverse=True)
        none = np.flatnonzero(~kinds.any(axis=1))
        return np.where(np.isin(kind.ravel(), none), 0, kind.ravel() + 1)

    def held_cvs(self, strand_count: int, cv_count: int) -> Bools:
        """(strand_count, cv_count), see `dynamics.held.HeldCvs`."""
        is_held = np.zeros((strand_count, cv_count), bool)
        first = self.place.astype(np.int64)
        is_held[self.strand, first] = True
        is_held[self.strand, np.minimum(first + 1, cv_count - 1)] = True
        return is_held

    def carried(self, rest: Floats, by_root: Floats, anchors: Floats) -> Floats:
        """Rest shapes of strands, carried by their roots and anchors, in the shape of `rest`,
        float32 world [m].

        At a hold, and beyond the last one, a strand follows its anchor alone, since a tie is a
        second root; between root and holds their influences change linearly. In the rest pose
        nothing changes, bit for bit.

        Args:
            rest: (strand_count, cv_count, 3) world [m] at rest.
            by_root: the same, carried by the roots alone.
            anchors: (anchor_count, 4, 4), all finite.
        """
        result = np.array(by_root, np.float32)
        cv = np.arange(rest.shape[1])
        first = np.floor(self.place)
        last = np.minimum(first + 1.0, rest.shape[1] - 1.0)
        begins = np.diff(self.strand, prepend=-1) != 0
        ends = np.append(begins[1:], True)[: len(begins)]
        from_cv = np.where(begins, ROOT_POINTS - 1.0, np.roll(last, 1))
        to_cv = np.where(ends, np.inf, np.roll(first, -1))
        rise = _ramp(cv, from_cv[:, None], first[:, None])
        fall = np.where(ends[:, None], 0.0, _ramp(cv, last[:, None], to_cv[:, None]))
        weight = np.minimum(rise, 1.0 - fall).astype(np.float32)
        matrix = anchors[self.anchor]
        moved = np.einsum("nij,ncj->nci", matrix[:, :3, :3], rest[self.strand])
        moved += matrix[:, None, :3, 3]
        moved -= by_root[self.strand]
        moved *= weight[..., None]
        np.add.at(result, self.strand, moved.astype(np.float32))
        return result


def _ramp(cv: Ints, begin: Floats, end: Floats) -> Floats:
    """0 up to `begin`, 1 from `end` on."""
    with np.errstate(invalid="ignore"):
        return np.clip((cv - begin) / np.maximum(end - begin, 1.0e-6), 0.0, 1.0)


def anchors_of(holds: Holds, ties: Floats, surface_now: Floats | None) -> Floats:
    """Where all anchors are, (anchor_count, 4, 4) float32, from world at rest to world now.

    Args:
        ties: (tie_count, 4, 4) the same for each tie; NaN for one that is gone.
        surface_now: (vertex_count, 3) [m] world, where the surface of held tips is; None: gone.
    """
    anchors = np.full((holds.anchor_count, 4, 4), np.nan, np.float32)
    anchors[: holds.tie_count] = ties
    if holds.surface is None or surface_now is None:
        return anchors
    assert holds.tip_triangle is not None and holds.tip_barycentric is not None
    rest, now = (
        root_frames(positions, holds.surface.triangles, holds.tip_triangle, holds.tip_barycentric)
        for positions in (holds.surface.positions, surface_now)
    )
    turn = now.rotation @ rest.rotation.transpose(0, 2, 1)
    # a surface at rest must turn nothing, not even by rounding
    turn[np.abs(turn - np.eye(3)).max(axis=(1, 2)) < 1.0e-12] = np.eye(3)
    tips = anchors[holds.tie_count :]
    tips[:] = np.eye(4)
    tips[:, :3, :3] = turn
    tips[:, :3, 3] = now.origin - np.einsum("nij,nj->ni", turn, rest.origin)
    return anchors
