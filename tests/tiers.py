"""Which tests a commit has to pass: all but those that are marked `slow`, see pyproject.toml."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def few_in_commits(cases: Iterable[Any], count: int = 1) -> list[Any]:
    """Cases for `parametrize`: the first so many for every commit, the others are slow."""
    return [case if number < count else _slow(case) for number, case in enumerate(cases)]


def _slow(case: Any) -> Any:
    values, marks, name = ((case,), (), None) if not hasattr(case, "marks") else case
    return pytest.param(*values, marks=[*marks, pytest.mark.slow], id=name)
