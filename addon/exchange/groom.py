"""`Groom`, which all strand formats are written from and read into: strands with the attributes
that engines read.

Positions are in Blender's space: right-handed, Z up, metres. Writers and readers convert to and
from the units and axes of files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..arrays import Bools, Floats, Ints, rows_of_pieces
from ..errors import HairloomError
from ..strands import StrandSet
from .tfxbone import BoneWeights


@dataclass(frozen=True)
class Groom:
    """Strands with all attributes that a file can hold, checked when made; None: not known.

    strands: points, radii [m], colours, groups, root UVs; guides are among them, marked by
        `is_guide`.
    name: of the groom, for objects in the file.
    strand_id: (strand_count,) int32, unique for each strand.
    is_guide: (strand_count,) bool; None: no strand is a guide.
    closest_guides: (strand_count, 3) int32, the strand_id of guides, nearest first.
    guide_weights: (strand_count, 3) float32, their sum is 1.
    group_names: group -> name, for some of the groups.
    bones: those that carry the strands; they go into a .tfxbone file beside .tfx.
    dropped: by a reader: reason -> number of strands left out.
    source: by a reader: the file.
    motion: by a reader: where the points are at other times.

    Raises:
        HairloomError: shapes that do not fit the strands, or closest guides without IDs.
    """

    strands: StrandSet
    name: str = "hair"
    strand_id: Ints | None = None
    is_guide: Bools | None = None
    closest_guides: Ints | None = None
    guide_weights: Floats | None = None
    group_names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    bones: BoneWeights | None = None
    dropped: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    source: Path | None = None
    motion: ReadMotion | None = None

    def __post_init__(self) -> None:
        strands = self.strands.strand_count
        shapes = {
            "strand_id": (strands,),
            "is_guide": (strands,),
            "closest_guides": (strands, 3),
            "guide_weights": (strands, 3),
        }
        for name, dtype in _DTYPES.items():
            value = getattr(self, name)
            if value is None:
                continue
            value = np.ascontiguousarray(value, dtype)
            if value.shape != shapes[name]:
                raise _broken(f"{name} has shape {value.shape} instead of {shapes[name]}")
            object.__setattr__(self, name, value)
        if self.bones is not None and self.bones.strand_count != strands:
            raise _broken(f"bones of {self.bones.strand_count} strands instead of {strands}")
        if self.motion is not None and self.motion.positions.shape[1] != len(self.strands.points):
            raise _broken(f"a motion of {self.motion.positions.shape[1]} points")
        if (self.closest_guides is None) != (self.guide_weights is None):
            raise _broken("closest_guides and guide_weights must be given together")
        if self.closest_guides is not None and self.strand_id is None:
            raise _broken("closest_guides refer to strands by strand_id, which is missing")

    @property
    def color(self) -> Floats | None:
        """The colours of the strands, (point_count, 3) scene-linear."""
        return self.strands.color

    def take(self, strands: Ints) -> Groom:
        """The strands with these indices, in this order, with all that belongs to them."""
        changes: dict[str, Any] = {"strands": self.strands.take(strands)}
        for name in _DTYPES:
            value = getattr(self, name)
            if value is not None:
                changes[name] = value[strands]
        if self.bones is not None:
            changes["bones"] = self.bones.take(strands)
        if self.motion is not None:
            positions = self.motion.positions[:, rows_of_pieces(strands, self.strands.offsets)]
            changes["motion"] = replace(self.motion, positions=positions)
        return replace(self, **changes)

    def guides(self) -> Groom:
        """The guides alone; empty where none are marked."""
        return self.take(np.flatnonzero(self._guide_flags()))

    def without_guides(self) -> Groom:
        """The strands that are seen, the groom itself where no guides are marked."""
        flags = self._guide_flags()
        return self.take(np.flatnonzero(~flags)) if flags.any() else self

    def _guide_flags(self) -> Bools:
        if self.is_guide is None:
            return np.zeros(self.strands.strand_count, bool)
        return self.is_guide


#: Maximum frames of a motion that is read: nearly seven minutes at 24 frames a second.
MAX_FRAMES = 10_000


@dataclass(frozen=True, eq=False)
class ReadMotion:
    """The points of a file at the times that it has.

    times: (n,) [s], ascending. positions: (n, point_count, 3) float32 [m], all finite.
    """

    times: Floats
    positions: Floats

    def at_frames(self, rate: float) -> tuple[int, Floats]:
        """The first whole frame, and the points from it on, (frames, point_count, 3), for at most
        MAX_FRAMES frames; interpolated linearly between the file's times.

        Args:
            rate: frames in a second; frame f is at f / rate seconds.
        """
        first, count = self._range(rate)
        frame = first + np.arange(min(count, MAX_FRAMES))
        left, fraction = bracket_times(self.times, frame / rate)
        near, far = self.positions[left], self.positions[left + 1]
        return first, np.asarray(near + (far - near) * fraction[:, None, None], np.float32)

    def cut_note(self, rate: float) -> str:
        """A note on frames that `at_frames` leaves out; empty without any."""
        _, count = self._range(rate)
        if count <= MAX_FRAMES:
            return ""
        return f"its motion has {count:,} frames, and only the first {MAX_FRAMES:,} are read."

    def _range(self, rate: float) -> tuple[int, int]:
        """The first whole frame, and how many there are."""
        first, last = round(self.times[0] * rate), round(self.times[-1] * rate)
        return first, last - first + 1


def bracket_times(times: Floats, wanted: Floats) -> tuple[Ints, Floats]:
    """Which of two or more ascending times comes before each wanted time, (n,), and how far that is
    to the next, 0 to 1."""
    left = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(times) - 2)
    fraction = (wanted - times[left]) / (times[left + 1] - times[left])
    return left, np.clip(fraction, 0.0, 1.0).astype(np.float32)


@dataclass(frozen=True)
class GroomMotion:
    """The groom's points at each frame, for formats that hold motion.

    positions: for each frame (point_count, 3) float32 [m], in the order of the groom's points and
        in its space; iterated once, so it can be a generator that keeps one frame in memory.
    rate: frames in a second.
    first_frame: the number of the first one; frame f is at f / rate seconds.
    """

    positions: Iterable[Floats]
    rate: float
    first_frame: int = 1


def with_guide_copies(groom: Groom, guides: Ints, guide: Ints, weight: Floats) -> Groom:
    """The groom with a marked copy of each guide after its strands.

    Unreal does not draw strands that are marked as guides, so these are in the groom twice.

    Args:
        guides: (guide_count,) indices of the strands that are guides.
        guide: (strand_count, 3) indices into the guides, nearest first.
        weight: (strand_count, 3), their sum is 1.
    """
    count, copies = groom.strands.strand_count, len(guides)
    ids = np.arange(count) if groom.strand_id is None else groom.strand_id.astype(np.int64)
    if count and int(ids.max()) + copies > _LARGEST_ID:
        ids = np.arange(count)
    guide_ids = np.arange(copies) + (int(ids.max()) + 1 if count else 0)
    itself = np.zeros((copies, 3), np.float32)
    itself[:, 0] = 1.0
    plain = replace(groom, closest_guides=None, guide_weights=None)
    return replace(
        plain.take(np.concatenate([np.arange(count), guides])),
        strand_id=np.concatenate([ids, guide_ids]),
        is_guide=np.arange(count + copies) >= count,
        closest_guides=np.concatenate([guide_ids[guide], np.repeat(guide_ids[:, None], 3, axis=1)]),
        guide_weights=np.concatenate([weight, itself]),
    )


_LARGEST_ID = np.iinfo(np.int32).max
_DTYPES = {
    "strand_id": np.int32,
    "is_guide": np.bool_,
    "closest_guides": np.int32,
    "guide_weights": np.float32,
}
assert set(_DTYPES) < {each.name for each in fields(Groom)}


def _broken(problem: str) -> HairloomError:
    return HairloomError(problem, place="groom", remedy="Pass it through a reader of grooms")
