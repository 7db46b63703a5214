"""The result of an operator or verb, for the user."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy

from ...pipeline import Rig


@dataclass(frozen=True)
class Outcome:
    """A result in one line, what was dropped, and warnings."""

    result: str
    dropped: dict[str, int]
    warnings: tuple[str, ...] = ()


def notes_of(hair: bpy.types.Object, rig: Rig) -> tuple[str, ...]:
    """Notes of the rig, with the hair's name."""
    return tuple(f"{hair.name}: {note}" for note in rig.notes)


def dropped_phrase(dropped: dict[str, int]) -> str:
    """Such as "dropped 3 (fewer than two points), 1 (no length)"; empty if nothing was."""
    reasons: Iterable[str] = (f"{count:,} ({reason})" for reason, count in dropped.items())
    return "dropped " + ", ".join(reasons) if dropped else ""
