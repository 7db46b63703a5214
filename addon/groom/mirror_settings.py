"""Settings of mirroring hair."""

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
            ("positive", "Positive", "On X, the left of a character that faces -Y"),
            ("negative", "Negative", "On X, the right of a character that faces -Y"),
        ),
        label="From",
        description="Side of the axis to copy to the other side",
    )
    axis: str = choice(
        "x",
        (
            ("x", "X", "Between left and right of an upright head"),
            ("y", "Y", "Between front and back of an upright head"),
            ("z", "Z", "Between top and bottom of an upright head"),
        ),
        label="Axis",
        description="Local axis of the surface object to mirror along, about its origin",
    )
