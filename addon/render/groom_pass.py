"""One groom on the GPU: its strands and cards, their shadow, and that of others on them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

from .card_pass import CardPass
from .inter_groom_shadow import may_shade
from .opacity_maps import OpacityMaps
from .snapshot import Snapshot
from .strand_pass import StrandPass


class GroomPass:
    """Making one touches no GPU."""

    def __init__(self) -> None:
        self.strands, self.cards = StrandPass(), CardPass()

    def maps(
        self, snapshot: Snapshot, *, view: Hashable = None, is_turning: bool = False
    ) -> OpacityMaps | None:
        """How much of this hair lies between each light and every place: of its strands, and of its
        cards where it has none. None where it throws no shadow.

        Args:
            view, is_turning: as in StrandPass.opacity.
        """
        strands = self.strands.opacity(snapshot, view=view, is_turning=is_turning)
        return strands or self.cards.opacity(snapshot)

    def others(
        self, key: Hashable, snapshot: Snapshot, maps: Mapping[Hashable, OpacityMaps | None]
    ) -> list[OpacityMaps]:
        """The maps of all other grooms whose shadow may fall on these strands.

        Args:
            key: of this groom among the maps, which are of the same lights in the same order.
        """
        others = [each for other, each in maps.items() if other != key and each is not None]
        if not others or not snapshot.strand_count:
            return []
        ball = self.strands.ball(snapshot)
        return [each for each in others if may_shade(each, ball)]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the artist should know of the last draw, each with its remedy."""
        return (*self.strands.statistics.notes, *self.cards.notes)
