"""How benchmarks begin, and tell what they found: a line a figure, then all of it as JSON."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from typing import Any

import bpy
import gpu
import numpy as np

#: that of a figure in the JSON
DIGITS = 6


def start() -> None:
    """Blender as a module can draw after this."""
    gpu.init()


def tell(found: Mapping[str, Any], reference: str) -> None:
    """Print the figures. `reference`: what ratios and errors are against."""
    for name, value in found.items():
        print(f"{name:40} {f'{value:14.{DIGITS}f}' if isinstance(value, float) else value}")
    print(json.dumps({**_rounded(found), "reference": reference, **machine()}))


def machine() -> dict[str, str]:
    """What computed and drew; `gpu` must be there."""
    return {
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def _rounded(found: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: round(value, DIGITS) if isinstance(value, float) else value
        for name, value in found.items()
    }
