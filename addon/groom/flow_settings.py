"""Settings of combing hair along strokes."""

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
        description="Amount by which hair at a stroke turns to the stroke's direction",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    reach: float = number(
        0.25,
        label="Reach",
        description="Maximum distance from a stroke at which hair follows it, as a fraction of "
        "the hair's length",
        soft=(0.02, 1.0),
        hard=(0.001, 100.0),
    )
    falloff: float = number(
        0.7,
        label="Falloff",
        description="Fraction of Reach over which the effect fades out; 0 ends it abruptly at "
        "Reach",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    lift: float = number(
        0.1,
        label="Lift",
        description="Amount by which hair rises from the surface, in addition to the stroke's own "
        "rise; at 0 it lies as flat as the stroke",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
    )
    length: float = number(
        0.0,
        label="Length",
        description="Amount by which hair takes on the length of the stroke beside its root; 0 "
        "keeps its own length",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
