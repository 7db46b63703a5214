"""What many tests make of the same things is made once in a process, and looked up afterwards."""

from __future__ import annotations

import functools
import hashlib
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hairloom.addon.params import SettingsMap

#: results of each function that are kept
CAPACITY = 40
_PLAIN = (str, bytes, bool, int, float, type(None), Enum, np.generic, SettingsMap)


class Unknown(Exception):
    """A value of which nobody can say what is in it."""


def digest(*values: Any) -> bytes:
    """The same for values of the same content.

    Raises:
        Unknown: there is one that is neither plain, an array nor made of such.
    """
    found = hashlib.blake2b(digest_size=16)
    for value in values:
        _take(found, value)
    return found.digest()


def _take(found: Any, value: Any) -> None:
    found.update(type(value).__qualname__.encode() + b":")
    if isinstance(value, np.ndarray) and value.dtype != object:
        found.update(f"{value.dtype}{value.shape}".encode())
        found.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value) and not isinstance(value, type):
        for each in fields(value):
            _take(found, getattr(value, each.name))
    elif isinstance(value, Mapping):
        _take(found, list(value.items()))
    elif isinstance(value, tuple | list):
        found.update(f"{len(value)}".encode())
        for each in value:
            _take(found, each)
    elif isinstance(value, _PLAIN):
        found.update(repr(value).encode() + b";")
    else:
        raise Unknown(type(value))


def once(
    patch: pytest.MonkeyPatch,
    module: ModuleType,
    name: str,
    also: Callable[[], Any] = lambda: None,
) -> None:
    """Let a function of a module make what it makes of the same arguments once.

    Args:
        also: what else it depends on.
    """
    make = getattr(module, name)
    made: OrderedDict[bytes, Any] = OrderedDict()

    @functools.wraps(make)
    def found(*arguments: Any, **named: Any) -> Any:
        try:
            key = digest(also(), arguments, named)
        except Unknown:
            return make(*arguments, **named)
        if key not in made:
            made[key] = make(*arguments, **named)
        result = made[key]
        made.move_to_end(key)
        if len(made) > CAPACITY:
            made.popitem(last=False)
        return result

    patch.setattr(module, name, found)
