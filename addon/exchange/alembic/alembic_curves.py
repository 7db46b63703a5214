"""The curves of an Alembic file as plain arrays; also a program of its own, for another process.

    python alembic_curves.py FILE RESULT.npz

Alembic's library may crash, or ask for all memory, on a damaged file. So this module imports no
other of ours: it can be run by its path in a process that may die. The result has, for each curves
object N in the file's order,

    N/name
    N/matrix                      (4, 4), takes row vectors to the world
    N/points, N/counts, N/basis, N/is_closed
    N/widths                      where there are some
    N/groom_*                     as the file has them
    N/times                       [s], only of curves that move, as are the next two
    N/motion                      (times, points, 3) in the world, while counts are the same
    N/ended                       the time from which on they are others, if there is such a time

and of the whole file "application", and "groom_*" of the top object.
"""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Arrays = dict[str, NDArray[Any]]

#: Memory that the process may take beside ten times the file's size [bytes].
MEMORY = 4 << 30
#: Maximum depth of objects, which form a cycle in some damaged files.
MAX_DEPTH = 64
#: Maximum samples of motion: nearly seven minutes at 24 frames a second.
MAX_TIMES = 10_000
#: Exit codes, as `run_reader` expects them: after an error that is reported on stderr; where the
#: results cannot be written.
EXIT_REPORTED, EXIT_NO_SPACE = 3, 4

#: In Alembic's enumerations. Curves of other bases run through their points, or near them.
_CUBIC, _BEZIER, _PERIODIC = 0, 1, 1
_VECTORS = {2: "IV2fArrayProperty", 3: "IV3fArrayProperty"}


def read_curves(path: str) -> Arrays:
    """All curves of a file, at the first of their samples and at all others.

    Raises:
        ImportError: no alembic3d. RuntimeError, ValueError: a file that the library cannot read.
    """
    from alembic3d import Abc

    archive = Abc.IArchive(path)
    found: Arrays = {}
    application = Abc.GetArchiveInfo(archive).get("appName", "")
    found["application"] = np.array(str(application))
    _walk(archive.getTop(), (), found, 0)
    return found


def _walk(thing: Any, parents: tuple[Any, ...], found: Arrays, depth: int) -> None:
    """Args:
    above: the schemas of the transforms above it, the outermost first.
    """
    from alembic3d import Abc, AbcGeom

    if depth > MAX_DEPTH:
        raise ValueError(f"its objects lie more than {MAX_DEPTH} deep")
    meta = thing.getMetaData()
    if AbcGeom.ICurves.matches(meta):
        number = sum(name.endswith("/points") for name in found)
        schema = Abc.ICompoundProperty(thing.getProperties(), ".geom")
        found[f"{number}/name"] = np.array(thing.getName())
        found[f"{number}/matrix"] = _matrix(parents)
        _read_geometry(schema, f"{number}/", found)
        _read_motion(schema, parents, f"{number}/", found)
        _read_user(schema, found)
    elif AbcGeom.IXform.matches(meta):
        _read_user(Abc.ICompoundProperty(thing.getProperties(), ".xform"), found)
        place = AbcGeom.IXform(thing, Abc.WrapExistingFlag.kWrapExisting).getSchema()
        parents = (*parents, place)
    for child in thing.children:
        _walk(child, parents, found, depth + 1)


def _matrix(parents: tuple[Any, ...], time: float | None = None) -> NDArray[np.float64]:
    """(4, 4) that takes row vectors to the world, at a time, or at the first."""
    matrix = np.eye(4)
    for place in parents:
        if not place.getValue().getInheritsXforms():
            matrix = np.eye(4)
        selectors, fraction = _bracketing_samples(place, time)
        own = [
            np.array([list(row) for row in place.getValue(*selector).getMatrix()], np.float64)
            for selector in selectors
        ]
        matrix = _interpolated(own, fraction) @ matrix
    return matrix


def _bracketing_samples(moving: Any, time: float | None) -> tuple[list[tuple[Any, ...]], float]:
    """Selectors of the samples before and after a time, and how far it is between them, 0 to 1;
    one selector where the time is that of a sample, or beyond all.

    The library itself only gives the nearest sample.
    """
    from alembic3d import Abc

    if time is None or moving.isConstant():
        return [()], 0.0
    sampling, count = moving.getTimeSampling(), moving.getNumSamples()
    numbers = {sampling.getFloorIndex(time, count), sampling.getCeilIndex(time, count)}
    times = [float(sampling.getSampleTime(number)) for number in sorted(numbers)]
    fraction = (time - times[0]) / (times[1] - times[0]) if len(times) > 1 else 0.0
    return [(Abc.ISampleSelector(each),) for each in times], fraction


def _interpolated(samples: list[NDArray[Any]], fraction: float) -> NDArray[Any]:
    """Values interpolated linearly between two samples."""
    return samples[0] if len(samples) == 1 else samples[0] + (samples[1] - samples[0]) * fraction


def _read_motion(schema: Any, parents: tuple[Any, ...], prefix: str, found: Arrays) -> None:
    from alembic3d import Abc

    headers = {header.getName(): header for header in schema.propertyheaders}
    if "P" not in headers or "nVertices" not in headers:
        return
    points, counts = (Abc.IArrayProperty(schema, name) for name in ("P", "nVertices"))
    moving = [each for each in (points, *parents) if not each.isConstant()]
    if not moving:
        return
    times = np.unique(np.concatenate([_times(each) for each in moving]))
    if len(times) > MAX_TIMES:
        raise ValueError(f"it has more than {MAX_TIMES:,} frames")
    first, positions = found[prefix + "counts"], []
    for time in times.tolist():
        selectors, fraction = _bracketing_samples(points, time)
        here = [
            _values(schema, headers["P"], *selector).astype(np.float64) for selector in selectors
        ]
        own = [np.array(counts.getValue(*selector)) for selector in selectors]
        is_same = [len(each) == len(found[prefix + "points"]) for each in here]
        if not all(is_same) or not all(np.array_equal(each, first) for each in own):
            found[prefix + "ended"] = np.array(time)
            break
        matrix = _matrix(parents, time)
        with np.errstate(over="ignore", invalid="ignore"):
            placed = _interpolated(here, fraction) @ matrix[:3, :3] + matrix[3, :3]
            positions.append(placed.astype(np.float32))
    found[prefix + "times"] = times[: len(positions)]
    found[prefix + "motion"] = np.array(positions, np.float32)


def _times(moving: Any) -> NDArray[np.float64]:
    """The times of a property's samples [s]."""
    sampling = moving.getTimeSampling()
    count = moving.getNumSamples()
    return np.array([sampling.getSampleTime(number) for number in range(count)], np.float64)


def _read_geometry(schema: Any, prefix: str, found: Arrays) -> None:
    from alembic3d import Abc

    for header in schema.propertyheaders:
        name = header.getName()
        ours = {"P": "points", "nVertices": "counts", "width": "widths"}.get(name)
        if ours is not None:
            found[prefix + ours] = _values(schema, header)
        elif name == "curveBasisAndType":
            kind, wrap, basis, _ = tuple(Abc.IScalarProperty(schema, name).getValue())
            is_bezier = kind == _CUBIC and basis == _BEZIER
            found[prefix + "basis"] = np.array("bezier" if is_bezier else "linear")
            found[prefix + "is_closed"] = np.array(wrap == _PERIODIC)
        elif name == ".arbGeomParams":
            _read_attributes(schema, header, prefix, found)


def _read_user(schema: Any, found: Arrays) -> None:
    """The file's own version and tool, from the first object that has some."""
    for header in schema.propertyheaders:
        if header.getName() == ".userProperties" and "groom_version_major" not in found:
            _read_attributes(schema, header, "", found)


def _read_attributes(schema: Any, header: Any, prefix: str, found: Arrays) -> None:
    from alembic3d import Abc

    parent = Abc.ICompoundProperty(schema, header.getName())
    for each in parent.propertyheaders:
        if each.getName().startswith("groom_"):
            values = _values(parent, each)
            # quaternions and boxes, for which numpy has no type, are text in the result
            is_plain = values.dtype.kind != "O"
            found[prefix + each.getName()] = values if is_plain else values.astype(str)


def _values(parent: Any, header: Any, *selector: Any) -> NDArray[Any]:
    """A property's first sample, or that of a time, of any type; indexed ones are expanded."""
    from alembic3d import Abc

    name = header.getName()
    if header.isCompound():
        inner = Abc.ICompoundProperty(parent, name)
        headers = {each.getName(): each for each in inner.propertyheaders}
        values, indices = (_values(inner, headers[each]) for each in (".vals", ".indices"))
        return values[indices]
    if header.isScalar():
        return np.array(Abc.IScalarProperty(parent, name).getValue())
    # Imath has no buffers of colours and points of other kinds: all are read as vectors
    kind = header.getDataType()
    typed = _VECTORS.get(kind.getExtent()) if kind.getPod().name == "kFloat32POD" else None
    if typed is None:
        return np.array(Abc.IArrayProperty(parent, name).getValue(*selector))
    no_matching = Abc.Argument(Abc.SchemaInterpMatching.kNoMatching)
    return np.array(getattr(Abc, typed)(parent, name, no_matching).getValue(*selector))


def _limit_memory(path: str) -> None:
    """Limit the memory of this process, so that a file with wrong counts cannot take all of it.

    Windows has no such limit, macOS refuses it. On Linux the memory that the process has already is
    added, which is much where it is Blender itself.
    """
    try:
        import resource
    except ImportError:
        return
    size = MEMORY + 10 * os.path.getsize(path)
    if sys.platform.startswith("linux"):
        with open("/proc/self/statm", encoding="ascii") as pages:
            size += int(pages.read().split()[0]) * resource.getpagesize()
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (size, size))


def _main(path: str, result: str) -> int:
    _limit_memory(path)
    try:
        found = read_curves(path)
    except (ImportError, RuntimeError, ValueError, LookupError, MemoryError) as error:
        print(str(error).strip() or type(error).__name__, file=sys.stderr)
        return EXIT_REPORTED
    try:
        with open(result, "wb") as file:
            np.savez(file, allow_pickle=False, **found)
    except OSError:
        return EXIT_NO_SPACE
    return 0


if __name__ == "__main__":
    code = _main(*sys.argv[-2:])
    sys.stderr.flush()
    os._exit(code)  # at once: the library's own shutdown may fail on what it has read
