"""The curves of a USD file as plain arrays: a program of its own, for another process.

    python usd_reader.py -- FILE RESULT.npz

A damaged file makes OpenUSD crash, and a text of a few kilobytes can describe more prims than any
machine holds. So only this process opens files, and it has limits of time, memory and prims. It
imports no other module of ours. It ends with EXIT_REPORTED, and a line on stderr, after an error.

The result has, for each BasisCurves in the file's order, all of it `pack_prims`:

    name, path
    matrix            (4, 4), takes row vectors to the stage
    points, counts, widths
    traits            wrap, type, basis, interpolation of widths
    times             [s], only of curves that move, as are the next three
    motion, matrices  (times, points, 3) and (times, 4, 4), while the number of points is the same
    ended             the time from which on it is another one, if there is such a time
    primvar/NAME      without indices, for each primvar of PRIMVARS that there is
    interpolation/NAME

And it has of the stage "up", "unit", "has_unit", "prim_names" (name and label of the topmost one),
"version" (major and minor; -1 where it names none), "others" (types of other geometry) and
"other_counts".
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Arrays = dict[str, NDArray[Any]]

#: as `run_reader` expects them: after an error that is on stderr; where results cannot be written
EXIT_REPORTED, EXIT_NO_SPACE = 3, 4
#: What grooms have beside points and widths.
PRIMVARS = (
    "groom_id",
    "groom_guide",
    "groom_group_id",
    "groom_group_name",
    "groom_color",
    "displayColor",
    "groom_closest_guides",
    "groom_guide_weights",
    "groom_root_uv",
    "surface_uv_coordinate",
    "st",
    "uv",
    "map1",
)
_PARTS = ("major", "minor")
#: Maximum points, more than any groom has; their positions alone take 3 GiB.
MAX_POINTS = 1 << 28
#: Maximum prims with all instances, more than any scene has that is sent for its hair.
MAX_PRIMS = 1_000_000
#: Memory that a file may take beside its own size [bytes], and as a multiple of it.
_BASE_MEMORY, _MEMORY_FACTOR = 640 << 20, 30
#: Processor time for any file, including the start [s], and bytes that take a second more.
_MIN_SECONDS, _BYTES_PER_SECOND = 6, 1_000_000


class _TooMuchError(Exception):
    """The file describes more than is plausible."""


def read_curves(path: str) -> Arrays:
    """All curves of a file, with default values or those of the first time."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(path)
    _limit_process(*(layer.realPath for layer in stage.GetUsedLayers()))
    found = _read_stage(stage)
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    others: Counter[str] = Counter()
    curves_prims: list[Arrays] = []
    points = 0
    walk = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
    for prims, prim in enumerate(walk):
        if prims > MAX_PRIMS:
            raise _TooMuchError(f"it has more than {MAX_PRIMS:,} prims with all instances")
        if prim.IsA(UsdGeom.BasisCurves):
            curves = _read_curves_prim(prim)
            points += len(curves.get("points", ())) * max(len(_times(prim)), 1)
            if points > MAX_POINTS:
                raise _TooMuchError(f"it has more than {MAX_POINTS:,} points in all frames")
            matrix = np.array(cache.GetLocalToWorldTransform(prim), np.float64)
            curves_prims.append(curves | {"matrix": matrix} | _motion(prim, curves))
        elif prim.IsA(UsdGeom.PointInstancer):
            others["PointInstancer"] += 1
            walk.PruneChildren()
        elif prim.IsA(UsdGeom.Gprim):
            others[str(prim.GetTypeName())] += 1
    found["others"] = np.array(sorted(others), np.str_)
    found["other_counts"] = np.array([others[kind] for kind in sorted(others)], np.int64)
    return found | pack_prims(curves_prims)


def pack_prims(prims: list[Arrays]) -> Arrays:
    """The arrays of many prims as a few, since each array in a file takes longer than a prim:
    arrays of one name, type and shape are joined, texts become one document. Empties the prims.

    "texts": JSON as bytes, for each prim {name: text or texts}. "layouts": JSON as bytes, the name
    and the dimensions of each K; "K/values": the rows of all prims that have it, "K/prims": which
    these are, "K/rows": how many rows each has.
    """
    texts: list[dict[str, Any]] = []
    numbers: dict[tuple[str, str, int, tuple[int, ...]], list[int]] = {}
    for number, prim in enumerate(prims):
        texts.append({name: a.tolist() for name, a in prim.items() if a.dtype.kind == "U"})
        for name, array in prim.items():
            if array.dtype.kind != "U":
                layout = name, array.dtype.str, array.ndim, array.shape[1:]
                numbers.setdefault(layout, []).append(number)
    found = {"texts": _as_json(texts), "layouts": _as_json([(n, d) for n, _, d, _ in numbers])}
    for key, ((name, *_), having) in enumerate(numbers.items()):
        rows = [np.atleast_1d(prims[number].pop(name)) for number in having]
        found[f"{key}/values"] = np.concatenate(rows)
        found[f"{key}/prims"] = np.array(having, np.int64)
        found[f"{key}/rows"] = np.array([len(each) for each in rows], np.int64)
    return found


def unpack_prims(arrays: Arrays) -> list[Arrays]:
    """The arrays of each prim again, by their names."""
    prims = [
        {name: np.array(text, np.str_) for name, text in each.items()}
        for each in json.loads(arrays["texts"].tobytes())
    ]
    for key, (name, dimensions) in enumerate(json.loads(arrays["layouts"].tobytes())):
        values, ends = arrays[f"{key}/values"], np.cumsum(arrays[f"{key}/rows"]).tolist()
        starts = [0, *ends[:-1]]
        for number, start, end in zip(arrays[f"{key}/prims"].tolist(), starts, ends, strict=True):
            prims[number][name] = values[start:end] if dimensions else values[start]
    return prims


def _as_json(content: object) -> NDArray[Any]:
    return np.frombuffer(json.dumps(content).encode(), np.uint8)


def _read_stage(stage: Any) -> Arrays:
    from pxr import UsdGeom

    prim = stage.GetDefaultPrim()
    names, version = ("", ""), (-1, -1)
    if prim:
        names = prim.GetName(), prim.GetDisplayName()
        parts = [prim.GetAttribute(f"userProperties:groom_version_{each}").Get() for each in _PARTS]
        if all(isinstance(part, int) for part in parts):
            version = abs(parts[0]), abs(parts[1])
    return {
        "up": np.array(str(UsdGeom.GetStageUpAxis(stage))),
        "unit": np.array(float(UsdGeom.GetStageMetersPerUnit(stage))),
        "has_unit": np.array(bool(stage.HasAuthoredMetadata("metersPerUnit"))),
        "prim_names": np.array(names, np.str_),
        "version": np.array(version, np.int64),
    }


def _read_curves_prim(prim: Any) -> Arrays:
    from pxr import UsdGeom

    curves, primvars = UsdGeom.BasisCurves(prim), UsdGeom.PrimvarsAPI(prim)
    traits = [_value(curves.GetWrapAttr()), _value(curves.GetTypeAttr())]
    traits += [_value(curves.GetBasisAttr()), curves.GetWidthsInterpolation()]
    values = {
        "points": _value(curves.GetPointsAttr()),
        "counts": _value(curves.GetCurveVertexCountsAttr()),
        "widths": _value(curves.GetWidthsAttr()),
        "name": prim.GetName(),
        "path": str(prim.GetPath()),
        "traits": [str(trait) for trait in traits],
    }
    for name in PRIMVARS:
        primvar = primvars.GetPrimvar(name)
        if primvar and primvar.HasValue():
            values[f"primvar/{name}"] = _flattened(primvar)
            values[f"interpolation/{name}"] = str(primvar.GetInterpolation())
    arrays = {name: _array(value) for name, value in values.items()}
    return {name: array for name, array in arrays.items() if array is not None}


def _times(prim: Any) -> list[float]:
    """The times at which a prim's points or the transforms above it are given; none if still."""
    from pxr import UsdGeom

    times = set(UsdGeom.BasisCurves(prim).GetPointsAttr().GetTimeSamples())
    above = prim
    while above:  # scopes and prims without a type may lie between
        if above.IsA(UsdGeom.Xformable):
            times |= set(UsdGeom.Xformable(above).GetTimeSamples())
        above = above.GetParent()
    return sorted(times) if len(times) > 1 else []


def _motion(prim: Any, curves: Arrays) -> Arrays:
    from pxr import UsdGeom

    times, attribute = _times(prim), UsdGeom.BasisCurves(prim).GetPointsAttr()
    if not times or "points" not in curves:
        return {}
    rate = prim.GetStage().GetTimeCodesPerSecond()
    positions, matrices = [], []
    found: Arrays = {}
    for time in times:
        here = _array(attribute.Get(time))
        if here is None or here.shape != curves["points"].shape:
            found["ended"] = np.array(time / rate)
            break
        positions.append(here.astype(np.float32))
        place = UsdGeom.XformCache(time).GetLocalToWorldTransform(prim)
        matrices.append(np.array(place, np.float64))
    found["times"] = np.array(times[: len(positions)], np.float64) / rate
    found["motion"] = np.array(positions, np.float32).reshape(-1, *curves["points"].shape)
    found["matrices"] = np.array(matrices, np.float64).reshape(-1, 4, 4)
    return found


def _value(attribute: Any) -> Any:
    """An attribute's default value, or its first time sample where it has only these."""
    from pxr import Usd

    value = attribute.Get()
    return attribute.Get(Usd.TimeCode.EarliestTime()) if value is None else value


def _flattened(primvar: Any) -> Any:
    """A primvar's values without its indices."""
    from pxr import Usd

    value = primvar.ComputeFlattened(Usd.TimeCode.Default())
    return primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()) if value is None else value


def _array(value: Any) -> NDArray[Any] | None:
    """Numbers or texts; None for values of other kinds."""
    if value is None:
        return None
    if isinstance(value, str):
        return np.array(value)
    with contextlib.suppress(TypeError, ValueError):
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return array
        if isinstance(value, Iterable):  # tokens and the like
            return np.array([str(each) for each in value], np.str_)
    return None


def error_summary(error: BaseException) -> str:
    """An error of the library in one line, without where in its code it was."""
    try:
        text = str(error)
    except UnicodeDecodeError:  # it quotes bytes of a damaged text
        text = ""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    last = lines[-1] if lines else type(error).__name__
    return last.rpartition("-- ")[2].strip("'. ")


def _limit_process(*paths: str) -> None:
    """Limit memory and time of this process by the size of these files; only on Linux, which tells
    how much memory it has.

    Only memory that it may write to is limited. Of its address space, libraries and stacks of
    threads take a gigabyte and use little of it.
    """
    if not sys.platform.startswith("linux"):
        return
    import resource

    size = sum(os.path.getsize(path) for path in paths if os.path.isfile(path))
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[5])
    limits = {
        resource.RLIMIT_CPU: _MIN_SECONDS + size // _BYTES_PER_SECOND,
        resource.RLIMIT_DATA: pages * resource.getpagesize() + _BASE_MEMORY + _MEMORY_FACTOR * size,
    }
    for limit, value in limits.items():
        _, hard_limit = resource.getrlimit(limit)
        resource.setrlimit(limit, (value, hard_limit))


def _main(path: str, result: str) -> int:
    from pxr import Tf

    _limit_process(path)
    try:
        found = read_curves(path)
        with open(result, "wb") as file:
            np.savez(file, allow_pickle=False, **found)
    except OSError:
        return EXIT_NO_SPACE
    except (Tf.ErrorException, _TooMuchError, RuntimeError, ValueError, MemoryError) as error:
        print(ascii(error_summary(error)), file=sys.stderr)
        return EXIT_REPORTED
    return 0


if __name__ == "__main__":
    code = _main(*sys.argv[-2:])
    sys.stderr.flush()
    os._exit(code)  # at once: the library's own shutdown may fail on what it has read
