"""The atlas of strands that were laid flat, sample by sample: the reference.

Twin of gpu_shaders/lib_atlas.glsl and of what render/atlas_pass.py does with it. Each texel has
SAMPLES x SAMPLES samples, each of which shows the outermost strand at its place. The texel's alpha
is the fraction of its samples that show a strand; its other maps are the means over those.

Each row of samples lies a quarter of a sample further left than the one below, so that a texel's
samples are all at different places across: hair runs along a tile, and samples above one another
would line up with it. A GPU gets the same by shearing everything to the right.

Slow, as it loops over the triangles of all strands; also serves machines without a GPU.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.vectors import unit_or
from .atlas_maps import AtlasMaps
from .bake_strands import FlatStrands

#: Samples of a texel across, and along.
SAMPLES = 4
#: Steps of the R2 sequence (Roberts 2018) in x and y, and from strand to strand, in units of 2^-24.
SPARSE_STEPS = (12664745, 9560333, 10368890)
SPARSE_RANGE = 1 << 24
#: Maximum number of samples in memory at a time.
_MAX_SAMPLES = 1 << 20
#: Maximum texels across a block, so that sheared samples fit into a texture.
_MAX_BLOCK_WIDTH = 2048
_EDGE_SIGNS = np.array([[-1.0], [1.0]])
_TINY = 1e-12


def with_min_width(flat: FlatStrands, size: int) -> tuple[Floats, Floats]:
    """Half widths of ribbons at least a sample wide, and the fraction of their samples that counts.

    A strand thinner than a sample thus still covers as much as its width, see `is_counted`.

    Args:
        size: of the atlas [pixels].

    Returns:
        half as in FlatStrands, and fraction (n, cv_count) in [0, 1].
    """
    side = size * SAMPLES
    direction = np.gradient(flat.place, axis=1) * side
    length = np.linalg.norm(direction, axis=-1)
    half_width = flat.half_width * side
    across = np.abs(half_width[..., 0] * direction[..., 1] - half_width[..., 1] * direction[..., 0])
    across = np.where(length > _TINY, across / np.maximum(length, _TINY), 0.0)
    fraction = np.clip(across / 0.5, 0.0, 1.0)
    is_thin = fraction < 1.0
    # a ribbon without width is widened across its direction
    turned = np.stack([direction[..., 1], -direction[..., 0]], axis=-1)
    turned = 0.5 * turned / np.maximum(length, _TINY)[..., None]
    wide = np.where(is_thin[..., None], turned, half_width) / side
    return wide.astype(np.float32), fraction.astype(np.float32)


def is_counted(column: Ints, row: Ints, strand: int, fraction: Floats) -> Bools:
    """Whether samples (...) of a widened ribbon count: `fraction` of them do, evenly spread."""
    x, y, z = SPARSE_STEPS
    place = (column * x + row * y + strand * z) % SPARSE_RANGE
    counted: Bools = place < fraction * SPARSE_RANGE
    return counted


def fibre_normal(tangent: Floats, side: Floats) -> Floats:
    """Normal of a round strand seen from outside the card, (..., 3).

    Args:
        tangent: (..., 3) unit vectors in the card's frame.
        side: (...) place across the strand, from -1 to 1.
    """
    right = np.stack([tangent[..., 1], -tangent[..., 0], np.zeros_like(side)], axis=-1)
    right = unit_or(right, (1.0, 0.0, 0.0))
    front = np.cross(right, tangent)
    up = np.sqrt(np.maximum(1.0 - side * side, 0.0))
    normal: Floats = right * side[..., None] + front * up[..., None]
    return normal


@dataclass(frozen=True)
class Block:
    """A part of the atlas that is made at once: its lower left texel and its size [pixels]."""

    left: int
    bottom: int
    width: int
    height: int

    @property
    def samples_across(self) -> int:
        """Columns of samples; the shear moves the top row right by one sample per texel of
        height."""
        return SAMPLES * self.width + self.height

    def sheared(self, place: Floats, size: int) -> Floats:
        """Places of the atlas, (..., 2) in 0 to 1, in sheared samples, (..., 2)."""
        x, y = np.moveaxis((place * size - (self.left, self.bottom)) * SAMPLES, -1, 0)
        return np.stack([x + y / SAMPLES - 0.5, y], axis=-1)

    def overlapping(self, flat: FlatStrands, half_width: Floats, size: int) -> Ints:
        """Indices of the strands that may lie in the block. half_width: as in FlatStrands."""
        reach = np.abs(half_width)
        low = (flat.place - reach).min(axis=1) * size
        high = (flat.place + reach).max(axis=1) * size
        corner = np.array([self.left, self.bottom])
        inside = (low < corner + (self.width, self.height)) & (high > corner)
        return np.flatnonzero(inside.all(axis=1))


def atlas_blocks(size: int) -> list[Block]:
    """The blocks of an atlas, all of one size except those at the top."""
    width = min(size, _MAX_BLOCK_WIDTH)
    height = max(min(_MAX_SAMPLES // (width * SAMPLES**2), size), 1)
    starts = range(0, size, height), range(0, size, width)
    return [Block(x, y, width, min(height, size - y)) for y in starts[0] for x in starts[1]]


def sample_maps(flat: FlatStrands, size: int) -> AtlasMaps:
    """The maps of an atlas, with zeros where no strand is."""
    half_width, fraction = with_min_width(flat, size)
    maps: dict[str, Any] = {}
    for block in atlas_blocks(size):
        for name, part in _sample_block(flat, half_width, fraction, size, block).items():
            whole = maps.setdefault(name, np.zeros((size, size, *part.shape[2:]), np.float32))
            rows = slice(block.bottom, block.bottom + block.height)
            whole[rows, block.left : block.left + block.width] = part
    return AtlasMaps(**maps, base_gain=flat.base_gain)


def _sample_block(
    flat: FlatStrands, half_width: Floats, fraction: Floats, size: int, block: Block
) -> dict[str, Any]:
    """The maps of a block's texels."""
    shape = block.height * SAMPLES, block.samples_across
    nearest = np.full(shape, -np.inf, np.float32)
    values = np.zeros((*shape, 10), np.float32)  # along, id, depth, occlusion, tangent, base
    normal = np.zeros((*shape, 3), np.float32)
    for strand in block.overlapping(flat, half_width, size):
        edges = flat.place[strand, :, None] + half_width[strand, :, None] * _EDGE_SIGNS
        corners = block.sheared(edges, size).reshape(-1, 2)
        for row, column, vertices, weights in _triangle_samples(corners, shape):
            sample = weights @ _vertex_values(flat, fraction, strand, vertices)
            place = column + block.left * SAMPLES, row + block.bottom * SAMPLES
            counts = is_counted(*place, int(strand), sample[:, 0])
            # of two that lie equally far outside, the later one shows
            counts &= sample[:, 4] >= nearest[row, column]
            row, column, sample = row[counts], column[counts], sample[counts]
            nearest[row, column] = sample[:, 4]
            tangent = unit_or(sample[:, 6:9], (0.0, 1.0, 0.0))
            values[row, column] = np.concatenate([sample[:, 2:6], tangent, sample[:, 9:]], axis=1)
            normal[row, column] = fibre_normal(tangent, sample[:, 1])
    return _downsampled(*(_unsheared(image, block) for image in (nearest, values, normal)))


def _unsheared(image: Floats, block: Block) -> Floats:
    """Sheared samples, (rows, samples across, ...), moved back to the block's width."""
    row = np.arange(block.height * SAMPLES)[:, None]
    return image[row, row // SAMPLES + np.arange(block.width * SAMPLES)]


def _triangle_samples(
    corners: Floats, shape: tuple[int, int]
) -> Iterator[tuple[Ints, Ints, Ints, Floats]]:
    """Triangle after triangle of a ribbon: rows and columns of its samples, its three vertices as
    numbers 2 station + (1 on the right), and their weights (n, 3).

    Args:
        corners: (2 * station_count, 2) left and right, station after station [samples].
        shape: rows and columns of all samples.
    """
    lowest = np.minimum(np.minimum(corners[:-2], corners[1:-1]), corners[2:])
    highest = np.maximum(np.maximum(corners[:-2], corners[1:-1]), corners[2:])
    low = np.maximum(np.floor(lowest).astype(int), 0)
    high = np.minimum(np.ceil(highest).astype(int), shape[::-1])
    for first in np.flatnonzero((low < high).all(axis=1)):
        vertices = np.arange(first, first + 3)
        a, b, c = corners[vertices]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(area) < _TINY:
            continue
        rows, columns = slice(low[first, 1], high[first, 1]), slice(low[first, 0], high[first, 0])
        row, column = (i.ravel() for i in np.mgrid[rows, columns])
        x, y = column + 0.5 - a[0], row + 0.5 - a[1]
        second = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / area
        third = ((b[0] - a[0]) * y - (b[1] - a[1]) * x) / area
        weights = np.stack([1.0 - second - third, second, third], axis=1)
        inside = (weights >= 0.0).all(axis=1)
        yield row[inside], column[inside], vertices, weights[inside]


def _vertex_values(flat: FlatStrands, fraction: Floats, strand: int, vertices: Ints) -> Floats:
    """fraction, side, along, id, depth, occlusion, tangent, base of the vertices, (3, 12)."""
    cv, sign = vertices // 2, 2.0 * (vertices % 2) - 1.0
    along = flat.along[strand, cv]
    number = np.full(3, flat.strand_id[strand])
    depth, occlusion = flat.depth[strand, cv], flat.occlusion[strand, cv]
    single = np.stack([fraction[strand, cv], sign, along, number, depth, occlusion], axis=1)
    return np.concatenate([single, flat.tangent[strand, cv], flat.base[strand, cv]], axis=1)


def _downsampled(nearest: Floats, values: Floats, normal: Floats) -> dict[str, Any]:
    """Texels from their samples, by the names of the maps."""
    rows, columns = nearest.shape[0] // SAMPLES, nearest.shape[1] // SAMPLES
    shape = (rows, SAMPLES, columns, SAMPLES)
    count = np.isfinite(nearest).reshape(shape).sum(axis=(1, 3))
    divisor = np.maximum(count, 1)[..., None]
    means = values.reshape(*shape, -1).sum(axis=(1, 3)) / divisor
    normals = normal.reshape(*shape, -1).sum(axis=(1, 3))
    depths = np.moveaxis(nearest.reshape(shape), 2, 1).reshape(rows, columns, -1)
    numbers = np.moveaxis(values[..., 1].reshape(shape), 2, 1).reshape(rows, columns, -1)
    outermost = depths.argmax(axis=-1)[..., None]
    is_hair = count > 0
    maps = {
        "alpha": count / SAMPLES**2,
        "base": means[..., 7:],
        "normal": _encoded_directions(normals, (0.0, 0.0, 1.0), is_hair),
        "tangent": _encoded_directions(means[..., 4:7], (0.0, 1.0, 0.0), is_hair),
        "depth": means[..., 2],
        "along": means[..., 0],
        "strand_id": np.take_along_axis(numbers, outermost, axis=-1)[..., 0] * is_hair,
        "occlusion": means[..., 3],
    }
    return {name: value.astype(np.float32) for name, value in maps.items()}


def _encoded_directions(
    vectors: Floats, fallback: tuple[float, float, float], is_hair: Bools
) -> Floats:
    return (0.5 * unit_or(vectors, fallback) + 0.5) * is_hair[..., None]
