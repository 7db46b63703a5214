"""What the artist sets about detail: how finely strands are divided, and how many are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice, integer, number, when

_SSALOD = "Rapp and Spielmann, Real-time hair rendering with screen space adaptive level of detail"
_WANG = "Wang 1984, subdivision depth of Bezier curves"


@dataclass(frozen=True, kw_only=True)
class DetailSettings(Settings):
    """How finely each segment of a strand is divided in the picture, and what is left out."""

    section = "detail"
    title = "Detail"
    owner = "groom"

    mode: str = choice(
        "adaptive",
        (
            ("adaptive", "Adaptive", "As few pieces as keep the curve within an error in pixels"),
            ("heuristic", "By Size and Angle", "More pieces for long and for bent segments"),
            ("fixed", "Fixed", "The same number of pieces everywhere"),
        ),
        label="Detail",
        description="How many straight pieces each segment of a strand is drawn with",
        source=_SSALOD,
    )
    error: float = number(
        0.5,
        label="Error",
        description="Adaptive: how far from its curve a strand may be drawn",
        soft=(0.1, 2.0),
        hard=(0.01, 100.0),
        unit="pixels",
        source=_WANG,
        shown_when=when("detail.mode", "adaptive"),
    )
    piece_length: float = number(
        8.0,
        label="Subdivision Length",
        description="By size and angle: length of a piece where hair bends by 45 degrees or more",
        soft=(2.0, 32.0),
        hard=(0.5, 1000.0),
        unit="pixels",
        source=_SSALOD,
        shown_when=when("detail.mode", "heuristic"),
    )
    subdivisions: int = integer(
        2,
        label="Subdivisions",
        description="Fixed: pieces of each segment",
        soft=(1, 8),
        hard=(1, 64),
        shown_when=when("detail.mode", "fixed"),
    )
    max_subdivisions: int = integer(
        64,
        label="Max Subdivisions",
        description="Pieces of a segment at most",
        soft=(1, 64),
        hard=(1, 64),
        source=_SSALOD,
        shown_when=when("detail.mode", "adaptive", "heuristic"),
    )
    culling: str = choice(
        "hidden",
        (
            ("none", "None", "Every strand is drawn"),
            ("hidden", "Hidden", "Strands that lie wholly behind the head are not drawn"),
            ("away", "Facing Away", "Strands whose root faces away from the eye are not drawn"),
        ),
        label="Culling",
        description="Which strands are left out because the head hides them",
        source=_SSALOD,
    )
    lod_height: float = number(
        300.0,
        label="LOD Height",
        description="Height of the groom below which fewer strands are drawn, wider to "
        "make up for it; 0 draws all of them always",
        soft=(0.0, 1000.0),
        hard=(0.0, 100_000.0),
        unit="pixels",
    )
    min_density: float = number(
        0.125,
        label="Min Density",
        description="Fraction of the strands that is drawn in any distance",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("detail.lod_height"),
    )
