"""The render engine: clean stills, the same everywhere, and animations that do not grow.

See the modules `_engine_...` for what is compared with what. The reference of stills is the same
scene at 1,024 samples.

make bench NAME=engine          some minutes
"""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu
import numpy as np
from _engine_frames import frame_figures
from _engine_picture import picture_figures
from _engine_shafts import shafts_figures
from _engine_skin import skin_figures


def main() -> None:
    gpu.init()
    found: dict[str, Any] = {
        **picture_figures(),
        **skin_figures(),
        **shafts_figures(),
        **frame_figures(),
    }
    for name, value in found.items():
        print(f"{name:40} {value:14.4f}")
    print(json.dumps({**{k: round(v, 5) for k, v in found.items()}, **machine()}))


def machine() -> dict[str, str]:
    return {
        "reference": "the same scene at 1,024 samples; another process; the tenth frame",
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main()
