"""Draws the picture of shells in docs/cards.md: two hairstyles as strands and as shells.

python tools/shells_pictures.py FOLDER
"""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import gpu
from cards_pictures import HEIGHT, SAMPLES, WIDTH, addon_module
from extension_loader import load_package
from make_styles import animal

STYLES = ("short_coat", "buzz_cut")


def pictures_of(style: str) -> list[Any]:
    """Strands, and shells."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Scene, "hairloom"):
        load_package().register()
    if style == "short_coat":
        animal()
    bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
    hair = bpy.context.object
    builds, cards = addon_module("blender.cards.build"), addon_module("cards.settings").CardSettings
    inputs, _, _ = builds.read_inputs(hair, bpy.context.evaluated_depsgraph_get())
    shells = replace(inputs.settings[cards], kind="shells", levels=1)
    inputs = replace(inputs, settings=inputs.settings.with_settings(shells))
    rig, groom = (
        inputs.rig,
        addon_module("blender.properties.groom_settings").GroomSettings.of(hair),
    )
    ambient = inputs.settings[addon_module("shading.ambient_settings").AmbientSettings]
    prepared = addon_module("blender.sessions.prepared_groom").prepare_groom(rig, ambient)
    head = addon_module("blender.scene.built_in_head").built_in_head()
    is_bust = addon_module("blender.setup.hairstyles").is_bust(hair.parent)
    studio = addon_module("blender.pictures.studio").Studio(
        prepared, groom, look=head.look("light") if is_bust else None
    )
    size = WIDTH, HEIGHT, SAMPLES
    strands = studio.picture(rig.rest_pose, rig.strands.points, *size)
    built = builds.BuiltCards.build(inputs)
    return [
        strands,
        studio.card_picture(built.with_drawing_settings(built.rest, inputs.settings), *size),
    ]


def main(folder: Path) -> None:
    gpu.init()
    pairs = [pictures_of(style) for style in STYLES]
    rows = [picture for pair in zip(*pairs, strict=True) for picture in pair]
    images = addon_module("blender.base.images")
    images.write_png(folder / "shells.png", images.contact_sheet(rows, len(STYLES)))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
