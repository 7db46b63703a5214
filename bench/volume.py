"""Hair as a volume: shadows against counting strands, scattering against Cycles, transparency
against sorting, the cost beside EEVEE.

See `_volume_shadows`, `_volume_balls`, `_volume_sintel`, `_volume_transparency` and `_volume_cost`
for what is compared with what.

make bench NAME=volume          some minutes; writes out/volume_sheet.png and out/volume_sintel.png
"""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu
import numpy as np
from _volume_balls import ball_figures
from _volume_cost import cost_figures
from _volume_shadows import shadow_figures
from _volume_sintel import sintel_figures
from _volume_transparency import transparency_figures


def main() -> None:
    gpu.init()
    found: dict[str, Any] = {
        **cost_figures(),
        **shadow_figures(),
        **transparency_figures(),
        **ball_figures(),
        **sintel_figures(),
    }
    for name, value in found.items():
        print(f"{name:40} {value:14.4f}")
    print(json.dumps({**{k: round(v, 5) for k, v in found.items()}, **machine()}))


def machine() -> dict[str, str]:
    return {
        "reference": "strands counted one by one; Cycles' Principled Hair, path traced; ribbons "
        "sorted; EEVEE at 1 sample",
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main()
