"""The state of hair at the top of the panels: what moves it, counts, and problems."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import bpy

from ..blender.base.gpu_preferences import memory_in_use, memory_problem
from ..blender.base.outcome import dropped_phrase
from ..blender.preview import previews as registry
from ..blender.preview.diagnostics import instances_note, issues_of, size_note, unfelt_note
from ..blender.preview.phases import Phase
from ..blender.preview.previews import previews
from ..blender.properties.properties import TRANSLATION_CONTEXT
from ..blender.sessions.measures import array_bytes
from ..blender.sessions.session import Session
from ..blender.viewport import view_transform
from ..blender.viewport.overlay import notes_of, statistics_of
from .long_work import draw_esc, running_label
from .messages import draw_lines, draw_message
from .texts import translated

_MEGABYTE = 1 << 20
#: fraction of a line for the name of its value
NAME_FRACTION = 0.36
#: text for a missing value
_NONE = "-"


@dataclass(frozen=True)
class Problem:
    """A problem, or something worth knowing. operator, button: those that fix it, if any."""

    text: str
    operator: str = ""
    button: str = ""


class Statistic(NamedTuple):
    """A line about the hair."""

    name: str
    value: str


def draw_state(layout: bpy.types.UILayout, session: Session | None) -> None:
    """Draw what moves the hair, counts, memory and times, with the same number of short lines in
    any state, so that buttons below do not move away from under the mouse."""
    lines = layout.column(align=True)
    for name, text in (Statistic("State", _state(session)), *_statistics(session)):
        parts = lines.split(factor=NAME_FRACTION)
        parts.label(text=name, text_ctxt=TRANSLATION_CONTEXT)
        row = parts.row(align=True)
        if name == "State" and running_label():
            row.label(text=running_label())
            draw_esc(row)
            continue
        row.label(text=text, translate=False)
        if name == "State" and session is not None and not session.is_made:
            row.operator("hairloom.cancel_build", text="", icon="X")


def _state(session: Session | None) -> str:
    """What moves the hair at the moment."""
    if session is None:
        return translated("not previewed")
    if not session.is_made:
        return _build_text(session.stage)
    preview = previews[session.uid]
    if preview.phase is Phase.BAKED and preview.bake is not None and session.is_recorded:
        is_stale = preview.bake.changed_inputs
        return translated("baked, out of date") if is_stale else translated("baked")
    if session.is_pending:
        return _build_text(session.stage)
    if preview.phase is Phase.WAITING or preview.is_deferred:
        return translated("waits for collider")
    device = session.device_name.partition(" ")[0]
    if session.is_playing:
        return translated("simulated, {device}", device=device)
    return translated("at rest, {device}", device=device)


def _build_text(stage: str) -> str:
    """What is being made; stages are those of `prepared_groom`."""
    texts = {
        "strands": translated("makes strands"),
        "ambient occlusion": translated("makes ambient occlusion"),
        "what the head hides": translated("finds what the head hides"),
        "light": translated("makes light"),
    }
    return texts.get(stage) or translated("makes hair")


def draw_card_progress(layout: bpy.types.UILayout, session: Session | None) -> bool:
    """Draw the stage of cards that are being built, with a button to cancel; returns whether any
    are."""
    if session is None or not session.cards.is_pending:
        return False
    row = layout.row(align=True)
    stage = session.cards.stage
    named = translated("Cards: {stage}", stage=_card_stage(stage))
    text = named if stage else translated("Cards: waiting")
    row.label(text=text, icon="SORTTIME", translate=False)
    row.operator("hairloom.cancel_build", text="", icon="X")
    return True


def _card_stage(stage: str) -> str:
    """The name of a stage of building cards."""
    texts = {
        "Other hair": translated("Other hair"),
        "Cards from strands": translated("Cards from strands"),
        "Shells from strands": translated("Shells from strands"),
        "Levels of detail": translated("Levels of detail"),
        "Atlas": translated("Atlas"),
        "Check of the order": translated("Check of the order"),
        "Textures": translated("Textures"),
    }
    return texts.get(stage, stage)


def _statistics(session: Session | None) -> Iterator[Statistic]:
    """All figures, also for hair that is not made."""
    rig = None if session is None or not session.is_made else session.rig
    drawn: tuple[str, ...] = (_NONE, _NONE)
    if session is not None and rig is not None:
        drawn = _drawn_counts(session)
    yield Statistic("Strands", _NONE if rig is None else f"{rig.strands.strand_count:,}")
    yield Statistic("Guides", _NONE if rig is None else f"{len(rig.guides):,}")
    yield Statistic("Drawn", drawn[0])
    yield Statistic("", drawn[1])
    size = 0 if session is None or rig is None else array_bytes(rig, session.snapshot)
    memory = translated(
        "{size:,.0f} MB, GPU {on_gpu:,.0f} MB", size=size / _MEGABYTE, on_gpu=memory_in_use()
    )
    yield Statistic("Memory", memory if size else _NONE)
    yield Statistic("Simulation", _time(session, "simulation"))
    yield Statistic("Drawing", _time(session, "drawing"))


def _drawn_counts(session: Session) -> tuple[str, str]:
    """The number of drawn strands or cards, and of their vertices or triangles."""
    if session.snapshot.cards is not None:
        cards, triangles, _ = session.cards.counts
        return (
            translated("{count:,} cards", count=cards),
            translated("{count:,} triangles", count=triangles),
        )
    drawn = statistics_of(session.uid)
    return (
        translated("{count:,} strands", count=drawn.strands),
        translated("{count:,} vertices", count=drawn.vertices),
    )


def _time(session: Session | None, part: str) -> str:
    milliseconds = None if session is None else session.times.milliseconds(part)
    if milliseconds is None:
        return _NONE
    return f"{milliseconds:,.0f} ms" if milliseconds >= 100.0 else f"{milliseconds:.1f} ms"


def problems_of(hair: bpy.types.Object, session: Session | None) -> tuple[Problem, ...]:
    """The problems, worst first, then other notes for the artist."""
    notices = [Problem(registry.notice())] if registry.notice() else []
    issues = issues_of(hair, session)
    problems = [*notices, *(Problem(each.text, each.operator, each.button) for each in issues)]
    if session is None:
        return tuple(problems)
    if session.source.dropped:
        problems.append(Problem(dropped_phrase(session.source.dropped).capitalize()))
    reported = {issue.instead_of for issue in issues}
    others = (
        previews[session.uid].problems,
        memory_problem(),
        view_transform.problem(),
        instances_note(hair),
        unfelt_note(session),
        size_note(session),
        *notes_of(session.uid),
    )
    for warning in dict.fromkeys((*session.warnings, *filter(None, others))):
        if warning not in reported:
            problems.append(Problem(warning.removeprefix(f"{hair.name}: ")))
    return tuple(problems)


def draw_problems_row(
    layout: bpy.types.UILayout, hair: bpy.types.Object, session: Session | None
) -> None:
    """Draw one row in any state: the number of problems, as a button that shows them, and the
    button that fixes the worst."""
    problems, row = problems_of(hair, session), layout.row(align=True)
    if not problems:
        row.label(text="No problems", icon="CHECKMARK")
        return
    several = translated("{count} problems", count=len(problems))
    text = translated("1 problem") if len(problems) == 1 else several
    row.operator("hairloom.show_problems", text=text, icon="ERROR", translate=False)
    fixable = next((problem for problem in problems if problem.operator), None)
    if fixable is not None:
        row.operator(fixable.operator, text=fixable.button, icon="MODIFIER")


def draw_problems(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    hair: bpy.types.Object,
    session: Session | None,
    width: float,
) -> None:
    """Draw all problems in full, each with its button. width: of the popup, see `draw_lines`."""
    for problem in problems_of(hair, session):
        box = layout.box().column(align=True)
        draw_lines(box, context, problem.text, "ERROR", width=width)
        if problem.operator:
            box.operator(problem.operator, text=problem.button, icon="MODIFIER")


def draw_notice(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw why a preview has ended by itself, if one has; for panels without hair."""
    if registry.notice():
        draw_message(layout, context, registry.notice(), "ERROR")
