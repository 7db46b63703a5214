"""Parameters of ambient occlusion."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer, number


@dataclass(frozen=True, kw_only=True)
class AmbientSettings(Settings):
    """Shade between the strands, from light that comes from all sides."""

    section = "ambient"
    title = "Ambient Occlusion"
    owner = "groom"

    strength: float = number(
        1.0,
        label="Strength",
        description="How much of the shade between the strands is shown",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    extinction: float = number(
        2.0,
        label="Extinction",
        description="How fast light dies in the hair, as a factor of what the strands' radius "
        "gives; raise it where few strands stand for many",
        soft=(0.0, 10.0),
        hard=(0.0, 10_000.0),
        source="Kajiya and Kay 1989, section 2; Kim and Neumann 2001, opacity shadow maps",
    )
    upper_fraction: float = number(
        0.4,
        label="Light from Above",
        description="0: the sky shines from all sides alike, 1: from straight above only",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    open_sky: float = number(
        0.5,
        label="AO Bias",
        description="Fraction of the sky that counts as no shade at all: half of it is what the "
        "surface of a solid body sees",
        unit="factor",
        soft=(0.25, 1.0),
        hard=(0.05, 1.0),
    )
    scalp_extinction: float = number(
        12.0,
        label="Scalp Extinction",
        description="How fast light dies in hair on its way to the skin; higher than Extinction, "
        "so that a scalp does not shine through strands that stand for many",
        soft=(0.0, 30.0),
        hard=(0.0, 10_000.0),
    )
    cell_count: int = integer(
        56,
        label="Resolution",
        description="Cells of the grid along the longest side of the hair",
        soft=(16, 96),
        hard=(4, 256),
    )
