"""Panel sections about hair cards: the cards in the scene, and settings to make and draw them."""

from __future__ import annotations

import bpy

from ..blender.preview import previews
from ..blender.properties.card_group import HAIRLOOM_PG_card_images
from .drawing import Draw, draw_section
from .operators_card_edits import draw_card_edits
from .operators_cards import draw_made_cards
from .preset_chooser import draw_preset_row
from .state import draw_card_progress


def draw_cards(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_preset_row(layout, hair, "cards")
    draw_section(layout, hair.data.hairloom, "card_drawing")
    session = previews.session_of(hair)
    # two lines in any state, so that the layout below keeps its place
    lines = ["", ""] if session is None else [*session.cards.lines, "", ""][:2]
    if draw_card_progress(layout, session):
        del lines[0]
    for line in lines:
        layout.label(text=line)
    draw_made_cards(layout, hair)
    draw_card_edits(layout)


def draw_strips(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_section(layout, hair.data.hairloom, "cards")


def draw_card_texture(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Settings of a baked atlas or of the generated texture. With a baked atlas, those of the
    texture only break up the highlights."""
    groom = hair.data.hairloom
    draw_section(layout, groom, "atlas")
    if groom.atlas.source == "baked":
        layout.label(text="Highlights")
    draw_section(layout, groom, "card_texture")
    layout.label(text="Own Pictures")
    pictures = hair.data.hairloom.card_images
    for name in HAIRLOOM_PG_card_images.__annotations__:
        label = pictures.bl_rna.properties[name].name
        layout.template_ID(pictures, name, open="image.open", text=label)


def draw_card_occlusion(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_section(layout, hair.data.hairloom, "card_occlusion")


def draw_card_drawing(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_section(layout, hair.data.hairloom, "card_drawing", "Drawing")


CARD_SECTIONS: tuple[tuple[str, str, Draw], ...] = (
    ("card_strips", "Strips", draw_strips),
    ("card_texture", "Texture", draw_card_texture),
    ("card_occlusion", "Ambient Occlusion", draw_card_occlusion),
    ("card_drawing", "Drawing", draw_card_drawing),
)
