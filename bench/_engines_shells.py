"""Shells of the short coat beside its strands, as `_engines_atlas` compares cards of fur.

From eight sides, with the hairstyle's settings: shells_triangles of the finest level, and
shells_coverage_percent and shells_color_percent, the worst side and channel.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from _engines_atlas import OUTPUT, _added, beside_strands

from hairloom.addon.blender.cards.build import BuiltCards
from hairloom.addon.cards.settings import CardSettings

SIDES = tuple((np.sin(turn), -np.cos(turn), 0.25) for turn in 2.0 * np.pi * np.arange(8) / 8)


def shell_figures() -> dict[str, Any]:
    inputs = _added("short_coat")
    kind = replace(inputs.settings[CardSettings], kind="shells", levels=1)
    inputs = replace(inputs, settings=inputs.settings.with_settings(kind))
    made = BuiltCards.build(inputs)
    coverage, color = beside_strands(inputs, made, SIDES, OUTPUT / "shells_short_coat.png")
    return {
        "shells_triangles": len(made.rest.mesh.triangles),
        "shells_coverage_percent": 100.0 * coverage,
        "shells_color_percent": 100.0 * color,
    }
