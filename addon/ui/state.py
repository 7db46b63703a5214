"""Where the artist looks first: what moves the hair, how much of it there is, and what is wrong."""

from __future__ import annotations

import bpy

from ..blender.base.outcome import dropped_phrase
from ..blender.preview import previews as registry
from ..blender.preview.diagnostics import Issue, instances_note, issues_of
from ..blender.preview.phases import Phase
from ..blender.preview.previews import previews
from ..blender.sessions.measures import PARTS, array_bytes
from ..blender.sessions.session import Session
from ..blender.viewport import view_transform
from ..blender.viewport.overlay import statistics_of
from .messages import draw_lines, draw_message

_MEGABYTE = 1 << 20


def draw_state(layout: bpy.types.UILayout, context: bpy.types.Context, session: Session) -> None:
    """Counts, times and memory of a previewed groom."""
    lines = layout.column(align=True)
    if not session.is_made:
        draw_lines(lines, context, f"It {registry.BUILDING}")
        return
    rig = session.rig
    lines.label(text=f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides")
    if session.snapshot.cards is not None:
        cards, triangles, _ = session.cards.counts
        lines.label(text=f"Shown: {cards:,} cards, {triangles:,} triangles")
    else:
        drawn = statistics_of(session.uid)
        lines.label(text=f"Shown: {drawn.strands:,} strands, {drawn.vertices:,} vertices")
    size = array_bytes(rig, session.snapshot) / _MEGABYTE
    lines.label(text=f"Memory: {size:,.0f} MB" if size >= 10.0 else f"Memory: {size:.1f} MB")
    for part in PARTS:  # also without a number: lines that come and go move all below
        spent = session.times.milliseconds(part)
        lines.label(text=f"{part.capitalize()}: {_shown(spent)}")
    draw_lines(lines, context, _moved_by(session))


def _shown(spent: float | None) -> str:
    if spent is None:
        return "-"
    return f"{spent:,.0f} ms" if spent >= 100.0 else f"{spent:.1f} ms"


def draw_issues(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    hair: bpy.types.Object,
    session: Session | None,
) -> None:
    """What is wrong, each with the button that fixes it; then what else the artist should know."""
    issues = issues_of(hair, session)
    for issue in issues:
        _draw_issue(layout, context, issue)
    if session is None:
        return
    if session.source.dropped:
        draw_message(layout, context, dropped_phrase(session.source.dropped).capitalize(), "INFO")
    reported = {issue.instead_of for issue in issues}
    problems = previews[session.uid].problems
    drawn = statistics_of(session.uid).notes
    others = filter(None, (problems, view_transform.problem(), instances_note(hair), *drawn))
    for warning in dict.fromkeys((*session.warnings, *others)):
        if warning not in reported:
            draw_message(layout, context, warning.removeprefix(f"{hair.name}: "), "ERROR")


def _draw_issue(layout: bpy.types.UILayout, context: bpy.types.Context, issue: Issue) -> None:
    box = layout.box().column(align=True)
    draw_lines(box, context, issue.text, "ERROR")
    box.operator(issue.operator, text=issue.button, icon="MODIFIER")


def _moved_by(session: Session) -> str:
    """What moves the hair at the moment, such as "Simulated on the GPU (OpenGL, llvmpipe)"."""
    preview = previews[session.uid]
    if preview.phase is Phase.BAKED and preview.bake is not None:
        return "Shown from the bake" + (", which is out of date" if preview.bake.changed else "")
    if session.is_pending:
        return f"Other hair {registry.BUILDING}"
    if preview.phase is Phase.WAITING or preview.is_deferred:
        return f"It {registry.WAITING}"
    computed = "Simulated" if session.is_playing else "To be simulated"
    return f"{computed} on the {session.computed_on}"


def draw_notice(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Why a preview has ended by itself, if one has."""
    if registry.notice():
        draw_message(layout, context, registry.notice(), "ERROR")
