"""What the artist sets about the look of strands: their shading and their drawn width."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..params import Settings, color, number

_SCHEUERMANN = "Scheuermann 2004, hair shading"


@dataclass(frozen=True, kw_only=True)
class ShadingSettings(Settings):
    """Kajiya-Kay with Scheuermann's two shifted highlights."""

    section: ClassVar[str] = "shading"
    title: ClassVar[str] = "Shading"

    base_color: tuple[float, float, float] = color(
        (0.055, 0.03, 0.018),
        label="Colour",
        description="Colour of the hair; it tints the highlights as well",
        source=_SCHEUERMANN,
    )
    primary_color: tuple[float, float, float] = color(
        (0.75, 0.88, 1.0),
        label="First Highlight",
        description="Colour of the highlight on the surface of the hair, before the hair tints it",
        source=_SCHEUERMANN,
    )
    primary_strength: float = number(
        9.0,
        label="First Strength",
        description="Brightness of the first highlight, as a factor of the diffuse light",
        soft=(0.0, 20.0),
        hard=(0.0, 100.0),
        source=_SCHEUERMANN,
    )
    primary_exponent: float = number(
        90.0,
        label="First Sharpness",
        description="Exponent of the first highlight; higher is narrower",
        soft=(2.0, 300.0),
        hard=(1.0, 2000.0),
        source=_SCHEUERMANN,
    )
    primary_shift: float = number(
        0.1,
        label="First Shift",
        description="Moves the first highlight to the tips, or to the roots when negative",
        soft=(-0.5, 0.5),
        hard=(-2.0, 2.0),
        source=_SCHEUERMANN,
    )
    secondary_color: tuple[float, float, float] = color(
        (1.0, 0.75, 0.5),
        label="Second Highlight",
        description="Colour of the highlight that has passed through the hair",
        source=_SCHEUERMANN,
    )
    secondary_strength: float = number(
        5.0,
        label="Second Strength",
        description="Brightness of the second highlight, as a factor of the diffuse light",
        soft=(0.0, 20.0),
        hard=(0.0, 100.0),
        source=_SCHEUERMANN,
    )
    secondary_exponent: float = number(
        22.0,
        label="Second Sharpness",
        description="Exponent of the second highlight; higher is narrower",
        soft=(2.0, 300.0),
        hard=(1.0, 2000.0),
        source=_SCHEUERMANN,
    )
    secondary_shift: float = number(
        -0.14,
        label="Second Shift",
        description="Moves the second highlight to the tips, or to the roots when negative",
        soft=(-0.5, 0.5),
        hard=(-2.0, 2.0),
        source=_SCHEUERMANN,
    )
    shift_noise: float = number(
        0.2,
        label="Shift Noise",
        description="How much the shift differs from strand to strand, which breaks up the bands",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
        source=_SCHEUERMANN,
    )
    sparkle: float = number(
        0.6,
        label="Sparkle",
        description="How much noise breaks up the second highlight",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source=_SCHEUERMANN,
    )
    noise_cells: float = number(
        4.0,
        label="Noise Cells",
        description="Cells of the shift and sparkle noise between root and tip",
        soft=(0.0, 32.0),
        hard=(0.0, 1000.0),
    )
    color_variation: float = number(
        0.3,
        label="Colour Variation",
        description="How much strands differ in brightness",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    ambient: float = number(
        1.0,
        label="Ambient",
        description="Factor of the light that comes evenly from the world",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
    )


@dataclass(frozen=True, kw_only=True)
class StrandSettings(Settings):
    """How wide strands are drawn."""

    section: ClassVar[str] = "strands"
    title: ClassVar[str] = "Strands"

    width_scale: float = number(
        1.0,
        label="Width Scale",
        description="Factor of the strands' radius; raise it where few strands stand for many",
        soft=(0.1, 10.0),
        hard=(0.0, 1000.0),
    )
    tip_width: float = number(
        0.5,
        label="Tip Width",
        description="Width at the tip, as a factor of the width at the root",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    minimum_width: float = number(
        1.0,
        label="Minimum Width",
        description="Strands are never drawn thinner than this many pixels at the root",
        soft=(0.0, 4.0),
        hard=(0.0, 100.0),
    )
