"""Which tests a commit has to pass: all but those that are marked `slow`, see pyproject.toml."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pytest


def few_in_commits(cases: Iterable[Any], count: int = 1) -> list[Any]:
    """Cases for `parametrize`: the first `count` for every commit, the others are slow."""
    return [case if number < count else _slow(case) for number, case in enumerate(cases)]


def few_by_name(cases: Mapping[str, Any], *slow: str) -> list[Any]:
    """Named cases for `parametrize`; those in `slow` are marked slow."""
    assert set(slow) <= set(cases)
    marks = {name: [pytest.mark.slow] if name in slow else [] for name in cases}
    return [pytest.param(case, marks=marks[name], id=name) for name, case in cases.items()]


def _slow(case: Any) -> Any:
    values, marks, name = ((case,), (), None) if not hasattr(case, "marks") else case
    return pytest.param(*values, marks=[*marks, pytest.mark.slow], id=name)
