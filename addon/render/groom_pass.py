"""One groom on the GPU: its strands and cards, and the shadows on them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

from .card_pass import CardPass
from .inter_groom_shadow import may_cast_shadow_on
from .opacity_maps import OpacityMaps
from .snapshot import Snapshot
from .strand_pass import StrandPass


class GroomPass:
    """The passes of one groom. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.strands, self.cards = StrandPass(), CardPass()

    def maps(
        self, snapshot: Snapshot, *, view: Hashable = None, is_turning: bool = False
    ) -> OpacityMaps | None:
        """The opacity maps of the groom's strands, or of its cards where it has no strands. None if
        it casts no shadow.

        Args:
            view, is_turning: as in StrandPass.opacity.
        """
        strands = self.strands.opacity(snapshot, view=view, is_turning=is_turning)
        return strands or self.cards.opacity(snapshot)

    def other_maps(
        self, key: Hashable, snapshot: Snapshot, maps: Mapping[Hashable, OpacityMaps | None]
    ) -> list[OpacityMaps]:
        """The maps of all other grooms that may cast shadows on these strands.

        Args:
            key: of this groom in `maps`; all maps are of the same lights in the same order.
        """
        other_maps = [each for other, each in maps.items() if other != key and each is not None]
        if not other_maps or not snapshot.strand_count:
            return []
        ball = self.strands.ball(snapshot)
        return [each for each in other_maps if may_cast_shadow_on(each, ball)]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes to the artist on the last draw, each with its remedy."""
        return (*self.strands.statistics.notes, *self.cards.notes)
