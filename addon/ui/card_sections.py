"""The sections about hair cards: those of the scene, and what they are made and drawn by."""

from __future__ import annotations

import bpy

from ..blender.preview import live
from ..blender.properties.card_group import HAIRLOOM_PG_card_images
from .drawing import Draw, draw_group, draw_named
from .operators_cards import draw_made_cards
from .preset_chooser import draw_preset_row


def draw_cards(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_preset_row(layout, hair, "cards")
    layout.prop(hair.data.hairloom.card_drawing, "shown_as")
    session = live.session_of(hair)
    for line in () if session is None else session.cards.lines:
        layout.label(text=line)
    draw_made_cards(layout, hair)


def draw_strips(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Only what acts on cards of this kind."""
    group = hair.data.hairloom.cards
    hidden = {name for way, names in CARDS.items() if way != group.way for name in names}
    if _is_baked(hair):
        hidden.add("atlas_columns")
    draw_named(layout, group, [p.name for p in group.settings.parameters() if p.name not in hidden])


def draw_card_texture(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """The atlas that is baked, or the texture that is made; of that one a baked atlas has only what
    breaks up the highlights."""
    groom = hair.data.hairloom
    layout.prop(groom.atlas, "source")
    names = [p.name for p in groom.card_texture.settings.parameters()]
    if _is_baked(hair):
        draw_named(layout, groom.atlas, [p.name for p in groom.atlas.settings.parameters()][1:])
        layout.label(text="Highlights")
        names = [name for name in names if name not in MADE_ALONE]
    draw_named(layout, groom.card_texture, names)
    layout.label(text="Own Pictures")
    pictures = hair.data.hairloom.card_images
    for name in HAIRLOOM_PG_card_images.__annotations__:
        label = pictures.bl_rna.properties[name].name
        layout.template_ID(pictures, name, open="image.open", text=label)


def _is_baked(hair: bpy.types.Object) -> bool:
    return bool(hair.data.hairloom.atlas.source == "baked")


def draw_card_occlusion(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_group(layout, hair.data.hairloom.card_occlusion)


def draw_card_drawing(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """It acts while cards are shown."""
    group = hair.data.hairloom.card_drawing
    column = layout.column()
    column.active = group.shown_as == "cards"
    names = [p.name for p in group.settings.parameters() if p.name != "shown_as"]
    if group.passes != "four":
        names.remove("skip_clear")
    draw_named(column, group, names)


#: what cards are made from -> the parameters that act on them alone
CARDS: dict[str, tuple[str, ...]] = {
    "guides": ("width_factor", "tip_width"),
    "clusters": ("card_count", "error", "cover", "crossed", "fly_aways"),
}
#: parameters of textures that act on those alone that are made by chance
MADE_ALONE = {"contrast", "edge_width", "root_length", "tip_length", "softness", "highlights"}
CARD_SECTIONS: tuple[tuple[str, str, Draw], ...] = (
    ("card_strips", "Strips", draw_strips),
    ("card_texture", "Texture", draw_card_texture),
    ("card_occlusion", "Ambient Occlusion", draw_card_occlusion),
    ("card_drawing", "Drawing", draw_card_drawing),
)
