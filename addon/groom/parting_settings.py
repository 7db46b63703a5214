"""Settings of combing hair away from partings."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, number


@dataclass(frozen=True, kw_only=True)
class PartingSettings(Settings):
    """How roots lean away from a parting."""

    section = "parting"
    title = "Comb from Partings"
    help_page = "styling#partings"

    amount: float = number(
        0.8,
        label="Amount",
        description="Amount by which roots beside a parting turn away from it",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    width: float = number(
        0.2,
        label="Width",
        description="Maximum distance from a parting at which roots turn, as a fraction of the "
        "hair's length",
        soft=(0.01, 0.5),
        hard=(0.0, 10.0),
    )
    along: float = number(
        0.6,
        label="Along",
        description="Fraction of each curve that turns, from its root",
        unit="factor",
        soft=(0.05, 1.0),
        hard=(0.01, 1.0),
    )
    lift: float = number(
        0.4,
        label="Lift",
        description="Amount by which hair rises from the surface where it turns away; 0 lies flat",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
    )
