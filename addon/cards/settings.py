"""Parameters of hair cards."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice, integer, number, toggle, when


@dataclass(frozen=True, kw_only=True)
class CardSettings(Settings):
    """How strands become strips of textured triangles."""

    section = "cards"
    title = "Hair Cards"
    help_page = "cards"
    owner = "groom"

    kind: str = choice(
        "cards",
        (
            ("cards", "Cards", "Strips of triangles along the hair"),
            ("shells", "Shells", "Layers above the skin, each showing where hair crosses it"),
            (
                "auto",
                "Automatic",
                "Shells if hair is short compared with the extent of its skin, such as fur and "
                "stubble, and its cards are not edited; else cards",
            ),
        ),
        label="Kind",
        description="Type of geometry to make",
    )
    max_triangles: int = integer(
        0,
        label="Max Triangles",
        description="Maximum number of triangles of the finest level; 0 is no limit for cards, and "
        "12,000 for shells",
        soft=(0, 50_000),
        hard=(0, 1_000_000),
    )
    shell_layers: int = integer(
        12,
        label="Shell Layers",
        description="Number of layers of shells from the skin to the tips",
        soft=(4, 24),
        hard=(2, 64),
        source="Lengyel 2001",
    )
    source: str = choice(
        "clusters",
        (
            ("clusters", "Clusters", "One card for each cluster of strands that lie together"),
            ("guides", "Guides", "One card along each guide"),
        ),
        label="Source",
        description="What each card is built from",
    )
    card_count: int = integer(
        800,
        label="Cards",
        description="Number of cards",
        soft=(50, 2000),
        hard=(1, 20_000),
        shown_when=when("cards.source", "clusters"),
    )
    error: float = number(
        0.008,
        label="Error",
        description="Maximum distance of a card's edges from the path of its strands, as a "
        "fraction of the hair's length; lower values give more segments",
        soft=(0.002, 0.1),
        hard=(0.0, 10.0),
        shown_when=when("cards.source", "clusters"),
    )
    cluster_width: float = number(
        1.0,
        label="Width Factor",
        description="Width of a card relative to the spread of its strands",
        soft=(0.5, 2.0),
        hard=(0.01, 100.0),
        shown_when=when("cards.source", "clusters"),
    )
    crossed: bool = toggle(
        False,
        label="Crossed Pairs",
        description="Add a second card through each one at a right angle, for volume from all "
        "sides",
        shown_when=when("cards.source", "clusters"),
    )
    fly_aways: float = number(
        0.1,
        label="Fly-Aways",
        description="Fraction of the cards used for single strands far from all others",
        soft=(0.0, 0.5),
        hard=(0.0, 1.0),
        unit="factor",
        shown_when=when("cards.source", "clusters"),
    )
    layers: int = integer(
        3,
        label="Layers",
        description="Number of layers of cards from the scalp to the surface",
        soft=(1, 5),
        hard=(1, 16),
    )
    base_width: float = number(
        1.0,
        label="Base Width",
        description="Factor on the width of the lowest layer, to keep the head from showing "
        "through; it fades to 1 at the outermost layer",
        soft=(1.0, 2.0),
        hard=(1.0, 10.0),
    )
    levels: int = integer(
        3,
        label="Levels of Detail",
        description="Number of meshes, each with about half the triangles of the previous one; "
        "all use the same textures",
        soft=(1, 5),
        hard=(1, 5),
    )
    segment_count: int = integer(
        12,
        label="Segments",
        description="Number of segments of a card from root to tip; for clusters, the maximum",
        soft=(4, 32),
        hard=(1, 128),
    )
    column_count: int = integer(
        2,
        label="Columns",
        description="Number of segments across a card; two or more let it bend",
        soft=(1, 4),
        hard=(1, 16),
    )
    width_factor: float = number(
        3.5,
        label="Width",
        description="Width at the root, in multiples of the mean distance between neighbouring "
        "guides",
        soft=(1.0, 6.0),
        hard=(0.01, 100.0),
        shown_when=when("cards.source", "guides"),
    )
    tip_width: float = number(
        0.5,
        label="Tip Width",
        description="Width at the tip relative to the root",
        soft=(0.0, 1.0),
        hard=(0.0, 10.0),
        shown_when=when("cards.source", "guides"),
    )
    bend: float = number(
        0.1,
        label="Bend",
        description="Depth of the edges behind the middle, as a fraction of the width",
        soft=(0.0, 0.5),
        hard=(-1.0, 1.0),
    )
    roundness: float = number(
        0.0,
        label="Roundness",
        description="Amount by which normals lean outwards at the edges, so that light wraps "
        "around a card; 0 keeps the normals of the strands",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
    )
    atlas_columns: int = integer(
        4,
        label="Variants",
        description="Number of different strips of hair in the texture; each card uses one",
        soft=(1, 8),
        hard=(1, 64),
        shown_when=when("atlas.source", "made"),
    )
    order_by: str = choice(
        "pieces",
        (
            (
                "pieces",
                "Pieces",
                "Sort pieces of crossing cards separately: fewest errors",
            ),
            ("cards", "Whole Cards", "Keep all faces of a card together"),
            ("distance", "Distance", "Sort whole cards by their distance from the head alone"),
        ),
        label="Order By",
        description="What to sort from the inside to the outside",
        source="Scheuermann 2004",
    )
    seed: int = integer(
        0,
        label="Seed",
        description="Random seed for the choice of strips",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
