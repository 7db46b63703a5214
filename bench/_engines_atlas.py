"""How much hair the atlas of exported cards holds, and how cards of fur look.

Third-party grooms, and the shipped fur on Blender's monkey, with default settings: widths are
found, children are added. Cards are made as by *Make Cards* and the exporters.

- opaque_percent: texels whose alpha is above 0.5.
- strand_texels: width of the median strand in the atlas, the mean over its rows.
- side_texels: width and height of the atlas; also for a groom of twenty strands.
- Of fur: triangles of the average card, and differences of its cards from its strands, from four
  sides: of the sum of alpha, and of the mean colour where hair covers, the worst channel.

Writes out/bench_engines/cards_NAME.png, strands above and cards below, and the atlases' alpha.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from _cards_strands import _differences, _shown
from _report import chosen
from _sight_grooms import GROOMS, rig_of
from extension_loader import REPOSITORY

import hairloom
from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.cards.build import (
    BuiltCards,
    CardInputs,
    MappedCards,
    build_steps,
    read_inputs,
)
from hairloom.addon.blender.cards.show import without_strands
from hairloom.addon.blender.sessions.prepared_groom import PreparedGroom
from hairloom.addon.blender.sessions.snapshots import snapshot_of
from hairloom.addon.card_flow import card_groom
from hairloom.addon.cards.atlas import AtlasPlan
from hairloom.addon.cards.steps import result_of
from hairloom.addon.light_flow import rest_light
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

OUTPUT = REPOSITORY / "out" / "bench_engines"
HAIR, FURS, STYLES = ("sintel", "ponytail"), ("bear", "mohawk"), ("short_coat", "shaggy_coat")
GROOMS_OF_ATLAS = (*GROOMS, *STYLES, "few")
FEW = 20
SIDES = ((0, -1, 0.2), (1, 0, 0.2), (0, 1, 0.2), (0.3, -0.3, 1))
SIZE, SAMPLES, FIELD_OF_VIEW = 320, 2, np.radians(30.0)
SUN, STRENGTH, WORLD = (0.4, 0.6, -0.8), 4.0, (0.3, 0.3, 0.3)


def atlas_figures(names: list[str]) -> dict[str, Any]:
    """The figures of these grooms, or of the usual ones."""
    found: dict[str, Any] = {}
    chosen(names, GROOMS_OF_ATLAS)
    for name in names or [*HAIR, "mohawk", *STYLES, "few"]:
        inputs = _inputs(name)
        made = result_of(build_steps(inputs))
        figures = _of_atlas(name, inputs, made)
        if name in FURS or name in STYLES:
            figures |= _of_fur(name, inputs, made)
        print(name, {key: round(value, 3) for key, value in figures.items()}, flush=True)
        found |= {f"{name}_{key}": value for key, value in figures.items()}
    return found


def _inputs(name: str) -> CardInputs:
    if name in STYLES:
        return _added(name)
    if name == "few":
        strands, head = GROOMS["built_in"]()
        few = strands.take(np.linspace(0, strands.strand_count - 1, FEW).astype(int))
        return CardInputs(rig_of((few, head), name, "none"))
    return CardInputs(rig_of(GROOMS[name](), name))


def _added(style: str) -> CardInputs:
    """A hairstyle that is added by the artist's button."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Scene, "hairloom"):
        hairloom.register()
    bpy.ops.mesh.primitive_monkey_add(size=0.2)
    bpy.context.object.modifiers.new("Smooth", "SUBSURF").levels = 2
    bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
    return read_inputs(bpy.context.object, bpy.context.evaluated_depsgraph_get())[0]


def _of_atlas(name: str, inputs: CardInputs, made: MappedCards) -> dict[str, float]:
    plan, alpha = made.build.plan, made.maps.by_name["alpha"]
    assert plan is not None
    OUTPUT.mkdir(parents=True, exist_ok=True)
    opaque = np.ones_like(alpha)
    write_png(OUTPUT / f"atlas_{name}.png", np.stack([alpha, alpha, alpha, opaque], axis=-1))
    return {
        "opaque_percent": 100.0 * float((alpha > 0.5).mean()),
        "strand_texels": _strand_texels(inputs, plan),
        "side_texels": len(alpha),
        "cards": made.build.finest.card_count,
        "triangles": len(made.build.finest.triangles),
        "order_wrong_percent": 100.0 * made.build.wrong_fraction,
    }


def _strand_texels(inputs: CardInputs, plan: AtlasPlan) -> float:
    radius = card_groom(inputs.rig, inputs.settings[StrandSettings]).radius[plan.strands]
    tile = plan.tile_of_strand
    widths = 2.0 * radius * plan.thickness[tile, None] / plan.strips.width[tile]
    across = plan.size / plan.grid.columns * (1.0 - 2.0 * plan.grid.padding[0])
    return float(np.median(widths.mean(axis=1))) * across


def _of_fur(name: str, inputs: CardInputs, made: MappedCards) -> dict[str, float]:
    path = OUTPUT / f"cards_{name}.png"
    coverage, color = beside_strands(inputs, BuiltCards.of(inputs.rig, made), SIDES, path)
    finest = made.build.finest
    return {
        "fur_triangles": len(finest.triangles) / finest.card_count,
        "fur_coverage_percent": 100.0 * coverage,
        "fur_color_percent": 100.0 * color,
    }


def beside_strands(
    inputs: CardInputs,
    cards: BuiltCards,
    sides: Sequence[tuple[float, float, float]],
    path: Path,
) -> tuple[float, float]:
    """Differences of cards from their strands in coverage and colour, see `_differences`; writes a
    picture, strands above and cards below."""
    strands = _lit(inputs)
    drawn = replace(
        without_strands(strands), cards=cards.with_drawing_settings(cards.rest, inputs.settings)
    )
    pictures = [_from_all_sides(inputs.rig, hair, sides) for hair in (strands, drawn)]
    path.parent.mkdir(parents=True, exist_ok=True)
    shown = [_shown(each) for row in pictures for each in row]
    write_png(path, contact_sheet(shown, len(sides)))
    return _differences(*pictures)


def _lit(inputs: CardInputs) -> Snapshot:
    rig = inputs.rig
    holes = () if rig.head is None else (replace(MeshSnapshot.of(rig.head), is_holdout=True),)
    ambient, settings = inputs.settings[AmbientSettings], inputs.settings
    hair = snapshot_of(PreparedGroom(rig, ambient, rest_light(rig, ambient)))
    return replace(
        hair,
        shading=settings[ShadingSettings],
        volume=settings[VolumeSettings].multiplied(extinction=hair.extinction),
        strand_settings=settings[StrandSettings],
        meshes=holes,
        lights=(Light.sun(SUN, (1.0, 1.0, 1.0), STRENGTH),),
        ambient=WORLD,
    )


def _from_all_sides(
    rig: Rig, hair: Snapshot, sides: Sequence[tuple[float, float, float]]
) -> list[np.ndarray]:
    cameras = [frame_camera(rig.strands.bounds(), side, FIELD_OF_VIEW, 1.0) for side in sides]
    return [render_image(hair, camera, SIZE, SIZE, SAMPLES) for camera in cameras]
