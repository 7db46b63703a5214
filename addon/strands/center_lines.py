"""Centre lines: strands of few CVs that go where the strand goes, without its curls.

Resampling a curl by CVs that are farther apart than half a winding takes points of it at random. A
centre line is the mean of the strand around each CV instead: weighted by a tent that reaches to
the CVs beside it, which lets through what the CVs can show and takes away what they cannot.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats
from .resample import resample
from .strand_set import StrandSet

#: A strand that loses less of its length by resampling has no curls that its CVs cannot show.
_FAITHFUL = 0.02
#: Samples of a strand between two CVs, of which the mean is taken.
_SAMPLES = 16
#: No segment gets room for more than this: one whose curls cancel out would have it for anything.
_WIDEST = 20.0
#: Strands averaged at once.
_CHUNK = 2048


def center_lines(strands: StrandSet, cv_count: int) -> StrandSet:
    """The same strands with `cv_count` CVs each, at equal fractions of their lengths; roots and
    tips stay where they are. Strands that CVs can follow are merely resampled.
    """
    lines = resample(strands, cv_count)
    if lines is strands or cv_count < 3:
        return lines
    length = strands.lengths()
    lost = np.flatnonzero(length - lines.lengths() > _FAITHFUL * length)
    if not len(lost):
        return lines
    points = lines.grid.copy()
    for start in range(0, len(lost), _CHUNK):
        some = lost[start : start + _CHUNK]
        dense = resample(strands.take(some), (cv_count - 1) * _SAMPLES + 1).grid
        points[some, 1:-1] = _means(dense)
    return replace(lines, points=points.reshape(-1, 3))


def curl_room(length: Floats, lines: Floats) -> Floats | None:
    """By which fraction of its length each segment of centre lines could be drawn out until its
    curls are straight, (n, cv_count - 1) float32; None where no strand is curled.

    Args:
        length: (n,) [m] of the strands, evenly along which the CVs lie.
        lines: (n, cv_count, 3) [m].
    """
    segment = np.linalg.norm(np.diff(lines, axis=1), axis=2)
    room = length[:, None] / segment.shape[1] / np.maximum(segment, 1.0e-12) - 1.0
    is_curled = length - segment.sum(axis=1) > _FAITHFUL * length
    if not is_curled.any():
        return None
    return np.where(is_curled[:, None], np.clip(room, 0.0, _WIDEST), 0.0).astype(np.float32)


def _means(dense: Floats) -> Floats:
    """Around the inner CVs, (n, cv_count - 2, 3)."""
    tent = 1.0 - np.abs(np.arange(1 - _SAMPLES, _SAMPLES)) / _SAMPLES
    windows = np.lib.stride_tricks.sliding_window_view(dense[:, 1:-1], len(tent), axis=1)
    return np.einsum("ncdk,k->ncd", windows[:, ::_SAMPLES], tent / tent.sum())
