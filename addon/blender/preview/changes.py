"""What Blender has evaluated anew, as a groom sees it."""

from __future__ import annotations

import bpy

from ..cards.occluders import shading_objects
from ..sessions.session import Session

#: what may light hair anew; a light that was hidden or deleted is told of as its scene's change
_LIGHTING = (bpy.types.Light, bpy.types.World, bpy.types.Collection, bpy.types.Scene)


def changes(depsgraph: bpy.types.Depsgraph) -> tuple[set[int], set[int], bool]:
    """Session numbers of what has moved or changed shape, of changed shapes; if lights changed."""
    moved, edited, is_lit_anew = set(), set(), False
    for update in depsgraph.updates:
        changed = update.id.original  # the evaluated copy has no session number
        if update.is_updated_geometry or update.is_updated_transform:
            moved.add(changed.session_uid)
        if update.is_updated_geometry:
            edited.add(changed.session_uid)
        is_light = isinstance(changed, bpy.types.Object) and changed.type == "LIGHT"
        is_lit_anew |= is_light or isinstance(changed, _LIGHTING)
    return moved, edited, is_lit_anew


def is_edited(session: Session, edited: set[int]) -> bool:
    """Whether the curves changed by themselves, not because modifiers carry them with the head."""
    if session.uid not in edited:
        return False
    hair = session.hair.handle.find()
    is_carried = session.head is not None and session.head.handle.uid in edited
    return hair is not None and not (is_carried and len(hair.modifiers))


def is_weighted_anew(session: Session, edited: set[int]) -> bool:
    """Whether the head's own mesh changed, and with it maybe the weights that children grow by."""
    if session.head is None or not session.settings.children_density:
        return False
    head = session.head.handle.find()
    return head is not None and head.data.session_uid in edited


def is_shaded_anew(session: Session, changed: set[int], layer: bpy.types.ViewLayer) -> bool:
    """Whether other hair that shades the cards of this groom may have changed, come or gone."""
    if not session.cards.is_shaded_by_others:
        return False
    others = shading_objects(session.hair.handle.find(), layer)
    uids = {each.session_uid for each in others}
    data = {each.data.session_uid for each in others}
    return uids != session.cards.shaded_by or not changed.isdisjoint(uids | data)


def is_among(session: Session, moved: set[int]) -> bool:
    """Whether the groom or its head has moved."""
    bodies = (session.hair, session.head)
    return any(body is not None and body.handle.uid in moved for body in bodies)
