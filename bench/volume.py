"""Hair as a volume: shadows against counting strands, scattering against Cycles.

See `_volume_shadows` and `_volume_balls` for what is compared with what.

make bench NAME=volume          about three minutes; writes out/volume_sheet.png
"""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu
import numpy as np
from _volume_balls import ball_figures
from _volume_shadows import shadow_figures


def main() -> None:
    gpu.init()
    found: dict[str, Any] = {**shadow_figures(), **ball_figures()}
    for name, value in found.items():
        print(f"{name:40} {value:14.4f}")
    print(json.dumps({**{k: round(v, 5) for k, v in found.items()}, **machine()}))


def machine() -> dict[str, str]:
    return {
        "reference": "strands counted one by one; Cycles' Principled Hair, path traced",
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main()
