"""Adding handlers to Blender's lists in bpy.app.handlers, and removing them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

#: one of the lists in bpy.app.handlers, and a handler for it
type HandlerEntry = tuple[list[Any], Callable[..., None]]


def append(entries: Iterable[HandlerEntry]) -> None:
    for handlers, handler in entries:
        handlers.append(handler)


def remove(entries: Iterable[HandlerEntry]) -> None:
    """Remove handlers that are still there: any script may have emptied a list."""
    for handlers, handler in entries:
        if handler in handlers:
            handlers.remove(handler)
