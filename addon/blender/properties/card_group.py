"""What an object of cards remembers: whose cards they are."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, IntProperty, PointerProperty

from .properties import OVERRIDABLE


def _is_hair(_group: object, obj: bpy.types.Object) -> bool:
    return bool(obj.type == "CURVES")


class HAIRLOOM_PG_card_object(bpy.types.PropertyGroup):
    """A mesh that holds the cards of a groom"""

    __annotations__ = {
        "groom": PointerProperty(
            type=bpy.types.Object,
            name="Cards Of",
            description="Hair that these cards were made from; Make Cards builds them again",
            poll=_is_hair,
            override=OVERRIDABLE,
        ),
        "level": IntProperty(
            name="Level",
            description="Level of detail, 0 is the finest",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "card_count": IntProperty(
            name="Cards",
            description="How many cards this mesh holds",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "wrong_share": FloatProperty(
            name="Wrong Order",
            description="Share of the pixels that the finest level draws in a wrong order, from "
            "all sides",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "image": PointerProperty(
            type=bpy.types.Image,
            name="Image",
            description="Picture of these cards, which is drawn anew with them",
            override=OVERRIDABLE,
        ),
    }
