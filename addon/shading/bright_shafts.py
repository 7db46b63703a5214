"""Shafts of light from bright parts of the picture: the reference for the shaders.

Nguyen and Donnelly 2005 (the Nalu demo's "God Rays", as in shafts.py): bright regions of the
picture are taken to polar coordinates, blurred along the radius, and taken back. Whatever covers a
bright thing in the picture cuts its shafts, hair in proportion to its coverage.

    S           bright part: colour * a^2 / (a + knee * threshold) / luminance,
                a = luminance - threshold
    B_i(r, angle)  the mean of w_i * S on the ray out from the middle of region i, weighted
                by exp(-s / l) at a distance s back
    added       strength * tint * scale * sum of B_i

A window, an emissive mesh and a sky have no lamp from which to blur outwards, so each region has a
middle of its own. The weights w_i add up to 1 and are bilinear over a coarse lattice. From the
bright part around each node, the mean shift (Fukunaga and Hostetler 1975) climbs to a middle: parts
of one window climb to the same middle, two windows far apart to two. Middles follow light that
moves.

scale is 1 as long as less than half of the picture is bright and falls to 0 where all of it is: a
white world casts no shafts.

Limitation: only what is in the picture counts, as in shafts.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from .luminance import LUMINANCE
from .shafts import PolarGrid, from_polar, radial_blur, to_polar
from .shafts_settings import ShaftSettings

#: height above the threshold at which brightness counts half [thresholds]
KNEE = 0.5
#: maximum luminance that counts, so that single pixels do not outshine all others
BRIGHTEST = 20.0
#: colours are cut off here, which keeps float32 from overflowing
LARGEST = 1.0e6
#: cells and spans of the lattice along the longer side of the picture
CELLS, SPANS = 48, 4
#: reach of the mean shift, and distance below which middles are one, both of the longer side
_REACH, _SAME = 0.2, 0.02
_SHIFTS = 30
#: maximum number of middles; fainter ones join the nearest
MAX_REGIONS = 6


@dataclass(frozen=True, eq=False)
class BrightRegion:
    """Bright part that is blurred outwards from one place.

    center: x, y [pixels].
    weights: (rows, columns) of the lattice, which fraction of the bright part belongs to it at each
        node.
    """

    center: tuple[float, float]
    weights: Floats


@dataclass(frozen=True, eq=False)
class BrightRegions:
    """All regions. scale: factor on the light that is added."""

    regions: tuple[BrightRegion, ...]
    scale: float


def wants_bright(settings: ShaftSettings) -> bool:
    """Whether bright things cast shafts."""
    is_wanted = settings.use_shafts and settings.source in ("bright", "both")
    return is_wanted and settings.bright_strength > 0.0


def bright_part(colors: Floats, threshold: float) -> Floats:
    """The bright part of scene-linear colours (..., 3+), and how certain it is, (..., 4): 1 from
    the knee on.

    Negative values and NaN count as black.
    """
    colors = np.asarray(colors, np.float64)[..., :3]
    colors = np.where(colors >= 0.0, np.minimum(colors, LARGEST), 0.0)
    luminance = colors @ LUMINANCE
    above = np.maximum(luminance - threshold, 0.0)
    is_bright = above > 0.0
    certainty = np.divide(
        above, above + KNEE * threshold, out=np.zeros_like(above), where=is_bright
    )
    finite = np.minimum(above * certainty, BRIGHTEST)
    factor = np.divide(finite, luminance, out=np.zeros_like(above), where=is_bright)
    certainty = np.minimum(2.0 * certainty, 1.0)
    return np.concatenate([colors * factor[..., None], certainty[..., None]], axis=-1)


def cell_side(width: int, height: int) -> int:
    """Side of the cells over which the bright part is summed [pixels]."""
    return -(-max(width, height) // CELLS)


def bright_cells(bright: Floats) -> Floats:
    """Sums over cells of a picture's `bright_part`, (rows, columns, 4): luminance, luminance times
    x and times y [pixels], and certainty.
    """
    height, width = bright.shape[:2]
    side = cell_side(width, height)
    luminance = bright[..., :3] @ LUMINANCE
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    values = np.stack([luminance, luminance * x, luminance * y, bright[..., 3]], axis=-1)
    missing = (0, -height % side), (0, -width % side), (0, 0)
    padded = np.pad(values, missing)
    rows, columns = padded.shape[0] // side, padded.shape[1] // side
    return padded.reshape(rows, side, columns, side, 4).sum(axis=(1, 3))


def node_spacing(width: int, height: int) -> float:
    """Distance between nodes of the lattice [pixels]; the first node is at the corner 0, 0."""
    return max(width, height) / SPANS


def bright_regions(cells: Floats, width: int, height: int) -> BrightRegions:
    """The regions of the bright part of a picture of this size [pixels], from the sums (rows,
    columns, 4) of `bright_cells`."""
    sums = np.asarray(cells, np.float64).reshape(-1, 4)
    scale = float(np.clip(2.0 * (1.0 - sums[:, 3].sum() / (width * height)), 0.0, 1.0))
    sums = sums[sums[:, 0] > 0.0]
    if not len(sums) or scale <= 0.0:
        return BrightRegions((), 0.0)
    light, places = sums[:, 0], sums[:, 1:3] / sums[:, :1]
    spacing = node_spacing(width, height)
    shape = int(np.ceil(height / spacing)) + 1, int(np.ceil(width / spacing)) + 1
    row, column = (index.ravel() for index in np.indices(shape))
    tents = np.maximum(1.0 - np.abs(places[:, 0] / spacing - column[:, None]), 0.0)
    tents *= np.maximum(1.0 - np.abs(places[:, 1] / spacing - row[:, None]), 0.0)
    of_node = tents @ light
    lit = np.flatnonzero(of_node > 0.0)
    # in an order that no rounding changes
    lit = lit[np.argsort(-np.log(of_node[lit]).round(2), kind="stable")]
    starts = (tents[lit] * light) @ places / of_node[lit, None]
    longer = max(width, height)
    middles = _mean_shift(starts, places, light, _REACH * longer)
    centers: list[Floats] = []
    group = np.zeros(len(row), np.int64)
    for node, middle in zip(lit, middles, strict=True):
        away = [float(np.hypot(*(middle - center))) for center in centers]
        nearest = int(np.argmin(away)) if away else -1
        is_new = nearest < 0 or away[nearest] > _SAME * longer
        if is_new and len(centers) < MAX_REGIONS:
            centers.append(middle)
            nearest = len(centers) - 1
        group[node] = nearest
    is_lit = np.isin(np.arange(len(row)), lit)
    found = []
    for number in range(len(centers)):
        joined = group[lit] == number
        x, y = of_node[lit][joined] @ middles[joined] / of_node[lit][joined].sum()
        weights = (is_lit & (group == number)).astype(np.float32).reshape(shape)
        found.append(BrightRegion((float(x), float(y)), weights))
    return BrightRegions(tuple(found), scale)


def _mean_shift(starts: Floats, places: Floats, light: Floats, reach: float) -> Floats:
    """Where the mean shift moves `starts`, in the light at `places` blurred by a Gaussian of
    `reach`."""
    middles = starts
    for _ in range(_SHIFTS):
        away = ((middles[:, None] - places) ** 2).sum(axis=-1)
        weights = np.exp(-away / (2.0 * reach * reach)) * light
        middles = weights @ places / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
    return middles


def bright_shafts(
    picture: Floats, seen: Floats, length: float, settings: ShaftSettings
) -> tuple[Floats, BrightRegions]:
    """A picture with the shafts of its bright things, and the regions of these.

    Args:
        picture: (height, width, 4) scene-linear, premultiplied.
        seen: (height, width, 3+) the picture over what lies behind it.
        length: of shafts [pixels].
    """
    height, width = picture.shape[:2]
    bright = bright_part(seen, settings.bright_threshold)
    found = bright_regions(bright_cells(bright), width, height)
    result = np.array(picture, np.float64)
    factor = settings.bright_strength * found.scale * np.asarray(settings.tint)
    for region in found.regions:
        grid = PolarGrid.over(region.center, width, height, settings.samples)
        rays = to_polar(bright[..., :3], grid) * weights_on(grid, region, width, height)
        blurred = radial_blur(rays, grid, length, start_weight=0.0)
        result[..., :3] += from_polar(blurred, grid, width, height) * factor
    return result.astype(np.float32), found


def weights_on(grid: PolarGrid, region: BrightRegion, width: int, height: int) -> Floats:
    """Weights of a region on the rays of a grid, (angles, radii, 1)."""
    x, y = grid.places
    spacing = node_spacing(width, height)
    rows, columns = region.weights.shape
    column = np.clip(x / spacing, 0.0, columns - 1.0)
    row = np.clip(y / spacing, 0.0, rows - 1.0)
    left, lower = np.floor(column), np.floor(row)
    across, up = column - left, row - lower

    def at(column: Floats, row: Floats) -> Floats:
        columns_, rows_ = np.minimum(column, columns - 1), np.minimum(row, rows - 1)
        found: Floats = region.weights[rows_.astype(int), columns_.astype(int)]
        return found

    below = at(left, lower) * (1.0 - across) + at(left + 1, lower) * across
    above = at(left, lower + 1) * (1.0 - across) + at(left + 1, lower + 1) * across
    return (below * (1.0 - up) + above * up)[..., None]
