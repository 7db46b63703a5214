"""`AtlasMaps`: the pictures of an atlas."""

from __future__ import annotations

from dataclasses import dataclass, fields

from ..arrays import Floats


@dataclass(frozen=True, eq=False)
class AtlasMaps:
    """Maps of one size, float32 in [0, 1], row 0 the lowest; what they say of hair goes on where
    alpha is 0, see bake_dilation.

    Directions d are 0.5 d + 0.5 in the card's own frame: x across the card, along u; y along the
    card from root to tip; z away from the head.

    alpha: (h, w) share of the texel that strands cover.
    base: (h, w, 3) linear; times `base_gain` it is what the hair's colour is multiplied by.
    normal: (h, w, 3) of the strands, which are round.
    tangent: (h, w, 3) way of the strands.
    depth: (h, w) 0.5 in the card's plane, larger further outside; 0 and 1 are half a card's mean
        width behind and before it.
    along: (h, w) from 0 at the strand's root to 1 at its tip.
    strand_id: (h, w) a random number for each strand, that of the outermost one in the texel.
    occlusion: (h, w) 1 open, 0 shut in, by the strands of the tile.
    """

    alpha: Floats
    base: Floats
    normal: Floats
    tangent: Floats
    depth: Floats
    along: Floats
    strand_id: Floats
    occlusion: Floats
    base_gain: float = 1.0

    @property
    def by_name(self) -> dict[str, Floats]:
        """All maps by their names."""
        return {name: getattr(self, name) for name in MAPS}


#: The maps by name.
MAPS = tuple(field.name for field in fields(AtlasMaps) if field.name != "base_gain")
