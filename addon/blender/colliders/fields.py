"""Distance fields of meshes, each built once, in a thread if the caller cannot wait.

A field depends only on the mesh and its resolution, so it is cached by their hash: for the next
preview, the next groom on the same head, or a bake. It is bitwise the same, whichever thread builds
it. The field of the built-in head is shipped.
"""

from __future__ import annotations

from threading import Lock

from ...dynamics.colliders import DistanceField
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...strands import Surface
from ..base.digests import digest
from ..base.thread_work import ThreadWork
from .bust_field import shipped_field

#: Number of cached fields, in use or not; 6 MB each by default.
MAX_CACHED = 8

_works: dict[str, ThreadWork[DistanceField]] = {}
#: threads that build hair need fields too
_lock = Lock()


class NotReadyError(Exception):
    """It is being built; try again later. For fields, `are_ready` says when."""


def field_of(
    surface: Surface, settings: DynamicsSettings, *, place: str, blocking: bool = True
) -> DistanceField:
    """The field of a closed mesh, which takes a second to build the first time.

    Args:
        place: the mesh's name in messages.
        blocking: False: do not wait until a thread has made it.

    Raises:
        HairloomError: see `DistanceField.from_surface`.
        NotReadyError: it is being built, and the call is not blocking.
    """
    key = field_key(surface, settings)
    with _lock:
        work = _works.pop(key, None)
        if work is None:
            work = ThreadWork(lambda _: _build(surface, settings, key), "distance field")
        _works[key] = work  # last in the order of use
    if blocking:
        work.wait()
        trim()
    elif not work.is_done:
        raise NotReadyError
    try:
        return work.result()
    except HairloomError as error:  # stays cached, since the same surface would fail again
        raise error.at(place) from error
    except Exception:
        with _lock:
            _works.pop(key, None)  # another try may succeed, such as after memory ran out
        raise


def head_field_of(head: Surface | None) -> DistanceField | None:
    """The field of the mesh that hair grows on, with default settings; None if it has no inside."""
    if head is None:
        return None
    try:
        return field_of(head, DynamicsSettings(), place="head")
    except HairloomError:
        return None


def are_ready() -> bool:
    """Whether no field is being built."""
    with _lock:
        return all(work.is_done for work in _works.values())


def trim() -> None:
    """Drop all but the `MAX_CACHED` fields that were used last.

    Not to be called while a caller that does not block gathers more fields than that: it would
    never get them all.
    """
    with _lock:
        ready = [key for key, work in _works.items() if work.is_done]
        for key in ready[:-MAX_CACHED]:
            del _works[key]


def forget() -> None:
    """Drop all fields."""
    with _lock:
        _works.clear()


def _build(surface: Surface, settings: DynamicsSettings, key: str) -> DistanceField:
    return shipped_field(surface, key) or DistanceField.from_surface(surface, settings)


def field_key(surface: Surface, settings: DynamicsSettings) -> str:
    """The digest of everything that a field depends on."""
    return digest(surface.positions, surface.triangles, settings.collider_resolution)
