"""What the artist sets about mirroring hair."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice


@dataclass(frozen=True, kw_only=True)
class MirrorSettings(Settings):
    """Which hair is mirrored, and across which plane."""

    section = "mirror"
    title = "Mirror Hair"
    help_page = "styling#mirror"

    side: str = choice(
        "positive",
        (
            ("positive", "Positive", "Such as a character's left, if it faces -Y"),
            ("negative", "Negative", "Such as a character's right, if it faces -Y"),
        ),
        label="From",
        description="Side of the axis whose hair is mirrored to the other side",
    )
    axis: str = choice(
        "x",
        (
            ("x", "X", "From left to right of an upright head"),
            ("y", "Y", "From front to back of an upright head"),
            ("z", "Z", "From top to bottom of an upright head"),
        ),
        label="Axis",
        description="Axis of the surface's object across which hair is mirrored, at its origin",
    )
