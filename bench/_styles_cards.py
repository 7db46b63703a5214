"""Cards of a hairstyle beside its strands, as *Make Cards* makes them with the style's settings.

From eight sides, in the light of a sun and of a grey world, before the head, which hides what is
behind it. Writes out/bench_styles/cards_NAME.png, strands above and cards below.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from _cards_strands import _differences, _shown
from _engines_atlas import _from_all_sides, _lit
from extension_loader import REPOSITORY

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.cards.build import BuiltCards, read_inputs
from hairloom.addon.blender.cards.show import without_strands

OUTPUT = REPOSITORY / "out" / "bench_styles"
SIDES = tuple((np.sin(turn), -np.cos(turn), 0.25) for turn in 2.0 * np.pi * np.arange(8) / 8)


def card_figures(style: str) -> dict[str, float]:
    """How far the cards of a style are from its strands: the sum of alpha, and the mean colour of
    what is covered; the worst side, and channel [%]."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
    inputs, _, _ = read_inputs(bpy.context.object, bpy.context.evaluated_depsgraph_get())
    strands, built = _lit(inputs), BuiltCards.now(inputs)
    drawn = replace(without_strands(strands), cards=built.drawn(built.rest, inputs.settings))
    pictures = [_from_all_sides(inputs.rig, hair, SIDES) for hair in (strands, drawn)]
    OUTPUT.mkdir(parents=True, exist_ok=True)
    shown = [_shown(each) for row in pictures for each in row]
    write_png(OUTPUT / f"cards_{style}.png", contact_sheet(shown, len(SIDES)))
    coverage, color = _differences(*pictures)
    return {"cards_coverage_percent": 100.0 * coverage, "cards_color_percent": 100.0 * color}
