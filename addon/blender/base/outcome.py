"""What an operator or a verb has done, in words for whoever asked for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy

from ...pipeline import Rig


@dataclass(frozen=True)
class Outcome:
    """What happened: one line of result, what was dropped, and what the artist should know."""

    result: str
    dropped: dict[str, int]
    warnings: tuple[str, ...] = ()


def notes_of(hair: bpy.types.Object, rig: Rig) -> tuple[str, ...]:
    """What the artist should know of how the hair was made ready."""
    return tuple(f"{hair.name}: {note}" for note in rig.notes)


def dropped_phrase(dropped: dict[str, int]) -> str:
    """Such as "dropped 3 (fewer than two points), 1 (no length)"; empty where nothing was."""
    reasons: Iterable[str] = (f"{count:,} ({reason})" for reason, count in dropped.items())
    return "dropped " + ", ".join(reasons) if dropped else ""
