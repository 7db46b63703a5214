"""Cards of a hairstyle beside its strands, as *Make Cards* makes them with the style's settings.

From eight sides, in the light of a sun and of a grey world, with the head as a
holdout. Writes out/bench_styles/cards_NAME.png, strands above and cards below.
"""

from __future__ import annotations

import bpy
from _engines_atlas import beside_strands
from _engines_shells import SIDES
from extension_loader import REPOSITORY

from hairloom.addon.blender.cards.build import BuiltCards, read_inputs

OUTPUT = REPOSITORY / "out" / "bench_styles"


def card_figures(style: str) -> dict[str, float]:
    """Differences of a style's cards from its strands, in the sum of alpha and in the mean colour
    where hair covers; the worst side and channel [%]."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
    inputs, _, _ = read_inputs(bpy.context.object, bpy.context.evaluated_depsgraph_get())
    built, path = BuiltCards.build(inputs), OUTPUT / f"cards_{style}.png"
    coverage, color = beside_strands(inputs, built, SIDES, path)
    return {"cards_coverage_percent": 100.0 * coverage, "cards_color_percent": 100.0 * color}
