"""Settings of Kajiya-Kay's two highlights after Scheuermann; shading/settings.py holds the rest."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, color, number, when

_SOURCE = "Scheuermann 2004, hair shading"


@dataclass(frozen=True, kw_only=True)
class KajiyaKaySettings(Settings):
    """Parameters of the model Kajiya-Kay."""

    primary_color: tuple[float, float, float] = color(
        (0.75, 0.88, 1.0),
        label="First Highlight",
        description="Colour of the highlight on the surface of the hair, before the hair tints it",
        source=_SOURCE,
        panel="First Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    primary_strength: float = number(
        9.0,
        label="First Strength",
        description="Brightness of the first highlight relative to diffuse light",
        soft=(0.0, 20.0),
        hard=(0.0, 100.0),
        source=_SOURCE,
        panel="First Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    primary_exponent: float = number(
        90.0,
        label="First Gloss",
        description="Exponent of the first highlight; higher is narrower",
        soft=(2.0, 300.0),
        hard=(1.0, 2000.0),
        source=_SOURCE,
        panel="First Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    primary_shift: float = number(
        0.1,
        label="First Shift",
        description="Shift of the first highlight towards the tips, or towards the roots if "
        "negative",
        soft=(-0.5, 0.5),
        hard=(-2.0, 2.0),
        source=_SOURCE,
        panel="First Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    secondary_color: tuple[float, float, float] = color(
        (1.0, 0.75, 0.5),
        label="Second Highlight",
        description="Colour of the highlight that has passed through the hair",
        source=_SOURCE,
        panel="Second Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    secondary_strength: float = number(
        5.0,
        label="Second Strength",
        description="Brightness of the second highlight relative to diffuse light",
        soft=(0.0, 20.0),
        hard=(0.0, 100.0),
        source=_SOURCE,
        panel="Second Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    secondary_exponent: float = number(
        22.0,
        label="Second Gloss",
        description="Exponent of the second highlight; higher is narrower",
        soft=(2.0, 300.0),
        hard=(1.0, 2000.0),
        source=_SOURCE,
        panel="Second Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
    secondary_shift: float = number(
        -0.14,
        label="Second Shift",
        description="Shift of the second highlight towards the tips, or towards the roots if "
        "negative",
        soft=(-0.5, 0.5),
        hard=(-2.0, 2.0),
        source=_SOURCE,
        panel="Second Highlight",
        shown_when=when("shading.model", "kajiya_kay"),
    )
