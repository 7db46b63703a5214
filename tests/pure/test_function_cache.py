"""Cached results equal those that a test would have computed itself."""

from __future__ import annotations

from types import ModuleType, SimpleNamespace
from typing import Any

import function_cache
import numpy as np
import pytest
from function_cache import CAPACITY, UnhashableError, cache_function, digest

from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.strands import StrandSet


def strands(end: float = 1.0, radius: float = 1.0) -> StrandSet:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, end]])
    return StrandSet(points, np.array([0, 2]), np.full(2, radius), np.zeros(1))


DIFFERENT = (
    strands(),
    strands(end=2.0),
    strands(radius=2.0),
    np.zeros((2, 3)),
    np.zeros((3, 2)),
    np.zeros((2, 3), np.float32),
    1,
    1.0,
    "1",
    None,
    (1, 2),
    (12,),
    ((1,), 2),
    {"a": 1},
    {"b": 1},
    AmbientSettings(),
    AmbientSettings(strength=0.5),
    SettingsMap(AmbientSettings(strength=0.5)),
    SettingsMap(AmbientSettings(strength=0.25)),
)


def test_what_differs_in_anything_is_another() -> None:
    assert len({digest(each) for each in DIFFERENT}) == len(DIFFERENT)
    assert digest(strands()) == digest(strands())


@pytest.mark.parametrize("value", [lambda: 1, SimpleNamespace(a=1), np.array([None]), {1}])
def test_what_nobody_can_look_into_is_unknown(value: Any) -> None:
    with pytest.raises(UnhashableError):
        digest(value)


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A module with a function that records its calls, and with `cells`, on which it depends."""
    module = ModuleType("one")
    module.calls, module.cells = [], 1

    def summed(values: Any, more: Any = None) -> float:
        module.calls.append(values)
        if more == "bad":
            raise ValueError(more)
        return float(np.sum(values)) + module.cells

    module.summed = summed
    cache_function(monkeypatch, module, "summed", extra_key=lambda: module.cells)
    return module


def test_the_same_is_made_once(module: Any) -> None:
    for _ in range(3):
        assert module.summed(np.arange(3.0)) == 4.0
    assert len(module.calls) == 1
    assert module.summed(np.arange(4.0)) == 7.0
    module.cells = 2
    assert module.summed(np.arange(3.0)) == 5.0
    assert len(module.calls) == 3


def test_what_fails_or_is_unknown_is_made_each_time(module: Any) -> None:
    for _ in range(2):
        with pytest.raises(ValueError, match="bad"):
            module.summed(np.arange(3.0), more="bad")
        assert module.summed(np.arange(3.0), more=lambda: 1) == 4.0
    assert len(module.calls) == 4


def test_only_the_latest_are_kept(module: Any) -> None:
    for number in range(CAPACITY + 1):
        module.summed(number)
    module.summed(CAPACITY)
    assert len(module.calls) == CAPACITY + 1
    module.summed(0)
    assert len(module.calls) == CAPACITY + 2


def test_a_function_is_itself_again_afterwards() -> None:
    with pytest.MonkeyPatch.context() as patch:
        cache_function(patch, function_cache, "digest")
        assert function_cache.digest is not digest
    assert function_cache.digest is digest
