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
        description="Factor on the light that strands block on its way from all sides; they send "
        "about half of it on",
        soft=(0.0, 10.0),
        hard=(0.0, 10_000.0),
        source="Kajiya and Kay 1989, section 2; Kim and Neumann 2001, opacity shadow maps",
    )
    upper_fraction: float = number(
        0.4,
        label="Light from Above",
        description="0: light comes evenly from all sides, 1: only from straight above",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    ao_bias: float = number(
        0.5,
        label="AO Bias",
        description="Fraction of the sky that counts as unoccluded; the surface of a solid body "
        "sees half of it",
        unit="factor",
        soft=(0.25, 1.0),
        hard=(0.05, 1.0),
    )
    scalp_extinction: float = number(
        2.0,
        label="Scalp Extinction",
        description="Extinction of light on its way to the skin; higher than Extinction, so that "
        "the scalp does not shine through",
        soft=(0.0, 30.0),
        hard=(0.0, 10_000.0),
    )
    cell_count: int = integer(
        56,
        label="Resolution",
        description="Cells of the grid along the longest side of the hair; short hair gets "
        "smaller ones",
        soft=(16, 96),
        hard=(4, 256),
    )
