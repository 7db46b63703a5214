"""What an object of cards remembers, and the artist's pictures for cards."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import FloatProperty, IntProperty, PointerProperty, StringProperty

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
        "made_name": StringProperty(
            name="Made As",
            description="Name under which Make Cards knows this object; a copy has another one",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "made_uid": IntProperty(
            name="Made In",
            description="Number of this object while the file is open; a copy has another one",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "card_count": IntProperty(
            name="Cards",
            description="How many cards this mesh holds",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "shell_layers": IntProperty(
            name="Shell Layers",
            description="How many layers of shells this mesh holds; 0: it holds cards",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "wrong_fraction": FloatProperty(
            name="Wrong Order",
            description="Fraction of the pixels that the finest level draws in a wrong order, from "
            "all sides",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "image": PointerProperty(
            type=bpy.types.Image,
            name="Image",
            description="Picture of these cards, which is drawn again with them",
            override=OVERRIDABLE,
        ),
    }


_PICTURES = {
    "base": ("Base", "Brightness of the strands, or their colour: multiplied by the hair's"),
    "alpha": ("Alpha", "Where there is hair: the alpha of this picture, or its red without one"),
    "shift": ("Shift", "Where the highlights lie along each strand; middle grey leaves them"),
    "noise": ("Noise", "What the second highlight is broken up by"),
    "tangent": ("Tangent", "Direction of the strands in place of the shift, as in a normal map"),
}


class HAIRLOOM_PG_card_images(bpy.types.PropertyGroup):
    """Pictures for hair cards; what is empty is generated"""

    __annotations__ = {
        name: PointerProperty(
            type=bpy.types.Image,
            name=label,
            description=f"{about}; empty: generated",
            override=OVERRIDABLE,
        )
        for name, (label, about) in _PICTURES.items()
    }


def picture_names(group: Any) -> tuple[tuple[str, str], ...]:
    """(texture, picture) of a HAIRLOOM_PG_card_images, by name."""
    chosen = ((name, getattr(group, name)) for name in type(group).__annotations__)
    return tuple((name, image.name_full) for name, image in chosen if image is not None)
