"""An Alembic file's curves objects as one: points in the world, attributes side by side."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Bools, Floats, Ints
from ...errors import HairloomError
from ..curve_basis import CurveSampling, invalid_curves, points_on_curves, usable_basis
from ..read_motion import join_motions, motion_end_note
from .alembic_curves import Arrays

type _Values = NDArray[Any]

_INT32 = np.iinfo(np.int32)


@dataclass(frozen=True)
class JoinedCurves:
    """Curves as a file has them, in its unit and axes, not yet cleaned.

    points: (point_count, 3) float32.
    offsets: (curve_count + 1,).
    widths: (point_count,), or None.
    group: (curve_count,) int32.
    root_uv: (curve_count, 2), or None.
    color: (point_count, 3), or None.
    is_guide: of each curve, or None.
    identities: strand_id, closest_guides and guide_weights of each curve, as far as present.
    group_names: group -> name.
    motion: times [s] and the points at these, (n, point_count, 3), or None.
    unusable: see `invalid_curves`.
    notes: what could not be used.
    """

    points: Floats
    offsets: Ints
    widths: Floats | None
    group: Ints
    root_uv: Floats | None
    color: Floats | None
    is_guide: Bools | None
    identities: Arrays
    group_names: dict[int, str]
    motion: tuple[Floats, Floats] | None
    unusable: dict[str, Bools]
    notes: tuple[str, ...]


@dataclass
class _Object:
    """One curves object, with notes on what could not be used.

    points: on the curves. counts: of each curve. control_count: of control points in the file.
    """

    name: str
    points: Floats
    counts: Ints
    arrays: Arrays
    control_count: int
    sampling: CurveSampling
    notes: list[str] = field(default_factory=list)

    def curve_values(self, name: str, width: int = 1) -> _Values | None:
        """An attribute's value for each curve, from values of curves or one for all."""
        values = self._values(name, width, (len(self.counts), 1))
        if values is None or len(values) == len(self.counts):
            return values
        return np.repeat(values, len(self.counts), axis=0)

    def point_values(self, name: str, width: int = 1) -> _Values | None:
        """An attribute's value for each point, from values of points, of curves, or one for all."""
        curves, ends = len(self.counts), self.sampling.varying_count
        values = self._values(name, width, (self.control_count, ends, curves, 1))
        if values is None:
            return None
        if len(values) == self.control_count:
            return values if self.sampling.vertex is None else self.sampling.vertex.apply(values)
        if len(values) == ends and self.sampling.varying is not None:
            return self.sampling.varying.apply(values)
        return np.repeat(values, self.counts if len(values) == curves else len(self.points), axis=0)

    def _values(self, name: str, width: int, counts: tuple[int, ...]) -> _Values | None:
        values = self.arrays.get(name)
        if values is None or not values.size:
            return None
        if values.dtype.kind not in "biuf" or values.size % width:
            self.notes.append(f"{self.name}: {name} is of another type")
            return None
        values = values.reshape(-1, width) if width > 1 else values.ravel()
        if len(values) not in counts:
            self.notes.append(f"{self.name}: {name} has {len(values)} values")
            return None
        return values


def join_curves(found: Arrays, path: Path) -> JoinedCurves:
    """All curves objects that `alembic_curves` has found.

    Raises:
        HairloomError: there are none, or one's counts do not fit its points.
    """
    numbers, closed = _numbers(found)
    objects = [_object(found, number, path) for number in numbers]
    objects = [each for each in objects if len(each.counts)]
    left_out = tuple(f"{name} was left out: its curves are closed" for name in closed)
    if not objects:
        raise HairloomError(
            "; ".join(("there are no curves in it", *left_out[:3])),
            place=str(path),
            remedy="Export hair curves, not meshes or empties",
        )
    counts = np.concatenate([each.counts for each in objects])
    widths = [_widths(each) for each in objects]
    group, names = _groups(objects)
    guide = _curve_values(objects, "groom_guide", 1, 0)
    return JoinedCurves(
        points=np.concatenate([each.points for each in objects]),
        offsets=np.concatenate([[0], np.cumsum(counts)]),
        widths=_concatenated(widths, [len(each.points) for each in objects], np.nan),
        group=group,
        root_uv=_curve_values(objects, "groom_root_uv", 2, 0.0),
        color=_concatenated(
            [each.point_values("groom_color", 3) for each in objects],
            [len(each.points) for each in objects],
            np.nan,
        ),
        is_guide=None if guide is None else guide != 0,
        identities=_identities(objects),
        group_names=names,
        motion=join_motions([_part_motion(each) for each in objects]),
        unusable=_unusable(objects),
        notes=(*_notes(objects), *left_out),  # after all others, which add notes to the objects
    )


def _notes(objects: list[_Object]) -> tuple[str, ...]:
    together = f"its {len(objects):,} curves objects were joined into one groom"
    notes = tuple(note for each in objects for note in each.notes)
    return (together, *notes) if len(objects) > 1 else notes


def _unusable(objects: list[_Object]) -> dict[str, Bools]:
    """Why curves cannot be used -> which of all."""
    of_objects = [invalid_curves(each.sampling, str(each.arrays.get("basis"))) for each in objects]
    return {
        reason: np.concatenate(
            [
                unfit.get(reason, np.zeros(len(each.counts), bool))
                for each, unfit in zip(objects, of_objects, strict=True)
            ]
        )
        for reason in dict.fromkeys(reason for unfit in of_objects for reason in unfit)
    }


def _numbers(found: Arrays) -> tuple[list[int], list[str]]:
    """The numbers of objects that have points and counts and are not closed; the names of closed
    ones."""
    every = [n for n in range(len(found)) if f"{n}/name" in found]
    full = [n for n in every if f"{n}/points" in found and f"{n}/counts" in found]
    closed = [n for n in full if found.get(f"{n}/is_closed")]
    return [n for n in full if n not in closed], [str(found[f"{n}/name"]) for n in closed]


def _object(found: Arrays, number: int, path: Path) -> _Object:
    prefix = f"{number}/"
    own = {n.removeprefix(prefix): v for n, v in found.items() if n.startswith(prefix)}
    name, points, counts = str(own["name"]), own["points"], own["counts"]
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind != "f" or counts.ndim != 1:
        raise _broken_curves(path, name, "its points are not positions")
    counts = counts.astype(np.int64)
    if len(counts) and (counts.min() < 0 or counts.sum() != len(points)):
        raise _broken_curves(
            path, name, f"its curves need {counts.sum()} points, but it has {len(points)}"
        )
    basis, said = usable_basis(str(own.get("basis", "linear")), counts)
    ended = (
        [motion_end_note(float(own["ended"]), "different counts of points")]
        if "ended" in own
        else []
    )
    notes = [f"{name}: {note}" for note in (*ended, *said)]
    sampling = points_on_curves(basis, True, counts)
    placed = _to_world(points, own["matrix"])
    if sampling.vertex is not None:
        notes.append(f"{name}: its {basis} curves were converted to points on the curves")
        placed = sampling.vertex.apply(placed)
    return _Object(name, placed, np.diff(sampling.offsets), own, len(points), sampling, notes)


def _part_motion(each: _Object) -> tuple[Floats | None, Floats]:
    """See `join_motions`."""
    times, positions = each.arrays.get("times"), each.arrays.get("motion")
    if times is None or positions is None or positions.shape[1:] != (each.control_count, 3):
        return None, each.points[None]
    vertex = each.sampling.vertex
    return times, positions if vertex is None else np.array([vertex.apply(at) for at in positions])


def _to_world(points: Floats, matrix: Floats) -> Floats:
    """Points in the world; untouched, to the bit, where the object is not moved."""
    if np.array_equal(matrix, np.eye(4)):
        return points.astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        moved = points.astype(np.float64) @ matrix[:3, :3] + matrix[3, :3]
        return moved.astype(np.float32)


def _widths(each: _Object) -> _Values | None:
    """The width at each point: as in engines, the attribute overrides the curves' own widths."""
    widths = each.point_values("groom_width")
    return each.point_values("widths") if widths is None else widths


def _groups(objects: list[_Object]) -> tuple[Ints, dict[int, str]]:
    """Group of each curve, and names; the objects are the groups where the file has no IDs."""
    has_ids = any("groom_group_id" in each.arrays for each in objects)
    ids, names = list[Ints](), dict[int, str]()
    for number, each in enumerate(objects):
        own = _as_int32(each.curve_values("groom_group_id")) if has_ids else None
        if own is None:
            own = np.full(len(each.counts), 0 if has_ids else number, np.int32)
        ids.append(own)
        texts = each.arrays.get("groom_group_name")
        if texts is not None and texts.dtype.kind == "U" and texts.size in (1, len(own)):
            groups, first = np.unique(own, return_index=True)
            chosen = np.broadcast_to(texts.ravel(), len(own))[first].tolist()
            names.update(zip(groups.tolist(), chosen, strict=True))
        elif not has_ids and len(objects) > 1:
            names[number] = each.name
    return np.concatenate(ids), names


def _identities(objects: list[_Object]) -> Arrays:
    """IDs, and closest guides, which refer to them, with weights."""
    ids = [_as_int32(each.curve_values("groom_id")) for each in objects]
    sizes = [len(each.counts) for each in objects]
    known = None if any(each is None for each in ids) else _concatenated(ids, sizes, 0)
    closest = _concatenated(
        [_as_int32(o.curve_values("groom_closest_guides", 3)) for o in objects], sizes, 0
    )
    weights = _curve_values(objects, "groom_guide_weights", 3, 0.0)
    found: Arrays = {}
    if known is not None:
        found["strand_id"] = known
    if known is not None and closest is not None and weights is not None:
        found["closest_guides"] = closest
        found["guide_weights"] = np.nan_to_num(weights, posinf=0.0, neginf=0.0)
    return found


def _as_int32(values: _Values | None) -> Ints | None:
    """As int32; what does not fit becomes 0."""
    if values is None:
        return None
    fits = np.isfinite(values) & (values >= _INT32.min) & (values <= _INT32.max)
    return np.where(fits, values, 0).astype(np.int32)


def _curve_values(objects: list[_Object], name: str, width: int, missing: float) -> _Values | None:
    """An attribute of all curves, `missing` for objects without it; None if no object has it."""
    values = [each.curve_values(name, width) for each in objects]
    return _concatenated(values, [len(each.counts) for each in objects], missing)


def _concatenated(parts: list[_Values | None], sizes: list[int], missing: float) -> _Values | None:
    there = next((part for part in parts if part is not None), None)
    if there is None:
        return None
    filled = [
        np.full((size, *there.shape[1:]), missing, there.dtype) if part is None else part
        for part, size in zip(parts, sizes, strict=True)
    ]
    return np.concatenate(filled)


def _broken_curves(path: Path, name: str, problem: str) -> HairloomError:
    return HairloomError(
        f"the curves '{name}' are broken: {problem}",
        place=str(path),
        remedy="The file is damaged: copy or export it again",
    )
