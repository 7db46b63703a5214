"""What the overlay draws of a groom, and in which views, as Blender shows it and its head."""

from __future__ import annotations

import bpy

from ..base.objects import is_solid, layers_with, spaces_without
from ..cards.show import as_shown, without_strands
from ..sessions.session import Session
from ..sessions.shown import with_all_strands
from .aids import aids_of
from .overlay import Drawing


def drawing_of(
    session: Session, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, note: str = ""
) -> Drawing:
    """What is drawn of this groom now.

    Args:
        note: is written into the views.
    """
    snapshot, head = as_shown(session.snapshot), None
    if not session.is_made:
        snapshot = without_strands(snapshot)
    if session.head is not None:
        head = session.head.handle.find()
    if head is None or not is_solid(head):
        snapshot = with_all_strands(snapshot)
    seen_in = layers_with(hair)
    return Drawing(
        snapshot,
        is_visible=bool(seen_in),
        is_made=session.is_made,
        seen_in=seen_in,
        hidden_in=spaces_without(hair),
        bare_in=frozenset() if head is None else spaces_without(head),
        guide_count=len(session.rig.guides),
        card_counts=session.cards.counts if snapshot.cards is not None else (),
        counts_of=hair.name if hair.hairloom.show_counts or snapshot.debug_view != "none" else "",
        note=note,
        aids=aids_of(session, hair, depsgraph),
    )
