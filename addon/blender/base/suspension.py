"""Reacting to nothing while a bake or an export goes through the frames."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_is_suspended = False


@contextmanager
def suspended() -> Iterator[None]:
    """React to none of Blender's events, nor to changed properties."""
    global _is_suspended
    _is_suspended = True
    try:
        yield
    finally:
        _is_suspended = False


def is_suspended() -> bool:
    return _is_suspended
