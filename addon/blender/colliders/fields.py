"""Distance fields of meshes, each made once, beside the window's work where nobody may wait.

A field depends only on the mesh and its resolution, so it is found again by their hash: in the next
preview, by the next groom on the same head, by a bake. It is the same to the bit, whichever thread
builds it. That of the built-in head ships.
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

#: Fields that are kept though nothing may collide with them any more, 6 MB each by default.
KEPT = 8

_works: dict[str, ThreadWork[DistanceField]] = {}
#: threads that make hair ask for fields too
_lock = Lock()


class NotMadeYetError(Exception):
    """The field is being made; ask again when `is_made` says so."""


def field_of(
    surface: Surface, settings: DynamicsSettings, *, place: str, blocking: bool = True
) -> DistanceField:
    """The field of a closed mesh, which takes a second to make for the first time.

    Args:
        place: names it in messages.
        blocking: False: have it made in a thread, and do not wait for that.

    Raises:
        HairloomError: see `DistanceField.from_surface`.
        NotMadeYetError: it is being made, and nobody waits.
    """
    key = field_key(surface, settings)
    with _lock:
        work = _works.pop(key, None)
        if work is None:
            work = ThreadWork(lambda _: _made(surface, settings, key), "distance field")
        _works[key] = work  # now the youngest
    if blocking:
        work.wait()
        trim()
    elif not work.is_done:
        raise NotMadeYetError
    try:
        return work.result()
    except HairloomError as error:  # a surface that cannot be one stays so, under any name
        raise HairloomError(error.problem, place=place, remedy=error.remedy) from error
    except Exception:
        with _lock:
            _works.pop(key, None)  # as where memory ran out, which may go well the next time
        raise


def solid_of(head: Surface | None) -> DistanceField | None:
    """The field of what hair grows on, by default settings; None where that encloses nothing."""
    if head is None:
        return None
    try:
        return field_of(head, DynamicsSettings(), place="head")
    except HairloomError:
        return None


def are_made() -> bool:
    """Whether no field is being made."""
    with _lock:
        return all(work.is_done for work in _works.values())


def trim() -> None:
    """Keep the youngest only. Not while somebody waits for many: he could never have them all."""
    with _lock:
        made = [key for key, work in _works.items() if work.is_done]
        for key in made[:-KEPT]:
            del _works[key]


def forget() -> None:
    """Keep none."""
    with _lock:
        _works.clear()


def _made(surface: Surface, settings: DynamicsSettings, key: str) -> DistanceField:
    return shipped_field(surface, key) or DistanceField.from_surface(surface, settings)


def field_key(surface: Surface, settings: DynamicsSettings) -> str:
    """What a field depends on."""
    return digest(surface.positions, surface.triangles, settings.collider_resolution)
