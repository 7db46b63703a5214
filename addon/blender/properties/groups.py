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
    property_annotations,
    property_group,
    weights_meant,
    weights_of_surface,
)

#: Shapes that the artist can choose from; "automatic" is what an object looks like.
COLLIDER_SHAPES = (
    ("automatic", "Automatic", "Meshes collide as they are, empties shown as spheres as balls"),
    (
        "mesh",
        "Mesh",
        "As it is: the signed distance of a closed mesh, which takes a second to make",
    ),
    (
        "sphere",
        "Sphere",
        "A ball around the middle of the bounding box, as wide as its longest side; of an empty: "
        "of its display size",
    ),
    (
        "capsule",
        "Capsule",
        "A rod with round ends along the longest side of the bounding box; of an empty: along Z, "
        "a display size to either side, half as thick",
    ),
    ("none", "None", "Hair does not collide with it"),
)
#: What acts on the hair and can be shown as lines in the viewport.
OVERLAYS = (
    ("colliders", "Colliders", "Spheres, capsules, and the boxes of distance fields"),
    (
        "wind",
        "Wind",
        "Where the mean wind blows to: as long as the hair is wide at 10 m/s. Force fields: where "
        "they push points of the hair, the same at 10 m/s²",
    ),
    ("lights", "Lights", "From the hair towards each light that shines on it"),
    (
        "stretch",
        "Stretch",
        "Guides by how far they are from the lengths of their style: yellow from 1 %, red from 5 %",
    ),
    (
        "contacts",
        "Contacts",
        "Points of guides that touch a collider; red: how deep they are inside",
    ),
    (
        "density",
        "Density",
        "Two slices of the cells in which hair feels hair: green as dense as at rest, blue less, "
        "yellow and red more",
    ),
    (
        "paint",
        "Painted",
        "Guides by what is painted beside this button: blue is 0, green a half, red 1 and more",
    ),
)
_DEBUG_VIEWS = (
    ("none", "Hair", "Hair as it is shaded"),
    ("detail", "Detail", "Each segment by the number of pieces it is divided into"),
    ("guide", "Guides", "Each strand by the guide that it follows most"),
    ("group", "Groups", "Each strand by its group"),
    ("occlusion", "Ambient Occlusion", "How much of the sky's light comes to each point, in grey"),
    (
        "stretch",
        "Stretch",
        "Each segment by its length beside that in the style: red is longer by 1 % or more, blue "
        "is shorter, grey is as long",
    ),
    (
        "depth",
        "Depth",
        "Each point by its distance from the head and other colliders: green touches them, blue is "
        "far away, yellow and red are inside",
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


def _tip_groups(group: Any, _context: bpy.types.Context, typed: str) -> list[str]:
    """Where the mesh that holds tips may hold them."""
    return weights_meant(group.tip_surface, typed)


def _grow_changed(group: Any, _context: bpy.types.Context) -> None:
    changed.grow(group.id_data)


def _hidden_text(name: str, description: str) -> Any:
    return StringProperty(name=name, description=description, options={"HIDDEN"})


#: section -> its class of properties, of all that a file keeps
SECTION_GROUPS = {
    section: property_group(kind, _redraw if kind.owner == "scene" else changed.settings)
    for section, kind in ALL_SETTINGS.items()
    if kind.owner != "job"
} | {"grow": property_group(ALL_SETTINGS["grow"], changed.grow)}
SECTION_GROUPS["grow"].__annotations__ |= {
    "density_group": StringProperty(
        name="Density",
        description="Vertex group, attribute of the surface, or image on its UVs that sets how "
        "densely hair grows. If empty, combed hair grows on the scalp, other hair everywhere",
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
    "shape": _hidden_text("Shape", "Digest of the curves as they grew; empty: they have not grown"),
    "made_by": _hidden_text("Made By", "Digest of the settings by which the curves grew last"),
    "problem": _hidden_text("Problem", "Why the curves could not follow the settings"),
}
SECTION_GROUPS["fin"].__annotations__ |= {
    "enabled": BoolProperty(
        name="Simulate",
        description="Simulate this cloth when Play is pressed, in playback and in bakes",
        default=True,
        override=OVERRIDABLE,
    ),
    "pin_group": StringProperty(
        name="Pin Group",
        description="Vertex group that holds the mesh to its animation: at weight 1 firmly, below "
        "softly. If empty, nothing is pinned and the mesh falls",
        override=OVERRIDABLE,
    ),
}


def operator_properties(section: str) -> dict[str, Any]:
    """For the `__annotations__` of an operator that works by the settings of one section."""
    return property_annotations(ALL_SETTINGS[section].parameters())


def _switch(section: str, parameter: str, values: tuple[str, str], name: str, text: str) -> Any:
    """A checkbox for a choice of which one value means off, as headers of panels have it.

    Args:
        values: of the choice when off, and what it becomes when turned on.
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
        "volume", "shadows", ("none", "deep"), "Shadows", "Let hair shade itself and what is near"
    ),
    "use_cards": _switch(
        "card_drawing", "shown_as", ("strands", "cards"), "Draw Cards", "Draw cards, not strands"
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
            description="Pictures instead of generated textures of hair cards",
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
            description="Hash of the strands that these curves were made from; another bake in the "
            "folder is not shown",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
    }


class HAIRLOOM_PG_character(bpy.types.PropertyGroup):
    """Everything about the hair of one object, of which several may share their curves."""

    __annotations__ = {
        **_pointers("character"),
        "bake": PointerProperty(
            type=HAIRLOOM_PG_bake,
            name="Bake",
            description="How and where this object is baked",
            override=OVERRIDABLE,
        ),
        "card_object": PointerProperty(
            type=HAIRLOOM_PG_card_object,
            name="Cards",
            description="Whose cards this mesh holds, if it does",
            override=OVERRIDABLE,
        ),
        "children_density": StringProperty(
            name="Density",
            description="How densely children grow: a vertex group or an attribute of the surface, "
            "an attribute of the curves, or an image; empty: wherever guides are near",
            search=masks_of_groom,
            options=set(),
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "hairstyle": StringProperty(
            name="Hairstyle",
            description="The hairstyle that these curves were added as, by name or file",
            override=OVERRIDABLE,
        ),
        "landmark": StringProperty(
            name="Landmark",
            description="Which place of its parent, a head, this object marks",
            override=OVERRIDABLE,
        ),
        "debug_view": EnumProperty(
            items=_DEBUG_VIEWS,
            name="Colour By",
            description="What the strands of the preview are coloured by",
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "show_counts": BoolProperty(
            name="Counts",
            description="Write into the viewport how many guides, strands, pieces and vertices are "
            "drawn; with a colouring they are always there",
            default=False,
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "shown_overlays": EnumProperty(
            items=OVERLAYS,
            options={"ENUM_FLAG"},
            name="Overlays",
            description="What acts on the hair, and what happens to it, drawn into the viewport as "
            "lines",
            default=set(),
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "shown_map": StringProperty(
            name="Painted Map",
            description="What is painted that Painted shows, by its name; empty: what a setting of "
            "this hair is painted by",
            search=masks_of_groom,
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "collider": PointerProperty(
            type=bpy.types.Object,
            name="Collider",
            description="Closed mesh that the hair stays out of; empty: the surface it grows from",
            poll=_is_mesh,
            override=OVERRIDABLE,
        ),
        "collider_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Colliders",
            description="Collection of the other objects that this hair or cloth stays out of; "
            "each has its own. Empty: for hair its surface alone, for cloth nothing. Read as Play "
            "begins",
            override=OVERRIDABLE,
        ),
        "field_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Fields",
            description="Collection of the force fields that act on this hair or cloth; empty: all "
            "of the scene",
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
            description="Collection of curves drawn on the surface, across which no strand follows "
            "another: hair falls to both sides of them",
            update=lambda self, _context: changed.settings(self.id_data),
            override=OVERRIDABLE,
        ),
        "stroke_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Strokes",
            description="Collection of curves drawn on the surface, which Comb Along Flow combs "
            "hair along, from their first points to their last",
            override=OVERRIDABLE,
        ),
        "trim_collection": PointerProperty(
            type=bpy.types.Collection,
            name="Trim Shapes",
            description="Collection of closed meshes, flat meshes and Empties that Trim to Shape "
            "cuts the hair by",
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
            description="Vertex group or float attribute of that mesh: it holds tips only where "
            "this is one half or more, as on the cheeks of a head that holds sideburns. If empty, "
            "it holds them everywhere",
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
            description="What these curves are hidden from while a render runs",
            options={"HIDDEN"},
            override=OVERRIDABLE,
        ),
        "hide_original": BoolProperty(
            name="Hide Blender's Strands",
            description="While previewing, show nothing of Blender's own drawing of these curves "
            "but their outline when they are selected",
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
            description="Draw hair curves by Hairloom over the pictures of this render engine, "
            "with their shadow on meshes, by a scene and nodes of the compositor",
            update=lambda self, _context: changed.hair_scene(self.id_data),
        ),
        "hair_scene": PointerProperty(
            type=bpy.types.Scene,
            name="Hair Scene",
            description="The scene that draws the hair of this one",
            options={"HIDDEN"},
        ),
        "is_hair_scene": BoolProperty(
            name="Is Hair Scene",
            description="This scene draws the hair of its background set, and nothing else",
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
            "Alpha", "Deliver how much of each pixel is covered by hair that nothing hides"
        ),
        "use_tangent": _pass_of_hair(
            "Tangent",
            "Deliver the direction of hair from root to tip, in world space: the mean of all "
            "strands that are seen in a pixel",
        ),
        "use_shadow": _pass_of_hair(
            "Shadow", "Deliver the fraction of their light that hair leaves to meshes, by colour"
        ),
        "use_strand_index": _pass_of_hair(
            "Strand Index",
            "Deliver the number of the nearest strand in its groom, counted from 1; 0 is no strand",
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
    """After CLASSES are registered."""
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
        type=HAIRLOOM_PG_view_layer, name="Hairloom", description="Passes of hair in this layer"
    )


def unregister() -> None:
    del bpy.types.ViewLayer.hairloom
    del bpy.types.Scene.hairloom
    del bpy.types.Object.hairloom
    del bpy.types.Curves.hairloom
