"""Hair cards of Sintel: how long they take, order, occlusion, passes, and cards beside strands.

See `_cards_build`, `_cards_atlas`, `_cards_order`, `_cards_occlusion`, `_cards_passes` and
`_cards_strands` for what is compared with what.

make bench NAME=cards           some minutes; writes out/cards_sheet.png
"""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu
import numpy as np
from _cards_atlas import atlas_figures
from _cards_build import build_figures
from _cards_occlusion import occlusion_figures
from _cards_order import order_figures
from _cards_passes import passes_figures
from _cards_strands import strands_figures


def main() -> None:
    gpu.init()
    found: dict[str, Any] = {
        **build_figures(),
        **atlas_figures(),
        **order_figures(),
        **occlusion_figures(),
        **passes_figures(),
        **strands_figures(),
    }
    for name, value in found.items():
        print(f"{name:40} {value:14.4f}")
    print(json.dumps({**{k: round(v, 5) for k, v in found.items()}, **machine()}))


def machine() -> dict[str, str]:
    return {
        "reference": "rays one by one; cards sorted for each view and pixels sorted; the strands "
        "themselves; the three-pass scheme",
        "backend": gpu.platform.backend_type_get(),
        "renderer": gpu.platform.renderer_get(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main()
