"""Settings of where widths come from."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice
from .widths import METHODS


@dataclass(frozen=True, kw_only=True)
class WidthSettings(Settings):
    """Where the widths of strands come from."""

    section = "widths"
    title = "Widths"
    help_page = "user_guide#strands-and-children"
    owner = "groom"
    is_animatable = False

    method: str = choice(
        "auto",
        METHODS,
        label="Widths",
        description="Source of the strands' widths",
        source="Robbins 2012, Chemical and Physical Behavior of Human Hair, chapter 9",
    )
