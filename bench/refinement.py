"""Refinement: children on the CPU against Blender's node, detail in the picture against fixed.

See `_refinement_node` and `_refinement_views` for what is compared with what.

make bench NAME=refinement          about two minutes
"""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu
import numpy as np
from _refinement_node import node_figures
from _refinement_views import view_figures


def main() -> None:
    gpu.init()
    found: dict[str, Any] = {**view_figures(), **node_figures()}
    for name, value in found.items():
        print(f"{name:40} {format(value, '14.4f') if isinstance(value, float) else value}")
    rounded = {k: round(v, 5) if isinstance(v, float) else v for k, v in found.items()}
    print(json.dumps({**rounded, **machine()}))


def machine() -> dict[str, str]:
    return {
        "reference": "Blender's Interpolate Hair Curves node; one piece a segment; the exact curve",
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main()
