"""Shading: Marschner's fibre against traced rays and Cycles, its tables, its GLSL, its cost.

See the modules `_shading_*` for what is compared with what. Writes out/shading_sheet.png, a ball of
hair beside Cycles'.

make bench NAME=shading          about five minutes
"""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu
import numpy as np
from _shading_ball import ball_figures
from _shading_cost import cost_figures
from _shading_cycles import lobe_figures
from _shading_glsl import glsl_relative_error
from _shading_reference import reference_figures


def main() -> None:
    gpu.init()
    found: dict[str, Any] = {
        **cost_figures(),
        **reference_figures(),
        "glsl_relative_error": glsl_relative_error(),
        **lobe_figures(),
        **ball_figures(),
    }
    for name, value in found.items():
        print(f"{name:40} {format(value, '14.6f') if isinstance(value, float) else value}")
    rounded = {k: round(v, 6) if isinstance(v, float) else v for k, v in found.items()}
    print(json.dumps({**rounded, **machine()}))


def machine() -> dict[str, str]:
    return {
        "reference": "rays through a dielectric cylinder; Cycles' Principled Hair (Chiang); "
        "numpy in float64",
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main()
