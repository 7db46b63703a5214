"""Mip maps of card textures, down to a single texel, that keep what each texture is for.

With plain averages, textures of hair go wrong at a distance: alpha falls below the threshold of the
alpha test and the hair grows thin, colours mix with those beside the strands, directions grow
shorter, and tiles of an atlas run into each other. Here

    alpha       keeps its coverage: in each tile as many texels pass the alpha test as at full size
                (Castano 2010, "Computing alpha mipmaps")
    colours     and all other values are averaged by how much hair there is
    directions  are averaged as vectors and are unit vectors again
    strand IDs  are not averaged: the ID that has most hair stays

Each level is half the one before it, rounded down, as GPUs have it; row 0 is the lowest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...cards.atlas_grid import AtlasGrid
from ...strands.vectors import unit_or

#: Maps that hold directions as 0.5 d + 0.5.
DIRECTIONS = ("normal", "tangent")
#: Maps of labels, which cannot be averaged.
LABELS = ("strand_id",)
#: Minimum texels of a tile whose own coverage is kept; with fewer, the whole texture's is.
_MIN_TILE_TEXELS = 16
#: Weight of texels without hair, so that the mean is that of all texels where none has hair.
_MIN_WEIGHT = 1e-12
#: Length below which a mean vector has no direction.
_MIN_LENGTH = 1e-6


def level_sizes(width: int, height: int) -> list[tuple[int, int]]:
    """(width, height) of all levels, the full size first and 1 x 1 last."""
    count = max(width, height).bit_length()
    return [(max(width >> level, 1), max(height >> level, 1)) for level in range(count)]


def mip_levels(
    maps: Mapping[str, Floats], *, grid: AtlasGrid | None = None, threshold: float | None = 0.5
) -> Iterator[dict[str, Floats]]:
    """All levels of a set of maps, the maps themselves first.

    Args:
        maps: name -> (height, width) or (height, width, channels) in [0, 1], all of one size;
            "alpha", if present, is where there is hair. See DIRECTIONS and LABELS.
        grid: the tiles that must not run into each other.
        threshold: of the alpha test, in (0, 1); None averages alpha as it stands, for blending.

    Yields:
        The same names with arrays of that level's size.
    """
    height, width = next(iter(maps.values())).shape[:2]
    grid = grid or AtlasGrid()
    alpha = maps.get("alpha")
    weight = np.ones((height, width), np.float32) if alpha is None else alpha
    coverage = None if threshold is None else _coverage(weight, grid, threshold)
    level = {name: _weighted(name, values, weight) for name, values in maps.items()}
    yield dict(maps)
    for smaller in level_sizes(width, height)[1:]:
        halving = _Halving.for_resize(weight.shape, (smaller[1], smaller[0]), grid)
        kept = {name: halving.heaviest(level[name], weight) for name in LABELS if name in level}
        averaged = {name: halving.mean(level[name]) for name in level if name not in kept}
        weight = halving.mean(weight)
        level = averaged | kept
        shown_level = {name: _unweighted(name, values, weight) for name, values in level.items()}
        if alpha is not None and coverage is not None and threshold is not None:
            shown_level["alpha"] = _with_coverage(weight, coverage, grid, threshold)
        yield {name: shown_level[name] for name in maps}


@dataclass(frozen=True)
class _Taps:
    """Along one axis: what each texel of the smaller level is made of.

    index: (new, taps) texels of the larger level; fraction: (new, taps) of each, 1 in sum.
    """

    index: Ints
    fraction: Floats

    @classmethod
    def for_resize(cls, old: int, new: int, tiles: int) -> _Taps:
        """Fractions by how far texels overlap, within the tile of the new one."""
        ratio = old / new
        first = np.floor(np.arange(new) * ratio + 1e-9).astype(np.intp)
        index = first[:, None] + np.arange(int(np.ceil(ratio)) + (old % new > 0))
        begin, end = np.arange(new)[:, None] * ratio, np.arange(1, new + 1)[:, None] * ratio
        fraction = np.minimum(end, index + 1) - np.maximum(begin, index)
        fraction = np.where(index < old, np.maximum(fraction, 0.0), 0.0)
        index = np.minimum(index, old - 1)
        if new >= tiles:  # else a texel is larger than a tile
            is_own = _tile_of(old, tiles)[index] == _tile_of(new, tiles)[:, None]
            fraction = fraction * is_own
        fraction = fraction / fraction.sum(axis=1, keepdims=True)
        return cls(index, fraction.astype(np.float32))

    def mean(self, values: Floats) -> Floats:
        """Means along axis 0, (new, ...)."""
        if np.array_equal(self.index.ravel(), np.arange(len(values))) and self.is_even:
            pairs = values.reshape(len(self.index), -1, *values.shape[1:])
            total = sum(pairs[:, each] for each in range(1, pairs.shape[1])) + pairs[:, 0]
            return (total / np.float32(pairs.shape[1])).astype(np.float32, copy=False)
        total = np.zeros((len(self.index), *values.shape[1:]), np.float32)
        for index, fraction in zip(self.index.T, self.fraction.T, strict=True):
            total += values[index] * fraction.reshape(-1, *(1,) * (values.ndim - 1))
        return total

    @property
    def is_even(self) -> bool:
        return bool(np.all(self.fraction == self.fraction[0, 0]))

    def heaviest(self, values: Floats, weight: Floats) -> tuple[Floats, Floats]:
        """The value of greatest weight along axis 0, and that weight."""
        weights = np.where(
            self.fraction.reshape(*self.fraction.shape, 1) > 0, weight[self.index], -1.0
        )
        best = np.argmax(weights, axis=1)[:, None]
        chosen = np.take_along_axis(values[self.index], best, axis=1)[:, 0]
        return chosen, np.take_along_axis(weights, best, axis=1)[:, 0]


@dataclass(frozen=True)
class _Halving:
    """The step from one level to the next."""

    rows: _Taps
    columns: _Taps

    @classmethod
    def for_resize(cls, old: tuple[int, ...], new: tuple[int, int], grid: AtlasGrid) -> _Halving:
        return cls(
            _Taps.for_resize(old[0], new[0], grid.rows),
            _Taps.for_resize(old[1], new[1], grid.columns),
        )

    def mean(self, values: Floats) -> Floats:
        by_rows = self.rows.mean(values)
        return np.swapaxes(self.columns.mean(np.swapaxes(by_rows, 0, 1)), 0, 1)

    def heaviest(self, values: Floats, weight: Floats) -> Floats:
        by_rows, weights = self.rows.heaviest(values, weight)
        return self.columns.heaviest(by_rows.T, weights.T)[0].T


def _tile_of(texels: int, tiles: int) -> Ints:
    """The tile in which each texel's middle lies, along one axis."""
    return np.floor((np.arange(texels) + 0.5) * (tiles / texels)).astype(np.intp)


def _weighted(name: str, values: Floats, weight: Floats) -> Floats:
    """Values times their weight, which is never 0, so that they can be summed level by level."""
    if name == "alpha" or name in LABELS:
        return values
    plain = 2.0 * values - 1.0 if name in DIRECTIONS else values
    by_weight = weight if values.ndim == 2 else weight[..., None]
    weighted: Floats = (plain * (by_weight + np.float32(_MIN_WEIGHT))).astype(
        np.float32, copy=False
    )
    return weighted


def _unweighted(name: str, values: Floats, weight: Floats) -> Floats:
    """The values of a texture, from such sums: where there is no hair, the mean of all texels."""
    if name == "alpha" or name in LABELS:
        return values
    by_weight = weight if values.ndim == 2 else weight[..., None]
    mean = values / (by_weight + np.float32(_MIN_WEIGHT))
    if name in DIRECTIONS:
        return np.asarray(
            0.5 * unit_or(mean, np.array([0.0, 0.0, 1.0], mean.dtype), _MIN_LENGTH) + 0.5,
            np.float32,
        )
    return np.clip(mean, 0.0, 1.0)


def _tiles(shape: tuple[int, ...], grid: AtlasGrid) -> list[tuple[slice, slice]]:
    """The texels of each tile; the whole level as one where tiles are too small."""
    height, width = shape
    texels = height * width / grid.tile_count
    if height < grid.rows or width < grid.columns or texels < _MIN_TILE_TEXELS:
        return [(slice(None), slice(None))]
    rows = np.searchsorted(_tile_of(height, grid.rows), np.arange(grid.rows + 1))
    columns = np.searchsorted(_tile_of(width, grid.columns), np.arange(grid.columns + 1))
    return [
        (slice(*rows[row : row + 2]), slice(*columns[column : column + 2]))
        for row in range(grid.rows)
        for column in range(grid.columns)
    ]


def _coverage(alpha: Floats, grid: AtlasGrid, threshold: float) -> Floats:
    """(tiles,) fraction of each tile's texels that pass the alpha test."""
    return np.array([np.mean(alpha[tile] >= threshold) for tile in _tiles(alpha.shape, grid)])


def _with_coverage(alpha: Floats, coverage: Floats, grid: AtlasGrid, threshold: float) -> Floats:
    """An alpha whose tiles have the coverage of the first level."""
    tiles = _tiles(alpha.shape, grid)
    if len(tiles) != len(coverage):
        coverage = np.array([coverage.mean()])
    kept = np.empty_like(alpha)
    for tile, fraction in zip(tiles, coverage, strict=True):
        kept[tile] = _with_passing_fraction(alpha[tile], fraction, threshold)
    return kept


def _with_passing_fraction(alpha: Floats, fraction: float, threshold: float) -> Floats:
    """Alpha, scaled so that this fraction of it passes the test, and one texel at least if any did.

    Castano scales all alphas by one factor. Here those that are to fail the test are scaled so; of
    those that are to pass, the distance to 1 is scaled, so that opaque hair stays opaque.
    """
    if fraction == 0.0:
        return np.minimum(alpha, np.nextafter(np.float32(threshold), np.float32(0.0)))
    values = np.sort(alpha, axis=None)[::-1]
    target_count = min(max(round(fraction * values.size), 1), values.size)
    # Equal texels pass together or not at all
    steps = np.append(np.flatnonzero(values[:-1] > values[1:]) + 1, values.size)
    count = steps[np.argmin(np.abs(steps - target_count))]
    cutoff = values[count - 1 : count + 1].mean() if count < values.size else values[-1]
    if cutoff <= 0.0 or cutoff >= 1.0:
        return alpha
    below = alpha * (threshold / cutoff)
    above = threshold + (alpha - cutoff) * ((1.0 - threshold) / (1.0 - cutoff))
    return np.where(alpha < cutoff, below, above).astype(np.float32)
