"""Diffusion of light along the skin, in the head's UV map: a blur of even width in world space.

Reference: Green 2004, GPU Gems, chapter 16; D'Eon and Luebke 2007, GPU Gems 3, chapter 14.
Twin of gpu_shaders/skin_blur.comp.glsl and lib_skin.glsl.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats, Ints
from .layout import CLOSING, SkinLayout
from .near_borders import along_border

#: Standard deviations after which a Gaussian ends, and the texels a side at which it is sampled.
KERNEL_REACH, KERNEL_TAPS = 2.5, 24
#: lights whose shadow one texture holds
SKIN_LIGHTS = 4
#: [texels] two sides of a seam that are closer than this in the map share texels
NARROW = 1.0
#: minimum fraction of known texels for a value
MIN_KNOWN = 1e-6


def blurred(values: Floats, layout: SkinLayout, softness: float, axis: int) -> Floats:
    """Values (rows, columns, channels), spread along rows (axis 0: along x) or columns (axis 1).

    Each texel is the mean of texels of its own island, by a Gaussian of the texel's own width. Skew
    of the map is ignored, so the width is right only in the mean of both directions.

    Args:
        softness: standard deviation [m].
    """
    sigma = np.maximum(softness / layout.stretch[..., axis], 1e-3)
    step = np.maximum(np.ceil(KERNEL_REACH * sigma / KERNEL_TAPS), 1.0).astype(int)
    rows, columns = layout.island.shape
    row, column = np.indices((rows, columns))
    total, weight = np.zeros(values.shape), np.zeros((rows, columns, 1))
    for tap in range(-KERNEL_TAPS, KERNEL_TAPS + 1):
        away = tap * step
        there = (row, column + away) if axis == 0 else (row + away, column)
        inside = (there[0] >= 0) & (there[0] < rows) & (there[1] >= 0) & (there[1] < columns)
        at = np.clip(there[0], 0, rows - 1), np.clip(there[1], 0, columns - 1)
        counts = inside & (layout.island[at] == layout.island)
        counts &= np.abs(away) <= KERNEL_REACH * sigma
        fraction = np.where(counts, np.exp(-0.5 * (away / sigma) ** 2), 0.0)[..., None]
        total += fraction * values[at]
        weight += fraction
    return np.where(layout.island[..., None] >= 0, total / np.maximum(weight, 1e-9), 1.0)


def soft_shadow(
    values: Floats, layout: SkinLayout, place: Floats, island: Ints
) -> tuple[Floats, Floats]:
    """Values at places (n, 2) of islands (n,), (n, channels), the same on both sides of a seam; and
    the fraction of them that is known, (n,).

    The difference that the blur leaves between the two sides is closed by half on each side, less
    and less away from the seam.
    """
    found, known = looked_up(values, layout.island, place, island)
    seam = _seam_at(layout, place, island)
    if not (seam >= 0).any():
        return found, known
    ends = layout.seams[seam]
    # at the tip of a slit a texel may refer only to the other side of the same island
    is_same = layout.seam_islands[seam, 0] == layout.seam_islands[seam, 1]
    is_turned = is_same & (_distance(place, ends[..., 2:]) < _distance(place, ends[..., :2]))
    ends = np.where(is_turned[:, None, None], ends[..., [2, 3, 0, 1]], ends)
    fraction = along_border(place, ends[:, 0, :2], ends[:, 1, :2])[:, None]
    on_seam = ends[:, 0] * (1.0 - fraction) + ends[:, 1] * fraction
    here, _ = looked_up(values, layout.island, on_seam[:, :2], island)
    across, is_known = looked_up(
        values, layout.island, on_seam[:, 2:], layout.seam_islands[seam, 1]
    )
    shifts = corner_shifts(values, layout)[seam]
    shift = shifts[:, 0] * (1.0 - fraction) + shifts[:, 1] * fraction
    nearness = np.clip(1.0 - np.linalg.norm(place - on_seam[:, :2], axis=1) / CLOSING, 0.0, 1.0)
    fade = nearness * nearness * (3.0 - 2.0 * nearness)
    fade = np.where((seam >= 0) & (is_known > 0.0), fade, 0.0)
    # where both sides lie on the same texels, both read between them
    gap = on_seam[:, 2:] - on_seam[:, :2]
    is_narrow = is_same & (np.linalg.norm(gap, axis=1) < NARROW)
    between = place + 0.5 * fade[:, None] * np.where(is_narrow[:, None], gap, 0.0)
    middle, _ = looked_up(values, layout.island, between, island)
    difference = np.where(is_narrow[:, None], 0.0, 0.5 * (across - here))
    return middle + fade[:, None] * (difference + shift), known


def corner_shifts(values: Floats, layout: SkinLayout) -> Floats:
    """Mean of all sides that meet at each seam's ends, minus the mean of its own two,
    (seam_count, 2, channels); 0 unless three or more sides meet.
    """
    places, islands = layout.copies[:, :2], layout.copies[:, 2].astype(int)
    found, known = looked_up(values, layout.island, places, islands)
    counted = np.concatenate([found, np.ones_like(known)[:, None]], axis=1)
    sums = np.cumsum(np.pad(counted * (known > 0.0)[:, None], ((1, 0), (0, 0))), axis=0)
    first, count = layout.end_copies[..., 0], layout.end_copies[..., 1]
    total = sums[first + count] - sums[first]
    mean = total[..., :-1] / np.maximum(total[..., -1:], 1.0)
    for side in range(2):
        for end in range(2):
            place, island = layout.seams[:, end, 2 * side :][:, :2], layout.seam_islands[:, side]
            mean[:, end] -= 0.5 * looked_up(values, layout.island, place, island)[0]
    return np.where((count > 2)[..., None], mean, 0.0)


def _seam_at(layout: SkinLayout, place: Floats, island: Ints) -> Ints:
    """The nearest of the seams that the texels around each place refer to; -1 where there is
    none."""
    nearest, seam = np.full(len(place), np.inf), np.full(len(place), -1)
    for corner in range(4):
        row, column = _texel_around(layout.island.shape, place, corner)
        known = np.where(layout.island[row, column] == island, layout.seam[row, column], -1)
        if not len(layout.seams):
            continue
        far = np.where(known >= 0, _distance(place, layout.seams[known, :, :2]), np.inf)
        seam, nearest = np.where(far < nearest, known, seam), np.minimum(far, nearest)
    return seam


def _distance(place: Floats, edge: Floats) -> Floats:
    """From places (n, 2) to an edge each, start and end (n, 2, 2), (n,)."""
    fraction = along_border(place, edge[:, 0], edge[:, 1])[:, None]
    offset = edge[:, 0] * (1.0 - fraction) + edge[:, 1] * fraction - place
    distance: Floats = np.linalg.norm(offset, axis=1)
    return distance


def looked_up(
    values: Floats, texel_island: Ints, place: Floats, island: Ints
) -> tuple[Floats, Floats]:
    """Values interpolated at places (n, 2), from texels of these islands (n,) alone, (n, channels);
    and the weight of such texels, (n,).
    """
    fraction = place - 0.5 - np.floor(place - 0.5)
    total, known = np.zeros((len(place), values.shape[-1])), np.zeros(len(place))
    for corner in range(4):
        at = _texel_around(texel_island.shape, place, corner)
        step = np.array([corner & 1, corner >> 1])
        weight = np.prod(np.where(step, fraction, 1.0 - fraction), axis=-1)
        weight = np.where((texel_island[at] == island) & (island >= 0), weight, 0.0)
        total += weight[:, None] * values[at]
        known += weight
    return total / np.maximum(known, MIN_KNOWN)[:, None], known


def _texel_around(shape: tuple[int, ...], place: Floats, corner: int) -> tuple[Ints, Ints]:
    """Row and column of one of the four texels around places (n, 2)."""
    low = np.floor(place - 0.5).astype(int)
    column = np.clip(low[:, 0] + (corner & 1), 0, shape[1] - 1)
    return np.clip(low[:, 1] + (corner >> 1), 0, shape[0] - 1), column
