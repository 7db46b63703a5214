"""The hair and meshes that the artist's selection refers to."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from ..blender.base.objects import head_of, is_hidden, objects_in
from ..blender.preview import previews
from ..errors import HairloomError


def target_hair(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The hair that buttons and panels apply to, the active first.

    In a pinned Properties editor this is the hair that it shows. Otherwise these are the selected
    hair curves; else the hair whose cards are selected; else the hair on selected meshes, as when
    the head is being moved; else previewed hair.
    """
    pinned = pinned_hair(context)
    if pinned is not None:
        return [pinned]
    candidates = [context.active_object, *context.selected_objects]
    selected = list(dict.fromkeys(obj for obj in candidates if obj is not None))
    hair = [obj for obj in selected if obj.type == "CURVES"]
    return hair or _hair_of_cards(selected) or _hair_on_meshes(selected, context) or _previewed()


def pinned_hair(context: bpy.types.Context) -> bpy.types.Object | None:
    """The hair that a pinned Properties editor shows, whatever is selected."""
    space = context.space_data
    if not isinstance(space, bpy.types.SpaceProperties) or not space.use_pin_id:
        return None
    pinned = space.pin_id
    if isinstance(pinned, bpy.types.Object):
        return pinned if pinned.type == "CURVES" else None
    users = (obj for obj in objects_in(context.view_layer) if obj.data == pinned)
    return next((obj for obj in users if obj.type == "CURVES"), None)


def without_linked_duplicates(grooms: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """The first of each set of linked duplicates: a tool must change shared curves only once."""
    firsts: dict[bpy.types.ID, bpy.types.Object] = {}
    for hair in grooms:
        firsts.setdefault(hair.data, hair)
    return list(firsts.values())


def _hair_of_cards(objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """The hair that these cards were made from."""
    hair = [obj.hairloom.card_object.groom for obj in objects if obj.type == "MESH"]
    return list(dict.fromkeys(obj for obj in hair if obj is not None))


def _hair_on_meshes(
    meshes: list[bpy.types.Object], context: bpy.types.Context
) -> list[bpy.types.Object]:
    everything = objects_in(context.view_layer)
    hair = [obj for obj in everything if obj.type == "CURVES" and head_of(obj) in meshes]
    # hidden hair, such as the original after Make Real, only counts if there is no other
    return [obj for obj in hair if not is_hidden(obj, context.view_layer)] or hair


def _previewed() -> list[bpy.types.Object]:
    found = [session.hair.handle.find() for session in previews.sessions()]
    return [obj for obj in found if obj is not None]


def active_mesh(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object, if it is a mesh and selected."""
    active = context.active_object
    is_mesh = active is not None and active.type == "MESH" and active.select_get()
    return active if is_mesh else None


def growth_mesh(context: bpy.types.Context) -> bpy.types.Object | None:
    """The mesh to grow hair on: the active one, or the active hair's.

    The latter because newly grown hair is active, and Blender offers Adjust Last Operation only if
    the operator could run again in that state.
    """
    active = context.active_object
    if active is not None and active.type == "CURVES" and active.select_get():
        return head_of(active)
    return active_mesh(context)


def in_object_mode(operator: type[Any], context: bpy.types.Context) -> bool:
    """For `poll`: whether no object is being edited; the greyed-out button says so."""
    if context.mode == "OBJECT":
        return True
    operator.poll_message_set("Go back to Object Mode first")
    return False


def needs_hair(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """For `poll`: whether hair curves are selected; the greyed-out button says so."""
    if target_hair(context):
        return True
    operator.poll_message_set(
        "Select hair curves first, or add some: Add > Curve > Hairloom Hairstyle"
    )
    return False


def make_active(context: bpy.types.Context, objects: list[bpy.types.Object]) -> None:
    """Select these objects alone; the last becomes active.

    Raises:
        HairloomError: one is not in this view layer, such as hair previewed in another scene.
    """
    for selected in context.selected_objects:
        selected.select_set(False)
    for obj in objects:
        try:
            obj.select_set(True)
        except RuntimeError as error:
            raise HairloomError(
                "it is not in this view layer",
                place=obj.name,
                remedy="Switch to its scene, or include its collection",
            ) from error
        context.view_layer.objects.active = obj
