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
_PLAIN_TYPES = (str, bytes, bool, int, float, type(None), Enum, np.generic, SettingsMap)


class UnhashableError(Exception):
    """A value whose content cannot be hashed."""


def digest(*values: Any) -> bytes:
    """A digest that is equal for values of equal content.

    Raises:
        Unknown: a value is neither plain, nor an array, nor composed of these.
    """
    hasher = hashlib.blake2b(digest_size=16)
    for value in values:
        _update_digest(hasher, value)
    return hasher.digest()


def _update_digest(hasher: Any, value: Any) -> None:
    hasher.update(type(value).__qualname__.encode() + b":")
    if isinstance(value, np.ndarray) and value.dtype != object:
        hasher.update(f"{value.dtype}{value.shape}".encode())
        hasher.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value) and not isinstance(value, type):
        for each in fields(value):
            _update_digest(hasher, getattr(value, each.name))
    elif isinstance(value, Mapping):
        _update_digest(hasher, list(value.items()))
    elif isinstance(value, tuple | list):
        hasher.update(f"{len(value)}".encode())
        for each in value:
            _update_digest(hasher, each)
    elif isinstance(value, _PLAIN_TYPES):
        hasher.update(repr(value).encode() + b";")
    else:
        raise UnhashableError(type(value))


def cache_function(
    patch: pytest.MonkeyPatch,
    module: ModuleType,
    name: str,
    extra_key: Callable[[], Any] = lambda: None,
) -> None:
    """Cache a module's function by the content of its arguments.

    Args:
        also: everything else that its result depends on.
    """
    compute = getattr(module, name)
    results: OrderedDict[bytes, Any] = OrderedDict()

    @functools.wraps(compute)
    def cached(*arguments: Any, **named: Any) -> Any:
        try:
            key = digest(extra_key(), arguments, named)
        except UnhashableError:
            return compute(*arguments, **named)
        if key not in results:
            results[key] = compute(*arguments, **named)
        result = results[key]
        results.move_to_end(key)
        if len(results) > CAPACITY:
            results.popitem(last=False)
        return result

    patch.setattr(module, name, cached)
