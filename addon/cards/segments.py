"""The number of segments of a strip: as few as the allowed error permits."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands.vectors import unit
from .strip import CardFrames, Strips

#: Numbers of segments that are tried.
_SEGMENT_COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)


def candidate_segment_counts(max_segments: int) -> Ints:
    """The numbers of segments that a strip may be cut into, ascending, `max_segments` the last."""
    return np.array(
        [*(each for each in _SEGMENT_COUNTS if each < max_segments), max_segments], np.int32
    )


def segment_errors(strips: Strips, max_segments: int) -> Floats:
    """Deviation of the edges with each of `candidate_segment_counts`, (card_count, tried) float32
    [m].

    This is the largest distance of a CV's row from the cut strip at the same place along it,
    without the part along the strip. With `max_segments` segments it is 0, as nothing finer is
    tried. It is never larger than with fewer segments.
    """
    edges, tried = strip_edges(strips), candidate_segment_counts(max_segments)
    tangent = strips.frames.tangent[:, :, None]
    errors = np.zeros((len(edges), len(tried)), np.float32)
    for index, segments in enumerate(tried[:-1]):
        coarse = interpolated_rows(edges, np.linspace(0.0, 1.0, segments + 1))
        again = interpolated_rows(coarse, np.linspace(0.0, 1.0, edges.shape[1]))
        away = again - edges
        away -= tangent * np.sum(away * tangent, axis=-1, keepdims=True)
        errors[:, index] = np.linalg.norm(away, axis=-1).max(axis=(1, 2))
    return np.minimum.accumulate(errors, axis=1)


def fewest_segments(errors: Floats, error: float, max_segments: int) -> Ints:
    """The fewest segments with which each strip stays within `error` [m], (card_count,) int32.

    Args:
        errors: from `segment_errors` with the same `max_segments`.
    """
    fits = errors <= error
    fits[:, -1] = True
    return candidate_segment_counts(max_segments)[fits.argmax(axis=1)]


def with_segments(strips: Strips, chosen: Ints, segment_count: int) -> Strips:
    """The chosen strips with this many segments, equally spaced in CVs."""
    along = np.linspace(0.0, 1.0, segment_count + 1)
    frames = strips.frames
    center = interpolated_rows(frames.center[chosen], along)
    tangent = unit(interpolated_rows(frames.tangent[chosen], along))
    normal = interpolated_rows(frames.normal[chosen], along)
    normal = unit(normal - tangent * np.einsum("cri,cri->cr", normal, tangent)[..., None])
    width = interpolated_rows(strips.width[chosen][..., None], along)[..., 0]
    return Strips(CardFrames(center, tangent, normal, np.cross(tangent, normal)), width)


def strip_edges(strips: Strips) -> Floats:
    """Both edges of each strip, (card_count, row_count, 2, 3) [m]."""
    half = strips.frames.side * (strips.width / 2.0)[..., None]
    return np.stack([strips.frames.center - half, strips.frames.center + half], axis=2)


def interpolated_rows(rows: Floats, along: Floats) -> Floats:
    """Rows at these places from 0 to 1, linearly between, (card_count, len(along), ...)."""
    place = along * (rows.shape[1] - 1)
    left = np.minimum(place.astype(int), rows.shape[1] - 2)
    fraction = (place - left).astype(np.float32).reshape(1, -1, *[1] * (rows.ndim - 2))
    mixed: Floats = rows[:, left] * (1.0 - fraction) + rows[:, left + 1] * fraction
    return mixed
