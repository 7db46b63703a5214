"""How strips are cut: as few segments as the allowed error permits, shorter where they bend."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands.vectors import unit
from .strip import CardFrames, Strips

#: Numbers of segments that are tried.
_SEGMENT_COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)
#: The density of rows is the sum of an even part, of one where the strip bends, which makes both
#: together 1 on average, and of one that fades within this part of the strip from its root, where
#: light and skin change fastest. Measured on a bob.
_EVEN_DENSITY, _ROOT_DENSITY, _ROOT_PART = 0.3, 2.0, 0.08
#: Bends below this fraction of the distance between CVs are rounding.
_STRAIGHT = 1e-3
_TINY = 1e-12


def candidate_segment_counts(max_segments: int) -> Ints:
    """The numbers of segments (n,) that a strip may be cut into, ascending to `max_segments`."""
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
    every, rows_below = np.linspace(0.0, 1.0, edges.shape[1]), _rows_below(strips)
    for index, segments in enumerate(tried[:-1]):
        places = _row_places(rows_below, int(segments))
        again = interpolated_rows(interpolated_rows(edges, places), every, places)
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
    """The strips with these indices, (n,), with this many segments: closer rows where they bend
    and at their roots."""
    whole = strips.select(chosen)
    frames, places = whole.frames, _row_places(_rows_below(whole), segment_count)
    center = interpolated_rows(frames.center, places)
    tangent = unit(interpolated_rows(frames.tangent, places))
    normal = interpolated_rows(frames.normal, places)
    normal = unit(normal - tangent * np.einsum("cri,cri->cr", normal, tangent)[..., None])
    width = interpolated_rows(whole.width[..., None], places)[..., 0]
    return Strips(CardFrames(center, tangent, normal, np.cross(tangent, normal)), width, places)


def _rows_below(strips: Strips) -> Floats:
    """The fraction of a strip's rows that should lie below each CV, (card_count, row_count).

    A chord deviates from a bend by its length squared, so the error is least where the density of
    rows is proportional to the root of the bend: de Boor 1978, chapter XII. More rows are near the
    root, where cards lie close to the skin and the light on strands fades within a centimetre.
    """
    card_count, row_count = strips.width.shape
    if row_count < 3:
        return np.broadcast_to(np.linspace(0.0, 1.0, row_count), (card_count, row_count))
    edges, tangent = strip_edges(strips), strips.frames.tangent[:, 1:-1, None]
    bend = edges[:, 2:] - 2.0 * edges[:, 1:-1] + edges[:, :-2]
    bend = bend - tangent * np.sum(bend * tangent, axis=-1, keepdims=True)
    root = np.pad(np.sqrt(np.linalg.norm(bend, axis=-1).max(axis=2)), ((0, 0), (2, 2)), mode="edge")
    density = 0.25 * root[:, :-2] + 0.5 * root[:, 1:-1] + 0.25 * root[:, 2:]
    spacing = np.linalg.norm(np.diff(strips.frames.center, axis=1), axis=-1).mean(axis=1)
    mean = np.maximum(density.mean(axis=1), np.sqrt(_STRAIGHT * spacing) + _TINY)
    at_root = _ROOT_DENSITY * np.exp(-np.linspace(0.0, 1.0, row_count) / _ROOT_PART)
    density = _EVEN_DENSITY + (1.0 - _EVEN_DENSITY) * density / mean[:, None] + at_root
    below = np.zeros_like(density)
    np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1, out=below[:, 1:])
    return below / below[:, -1:]


def _row_places(rows_below: Floats, segment_count: int) -> Floats:
    """Where to cut each strip into this many segments, (card_count, segment_count + 1) float32.

    Args:
        rows_below: see `_rows_below`.
    """
    card_count, row_count = rows_below.shape
    wanted = np.linspace(0.0, 1.0, segment_count + 1)
    if segment_count >= row_count - 1:
        return np.broadcast_to(wanted.astype(np.float32), (card_count, segment_count + 1))
    every = np.broadcast_to(np.linspace(0.0, 1.0, row_count), rows_below.shape)
    places = interpolated_rows(every[..., None], wanted, rows_below)[..., 0]
    places[:, 0], places[:, -1] = 0.0, 1.0
    return places.astype(np.float32)


def strip_edges(strips: Strips) -> Floats:
    """Both edges of each strip, (card_count, row_count, 2, 3) [m]."""
    half = strips.frames.side * (strips.width / 2.0)[..., None]
    return np.stack([strips.frames.center - half, strips.frames.center + half], axis=2)


def interpolated_rows(rows: Floats, along: Floats, places: Floats | None = None) -> Floats:
    """Rows at other places from 0 to 1, linearly between, (card_count, k, ...).

    Args:
        rows: (card_count, row_count, ...).
        along: (k,) or (card_count, k) the places.
        places: (card_count, row_count) where the rows lie, ascending; None: evenly spaced.
    """
    cards, last = np.arange(len(rows))[:, None], rows.shape[1] - 2
    if places is None:
        place = np.broadcast_to(along * (rows.shape[1] - 1), (len(rows), along.shape[-1]))
        left = np.minimum(place.astype(int), last)
        fraction = place - left
    else:
        along = np.broadcast_to(along, (len(rows), along.shape[-1]))
        left = np.minimum((places[:, None, 1:] <= along[..., None]).sum(axis=-1), last)
        low, high = places[cards, left], places[cards, left + 1]
        fraction = (along - low) / np.maximum(high - low, _TINY)
    fraction = fraction.astype(np.float32).reshape(*fraction.shape, *[1] * (rows.ndim - 2))
    mixed: Floats = rows[cards, left] * (1.0 - fraction) + rows[cards, left + 1] * fraction
    return mixed
