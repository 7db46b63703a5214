"""A cache for costly functions that many tests call with the same arguments: each result is
computed once per process."""

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

#: results that are kept per function
CAPACITY = 40
_PLAIN = (str, bytes, bool, int, float, type(None), Enum, np.generic, SettingsMap)


class Unknown(Exception):
    """A value whose content cannot be hashed."""


def digest(*values: Any) -> bytes:
    """A digest that is equal for values of equal content.

    Raises:
        Unknown: a value is neither plain, nor an array, nor composed of these.
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
    """Cache a module's function by the content of its arguments.

    Args:
        also: everything else that its result depends on.
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
