"""Suspends all reactions to Blender's events while a bake or an export steps through frames."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_is_suspended = False


@contextmanager
def suspended() -> Iterator[None]:
    """Ignore Blender's events and changed properties inside the block."""
    global _is_suspended
    before, _is_suspended = _is_suspended, True
    try:
        yield
    finally:
        _is_suspended = before


def is_suspended() -> bool:
    return _is_suspended
