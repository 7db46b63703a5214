"""Parameters of how hair cards are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice, toggle, when

_ARE_DRAWN = when("card_drawing.shown_as", "cards", unmet_reason="no cards drawn")


@dataclass(frozen=True, kw_only=True)
class CardDrawingSettings(Settings):
    """How cards are shown, and in which passes and which order they are drawn."""

    section = "card_drawing"
    title = "Card Drawing"
    help_page = "cards#the-draw-order"
    owner = "groom"
    panels = ("Drawing",)

    shown_as: str = choice(
        "strands",
        (
            ("strands", "Strands", "Draw every strand as a ribbon"),
            ("cards", "Cards", "Draw hair cards instead of the strands"),
        ),
        label="Drawn As",
        description="How hair is drawn, in the viewport and in renders",
    )
    passes: str = choice(
        "four",
        (
            (
                "four",
                "Four",
                "Draw the depth of opaque pixels first, so that hidden ones are not shaded",
            ),
            ("three", "Three", "Opaque pixels, then both sides, with an alpha test in each pass"),
        ),
        label="Passes",
        description="Number of passes in which cards are drawn",
        source="Scheuermann 2004, optimized scheme and its fall-back",
        panel="Drawing",
        active_when=_ARE_DRAWN,
    )
    order: str = choice(
        "static",
        (
            ("static", "Static", "Sort once, from the inside to the outside"),
            (
                "view",
                "For Each View",
                "Sort in each view, from the farthest card to the nearest; for hair that swings",
            ),
        ),
        label="Order",
        description="Order in which cards are drawn",
        source="Scheuermann 2004, rendering with approximate depth sorting",
        panel="Drawing",
        active_when=_ARE_DRAWN,
    )
    skip_clear: bool = toggle(
        True,
        label="Skip Clear Pixels",
        description="Test alpha in the last pass, so that transparent pixels hide nothing. If "
        "off, the pass is as in the paper, and faster on some GPUs",
        panel="Drawing",
        active_when=_ARE_DRAWN,
        shown_when=when("card_drawing.passes", "four"),
    )
