"""Where settings live: those of a groom on its Curves, those of a character on its Object."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from ...parameters import ALL_SETTINGS, sections_of
from ...params import Owner
from ..base.redraw import redraw_views
from . import changed
from .bake_group import HAIRLOOM_PG_bake
from .card_group import HAIRLOOM_PG_card_images, HAIRLOOM_PG_card_object
from .properties import (
    OVERRIDABLE,
    masks_of_groom,
    matching_weights,
    property_annotations,
    property_group,
    weights_of_surface,
)

#: Shapes of colliders for the artist to choose from; "automatic" is what the object looks like.
COLLIDER_SHAPES = (
    (
        "automatic",
        "Automatic",
        "Meshes collide with their actual shape, Empties displayed as spheres collide as balls",
    ),
    (
        "mesh",
        "Mesh",
        "Actual shape of a closed mesh, as a signed distance field that takes a second to compute",
    ),
    (
        "sphere",
        "Sphere",
        "Ball at the middle of the bounding box, as wide as its longest side; for an Empty, with "
        "its display size as radius",
    ),
    (
        "capsule",
        "Capsule",
        "Rod with round ends along the longest side of the bounding box; for an Empty, along Z by "
        "its display size to either side, and half as thick",
    ),
    ("none", "None", "No collisions with this object"),
)
#: Overlays: what acts on the hair, and what happens to it, as lines in the viewport.
OVERLAYS = (
    ("colliders", "Colliders", "Spheres, capsules, and the boxes of distance fields"),
    (
        "wind",
        "Wind",
        "Direction and strength of the mean wind, and of force fields at points of the hair; a "
        "line as long as the hair is wide is 10 m/s of wind, or 10 m/s² of force",
    ),
    ("lights", "Lights", "From the hair towards each light that shines on it"),
    (
        "stretch",
        "Stretch",
        "Guides coloured by their stretch relative to the style: yellow from 1 %, red from 5 %",
    ),
    (
        "contacts",
        "Contacts",
        "Points of guides that touch a collider; red shows how deep they are inside",
    ),
    (
        "density",
        "Density",
        "Two slices of the hair grid: green is as dense as at rest, blue less dense, yellow and "
        "red denser",
    ),
    (
        "paint",
        "Painted",
        "Guides coloured by the map chosen beside this button: blue is 0, green 0.5, red 1 or more",
    ),
)
_DEBUG_VIEWS = (
    ("none", "Hair", "Shaded hair"),
    ("detail", "Detail", "Each segment coloured by the number of pieces it is divided into"),
    ("guide", "Guides", "Each strand coloured by the guide that it follows most"),
    ("group", "Groups", "Each strand coloured by its group"),
    ("occlusion", "Ambient Occlusion", "Amount of ambient light that reaches each point, in grey"),
    (
        "stretch",
        "Stretch",
        "Each segment coloured by its length relative to the style: red is longer by 1 % or more, "
        "blue is shorter, grey is equal",
    ),
    (
        "depth",
        "Depth",
        "Each point coloured by its distance from the head and other colliders: green touches "
        "them, blue is far away, yellow and red are inside",
    ),
)


def _redraw(_scene: bpy.types.ID) -> None:
    redraw_views()


def _pointers(owner: Owner) -> dict[str, Any]:
    return {
        section: PointerProperty(
            type=SECTION_GROUPS[section],
            name=ALL_SETTINGS[section].title,
            description=f"Settings of {ALL_SETTINGS[section].title.lower()}",
            override=OVERRIDABLE,
        )
        for section in sections_of(owner)
    }


def _is_mesh(_group: Any, obj: bpy.types.Object) -> bool:
    return obj.type == "MESH"


def _tip_groups(group: Any, _context: bpy.types.Context, text: str) -> list[str]:
    """The weights of the mesh that holds tips, for the search of Tip Group."""
    return matching_weights(group.tip_surface, text)


def _grow_changed(group: Any, _context: bpy.types.Context) -> None:
    changed.grow(group.id_data)


def _hidden_text(name: str, description: str) -> Any:
    return StringProperty(name=name, description=description, options={"HIDDEN"})


#: section -> its PropertyGroup class, for all settings that are saved in files
SECTION_GROUPS = {
    section: property_group(kind, _redraw if kind.owner == "scene" else changed.settings)
    for section, kind in ALL_SETTINGS.items()
    if kind.owner != "job"
} | {"grow": property_group(ALL_SETTINGS["grow"], changed.grow)}
SECTION_GROUPS["grow"].__annotations__ |= {
    "density_group": StringProperty(
        name="Density",
        description="Vertex group, attribute of the surface, or image on its UVs with the density "
        "of the hair. If empty, combed hair grows on the scalp, other hair everywhere",
        search=weights_of_surface,
        options=set(),
        update=_grow_changed,
    ),
    "length_group": StringProperty(
        name="Length Factor",
        description="Vertex group, attribute of the surface, or image on its UVs that the "
        "length is multiplied by. If empty, all hair has the same length",
        search=weights_of_surface,
        options=set(),
        update=_grow_changed,
    ),
    "shape": _hidden_text(
        "Shape", "Digest of the curves as they were grown; empty if they were not grown"
    ),
    "made_by": _hidden_text("Made By", "Digest of the settings that last grew the curves"),
    "problem": _hidden_text("Problem", "Why the curves could not follow the settings"),
}
SECTION_GROUPS["fin"].__annotations__ |= {
    "enabled": BoolProperty(
        name="Simulate",
        description="Simulate this cloth with Play, during playback and in bakes",
        default=True,
        override=OVERRIDABLE,
    ),
    "pin_group": StringProperty(
        name="Pin Group",
        description="Vertex group that pins the mesh to its animation, firmly at weight 1 and "
        "softly below. If empty, nothing is pinned and the mesh falls",
        override=OVERRIDABLE,
    ),
}


def operator_properties(section: str) -> dict[str, Any]:
    """The `__annotations__` of an operator that uses the settings of one section; `settings_of`
    refuses a script's numbers that are out of range."""
    return property_annotations(ALL_SETTINGS[section].parameters(), clamps=False)


def _switch(section: str, parameter: str, values: tuple[str, str], name: str, text: str) -> Any:
    """A checkbox, for the header of a panel, for a choice in which one value means off.

    Args:
        values: the values of the choice for off and for on.
    """

    def get(groom: Any) -> bool:
        return bool(getattr(getattr(groom, section), parameter) != values[0])

    def turn(groom: Any, on: bool) -> None:
        if on != get(groom):
            setattr(getattr(groom, section), parameter, values[on])

    return BoolProperty(name=name, description=text, get=get, set=turn)


_SWITCHES = {
    "use_children": _switch(
        "children", "method", ("none", "auto"), "Children", "Grow more hair between the curves"
    ),
    "use_shadows": _switch(
        "volume",
        "shadows",
        ("none", "deep"),
        "Shadows",
        "Let hair cast shadows on itself and on nearby objects",
    ),
    "use_cards": _switch(
        "card_drawing",
        "shown_as",
        ("strands", "cards"),
        "Draw Cards",
        "Draw cards instead of strands",
    ),
}


class HAIRLOOM_PG_groom(bpy.types.PropertyGroup):
    """Everything about one groom that goes with its curves."""

    __annotations__ = {
        **_pointers("groom"),
        **_SWITCHES,
        "card_images": PointerProperty(
            type=HAIRLOOM_PG_card_images,
            name="Card Pictures",
            description="Pictures to use instead of the generated textures of hair cards",
            override=OVERRIDABLE,
        ),
        "baked_in": StringProperty(
            name="Baked In",
            description="Folder of the bake that these curves show in renders",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "baked_rig": StringProperty(
            name="Baked Rig",
            description="Hash of the strands that these curves were made from; a bake of other "
            "strands is not shown",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
    }


class HAIRLOOM_PG_character(bpy.types.PropertyGroup):
    """Everything about the hair of one object; several objects may share their curves."""

    __annotations__ = {
        **_pointers("character"),
        "bake": PointerProperty(
            type=HAIRLOOM_PG_bake,
            name="Bake",
            description="Bake settings of this object",
            override=OVERRIDABLE,
        ),
        "card_object": PointerProperty(
            type=HAIRLOOM_PG_card_object,
            name="Cards",
            description="Hair cards in this mesh, if any",
            override=OVERRIDABLE,
        ),
        "children_density": StringProperty(
            name="Density",
            description="Density of the children: a vertex group or attribute of the surface, an "
            "attribute of the curves, or an image. If empty, children grow wherever guides are "
            "near",
            search=masks_of_groom,
            options=set(),
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "hairstyle": StringProperty(
            name="Hairstyle",
            description="Name or file of the hairstyle that these curves were added as",
            override=OVERRIDABLE,
        ),
        "landmark": StringProperty(
            name="Landmark",
            description="Place on the parent head that this object marks",
            override=OVERRIDABLE,
        ),
        "debug_view": EnumProperty(
            items=_DEBUG_VIEWS,
            name="Colour By",
            description="Colouring of the strands in the preview",
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "show_counts": BoolProperty(
            name="Counts",
            description="Show the numbers of drawn guides, strands, pieces and vertices in the "
            "viewport; a colouring other than Hair always shows them",
            default=False,
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "shown_overlays": EnumProperty(
            items=OVERLAYS,
            options={"ENUM_FLAG"},
            name="Overlays",
            description="Lines in the viewport that show what acts on the hair and how it responds",
            default=set(),
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "shown_map": StringProperty(
            name="Painted Map",
            description="Name of the map that the overlay Painted shows. If empty, a map used by "
            "a setting of this hair",
            search=masks_of_groom,
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "collider": PointerProperty(
            type=bpy.types.Object,
            name="Collider",
            description="Closed mesh that the hair stays out of. If empty, the surface that it "
            "grows from",
            poll=_is_mesh,
            override=OVERRIDABLE,
        ),
        "collider_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Colliders",
            description="Collection of other objects that this hair or cloth collides with, read "
            "when Play starts. If empty, hair collides with its surface alone, cloth with nothing",
            override=OVERRIDABLE,
        ),
        "field_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Fields",
            description="Collection of force fields that act on this hair or cloth. If empty, all "
            "force fields of the scene",
            override=OVERRIDABLE,
        ),
        "tie_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Ties",
            description="Collection of rings that hold the hair passing through them: circle "
            "Empties, curves or meshes",
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "parting_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Partings",
            description="Collection of curves drawn on the surface, along which the hair is "
            "parted to both sides",
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "stroke_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Strokes",
            description="Collection of curves drawn on the surface, along which Comb Along Flow "
            "combs hair, from first to last point",
            override=OVERRIDABLE,
        ),
        "trim_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Trim Shapes",
            description="Collection of closed meshes, flat meshes and Empties to which Trim to "
            "Shape cuts the hair",
            override=OVERRIDABLE,
        ),
        "tip_surface": PointerProperty(
            type=bpy.types.Object,
            name="Held Tips",
            description="Mesh that holds the tips near it, such as a bun",
            poll=_is_mesh,
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "tip_group": StringProperty(
            name="Tip Group",
            description="Vertex group or float attribute of the mesh, which holds tips only where "
            "this is 0.5 or more, such as the cheeks of a head that holds sideburns. If empty, it "
            "holds tips everywhere",
            search=_tip_groups,
            search_options={"SUGGESTION"},
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "collider_shape": EnumProperty(
            items=COLLIDER_SHAPES,
            name="Collides As",
            description="Shape in which this object collides with hair and cloth",
            override=OVERRIDABLE,
        ),
        "hidden_rays": IntProperty(
            name="Hidden Rays",
            description="Rays from which these curves are hidden during a render",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "hide_original": BoolProperty(
            name="Hide Blender's Strands",
            description="Hide Blender's own drawing of these curves during the preview, except "
            "for their outline when selected",
            default=True,
            update=lambda self, _context: changed.display(self.id_data),
            override=OVERRIDABLE,
        ),
    }


class HAIRLOOM_PG_scene(bpy.types.PropertyGroup):
    """Everything about the pictures of one scene."""

    __annotations__ = {
        **_pointers("scene"),
        "use_hair_scene": BoolProperty(
            name="Hairloom Hair",
            description="Draw hair curves and their shadows on meshes with Hairloom over the "
            "pictures of this render engine, by means of a second scene and compositor nodes",
            update=lambda self, _context: changed.hair_scene(self.id_data),
        ),
        "hair_scene": PointerProperty(
            type=bpy.types.Scene,
            name="Hair Scene",
            description="Scene that draws the hair of this one",
            options={"HIDDEN"},
        ),
        "is_hair_scene": BoolProperty(
            name="Is Hair Scene",
            description="Whether this scene draws only the hair of its background set",
            options={"HIDDEN"},
        ),
    }


def _pass_of_hair(name: str, description: str) -> Any:
    return BoolProperty(
        name=name,
        description=description,
        update=lambda self, _context: changed.passes(self.id_data),
    )


class HAIRLOOM_PG_view_layer(bpy.types.PropertyGroup):
    """Passes of hair that Blender has no setting for."""

    __annotations__ = {
        "use_alpha": _pass_of_hair(
            "Alpha", "Render the fraction of each pixel covered by visible hair"
        ),
        "use_tangent": _pass_of_hair(
            "Tangent",
            "Render the direction of hair from root to tip in world space, averaged over all "
            "strands visible in a pixel",
        ),
        "use_shadow": _pass_of_hair(
            "Shadow", "Render the fraction of light that hair lets reach meshes, by colour"
        ),
        "use_strand_index": _pass_of_hair(
            "Strand Index",
            "Render the number of the nearest strand in its groom, counted from 1; 0 is no strand",
        ),
    }


CLASSES = (
    *SECTION_GROUPS.values(),
    HAIRLOOM_PG_bake,
    HAIRLOOM_PG_card_object,
    HAIRLOOM_PG_card_images,
    HAIRLOOM_PG_groom,
    HAIRLOOM_PG_character,
    HAIRLOOM_PG_scene,
    HAIRLOOM_PG_view_layer,
)


def register() -> None:
    """Add the property groups to Blender's types; CLASSES must be registered."""
    bpy.types.Curves.hairloom = PointerProperty(
        type=HAIRLOOM_PG_groom,
        name="Hairloom",
        description="Settings of this groom",
        override=OVERRIDABLE,
    )
    bpy.types.Object.hairloom = PointerProperty(
        type=HAIRLOOM_PG_character,
        name="Hairloom",
        description="Settings of this object's hair",
        override=OVERRIDABLE,
    )
    bpy.types.Scene.hairloom = PointerProperty(
        type=HAIRLOOM_PG_scene, name="Hairloom", description="Settings of this scene's pictures"
    )
    bpy.types.ViewLayer.hairloom = PointerProperty(
        type=HAIRLOOM_PG_view_layer, name="Hairloom", description="Hair passes of this view layer"
    )


def unregister() -> None:
    del bpy.types.ViewLayer.hairloom
    del bpy.types.Scene.hairloom
    del bpy.types.Object.hairloom
    del bpy.types.Curves.hairloom
