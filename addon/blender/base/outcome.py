"""The result of an operator or verb, for the user."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import NamedTuple

import bpy

from ...errors import HairloomError
from ...rig_flow import Rig


@dataclass(frozen=True)
class Outcome:
    """A result in one line, counts of dropped strands by reason, and warnings."""

    result: str
    dropped: dict[str, int]
    warnings: tuple[str, ...] = ()


def notes_of(name: str, rig: Rig) -> tuple[str, ...]:
    """The notes of a rig, each with the hair's name."""
    return tuple(f"{name}: {note}" for note in rig.notes)


def dropped_phrase(dropped: dict[str, int]) -> str:
    """A phrase such as "dropped 3 (fewer than two points), 1 (no length)"; empty if none were."""
    reasons: Iterable[str] = (f"{count:,} ({reason})" for reason, count in dropped.items())
    return "dropped " + ", ".join(reasons) if dropped else ""


@dataclass
class Reports:
    """The reports of an operator. error: the one that stopped it."""

    messages: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    error: HairloomError | None = None


class PastReport(NamedTuple):
    """A report of an operator, kept for display.

    time: of day, as text. source: the operator's label.
    """

    time: str
    source: str
    kind: str
    text: str


#: the most recent reports, the oldest first
past_reports: deque[PastReport] = deque(maxlen=20)

#: where reports go while a job without a window runs an operator; None: to Blender
_COLLECTED: ContextVar[Reports | None] = ContextVar("collected reports", default=None)


@contextmanager
def collected_reports() -> Iterator[Reports]:
    """Collect the reports of operators inside; through Blender, errors would become mere text."""
    reports = Reports()
    token = _COLLECTED.set(reports)
    try:
        yield reports
    finally:
        _COLLECTED.reset(token)


def report(operator: bpy.types.Operator, kind: str, message: str | HairloomError) -> None:
    """Report to Blender, or to the job that runs the operator.

    Args:
        kind: "INFO", "WARNING" or "ERROR"; the message of an error is the error itself.
    """
    collected = _COLLECTED.get()
    if collected is None:
        past_reports.append(
            PastReport(time.strftime("%H:%M:%S"), operator.bl_label, kind, str(message))
        )
        operator.report({kind}, str(message))
    elif isinstance(message, HairloomError):
        collected.error = message
    else:
        (collected.messages if kind == "INFO" else collected.warnings).append(message)
