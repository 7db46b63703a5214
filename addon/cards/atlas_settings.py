"""Parameters of the atlas: the texture that all cards of a groom share."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..errors import HairloomError
from ..params import Settings, choice, integer, number, when
from .atlas_grid import AtlasGrid

#: Sizes that engines accept: powers of two, so that each mip map halves them.
SIZES = (128, 256, 512, 1024, 2048, 4096)
#: Maximum size of an automatic atlas.
_AUTOMATIC_MAX = 2048
#: Minimum size of a tile between its padding, across and along [pixels].
MIN_TILE = (4, 8)


@dataclass(frozen=True, kw_only=True)
class AtlasSettings(Settings):
    """How large the atlas is, how it is divided, and what it shows."""

    section = "atlas"
    title = "Atlas"
    help_page = "card_textures"
    owner = "groom"

    source: str = choice(
        "baked",
        (
            ("made", "Procedural", "Procedural strips of hair"),
            (
                "baked",
                "Baked",
                "The groom's own strands, laid flat; procedural if there are only guides",
            ),
        ),
        label="Source",
        description="Source of the cards' texture",
    )
    size: str = choice(
        "auto",
        (
            (
                "auto",
                "Automatic",
                "Use the fewest pixels that show strands one and a half pixels wide, up to "
                f"{_AUTOMATIC_MAX} x {_AUTOMATIC_MAX}, with no more tiles than cards",
            ),
            *((str(size), str(size), f"{size} x {size} pixels") for size in SIZES),
        ),
        label="Size",
        description="Width and height of the atlas in pixels",
        shown_when=when("atlas.source", "baked"),
    )
    columns: int = integer(
        16,
        label="Columns",
        description="Number of tiles side by side; a power of two keeps tiles apart in all mip "
        "maps. With an automatic size, columns times rows is the maximum number of tiles",
        soft=(1, 32),
        hard=(1, 64),
        shown_when=when("atlas.source", "baked"),
    )
    rows: int = integer(
        4,
        label="Rows",
        description="Number of rows of tiles; a power of two keeps tiles apart in all mip maps",
        soft=(1, 16),
        hard=(1, 64),
        shown_when=when("atlas.source", "baked"),
    )
    padding: int = integer(
        4,
        label="Padding",
        description="Empty pixels on each side of a tile, so that tiles do not bleed into each "
        "other",
        soft=(0, 16),
        hard=(0, 256),
        shown_when=when("atlas.source", "baked"),
    )
    strand_width: float = number(
        1.57,  # pi / 2: the mean of |cos| over all turns of a card is 2 / pi
        label="Strand Width",
        description="Factor on the strand width in the atlas, because cards are mostly seen at a "
        "slant, where their strands look narrower",
        soft=(1.0, 2.0),
        hard=(0.01, 100.0),
        shown_when=when("atlas.source", "baked"),
    )
    seed: int = integer(
        0,
        label="Seed",
        description="Random seed for the strands in the tiles",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
        shown_when=when("atlas.source", "baked"),
    )

    def fitted(self, tile_count: int, across: float, along: float) -> AtlasSettings:
        """With an automatic size, the smallest atlas that holds this many tiles, or as many as the
        settings allow, of this size each; else the same settings.

        Args:
            across, along: wanted size of a tile between its padding [pixels].
        """
        if self.size != "auto":
            return self
        count = max(min(tile_count, self.columns * self.rows), 1)
        columns = [1 << power for power in range(count.bit_length())]
        sides = [
            max(each * (across + 2 * self.padding), -(-count // each) * (along + 2 * self.padding))
            for each in columns
        ]
        side, best = min(zip(sides, columns, strict=True))
        size = next(size for size in SIZES if size >= min(side, _AUTOMATIC_MAX))
        return replace(self, size=str(size), columns=best, rows=-(-count // best))

    @property
    def side(self) -> int:
        """Width and height of an atlas whose size is not automatic [pixels]."""
        return int(self.size)

    @property
    def inner_tile(self) -> tuple[float, float]:
        """Size of a tile between its padding, across and along [pixels]; may be negative."""
        parts = (self.columns, self.rows)
        across, along = (self.side / count - 2.0 * self.padding for count in parts)
        return across, along

    @property
    def grid(self) -> AtlasGrid:
        """The tiles.

        Raises:
            HairloomError: the padding leaves too little of a tile; the message gives the size that
                the atlas needs.
        """
        if any(size < minimum for size, minimum in zip(self.inner_tile, MIN_TILE, strict=True)):
            raise self._too_small()
        fraction = self.padding / self.side
        return AtlasGrid(self.columns, self.rows, (fraction * self.columns, fraction * self.rows))

    def _too_small(self) -> HairloomError:
        across, along = (self.side / count for count in (self.columns, self.rows))
        parts = zip((self.columns, self.rows), MIN_TILE, strict=True)
        needed = max(count * (minimum + 2 * self.padding) for count, minimum in parts)
        return HairloomError(
            f"{self.columns} x {self.rows} tiles of {across:g} x {along:g} pixels with "
            f"{self.padding} pixels of padding do not fit in {self.side} pixels; they need "
            f"{needed}, which is {needed - self.side} more",
            place=self.title,
            remedy="Use a larger atlas, fewer columns and rows, or less padding",
        )
