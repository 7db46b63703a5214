"""The curves of an Alembic file as plain arrays; also a program of its own, for another process.

    python alembic_curves.py FILE RESULT.npz

Alembic's library may crash, or ask for all memory, on a damaged file. So this module imports no
other of ours: it can be run by its path in a process that may die. The result has, for each curves
object N in the file's order, "N/name", "N/matrix" (4, 4) that takes row vectors to the world,
"N/points", "N/counts", "N/widths" where there are some, and "N/groom_*" as the file has them; and
what the file says of itself: "application", and "groom_*" of the top object.
"""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Arrays = dict[str, NDArray[Any]]

#: What the process may take beside ten times the file's size [bytes].
MEMORY = 4 << 30
#: Objects below each other; a damaged file may have them in a circle.
DEEPEST = 64
#: Exit codes, as `run_reader` expects them: after an error that is reported on stderr; where the
#: results cannot be written.
REPORTED, NO_ROOM = 3, 4

_VECTORS = {2: "IV2fArrayProperty", 3: "IV3fArrayProperty"}


def read_curves(path: str) -> Arrays:
    """All curves of a file, at the first of their samples.

    Raises:
        ImportError: no alembic3d. RuntimeError, ValueError: a file that the library cannot read.
    """
    from alembic3d import Abc

    archive = Abc.IArchive(path)
    found: Arrays = {}
    application = Abc.GetArchiveInfo(archive).get("appName", "")
    found["application"] = np.array(str(application))
    _walk(archive.getTop(), np.eye(4), found, 0)
    return found


def _walk(thing: Any, matrix: NDArray[np.float64], found: Arrays, depth: int) -> None:
    from alembic3d import Abc, AbcGeom

    if depth > DEEPEST:
        raise ValueError(f"its objects lie more than {DEEPEST} deep")
    meta = thing.getMetaData()
    if AbcGeom.ICurves.matches(meta):
        number = sum(name.endswith("/points") for name in found)
        schema = Abc.ICompoundProperty(thing.getProperties(), ".geom")
        found[f"{number}/name"] = np.array(thing.getName())
        found[f"{number}/matrix"] = matrix
        _read_geometry(schema, f"{number}/", found)
        _read_user(schema, found)
    elif AbcGeom.IXform.matches(meta):
        _read_user(Abc.ICompoundProperty(thing.getProperties(), ".xform"), found)
        place = AbcGeom.IXform(thing, Abc.WrapExistingFlag.kWrapExisting).getSchema().getValue()
        matrix = np.array([list(row) for row in place.getMatrix()], np.float64) @ matrix
    for child in thing.children:
        _walk(child, matrix, found, depth + 1)


def _read_geometry(schema: Any, prefix: str, found: Arrays) -> None:
    from alembic3d import Abc

    for header in schema.propertyheaders:
        name = header.getName()
        ours = {"P": "points", "nVertices": "counts", "width": "widths"}.get(name)
        if ours is not None:
            found[prefix + ours] = _values(schema, header)
            if ours == "points":
                samples = Abc.IArrayProperty(schema, name).getNumSamples()
                found[prefix + "samples"] = np.array(samples)
        elif name == ".arbGeomParams":
            _read_attributes(schema, header, prefix, found)


def _read_user(schema: Any, found: Arrays) -> None:
    """The file's own version and tool; the first object that has some is believed."""
    for header in schema.propertyheaders:
        if header.getName() == ".userProperties" and "groom_version_major" not in found:
            _read_attributes(schema, header, "", found)


def _read_attributes(schema: Any, header: Any, prefix: str, found: Arrays) -> None:
    from alembic3d import Abc

    parent = Abc.ICompoundProperty(schema, header.getName())
    for each in parent.propertyheaders:
        if each.getName().startswith("groom_"):
            found[prefix + each.getName()] = _values(parent, each)


def _values(parent: Any, header: Any) -> NDArray[Any]:
    """A property's first sample, whatever its type; indexed ones are expanded."""
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
        return np.array(Abc.IArrayProperty(parent, name).getValue())
    anyhow = Abc.Argument(Abc.SchemaInterpMatching.kNoMatching)
    return np.array(getattr(Abc, typed)(parent, name, anyhow).getValue())


def _limit_memory(path: str) -> None:
    """A file whose counts lie must not take all memory; only where the system sees to it: Windows
    has no such limit, macOS refuses it. Blender itself, where it is this process, has much."""
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
        return REPORTED
    try:
        with open(result, "wb") as file:
            np.savez(file, allow_pickle=False, **found)
    except OSError:
        return NO_ROOM
    return 0


if __name__ == "__main__":
    code = _main(*sys.argv[-2:])
    sys.stderr.flush()
    os._exit(code)  # at once: the library's own end may fail on what it has read
