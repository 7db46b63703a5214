"""Opacity maps: how much hair lies between a light and a place.

A texel holds, for each layer, the fraction of its area that the strands between the light and the
far end of that layer cover, summed over all strands though they overlap: the optical depth tau.
Behind it, exp(-extinction tau) of the light is left (Beer and Lambert).

Layers are placed by one of two methods, given by where they end:
    slices  evenly through the ball around the hair (Kim and Neumann 2001; Nguyen and Donnelly
            2005 draw 16 of them in one pass);
    deep    from the first hair that light meets in each texel on, each layer thicker than the one
            before (Yuksel and Keyser 2008): they follow the hair, so that it shows no bands. In the
            paper a layer is equally thick in all texels; ours divide the range up to the last hair,
            so that few layers suffice for a thin fringe and a whole head alike.
Slices are deep layers that start at 0 and end at 1 everywhere, so that one shader draws both.

First and last hair are stored for blocks of texels, as a plane each: with one depth per block, hair
that light grazes would be lit on one side of a block and dark on the other. Hair that a mesh hides
from the light is in no layer, so that all layers serve the hair in front of a head.

All depths are those of light_frame.py, 0 to 1 through the ball. Between the ends of two layers
tau is taken as linear. Reference of gpu_shaders/lib_opacity.glsl.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats, Ints, piece_starts
from .light_frame import LightFrame
from .settings import VolumeSettings

#: minimum thickness of all deep layers together
MIN_THICKNESS = 1.0 / 1024.0
#: meshes this close in front do not count, whatever the bias of strands: the depth of a facet that
#: light grazes varies this much across a texel
MIN_MESH_BIAS = 0.01
#: fraction of a map's side over which the shadows of meshes on meshes fade to its border
MAP_BORDER = 0.06
#: pieces into which the reference cuts strands, in texels
_PIECE = 0.25


def layer_ends(settings: VolumeSettings) -> Floats:
    """Where layers end, as fractions of their whole thickness, (layer_count,), rising to 1."""
    if settings.shadows == "slices":
        return np.arange(1, settings.slices + 1) / settings.slices
    # half of them reach layer_depth
    power = np.log(settings.layer_depth) / np.log(0.5)
    ends: Floats = (np.arange(1, settings.layers + 1) / settings.layers) ** power
    return ends


def layers_including(depth: Floats, ends: Floats) -> Bools:
    """The layers whose sums include a strand at this fraction of their depth, (..., n)."""
    return depth[..., None] <= ends


def layers_passed(depth: Floats, ends: Floats) -> Floats:
    """The fraction of each layer that lies in front of this depth, (..., n)."""
    starts = np.concatenate([[0.0], ends[:-1]])
    passed: Floats = np.clip((depth[..., None] - starts) / (ends - starts), 0.0, 1.0)
    return passed


def layer_weights(depth: Floats, ends: Floats) -> Floats:
    """Weights of the layers' sums that add up to tau at this depth, (..., n).

    The fraction of each layer that is passed, minus the next one's: tau is one dot product.
    """
    passed = layers_passed(depth, ends)
    passed[..., :-1] -= passed[..., 1:]
    return passed


def transmittance(
    optical_depth: Floats, extinction: float, forward: Floats | float = 0.0
) -> Floats:
    """Fraction of light left, with the fraction `forward` of what strands block and send on.

    See passed() in dual.py: straight light and light sent on, in one.
    """
    return np.exp(-extinction * optical_depth * (1.0 - forward))


@dataclass(frozen=True)
class LayerSpans:
    """Where deep layers start, and how thick they are together: planes over blocks of texels.

    start, thickness: (side, side, 3) in the middle of a block, and the change per texel to the
        right, and upwards.
    block: texels along the side of a block.
    """

    start: Floats
    thickness: Floats
    block: int

    @classmethod
    def from_first_and_last(cls, first: Floats, last: Floats, block: int) -> LayerSpans:
        """Spans from the first hair to the last.

        Args:
            first, last: (side, side) depth of these in each block; without hair, first lies behind
                last, and layers start at 1 and are 1 thick.
        """
        is_bare = last < first
        planes = (_plane(np.where(is_bare, np.nan, each), block) for each in (first, last))
        start, end = (np.where(is_bare[..., None], 0.0, each) for each in planes)
        start[is_bare, 0], end[is_bare, 0] = 1.0, 2.0
        return cls(start, end - start, block)

    def at(self, row: Ints, column: Ints, place: Floats) -> tuple[Floats, Floats]:
        """Where the layers of texels start and how thick they are at a place, (...) each.

        Args:
            row, column: (...) of the texels. place: (..., 2) column and row in texels, in these or
                near: planes extend beyond their blocks.
        """
        row, column = row // self.block, column // self.block
        aside = place - (np.stack([column, row], axis=-1) + 0.5) * self.block
        weights = np.concatenate([np.ones_like(aside[..., :1]), aside], axis=-1)
        start, thickness = (
            (plane[row, column] * weights).sum(axis=-1) for plane in (self.start, self.thickness)
        )
        return start, np.maximum(thickness, MIN_THICKNESS)

    def fraction(self, row: Ints, column: Ints, place: Floats, depth: Floats) -> Floats:
        """A depth (...) at a place, as a fraction of the layers of texels, see `at`."""
        start, thickness = self.at(row, column, place)
        return (depth - start) / thickness


def _plane(depth: Floats, block: int) -> Floats:
    """See LayerSpans, (side, side, 3). depth: (side, side), nan where there is no hair.

    Along each axis, the slope is the smaller of the changes to the two neighbouring blocks. It is 0
    beside a block without hair, and where a block is nearer or farther than both neighbours: a
    clump before the others is no slope (van Leer 1979, the minmod limiter).
    """
    planes = [depth]
    for axis in (1, 0):
        steps = np.diff(depth, axis=axis, prepend=np.nan, append=np.nan)
        before, after = (np.delete(steps, end, axis=axis) for end in (-1, 0))
        is_slope = before * after > 0.0  # nan is not
        smaller = np.where(np.abs(before) < np.abs(after), before, after)
        planes.append(np.where(is_slope, smaller, 0.0) / block)
    return np.stack(planes, axis=-1)


def look_up(
    layers: Floats,
    spans: LayerSpans,
    meshes: Floats,
    ends: Floats,
    places: Floats,
    depth: Floats,
    bias: float,
) -> tuple[Floats, Floats, Floats]:
    """Hair and meshes on the light's way, interpolated between the four texels around each place of
    a map.

    Beyond a place each texel counts up to its own first mesh. With slices, the GPU counts all four
    up to the nearest of these, in one look-up.

    Args:
        layers: (resolution, resolution, n) sums, row by row.
        spans: of these texels.
        meshes: (side, side) depth of the first mesh, 1 where there is none; in texels of their own.
        ends: (n,).
        places: (m, 2) in 0..1. depth: (m,).
        bias: strands this close in front do not count, nor do meshes, but for them it is at least
            MIN_MESH_BIAS.

    Returns:
        tau up to each place, tau from there on to the first mesh, and the fraction of the light
        that no mesh blocks; each (m,).
    """
    resolution = len(layers)
    inside = np.minimum(depth, 1.0) - bias
    before_meshes = np.minimum(depth, 1.0) - max(bias, MIN_MESH_BIAS)
    tau, beyond, lit = np.zeros((3, len(places)))
    for row, column, weight in _corners(places, len(meshes)):
        lit += weight * (before_meshes <= meshes[row, column])
    for row, column, weight in _corners(places, resolution):
        sums = layers[row, column]
        middle_row, middle_column = (
            (2 * each + 1) * len(meshes) // (2 * resolution) for each in (row, column)
        )
        mesh = meshes[middle_row, middle_column]
        middle = np.stack([column, row], axis=-1) + 0.5
        weights = layer_weights(spans.fraction(row, column, places * resolution, inside), ends)
        tau += weight * np.einsum("mn,mn->m", sums, weights)
        weights = layer_weights(spans.fraction(row, column, middle, mesh), ends)
        beyond += weight * np.einsum("mn,mn->m", sums, weights)
    is_inside = ((places >= 0.0) & (places <= 1.0)).all(axis=1)
    tau, beyond = np.where(is_inside, tau, 0.0), np.where(is_inside, beyond, 0.0)
    return tau, np.maximum(beyond - tau, 0.0), np.where(is_inside, lit, 1.0)


def _corners(places: Floats, side: int) -> Iterator[tuple[Ints, Ints, Floats]]:
    """Row, column and weight, (m,) each, of the four texels around places."""
    scaled = places * side - 0.5
    low = np.floor(scaled).astype(np.int64)
    fraction = scaled - low
    for right, up in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column = np.clip(low[:, 0] + right, 0, side - 1)
        row = np.clip(low[:, 1] + up, 0, side - 1)
        yield row, column, np.abs(1 - right - fraction[:, 0]) * np.abs(1 - up - fraction[:, 1])


def mesh_shadow_weight(places: Floats) -> Floats:
    """Weight of the shadows of meshes on meshes, which reach beyond a map, (...).

    1 inside, 0 at the map's border, so that shadows do not end at a line.

    Args:
        places: (..., 2) in 0..1, and beyond.
    """
    away = np.abs(places - 0.5).max(axis=-1)
    return np.clip((0.5 - away) / MAP_BORDER, 0.0, 1.0)


def self_tau(half_width: Floats) -> Floats:
    """The part of the map's tau at a strand's middle line that is the strand itself, (...).

    A strand does not shade itself. Maps draw it at least a texel wide, and a look-up blends over a
    texel to each side: the integral of that tent over the strand's width.

    Args:
        half_width: in texels.
    """
    drawn_half_width = np.maximum(half_width, 0.5)
    blocked = np.minimum(drawn_half_width, 1.0)
    return half_width / drawn_half_width * blocked * (2.0 - blocked)


def self_fraction(depth: Floats, bias: float, ends: Floats) -> Floats:
    """The fraction of a strand or a card that counts in tau at its own place, (...).

    It is in the sum of its layer, and tau grows linearly through that.

    Args:
        depth, bias: its depth behind the start of the layers, (...), and the distance in front of
            it within which nothing counts, in fractions of their total thickness.
        ends: of the layers, (n,).
    """
    layer = np.minimum(np.searchsorted(ends, depth), len(ends) - 1)
    start = np.concatenate([[0.0], ends[:-1]])[layer]
    return np.clip((depth - bias - start) / (ends[layer] - start), 0.0, 1.0)


@dataclass(frozen=True)
class Coverage:
    """Strands as a light sees them, in pieces smaller than a texel.

    texel: (n,) number of the texel, row by row; only pieces inside of the map.
    place: (n, 2) of each piece's middle, in texels. depth: (n,) of it.
    covered: (n,) fraction of the texel's area.
    """

    resolution: int
    texel: Ints
    place: Floats
    depth: Floats
    covered: Floats

    def optical_depth(self, texel: Ints, depth: Floats) -> Floats:
        """tau at depths in texels, (m,): the sum over the pieces in front, one by one."""
        order = np.lexsort((self.depth, self.texel))
        key = self.texel[order] + np.clip(self.depth[order], 0.0, 1.0 - 1e-9)
        summed = np.concatenate([[0.0], np.cumsum(self.covered[order])])
        before = np.searchsorted(key, texel.astype(np.float64))
        upto = np.searchsorted(key, texel + np.clip(depth, 0.0, 1.0 - 1e-9))
        return summed[upto] - summed[before]

    def spans(self, block: int = 1) -> LayerSpans:
        """Where deep layers start and end: at the first and the last piece in blocks of `block`
        texels along each side.
        """
        side = self.resolution // block
        row, column = np.divmod(self.texel, self.resolution)
        of_piece = row // block * side + column // block
        first, last = np.full((2, side**2), np.inf) * [[1.0], [-1.0]]
        np.minimum.at(first, of_piece, self.depth)
        np.maximum.at(last, of_piece, self.depth)
        return LayerSpans.from_first_and_last(
            first.reshape(side, side), last.reshape(side, side), block
        )

    def layers(self, ends: Floats, spans: LayerSpans) -> Floats:
        """The sums that a map holds, (resolution^2, layer_count)."""
        row, column = np.divmod(self.texel, self.resolution)
        behind = np.minimum(spans.fraction(row, column, self.place, self.depth), 1.0)
        # a piece is added to the first layer that it counts in; cumsum adds it to the others
        first = self.texel * len(ends) + np.searchsorted(ends, behind)
        held = np.bincount(first, self.covered, self.resolution**2 * len(ends))
        return np.cumsum(held.reshape(-1, len(ends)), axis=1)


def coverage(
    strands: Floats, radius: Floats, frame: LightFrame, resolution: int, opacity: float = 1.0
) -> Coverage:
    """Strands cut into pieces, each of which covers a part of one texel.

    Segments that reach behind a light are left out.

    Args:
        strands: (strand_count, cv_count, 3) [m], world space, straight between their CVs.
        radius: (strand_count, cv_count) [m].
        opacity: of a strand over its full width.
    """
    start, end = strands[:, :-1].reshape(-1, 3), strands[:, 1:].reshape(-1, 3)
    thick = (radius[:, :-1] + radius[:, 1:]).ravel()
    is_ahead = frame.is_ahead(start) & frame.is_ahead(end)
    start, end, thick = start[is_ahead], end[is_ahead], thick[is_ahead]
    from_place, _ = frame.places(start.astype(np.float64))
    to_place, _ = frame.places(end.astype(np.float64))
    texels = np.linalg.norm(to_place - from_place, axis=-1) * resolution
    count = np.maximum(np.ceil(texels / _PIECE), 1).astype(np.int64)
    segment = np.repeat(np.arange(len(start)), count)
    first = np.repeat(piece_starts(count), count)
    fraction = (np.arange(len(segment)) - first + 0.5) / count[segment]
    middle = start[segment] + (end - start)[segment] * fraction[:, None]
    place, depth = frame.places(middle.astype(np.float64))
    along = (end - start)[segment].astype(np.float64) / count[segment][:, None]
    area = thick[segment] * frame.strand_area(middle.astype(np.float64), along)
    covered = opacity * area * resolution**2
    column, row = np.floor(place * resolution).astype(np.int64).T
    is_inside = (column >= 0) & (column < resolution) & (row >= 0) & (row < resolution)
    texel = (row * resolution + column)[is_inside]
    place = place[is_inside] * resolution
    return Coverage(resolution, texel, place, depth[is_inside], covered[is_inside])
