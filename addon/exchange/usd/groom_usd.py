"""Writing grooms as USD BasisCurves, in the manner of Blender's own exporter.

    /name            Xform, the default prim
    /name/strands    BasisCurves: cubic, catmullRom, pinned, so that curves pass through all points
                     and end at the first and the last; or one such prim for each group, by its name

Widths are twice the radii. All further attributes are primvars with the names of Epic's "Using
Alembic for Grooms". Unreal Engine only reads primvars of the plain types (float3, not color3f) with
a value for each strand or point, reads the version from user properties of the topmost prim, and
needs GroomAPI applied to it. For all others, root UVs are repeated as `st`, and colours as
`displayColor`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats, Ints, rows_of_pieces
from ...errors import HairloomError
from ..files.atomic import atomic_write, write_error, write_failure_reason
from ..files.axes import from_z_up
from ..files.file_names import identifier_name, unique_names
from ..groom import Groom, GroomMotion
from .usd_library import SUFFIXES, usd_library
from .usd_reader import error_summary

#: The version of Epic's conventions that the names of primvars are from.
GROOM_VERSION = (1, 5)

#: Size of the frames that are kept in memory before they are saved [bytes].
_MAX_UNSAVED_BYTES = 1 << 28


@dataclass(frozen=True)
class UsdSpace:
    """The unit and axes of the stage.

    up: "Y" or "Z".
    scale: metres in one unit.
    """

    up: str
    scale: float


def write_usd(
    path: Path,
    groom: Groom,
    *,
    up: str = "Z",
    scale: float = 1.0,
    by_group: bool = False,
    is_linear: bool = False,
    motion: GroomMotion | None = None,
) -> None:
    """Write a groom with all its attributes; the file is there complete or not at all.

    Args:
        path: .usdc (binary), .usda (text), or .usd, which is binary.
        up: the file's up axis, "Y" or "Z".
        scale: metres in one unit of the file.
        by_group: a prim for each group in place of one for all.
        is_linear: straight between points, in place of cubic.
        motion: time samples, one a frame; the groom itself stays the default value.

    Raises:
        HairloomError: no strands, no OpenUSD, another suffix, frames that do not fit the groom, or
            nothing can be written there.
    """
    usd = usd_library(path)
    if path.suffix.lower() not in SUFFIXES:
        raise HairloomError(
            f"'{path.suffix}' is not a suffix of USD files",
            place=str(path),
            remedy="Use .usdc, .usda or .usd",
        )
    if not groom.strands.strand_count:
        raise HairloomError(
            "there are no strands to write", place=str(path), remedy="Choose hair that has strands"
        )
    space = _checked_space(up, scale, path)
    with atomic_write(path) as temporary:
        try:
            stage = usd.Usd.Stage.CreateNew(str(temporary))
            root = _root(usd, stage, groom, space)
            parts = [
                _write_part(usd, root, name, part, space, is_linear)
                for name, part in _parts(groom, by_group)
            ]
            if motion is not None:
                _write_motion(usd, stage, parts, motion, space, path)
            stage.GetRootLayer().Save()
        except usd.Tf.ErrorException as error:
            raise write_error(path, write_failure_reason(path, error_summary(error))) from error


def _checked_space(up: str, scale: float, path: Path) -> UsdSpace:
    from_z_up(np.zeros(3), up)  # refuses another axis
    if not (np.isfinite(scale) and scale > 0.0):
        raise HairloomError(
            f"a unit of {scale} m is not valid",
            place=str(path),
            remedy="Use a number above 0, such as 0.01 for centimetres",
        )
    return UsdSpace(up, scale)


def _root(usd: ModuleType, stage: Any, groom: Groom, space: UsdSpace) -> Any:
    """The topmost prim, with the stage's units and axes."""
    geometry = usd.UsdGeom
    geometry.SetStageMetersPerUnit(stage, space.scale)
    geometry.SetStageUpAxis(stage, getattr(geometry.Tokens, space.up.lower()))
    prim = geometry.Xform.Define(stage, f"/{identifier_name(groom.name)}").GetPrim()
    prim.SetDisplayName(groom.name)
    prim.AddAppliedSchema("GroomAPI")
    stage.SetDefaultPrim(prim)
    types = usd.Sdf.ValueTypeNames
    major, minor = GROOM_VERSION
    for name, kind, value in (
        ("groom_version_major", types.Int, major),
        ("groom_version_minor", types.Int, minor),
        ("groom_tool", types.String, "Hairloom"),
    ):
        prim.CreateAttribute(f"userProperties:{name}", kind, custom=True).Set(value)
    return prim


@dataclass(frozen=True)
class _Part:
    """Strands that share a prim, and the indices of their points in the whole groom."""

    points: Ints | slice
    groom: Groom


def _parts(groom: Groom, by_group: bool) -> Iterator[tuple[str, _Part]]:
    """(name, strands) of each prim."""
    if not by_group:
        yield "strands", _Part(slice(None), groom)
        return
    numbers = np.unique(groom.strands.group).tolist()
    names = unique_names(
        identifier_name(groom.group_names.get(each, ""), f"group_{each}".replace("-", "_"))
        for each in numbers
    )
    for name, group in zip(names, numbers, strict=True):
        strands = np.flatnonzero(groom.strands.group == group)
        yield name, _Part(rows_of_pieces(strands, groom.strands.offsets), groom.take(strands))


def _write_part(
    usd: ModuleType, root: Any, name: str, part: _Part, space: UsdSpace, is_linear: bool
) -> tuple[Any, _Part]:
    """A prim of curves with the groom at rest, and the part that is in it."""
    tokens, strands = usd.UsdGeom.Tokens, part.groom.strands
    path = root.GetPath().AppendChild(name)
    curves = usd.UsdGeom.BasisCurves.Define(root.GetStage(), path)
    curves.CreateTypeAttr(tokens.linear if is_linear else tokens.cubic)
    curves.CreateBasisAttr(tokens.catmullRom)
    curves.CreateWrapAttr(tokens.pinned)
    curves.CreateCurveVertexCountsAttr(usd.Vt.IntArray.FromNumpy(strands.point_counts))
    widths = strands.radius * np.float32(2.0 / space.scale)
    curves.CreateWidthsAttr(usd.Vt.FloatArray.FromNumpy(widths))
    curves.SetWidthsInterpolation(tokens.vertex)
    _set_points(usd, curves, strands.points, float(widths.max()), space)
    primvars = usd.UsdGeom.PrimvarsAPI(curves)
    for primvar, kind, interpolation, values in _primvars(part.groom):
        array = _VT_ARRAYS[kind]
        value_type = usd.Sdf.ValueTypeNames.Find(f"{kind}[]")
        primvars.CreatePrimvar(primvar, value_type, interpolation).Set(
            getattr(usd.Vt, array).FromNumpy(np.ascontiguousarray(values))
        )
    names = _group_names(part.groom)
    if names:
        text = usd.Sdf.ValueTypeNames.StringArray
        primvars.CreatePrimvar("groom_group_name", text, "uniform").Set(usd.Vt.StringArray(names))
    return curves, part


_VT_ARRAYS = {
    "int": "IntArray",
    "int3": "Vec3iArray",
    "float2": "Vec2fArray",
    "texCoord2f": "Vec2fArray",
    "float3": "Vec3fArray",
    "color3f": "Vec3fArray",
}


def _primvars(groom: Groom) -> Iterator[tuple[str, str, str, NDArray[Any]]]:
    """(name, type, interpolation, values) of all that is known."""
    strands = groom.strands
    yield "groom_group_id", "int", "uniform", strands.group
    if groom.is_guide is not None:
        yield "groom_guide", "int", "uniform", groom.is_guide.astype(np.int32)
    if groom.strand_id is not None:
        yield "groom_id", "int", "uniform", groom.strand_id
    if strands.root_uv is not None:
        yield "groom_root_uv", "float2", "uniform", strands.root_uv
        yield "st", "texCoord2f", "uniform", strands.root_uv
    if groom.color is not None:
        yield "groom_color", "float3", "vertex", groom.color
        yield "displayColor", "color3f", "vertex", groom.color
    if groom.closest_guides is not None and groom.guide_weights is not None:
        yield "groom_closest_guides", "int3", "uniform", groom.closest_guides
        yield "groom_guide_weights", "float3", "uniform", groom.guide_weights


def _group_names(groom: Groom) -> list[str]:
    """For each strand the name of its group, empty where it has none; nothing without any."""
    if not groom.group_names:
        return []
    groups, group_index = np.unique(groom.strands.group, return_inverse=True)
    names = [groom.group_names.get(group, "") for group in groups.tolist()]
    return [names[each] for each in group_index.tolist()]


def _set_points(
    usd: ModuleType, curves: Any, points: Floats, width: float, space: UsdSpace, *time: float
) -> None:
    """Set points [m] and the box around them, at a time or as default values."""
    placed = np.ascontiguousarray(from_z_up(points, space.up), np.float32)
    if space.scale != 1.0:
        placed = placed / np.float32(space.scale)
    curves.CreatePointsAttr().Set(usd.Vt.Vec3fArray.FromNumpy(placed), *time)
    extent = np.stack([placed.min(axis=0), placed.max(axis=0)]) + [[-width / 2], [width / 2]]
    box = usd.Vt.Vec3fArray.FromNumpy(extent.astype(np.float32))
    curves.CreateExtentAttr().Set(box, *time)


def _write_motion(
    usd: ModuleType,
    stage: Any,
    parts: list[tuple[Any, _Part]],
    motion: GroomMotion,
    space: UsdSpace,
    path: Path,
) -> None:
    """Time samples at the numbers of frames."""
    point_count = sum(part.groom.strands.point_count for _, part in parts)
    is_binary, unsaved_bytes, count = path.suffix.lower() != ".usda", 0, 0
    widths = [2.0 * float(part.groom.strands.radius.max()) / space.scale for _, part in parts]
    for points in motion.positions:
        if points.shape != (point_count, 3) or not np.isfinite(points).all():
            raise HairloomError(
                f"frame {motion.first_frame + count} has points that do not fit the groom",
                place=str(path),
                remedy="Bake the motion again",
            )
        for (curves, part), width in zip(parts, widths, strict=True):
            time = float(motion.first_frame + count)
            _set_points(usd, curves, points[part.points], width, space, time)
        count, unsaved_bytes = count + 1, unsaved_bytes + points.nbytes
        if (
            is_binary and unsaved_bytes > _MAX_UNSAVED_BYTES
        ):  # a binary file only grows; a text is one piece
            stage.GetRootLayer().Save()
            unsaved_bytes = 0
    stage.SetTimeCodesPerSecond(motion.rate)
    stage.SetFramesPerSecond(motion.rate)
    stage.SetStartTimeCode(motion.first_frame)
    stage.SetEndTimeCode(motion.first_frame + max(count - 1, 0))
