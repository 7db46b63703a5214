"""Parameters of hair cards."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, choice, integer, number, toggle, when


@dataclass(frozen=True, kw_only=True)
class CardSettings(Settings):
    """How strands become strips of textured triangles."""

    section = "cards"
    title = "Hair Cards"
    owner = "groom"

    source: str = choice(
        "clusters",
        (
            ("clusters", "Clusters", "A card for each cluster of strands that lie together"),
            ("guides", "Guides", "A card along each guide"),
        ),
        label="Source",
        description="What a card stands for",
    )
    card_count: int = integer(
        800,
        label="Cards",
        description="Clusters: how many cards are made",
        soft=(50, 2000),
        hard=(1, 20_000),
        shown_when=when("cards.source", "clusters"),
    )
    error: float = number(
        0.002,
        label="Error",
        description="Clusters: how far a card's edges may be from the strands' own way; less "
        "makes more segments",
        soft=(0.0005, 0.02),
        hard=(0.0, 10.0),
        unit="length",
        shown_when=when("cards.source", "clusters"),
    )
    cluster_width: float = number(
        1.0,
        label="Width Factor",
        description="Clusters: width of a card, as a factor of how widely its strands lie",
        soft=(0.5, 2.0),
        hard=(0.01, 100.0),
        shown_when=when("cards.source", "clusters"),
    )
    crossed: bool = toggle(
        False,
        label="Crossed Pairs",
        description="Clusters: a second card through each, turned by a right angle, so that hair "
        "has body from all sides",
        shown_when=when("cards.source", "clusters"),
    )
    fly_aways: float = number(
        0.1,
        label="Fly-aways",
        description="Clusters: share of the cards that go to single strands which lie far from "
        "all others",
        soft=(0.0, 0.5),
        hard=(0.0, 1.0),
        unit="factor",
        shown_when=when("cards.source", "clusters"),
    )
    layers: int = integer(
        3,
        label="Layers",
        description="Into how many layers from the scalp to the surface the cards are told apart",
        soft=(1, 5),
        hard=(1, 16),
    )
    base_width: float = number(
        1.0,
        label="Base Width",
        description="How much wider the cards of the lowest layer are, so that the head does not "
        "show through; the outermost layer is never widened",
        soft=(1.0, 2.0),
        hard=(1.0, 10.0),
    )
    levels: int = integer(
        3,
        label="Levels of Detail",
        description="How many meshes are made, each with about half the triangles of the one "
        "before; all use the same textures",
        soft=(1, 5),
        hard=(1, 5),
    )
    segment_count: int = integer(
        12,
        label="Segments",
        description="Pieces of a card from root to tip; with clusters, the most",
        soft=(4, 32),
        hard=(1, 128),
    )
    column_count: int = integer(
        2,
        label="Columns",
        description="Pieces of a card across; two or more can bend",
        soft=(1, 4),
        hard=(1, 16),
    )
    width_factor: float = number(
        3.5,
        label="Width",
        description="Guides: width at the root, in mean distances between neighbouring guides",
        soft=(1.0, 6.0),
        hard=(0.01, 100.0),
        shown_when=when("cards.source", "guides"),
    )
    tip_width: float = number(
        0.5,
        label="Tip Width",
        description="Guides: width at the tip as a part of the width at the root",
        soft=(0.0, 1.0),
        hard=(0.0, 10.0),
        shown_when=when("cards.source", "guides"),
    )
    bend: float = number(
        0.1,
        label="Bend",
        description="How far the edges fall behind the middle, as a part of the width",
        soft=(0.0, 0.5),
        hard=(-1.0, 1.0),
    )
    roundness: float = number(
        0.0,
        label="Roundness",
        description="How far the normals lean outwards at the edges, so that light wraps around "
        "a card; 0 leaves them those of the strands",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
    )
    atlas_columns: int = integer(
        4,
        label="Variants",
        description="Different strips of hair side by side in the texture; each card uses one",
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
                "Pieces of cards that cross each other are sorted apart: fewest errors",
            ),
            ("cards", "Whole Cards", "All faces of a card stay together"),
            ("distance", "Distance", "Whole cards by their distance from the head alone"),
        ),
        label="Order By",
        description="What is sorted from the inside to the outside",
        source="Scheuermann 2004",
    )
    seed: int = integer(
        0,
        label="Seed",
        description="Another number gives the cards other strips of the texture",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
