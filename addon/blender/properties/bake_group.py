"""The properties of a bake, on the object that is baked."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, IntProperty, PointerProperty, StringProperty

from . import changed
from .properties import OVERRIDABLE


def _changed(group: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    changed.bake(group.id_data)


class HAIRLOOM_PG_bake(bpy.types.PropertyGroup):
    """The bake of one object"""

    folder: StringProperty(
        name="Cache",
        description="Folder of the bake. If empty, a folder named after the file and the object, "
        "in hairloom_cache beside the file",
        subtype="DIR_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        update=_changed,
        override=OVERRIDABLE,
    )
    use_own_range: BoolProperty(
        name="Own Frame Range",
        description="Bake a different frame range than the scene's",
        default=False,
        override=OVERRIDABLE,
    )
    first: IntProperty(
        name="First",
        description="First frame to bake; the hair starts at rest here, or Pre-Roll frames earlier",
        default=1,
        min=-99999,
        max=999999,
        override=OVERRIDABLE,
    )
    last: IntProperty(
        name="Last",
        description="Last frame to bake",
        default=250,
        min=-99999,
        max=999999,
        override=OVERRIDABLE,
    )
    is_shown: BoolProperty(
        name="Play the Bake",
        description="Show the baked frames instead of simulating them",
        default=True,
        update=_changed,
        override=OVERRIDABLE,
    )
    in_renders: BoolProperty(
        name="Show in Renders",
        description="Add a copy of the hair that plays the bake and replaces these curves in "
        "renders",
        default=True,
        override=OVERRIDABLE,
    )
    follows: BoolProperty(
        name="Simulate on Playback",
        description="Simulate this hair frame by frame while Blender plays its animation, "
        "starting at rest in the first frame",
        default=True,
        override=OVERRIDABLE,
    )
    owner: StringProperty(
        name="Owner",
        description="Name of the object when it was baked",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    copy: PointerProperty(
        type=bpy.types.Object,
        name="Copy in Renders",
        description="Hair curves that show the bake in renders",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    shown_hair: PointerProperty(
        type=bpy.types.Object,
        name="Shown Hair",
        description="Hair whose bake this copy shows, and whose animated settings renders use",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    hides: BoolProperty(
        name="Is Replaced in Renders",
        description="Whether the copy replaces these curves in renders",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    was_hidden: BoolProperty(
        name="Was Hidden in Renders",
        description="Whether these curves were already hidden in renders before the bake",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
