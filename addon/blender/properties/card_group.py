"""Properties of objects that hold cards, and the artist's pictures for cards."""

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
            description="Hair that these cards were made from; Make Cards makes them again",
            poll=_is_hair,
            override=OVERRIDABLE,
        ),
        "level": IntProperty(
            name="Level",
            description="Level of detail; 0 is the finest",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "made_name": StringProperty(
            name="Made As",
            description="Name by which Make Cards recognizes this object and tells it from copies",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "made_uid": IntProperty(
            name="Made In",
            description="Number of this object while the file is open, which tells it from copies",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "card_count": IntProperty(
            name="Cards",
            description="Number of cards in this mesh",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "shell_layers": IntProperty(
            name="Shell Layers",
            description="Number of shell layers in this mesh; 0 if it holds cards",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "wrong_fraction": FloatProperty(
            name="Wrong Order",
            description="Fraction of pixels, seen from all sides, that the finest level draws in "
            "the wrong order",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "image": PointerProperty(
            type=bpy.types.Image,
            name="Image",
            description="Picture of these cards, made together with them",
            override=OVERRIDABLE,
        ),
    }


_PICTURES = {
    "base": ("Base", "Brightness or colour of the strands, multiplied by the hair's colour"),
    "alpha": (
        "Alpha",
        "Coverage by hair: the picture's alpha, or its red channel if it has no alpha",
    ),
    "shift": (
        "Shift",
        "Shift of the highlights along each strand; middle grey does not shift them",
    ),
    "noise": ("Noise", "Noise that breaks up the second highlight"),
    "tangent": (
        "Tangent",
        "Direction of the strands, encoded as in a normal map; used instead of the shift",
    ),
}


class HAIRLOOM_PG_card_images(bpy.types.PropertyGroup):
    """Pictures for hair cards; empty ones are generated"""

    __annotations__ = {
        name: PointerProperty(
            type=bpy.types.Image,
            name=label,
            description=f"{about}. If empty, a generated texture is used",
            override=OVERRIDABLE,
        )
        for name, (label, about) in _PICTURES.items()
    }


def picture_names(group: Any) -> tuple[tuple[str, str], ...]:
    """(texture, picture) of a HAIRLOOM_PG_card_images, by name."""
    chosen = ((name, getattr(group, name)) for name in type(group).__annotations__)
    return tuple((name, image.name_full) for name, image in chosen if image is not None)
