"""Where the artist looks first: what moves the hair, how much of it there is, and what is wrong."""

from __future__ import annotations

import bpy

from ..blender.base.outcome import dropped_phrase
from ..blender.preview import late, live, timeline
from ..blender.preview.troubles import Trouble, instances_note, troubles_of
from ..blender.sessions import measures
from ..blender.sessions.session import Session
from ..blender.viewport import view_transform
from ..blender.viewport.overlay import statistics_of
from .messages import draw_lines, draw_message

_MEGABYTE = 1 << 20


def draw_state(layout: bpy.types.UILayout, context: bpy.types.Context, session: Session) -> None:
    """Counts, times and memory of a previewed groom."""
    lines = layout.column(align=True)
    if not session.is_made:
        draw_lines(lines, context, f"It {live.MAKING}")
        return
    rig = session.rig
    lines.label(text=f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides")
    if session.snapshot.cards is not None:
        cards, triangles, _ = session.cards.counts
        lines.label(text=f"Shown: {cards:,} cards, {triangles:,} triangles")
    else:
        drawn = statistics_of(session.uid)
        lines.label(text=f"Shown: {drawn.strands:,} strands, {drawn.vertices:,} vertices")
    size = measures.array_bytes(rig, session.snapshot) / _MEGABYTE
    lines.label(text=f"Memory: {size:,.0f} MB" if size >= 10.0 else f"Memory: {size:.1f} MB")
    for part in measures.PARTS:  # also without a number: lines that come and go move all below
        spent = measures.milliseconds(session.uid, part)
        lines.label(text=f"{part.capitalize()}: {_shown(spent)}")
    draw_lines(lines, context, _moved_by(session))


def _shown(spent: float | None) -> str:
    if spent is None:
        return "-"
    return f"{spent:,.0f} ms" if spent >= 100.0 else f"{spent:.1f} ms"


def draw_troubles(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    hair: bpy.types.Object,
    session: Session | None,
) -> None:
    """What is wrong, each with the button that mends it; then what else the artist should know."""
    troubles = troubles_of(hair, session)
    for trouble in troubles:
        _draw_trouble(layout, context, trouble)
    if session is None:
        return
    if session.source.dropped:
        draw_message(layout, context, dropped_phrase(session.source.dropped).capitalize(), "INFO")
    told = {trouble.instead_of for trouble in troubles}
    others = filter(
        None, (timeline.trouble(session.uid), view_transform.trouble(), instances_note(hair))
    )
    for warning in dict.fromkeys((*session.warnings, *others)):
        if warning not in told:
            draw_message(layout, context, warning.removeprefix(f"{hair.name}: "), "ERROR")


def _draw_trouble(layout: bpy.types.UILayout, context: bpy.types.Context, trouble: Trouble) -> None:
    box = layout.box().column(align=True)
    draw_lines(box, context, trouble.text, "ERROR")
    box.operator(trouble.operator, text=trouble.button, icon="MODIFIER")


def _moved_by(session: Session) -> str:
    """What moves the hair at the moment, such as "Simulated on the GPU (OpenGL, llvmpipe)"."""
    baked = timeline.baked(session.uid)
    if baked is not None and baked.is_shown:
        return "Shown from the bake" + (", which is out of date" if baked.changed else "")
    if session.is_pending:
        return f"Other hair {live.MAKING}"
    if live.is_waiting(session) or late.is_late(session):
        return f"It {live.WAITING}"
    computed = "Simulated" if session.is_playing else "To be simulated"
    return f"{computed} on the {session.computed_on}"


def draw_notice(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Why a preview has ended by itself, if one has."""
    if live.notice():
        draw_message(layout, context, live.notice(), "ERROR")
