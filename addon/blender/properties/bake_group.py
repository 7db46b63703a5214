"""The properties of a bake; they live on the object that is baked."""

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
        description="Folder of the bake; empty: hairloom_cache beside the file, in folders named "
        "after the file and the object",
        subtype="DIR_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        update=_changed,
        override=OVERRIDABLE,
    )
    use_own_range: BoolProperty(
        name="Own Frame Range",
        description="Bake other frames than those of the scene",
        default=False,
        override=OVERRIDABLE,
    )
    first: IntProperty(
        name="First",
        description="First frame to bake; the hair begins at rest here, or Pre-Roll frames before",
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
        description="Show the baked frames in place of simulating them; off: simulate again",
        default=True,
        update=_changed,
        override=OVERRIDABLE,
    )
    in_renders: BoolProperty(
        name="Show in Renders",
        description="Add a copy of the hair that shows the bake in renders, where it takes the "
        "place of these curves",
        default=True,
        override=OVERRIDABLE,
    )
    follows: BoolProperty(
        name="Simulate on Playback",
        description="While Blender plays its animation, simulate this hair frame by frame, from "
        "rest at the first frame",
        default=True,
        override=OVERRIDABLE,
    )
    owner: StringProperty(
        name="Owner",
        description="Name that the object had when it was baked",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    copy: PointerProperty(
        type=bpy.types.Object,
        name="Copy in Renders",
        description="The hair curves that show the bake in renders",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    stands_for: PointerProperty(
        type=bpy.types.Object,
        name="Stands For",
        description="The hair whose bake this copy shows; renders have its animated settings by it",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    hides: BoolProperty(
        name="Is Replaced in Renders",
        description="Whether the copy takes the place of these curves in renders",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    was_hidden: BoolProperty(
        name="Was Hidden in Renders",
        description="Whether renders left these curves out before there was a bake",
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
