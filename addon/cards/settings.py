"""Parameters of hair cards."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer, number


@dataclass(frozen=True, kw_only=True)
class CardSettings(Settings):
    """How a guide becomes a strip of textured triangles."""

    section = "cards"
    title = "Hair cards"

    segment_count: int = integer(
        12,
        label="Segments",
        description="Pieces of a card from root to tip",
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
        description="Width at the root, in mean distances between neighbouring guides",
        soft=(1.0, 6.0),
        hard=(0.01, 100.0),
    )
    tip_width: float = number(
        0.5,
        label="Tip width",
        description="Width at the tip as a part of the width at the root",
        soft=(0.0, 1.0),
        hard=(0.0, 10.0),
    )
    bend: float = number(
        0.1,
        label="Bend",
        description="How far the edges fall behind the middle, as a part of the width",
        soft=(0.0, 0.5),
        hard=(-1.0, 1.0),
    )
    roundness: float = number(
        0.5,
        label="Roundness",
        description="How far the normals lean outwards at the edges, so that light wraps around "
        "a card; added to the bend",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
    )
    atlas_columns: int = integer(
        4,
        label="Variants",
        description="Different strips of hair side by side in the texture; each card uses one",
        soft=(1, 8),
        hard=(1, 64),
    )
    seed: int = integer(
        0,
        label="Seed",
        description="Another number gives the cards other strips of the texture",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
