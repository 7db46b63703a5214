"""Sort Hair Cards: the artist's own cards, sorted and given ambient occlusion."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..blender.base.outcome import report
from ..blender.cards.adopt import ORDERS, SortedCards, SortOptions, sort_steps
from ..blender.cards.material import alpha_images
from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..cards.occlusion_settings import CardOcclusionSettings
from ..errors import HairloomError
from .long_work import LongWork, Steps, as_progress
from .selection import active_mesh

_DIRECTIONS = (
    ("auto", "Automatic", "Detect the root end of the UVs by its distance from the head"),
    ("down", "Down", "Roots are at the top of the texture"),
    ("up", "Up", "Roots are at the bottom of the texture"),
    ("right", "Right", "Roots are at the left of the texture"),
    ("left", "Left", "Roots are at the right of the texture"),
)


class HAIRLOOM_OT_sort_cards(LongWork, bpy.types.Operator):
    """Sort the faces of the active hair card mesh from the inside to the outside, the order in
    which engines must draw them, and store ambient occlusion. Esc cancels"""

    bl_idname = "hairloom.sort_cards"
    bl_label = "Sort Hair Cards"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "head": StringProperty(
            name="Head",
            description="Mesh that the hair grows from; it also occludes the cards",
        ),
        "by": EnumProperty(name="Order By", description="What to sort", items=ORDERS),
        "dangling": StringProperty(
            name="Dangling",
            description="Vertex group of swinging cards, such as a ponytail; they are drawn after "
            "all others",
        ),
        "direction": EnumProperty(
            name="Root to Tip",
            description="Direction of the hair on the texture",
            items=_DIRECTIONS,
        ),
        "use_occlusion": BoolProperty(
            name="Ambient Occlusion",
            description="Store the ambient occlusion of each vertex, as an attribute and as a UV "
            "map",
            default=True,
        ),
        "alpha": StringProperty(
            name="Alpha",
            description="Image whose alpha makes cards transparent. If empty, the material's image",
        ),
        **operator_properties("card_occlusion"),
    }

    @classmethod
    def poll(cls: Any, context: bpy.types.Context) -> bool:
        return cls.can_start() and _can_sort(cls, context)

    def invoke(self: Any, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        obj = active_mesh(context)
        assert obj is not None
        if not self.head:
            head = _likely_head(obj, context)
            self.head = "" if head is None else head.name
        if not self.alpha:
            images = alpha_images(obj)
            self.alpha = images[0].name if len(images) == 1 else ""
        return context.window_manager.invoke_props_dialog(self, confirm_text="Sort")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop_search(self, "head", bpy.data, "objects")
        layout.prop(self, "by")
        layout.prop_search(self, "dangling", context.object, "vertex_groups")
        layout.prop(self, "direction")
        layout.prop(self, "use_occlusion")
        column = layout.column()
        if not self.use_occlusion:
            column.active = False
            column.label(text="Without Ambient Occlusion:", icon="BLANK1")
        column.prop_search(self, "alpha", bpy.data, "images")
        for parameter in CardOcclusionSettings.parameters():
            column.prop(self, parameter.name)

    def steps(self: Any, context: bpy.types.Context) -> Steps[None]:
        obj = active_mesh(context)
        assert obj is not None
        options = SortOptions(
            head=_named_head(self.head, obj),
            by=self.by,
            direction=self.direction,
            dangling=self.dangling,
            occlusion=settings_of(self, CardOcclusionSettings) if self.use_occlusion else None,
            alpha=_named_image(self.alpha),
        )
        steps = sort_steps(obj, context.evaluated_depsgraph_get(), options)
        self._report(obj, (yield from as_progress(steps)))

    def _report(self, obj: bpy.types.Object, result: SortedCards) -> None:
        for note in result.notes:
            report(self, "WARNING", f"{obj.name}: {note}")
        moved = f"{result.moved} of {result.face_count} faces moved"
        count = "1 card" if result.card_count == 1 else f"{result.card_count} cards"
        report(self, "INFO", f"Sorted {count}; {moved}")


def _can_sort(operator: type[Any], context: bpy.types.Context) -> bool:
    obj = active_mesh(context)
    if obj is None:
        operator.poll_message_set("Select a mesh of hair cards")
    elif not obj.is_editable or not obj.data.is_editable:
        operator.poll_message_set("It is linked from another file: make it local first")
    elif obj.mode != "OBJECT":
        operator.poll_message_set("Go back to Object Mode first")
    else:
        return True
    return False


def _likely_head(cards: bpy.types.Object, context: bpy.types.Context) -> bpy.types.Object | None:
    """The parent mesh, else the only other selected mesh; None: there is neither."""
    if cards.parent is not None and cards.parent.type == "MESH":
        return cards.parent
    others = [obj for obj in context.selected_objects if obj.type == "MESH" and obj != cards]
    return others[0] if len(others) == 1 else None


def _named_head(name: str, cards: bpy.types.Object) -> bpy.types.Object | None:
    if not name:
        return None
    head = bpy.data.objects.get(name)
    if head is None or head.type != "MESH" or head == cards:
        raise HairloomError(
            "it is not a mesh that hair can grow from" if head else "there is no such object",
            place=f"Head '{name}'",
            remedy="Choose the mesh of the head, or none",
        )
    return head


def _named_image(name: str) -> bpy.types.Image | None:
    if not name:
        return None
    image = bpy.data.images.get(name)
    if image is None:
        raise HairloomError(
            "there is no such picture", place=f"Alpha '{name}'", remedy="Choose one, or none"
        )
    return image


CLASSES = (HAIRLOOM_OT_sort_cards,)
