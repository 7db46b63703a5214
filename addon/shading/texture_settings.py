"""Parameters of generated hair textures."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice, integer, number, when


@dataclass(frozen=True, kw_only=True)
class TextureSettings(Settings):
    """Appearance of the strips of hair on a card texture."""

    section = "card_texture"
    title = "Card Texture"
    help_page = "card_textures"
    owner = "groom"

    variant_width: int = integer(
        128,
        label="Variant Width",
        description="Width of one strip of hair in pixels",
        soft=(32, 512),
        hard=(8, 4096),
    )
    height: int = integer(
        512,
        label="Height",
        description="Height from root to tip in pixels",
        soft=(128, 2048),
        hard=(8, 8192),
    )
    strand_count: int = integer(
        32,
        label="Strands",
        description="Number of strands side by side in one strip",
        soft=(8, 64),
        hard=(2, 1024),
    )
    contrast: float = number(
        0.45,
        label="Contrast",
        description="Difference in brightness between the darkest and the brightest strand",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        source="Scheuermann 2004, stretched noise as base texture",
        shown_when=when("atlas.source", "made"),
    )
    edge_width: float = number(
        0.3,
        label="Edge Width",
        description="Fraction of the width, from each side, in which the strip dissolves into "
        "strands",
        unit="factor",
        soft=(0.05, 0.5),
        hard=(0.001, 0.5),
        shown_when=when("atlas.source", "made"),
    )
    root_length: float = number(
        0.04,
        label="Root Length",
        description="Fraction of the length in which strands join into the strip at the root",
        unit="factor",
        soft=(0.0, 0.3),
        hard=(0.0, 1.0),
        shown_when=when("atlas.source", "made"),
    )
    tip_length: float = number(
        0.6,
        label="Tip Length",
        description="Fraction of the length, from the tip, in which the strip dissolves into "
        "strands",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("atlas.source", "made"),
    )
    softness: float = number(
        0.25,
        label="Softness",
        description="Softness of strand ends; lower values give harder edges",
        unit="factor",
        soft=(0.05, 1.0),
        hard=(0.001, 1.0),
        shown_when=when("atlas.source", "made"),
    )
    wander: float = number(
        0.04,
        label="Wander",
        description="Distance that strands stray sideways, as a fraction of the width",
        soft=(0.0, 0.1),
        hard=(0.0, 0.1),
    )
    shift_cells: int = integer(
        3,
        label="Shift Cells",
        description="Number of cells of the shift texture along a strand",
        soft=(1, 16),
        hard=(1, 256),
        source="Scheuermann 2004, specular shift texture",
    )
    sparkle_cells: int = integer(
        24,
        label="Sparkle Cells",
        description="Number of cells of the noise texture along a strand, which make the second "
        "highlight sparkle",
        soft=(1, 64),
        hard=(1, 1024),
        source="Scheuermann 2004, specular noise texture",
    )
    highlights: str = choice(
        "shift",
        (
            (
                "shift",
                "Shift Texture",
                "Shift the highlights along the hair, by a different amount for each strand",
            ),
            ("tangent", "Tangent Map", "Store the direction of each strand in a tangent map"),
        ),
        label="Highlights By",
        description="Texture that breaks up the highlights",
        source="Scheuermann 2004, hair shading",
        shown_when=when("atlas.source", "made"),
    )
    seed: int = integer(
        0,
        label="Seed",
        description="Random seed of the strands",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
