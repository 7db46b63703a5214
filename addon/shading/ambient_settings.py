"""Parameters of ambient occlusion."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer, number


@dataclass(frozen=True, kw_only=True)
class AmbientSettings(Settings):
    """Shade between the strands, from light that comes from all sides."""

    section = "ambient"
    title = "Ambient Occlusion"
    help_page = "shading#shadows"
    owner = "groom"
    is_animatable = False

    strength: float = number(
        1.0,
        label="Strength",
        description="Amount of ambient occlusion between strands",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    extinction: float = number(
        0.4,
        label="Extinction",
        description="Factor on the surrounding light that strands block; they pass about half of "
        "it on",
        soft=(0.0, 10.0),
        hard=(0.0, 10_000.0),
        source="Kajiya and Kay 1989, section 2; Kim and Neumann 2001, opacity shadow maps",
    )
    upper_fraction: float = number(
        0.4,
        label="Light from Above",
        description="Direction of the surrounding light: 0 is even from all sides, 1 only from "
        "straight above",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    ao_bias: float = number(
        0.5,
        label="AO Bias",
        description="Fraction of visible sky that counts as unoccluded; the surface of a solid "
        "body sees one half",
        unit="factor",
        soft=(0.25, 1.0),
        hard=(0.05, 1.0),
    )
    scalp_extinction: float = number(
        2.0,
        label="Scalp Extinction",
        description="Extinction of light on its way to the skin; set higher than Extinction to "
        "keep the scalp from shining through",
        soft=(0.0, 30.0),
        hard=(0.0, 10_000.0),
    )
    cell_count: int = integer(
        56,
        label="Resolution",
        description="Number of grid cells along the longest side of the hair; short hair gets "
        "smaller cells",
        soft=(16, 96),
        hard=(4, 256),
    )
