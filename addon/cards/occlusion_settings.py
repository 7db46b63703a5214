"""Parameters of the ambient occlusion of hair cards."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer, number, toggle


@dataclass(frozen=True, kw_only=True)
class CardOcclusionSettings(Settings):
    """How hair and the body occlude light from all sides at the vertices of cards."""

    section = "card_occlusion"
    title = "Card Occlusion"
    help_page = "cards#cards-in-the-scene"
    owner = "groom"

    strength: float = number(
        1.0,
        label="Strength",
        description="Amount of ambient occlusion to store",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    extinction: float = number(
        2.0,
        label="Extinction",
        description="Extinction of light in cards of other grooms and in your own sorted cards, "
        "as a power of their transparency. Cards made from a groom use the occlusion of its "
        "strands",
        soft=(0.0, 10.0),
        hard=(0.0, 1_000.0),
    )
    rays: int = integer(
        256,
        label="Rays",
        description="Number of rays per vertex; time grows in proportion",
        soft=(64, 1024),
        hard=(1, 65_536),
    )
    reach: float = number(
        2.0,
        label="Reach",
        description="Maximum distance at which cards and bodies occlude, relative to the extent of "
        "all cards",
        soft=(0.05, 4.0),
        hard=(0.0, 1_000.0),
    )
    self_occlusion_distance: float = number(
        0.03,
        label="Self Distance",
        description="Distance beyond which a card occludes itself, relative to the extent of all "
        "cards; slightly more than a card's width, so that only curls do",
        soft=(0.0, 0.2),
        hard=(0.0, 1_000.0),
    )
    others: bool = toggle(
        False,
        label="Other Hair",
        description="Include hair of other grooms: their cards written by Make Cards or Sort Hair "
        "Cards, or their strands if there are none",
    )
