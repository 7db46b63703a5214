"""What the artist sets about combing hair along strokes."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, number


@dataclass(frozen=True, kw_only=True)
class FlowSettings(Settings):
    """How hair follows strokes that are drawn on its surface."""

    section = "flow"
    title = "Comb Along Flow"
    help_page = "styling#flow"

    amount: float = number(
        1.0,
        label="Amount",
        description="How far hair at a stroke turns to its direction",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    reach: float = number(
        0.25,
        label="Reach",
        description="Distance from a stroke up to which hair follows it, as a fraction of the "
        "hair's length",
        soft=(0.02, 1.0),
        hard=(0.001, 100.0),
    )
    falloff: float = number(
        0.7,
        label="Falloff",
        description="Part of Reach in which the stroke's effect fades: 0 ends at Reach at once",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    lift: float = number(
        0.1,
        label="Lift",
        description="How much hair rises from the surface, beside what the stroke itself rises: 0 "
        "lies as flat as the stroke",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
    )
    length: float = number(
        0.0,
        label="Length",
        description="How far hair becomes as long as the stroke beside its root: 0 keeps its "
        "length",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
