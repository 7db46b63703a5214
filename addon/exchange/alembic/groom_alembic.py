"""Grooms as Alembic files for engines, after Epic's "Alembic for Grooms Specification" 1.5.

One IXform has the version and the name of this program; below it lie ICurves with the attributes
groom_guide, groom_group_id, groom_group_name, groom_id, groom_root_uv, groom_width, groom_color,
groom_closest_guides and groom_guide_weights. Vectors have the interpretation "vector": Unreal's
importer refuses others. Widths are the curves' own as well, where Unity and Blender look for them;
Alembic stores the same numbers once.
"""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Floats, Ints, rows_of_pieces, rows_of_ranges
from ...errors import HairloomError
from ...strands import StrandSet
from ...strands.resample import arc_length_positions
from ..files.atomic import atomic_write, check_free_space, write_error, write_failure_reason
from ..files.file_names import identifier_name, unique_names
from ..groom import Groom, GroomMotion
from ..groom_presets import MIN_WIDTH, UNREAL, GroomPreset, selected_strands
from .alembic_library import (
    alembic_library,
    geometry_scope,
    imath_array,
    parameter_sample,
    write_parameter,
)

VERSION = (1, 5)
TOOL = "Hairloom"
#: Maximum frame rate, far above any in use: higher ones break files and times.
_MAX_RATE = 1.0e4
#: At least the bytes of a point and of a strand with all attributes, and of all headers together.
_POINT_BYTES, _STRAND_BYTES, _HEADER_BYTES = 40, 64, 1 << 18


def write_groom_alembic(
    path: Path, groom: Groom, preset: GroomPreset = UNREAL, *, motion: GroomMotion | None = None
) -> None:
    """Write a groom, still or moving; the file is there complete or not at all.

    Strands without an ID get their number as one. Widths are at least MIN_WIDTH.

    Args:
        preset: the engine's units, axes and limits; `replace` changes some of them.
        motion: positions over time; widths and attributes stay the groom's.

    Raises:
        HairloomError: no alembic3d, nothing to write, frames that do not fit the groom or are not
            finite, or nothing can be written there.
    """
    library = alembic_library(str(path))
    parts = _parts(groom, preset)
    if not parts:
        what = "guides" if preset.parts == "guides" else "strands"
        raise HairloomError(
            f"there are no {what} to write", place=str(path), remedy=f"Choose hair that has {what}"
        )
    with atomic_write(path) as temporary:
        try:
            _write(library, temporary, groom, parts, preset, motion)
        except BaseException as error:
            # the traceback's frames would keep the archive open, and Windows deletes no open file
            traceback.clear_frames(error.__traceback__)
            if not isinstance(error, RuntimeError):
                raise
            why = write_failure_reason(path, str(error).strip() or "no reason given")
            raise write_error(path, why) from error
        if not is_complete_alembic(temporary):
            raise write_error(path, write_failure_reason(path, "the disk may be full"))


def is_complete_alembic(path: Path) -> bool:
    """Whether an Alembic file was written to its end, as its sixth byte tells."""
    with path.open("rb") as file:
        return file.read(6) == b"Ogawa\xff"


@dataclass(frozen=True)
class _Part:
    """One curves object: its name, and which strands it has; None: all, in their order."""

    name: str
    strands: Ints | None

    def strands_of(self, groom: Groom, preset: GroomPreset) -> _PartStrands:
        """A copy of the object's strands, to be kept only while it is written."""
        own = groom if self.strands is None else groom.take(self.strands)
        return _PartStrands(own, cap_points(own.strands, preset.max_points))

    def point_counts(self, strands: StrandSet, max_points: int) -> Ints:
        """Points of each curve that is written."""
        counts = strands.point_counts
        return np.minimum(counts if self.strands is None else counts[self.strands], max_points)


@dataclass(frozen=True)
class _PartStrands:
    """The strands of a curves object, and which of their points are written."""

    groom: Groom
    cap: PointCap | None

    @property
    def point_counts(self) -> Ints:
        return self.groom.strands.point_counts if self.cap is None else np.diff(self.cap.offsets)

    def capped(self, values: Floats) -> Floats:
        """Values at the points of this object's strands, interpolated at those that are written."""
        return values if self.cap is None else self.cap.apply(values)


@dataclass(frozen=True)
class _FramePoints:
    """How a curves object gets its points from a frame: indices, None for all, and the cap."""

    points: Ints | None
    cap: PointCap | None

    @classmethod
    def of(cls, part: _Part, part_strands: _PartStrands, strands: StrandSet) -> _FramePoints:
        points = None if part.strands is None else rows_of_pieces(part.strands, strands.offsets)
        return cls(points, part_strands.cap)

    def of_frame(self, frame: Floats, preset: GroomPreset) -> Floats:
        """The points that are written, in the file's space."""
        placed = preset.space.to_file(frame if self.points is None else frame[self.points])
        return placed if self.cap is None else self.cap.apply(placed)


def _parts(groom: Groom, preset: GroomPreset) -> list[_Part]:
    parts = (_Part(name, strands) for name, strands in _strands_of_parts(groom, preset))
    count = groom.strands.strand_count
    return [p for p in parts if (count if p.strands is None else len(p.strands))]


def _strands_of_parts(groom: Groom, preset: GroomPreset) -> Iterator[tuple[str, Ints | None]]:
    """Name and strands of each curves object; None: all of them, in their order."""
    count = groom.strands.strand_count
    wanted = selected_strands(groom, preset.parts)
    if not preset.splits_groups:
        yield identifier_name(groom.name), None if len(wanted) == count else wanted
        return
    group = groom.strands.group[wanted]
    numbers = np.unique(group).tolist()
    names = unique_names(
        identifier_name(groom.group_names.get(each, f"{groom.name}_{each}")) for each in numbers
    )
    for name, number in zip(names, numbers, strict=True):
        yield name, wanted[group == number]


def _write(
    library: Any,
    path: Path,
    groom: Groom,
    parts: list[_Part],
    preset: GroomPreset,
    motion: GroomMotion | None,
) -> None:
    """Write the file, which is closed, and so finished, when the last local object is released.

    Alembic's library ends the process where the disk is full, so free space is checked before.
    """
    counts = [part.point_counts(groom.strands, preset.max_points) for part in parts]
    points, strands = sum(int(each.sum()) for each in counts), sum(map(len, counts))
    check_free_space(path, points * _POINT_BYTES + strands * _STRAND_BYTES + _HEADER_BYTES)
    archive, time = _archive(library, path, groom, motion)
    top = library.geom.OXform(archive.getTop(), f"{identifier_name(groom.name)}_groom")
    _write_version(library, top.getSchema().getUserProperties(), groom, preset)
    frames = iter([groom.strands.points] if motion is None else motion.positions)
    first = _check_frame(next(frames, None), groom)
    moving_curves = []
    for part in parts:  # one after the other, so that no more than one is in memory twice
        curves = library.geom.OCurves(top, part.name, library.abc.Argument(time))
        schema, part_strands = curves.getSchema(), part.strands_of(groom, preset)
        frame_points = _FramePoints.of(part, part_strands, groom.strands)
        schema.set(
            _first_sample(library, part_strands, preset, frame_points.of_frame(first, preset))
        )
        _write_attributes(library, schema.getArbGeomParams(), part_strands, preset)
        if motion is not None:
            moving_curves.append((schema, frame_points))
    for frame in frames:
        checked = _check_frame(frame, groom)
        check_free_space(path, points * _POINT_BYTES + _HEADER_BYTES)
        for schema, frame_points in moving_curves:
            schema.set(_sample(library, preset, frame_points.of_frame(checked, preset)))


def _archive(library: Any, path: Path, groom: Groom, motion: GroomMotion | None) -> tuple[Any, int]:
    """A new archive, and the number of its time sampling."""
    if motion is None:
        return library.abc.CreateArchiveWithInfo(str(path), TOOL, groom.name), 0
    if not 0.0 < motion.rate <= _MAX_RATE:
        raise HairloomError(
            f"{motion.rate} frames a second cannot be written",
            place="frame rate",
            remedy="Choose a rate above 0",
        )
    archive = library.abc.CreateArchiveWithInfo(str(path), float(motion.rate), TOOL, groom.name)
    step = 1.0 / motion.rate
    sampling = library.core.TimeSampling(step, motion.first_frame * step)
    return archive, archive.addTimeSampling(sampling)


def _check_frame(frame: Floats | None, groom: Groom) -> Floats:
    """A frame's points, which are as many as the groom's."""
    expected = (groom.strands.point_count, 3)
    if frame is None or frame.shape != expected or not np.isfinite(frame).all():
        found = "none" if frame is None else f"{frame.shape}"
        raise HairloomError(
            f"a frame does not have finite points of shape {expected} (found {found})",
            place=groom.name,
            remedy="Bake the motion again",
        )
    return frame


def _write_version(library: Any, properties: Any, groom: Groom, preset: GroomPreset) -> None:
    abc, space = library.abc, preset.space
    abc.OInt16Property(properties, "groom_version_major").setValue(VERSION[0])
    abc.OInt16Property(properties, "groom_version_minor").setValue(VERSION[1])
    abc.OStringProperty(properties, "groom_tool").setValue(TOOL)
    about = f"up={space.up};per_metre={space.units_per_metre!r};mirrored={int(space.is_mirrored)}"
    abc.OStringProperty(properties, "groom_properties").setValue(about)


def _sample(library: Any, preset: GroomPreset, points: Floats) -> Any:
    """Points, and the kind of curve, which each sample repeats. All else must stay unset: Unreal
    takes empty knots for broken ones."""
    geom, is_cubic = library.geom, preset.basis == "cubic"
    sample = geom.OCurvesSchemaSample()
    sample.setPositions(imath_array(library, points))
    sample.setType(geom.CurveType.kCubic if is_cubic else geom.CurveType.kLinear)
    sample.setBasis(geom.BasisType.kCatmullromBasis if is_cubic else geom.BasisType.kNoBasis)
    sample.setWrap(geom.CurvePeriodicity.kNonPeriodic)
    return sample


def _first_sample(library: Any, part: _PartStrands, preset: GroomPreset, points: Floats) -> Any:
    """A sample with counts, widths and UVs, which later ones repeat."""
    sample = _sample(library, preset, points)
    sample.setCurvesNumVertices(imath_array(library, part.point_counts.astype(np.int32)))
    sample.setWidths(parameter_sample(library, _widths(part, preset), "Vertex"))
    uv = part.groom.strands.root_uv
    if preset.has_curve_uv and uv is not None:
        sample.setUVs(parameter_sample(library, np.repeat(uv, part.point_counts, axis=0), "Vertex"))
    return sample


def _write_attributes(library: Any, parent: Any, part: _PartStrands, preset: GroomPreset) -> None:
    groom, count = part.groom, part.groom.strands.strand_count
    number = np.arange(count) if groom.strand_id is None else groom.strand_id
    uniform: dict[str, Floats | Ints | None] = {
        "groom_group_id": groom.strands.group,
        "groom_id": number.astype(np.int32),
        "groom_root_uv": groom.strands.root_uv,
    }
    if groom.is_guide is not None:
        uniform["groom_guide"] = groom.is_guide.astype(np.int32)
    if preset.parts == "both":
        uniform["groom_closest_guides"] = groom.closest_guides
        uniform["groom_guide_weights"] = groom.guide_weights
    for name, values in uniform.items():
        if values is not None:
            write_parameter(library, parent, name, values, "Uniform")
    write_parameter(library, parent, "groom_width", _widths(part, preset), "Vertex")
    if groom.color is not None:
        write_parameter(library, parent, "groom_color", part.capped(groom.color), "Vertex")
    _write_group_names(library, parent, groom)


def _write_group_names(library: Any, parent: Any, groom: Groom) -> None:
    """Write each name once, and its index for each strand."""
    if not groom.group_names:
        return
    groups, group_index = np.unique(groom.strands.group, return_inverse=True)
    names = library.imath.StringArray(len(groups))
    for place, group in enumerate(groups.tolist()):
        names[place] = groom.group_names.get(group, f"{groom.name}_{group}")
    # unsigned arrays cannot be made from a buffer, but from doubles
    numbers = library.imath.DoubleArrayFromBuffer(group_index.astype(np.float64))
    indices = library.imath.UnsignedIntArray(numbers)
    scope = geometry_scope(library, "Uniform")
    sample = library.geom.OStringGeomParamSample(names, indices, scope)
    library.geom.OStringGeomParam(parent, "groom_group_name", True, scope, 1).set(sample)


def _widths(part: _PartStrands, preset: GroomPreset) -> Floats:
    """Widths of the points that are written, in the file's unit."""
    width = np.maximum(part.capped(part.groom.strands.radius) * np.float32(2.0), MIN_WIDTH)
    return (width * preset.space.units_per_metre).astype(np.float32)


@dataclass(frozen=True)
class PointCap:
    """Where new points lie between old ones, the same for all values and all frames.

    left, right: (new_count,) indices of old points.
    weight: (new_count,) float32, of the right one.
    offsets: (strand_count + 1,) int32, of the new points.
    """

    left: Ints
    right: Ints
    weight: Floats
    offsets: Ints

    def apply(self, values: Floats) -> Floats:
        """Values of the old points (point_count, ...) at the new ones."""
        weight = self.weight.reshape(-1, *[1] * (values.ndim - 1))
        return values[self.left] * (1.0 - weight) + values[self.right] * weight


def cap_points(strands: StrandSet, max_points: int) -> PointCap | None:
    """`max_points` equally spaced points for each strand with more; None where none has more."""
    counts = strands.point_counts
    long = np.flatnonzero(counts > max_points)
    if not len(long):
        return None
    new_counts = np.minimum(counts, max_points)
    offsets = np.concatenate([[0], np.cumsum(new_counts)]).astype(np.int32)
    left = rows_of_ranges(strands.offsets[:-1], new_counts)
    right, weight = left.copy(), np.zeros(len(left), np.float32)

    own_left, own_weight = arc_length_positions(strands.take(long), max_points)
    old = rows_of_pieces(long, strands.offsets)
    places = (offsets[long][:, None] + np.arange(max_points)).ravel()
    left[places] = old[own_left.ravel()]
    right[places] = left[places] + 1
    weight[places] = own_weight.ravel()
    return PointCap(left, right, weight, offsets)
