"""Parameters of the ambient occlusion of hair cards."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer, number, toggle


@dataclass(frozen=True, kw_only=True)
class CardOcclusionSettings(Settings):
    """How hair and the body shade the vertices of cards from the light of all sides."""

    section = "card_occlusion"
    title = "Card Occlusion"
    owner = "groom"

    strength: float = number(
        1.0,
        label="Strength",
        description="How much of the shade between the cards is stored",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    extinction: float = number(
        2.0,
        label="Extinction",
        description="How fast light dies in cards of other grooms, and in your own that are "
        "sorted, as a power of what their alpha lets through; the same as in strands. Cards of a "
        "groom have the occlusion of its strands",
        soft=(0.0, 10.0),
        hard=(0.0, 1_000.0),
    )
    rays: int = integer(
        256,
        label="Rays",
        description="Directions from which light comes to each vertex; time grows with them",
        soft=(64, 1024),
        hard=(1, 65_536),
    )
    reach: float = number(
        1.0,
        label="Reach",
        description="How far away cards and bodies still shade",
        unit="length",
        soft=(0.02, 2.0),
        hard=(0.0, 1_000.0),
    )
    own_reach: float = number(
        0.02,
        label="Self-occlusion Distance",
        description="From where on a card shades itself: a little more than its width, so that "
        "only what curls over itself does",
        unit="length",
        soft=(0.0, 0.1),
        hard=(0.0, 1_000.0),
    )
    others: bool = toggle(
        False,
        label="Other Hair",
        description="Hair of other grooms shades as well: their cards that Make Cards or Sort Hair "
        "Cards has written, and the strands of those without",
    )
