"""How benchmarks start and report: a line for each figure, then all of them as JSON."""

from __future__ import annotations

import json
import operator
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

import bpy
import gpu
import numpy as np

from hairloom.addon.render.strand_layers import is_software

#: decimal places of figures
DIGITS = 6


def start() -> None:
    """Let Blender as a module draw."""
    gpu.init()


def measured(
    parts: Mapping[str, Callable[[], Mapping[str, Any]]], names: Sequence[str]
) -> dict[str, Any]:
    """The figures of these parts of a benchmark, or of all if none is named."""
    return {key: value for name in chosen(names, parts) for key, value in parts[name]().items()}


def chosen(names: Sequence[str], parts: Iterable[str]) -> list[str]:
    """These parts of a benchmark, or all if none is named; exits if one is unknown."""
    known = list(parts)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SystemExit(f"There is no part {', '.join(unknown)}; there are {', '.join(known)}.")
    return list(names) or known


def report(
    found: Mapping[str, Any],
    reference: str,
    *,
    max_limits: Mapping[str, float] | None = None,
    min_limits: Mapping[str, float] | None = None,
) -> int:
    """Print the figures and the missed limits; the exit status: 1 if a figure misses its limit, or
    if there is no figure.

    found: figures by name; None: not measured. reference: what ratios and errors are relative to.
    max_limits, min_limits: limits by name, or by a pattern of names such as `*_seconds`; one that
    matches no figure is ignored. NaN misses every limit.
    """
    limits = _limits(found, max_limits or {}, operator.le) | _limits(
        found, min_limits or {}, operator.ge
    )
    missed = [name for name, limit in limits.items() if not limit.holds(found[name])]
    for name, value in found.items():
        shown = f"{value:14.{DIGITS}f}" if isinstance(value, float) else f"{value!s:>14}"
        limit_text = f"   {limits[name]}" if name in limits else ""
        print(f"{name:40} {shown}{limit_text}{', missed' if name in missed else ''}")
    about = {"limits": {name: str(limit) for name, limit in limits.items()}, "missed": missed}
    print(json.dumps({**_rounded(found), "reference": reference, **about, **machine()}), flush=True)
    return int(bool(missed) or not found)


@dataclass(frozen=True)
class _Limit:
    holds_for: Callable[[float, float], bool]
    value: float

    def holds(self, found: float) -> bool:
        return self.holds_for(found, self.value)

    def __str__(self) -> str:
        return f"at {'most' if self.holds_for is operator.le else 'least'} {self.value:,.10g}"


def _limits(
    found: Mapping[str, Any], patterns: Mapping[str, float], holds: Callable[[float, float], bool]
) -> dict[str, _Limit]:
    """The limits of measured figures whose names match a pattern."""
    return {
        name: _Limit(holds, value)
        for pattern, value in patterns.items()
        for name in found
        if found[name] is not None and fnmatchcase(name, pattern)
    }


def machine() -> dict[str, str | bool]:
    """The versions and the GPU behind the figures; call `start` first."""
    return {
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "is_software": is_software(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def _rounded(found: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: round(value, DIGITS) if isinstance(value, float) else value
        for name, value in found.items()
    }
