"""Settings of detail: how finely strands are subdivided, and how many are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice, integer, number, when

_SSALOD = "Rapp and Spielmann, Real-time hair rendering with screen space adaptive level of detail"
_WANG = "Wang 1984, subdivision depth of Bezier curves"


@dataclass(frozen=True, kw_only=True)
class DetailSettings(Settings):
    """How finely each segment of a strand is subdivided in the picture, and which are not drawn."""

    section = "detail"
    title = "Detail"
    help_page = "refinement#detail"
    owner = "groom"
    panel_after = "strands"

    mode: str = choice(
        "adaptive",
        (
            (
                "adaptive",
                "Adaptive",
                "Use the fewest pieces that keep strands within an error in pixels",
            ),
            ("heuristic", "By Size and Angle", "Use more pieces for long and for curved segments"),
            ("fixed", "Fixed", "Use the same number of pieces everywhere"),
        ),
        label="Detail",
        description="How segments of a strand are subdivided",
        source=_SSALOD,
    )
    error: float = number(
        0.5,
        label="Error",
        description="Maximum distance of a drawn strand from its curve",
        soft=(0.1, 2.0),
        hard=(0.01, 100.0),
        unit="pixels",
        source=_WANG,
        shown_when=when("detail.mode", "adaptive"),
    )
    piece_length: float = number(
        8.0,
        label="Piece Length",
        description="Length of a piece where hair bends by 45 degrees or more",
        soft=(2.0, 32.0),
        hard=(0.5, 1000.0),
        unit="pixels",
        source=_SSALOD,
        shown_when=when("detail.mode", "heuristic"),
    )
    subdivisions: int = integer(
        2,
        label="Subdivisions",
        description="Number of pieces per segment",
        soft=(1, 8),
        hard=(1, 64),
        shown_when=when("detail.mode", "fixed"),
    )
    max_subdivisions: int = integer(
        64,
        label="Max Pieces",
        description="Maximum number of pieces per segment",
        soft=(1, 64),
        hard=(1, 64),
        source=_SSALOD,
        shown_when=when("detail.mode", "adaptive", "heuristic"),
    )
    culling: str = choice(
        "hidden",
        (
            ("none", "None", "Draw every strand"),
            ("hidden", "Hidden", "Skip strands that lie entirely behind the head"),
            ("away", "Facing Away", "Skip strands whose root faces away from the camera"),
        ),
        label="Culling",
        description="Strands to skip because the head hides them",
        source=_SSALOD,
    )
    lod_size: float = number(
        300.0,
        label="LOD Size",
        description="Size of the groom in the picture (the larger of width and height) below "
        "which fewer, wider strands are drawn; 0 always draws all",
        soft=(0.0, 1000.0),
        hard=(0.0, 100_000.0),
        unit="pixels",
    )
    min_density: float = number(
        0.125,
        label="Min Density",
        description="Minimum fraction of the strands to draw at any distance",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("detail.lod_size"),
    )
