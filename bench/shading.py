"""Shading: Marschner's fibre against traced rays and Cycles, its tables, its GLSL, its cost.

See the modules `_shading_*` for what is compared with what. Writes out/shading_sheet.png, a ball of
hair beside Cycles'.

make bench NAME=shading          about five minutes
"""

from __future__ import annotations

from typing import Any

from _report import start, tell
from _shading_ball import ball_figures
from _shading_cost import cost_figures
from _shading_cycles import lobe_figures
from _shading_glsl import glsl_relative_error
from _shading_reference import reference_figures

REFERENCE = "rays through a dielectric cylinder; Cycles' Principled Hair (Chiang); numpy in float64"


def main() -> None:
    start()
    found: dict[str, Any] = {
        **cost_figures(),
        **reference_figures(),
        "glsl_relative_error": glsl_relative_error(),
        **lobe_figures(),
        **ball_figures(),
    }
    tell(found, REFERENCE)


main()
