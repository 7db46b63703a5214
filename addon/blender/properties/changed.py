"""Notifies subscribers of changed properties, so that properties need not import their users."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import bpy

type Listener = Callable[[bpy.types.ID], None]

#: kind of change -> its subscribers
_listeners: dict[str, list[Listener]] = {
    "settings": [],
    "grow": [],
    "display": [],
    "bake": [],
    "hair_scene": [],
    "passes": [],
}
#: changes (kind, data-block) that wait for the end of `as_one_change`; None outside of it
_PENDING: ContextVar[list[tuple[str, bpy.types.ID]] | None] = ContextVar(
    "pending changes", default=None
)


def subscribe(kind: str, listener: Listener) -> None:
    """Call the listener with the data-block whose properties of this kind change."""
    _listeners[kind].append(listener)


def unsubscribe(kind: str, listener: Listener) -> None:
    _listeners[kind].remove(listener)


def settings(owner: bpy.types.ID) -> None:
    """A setting of a groom or of its object was changed."""
    _call("settings", owner)


def grow(owner: bpy.types.ID) -> None:
    """A setting by which hair grows was changed."""
    _call("grow", owner)


def display(owner: bpy.types.ID) -> None:
    """Blender's own strands were shown or hidden."""
    _call("display", owner)


def bake(owner: bpy.types.ID) -> None:
    """The folder of the bake, or whether it is shown, was changed."""
    _call("bake", owner)


def hair_scene(owner: bpy.types.ID) -> None:
    """Whether Hairloom draws the hair of a scene over its engine's pictures was changed."""
    _call("hair_scene", owner)


def passes(owner: bpy.types.ID) -> None:
    """The passes of a view layer were changed."""
    _call("passes", owner)


@contextmanager
def as_one_change() -> Iterator[None]:
    """All properties of a data-block that are set inside count as one change, at the end."""
    if _PENDING.get() is not None:
        yield
        return
    pending: list[tuple[str, bpy.types.ID]] = []
    token = _PENDING.set(pending)
    try:
        yield
    finally:
        _PENDING.reset(token)
        for kind, owner in pending:
            _call(kind, owner)


def _call(kind: str, owner: bpy.types.ID) -> None:
    pending = _PENDING.get()
    if pending is not None:
        if (kind, owner) not in pending:
            pending.append((kind, owner))
        return
    for listener in _listeners[kind]:
        listener(owner)
