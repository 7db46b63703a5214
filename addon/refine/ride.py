"""Strands that ride on their guides: each keeps its rest shape and takes on the guides' motion."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..arrays import Floats, Ints

#: Strands moved at once, so that they stay in the processor's cache.
_CHUNK = 512


class Weights(Protocol):
    """guide: (strand_count, 3), indices into the guides. weight: (strand_count, 3), sum 1."""

    @property
    def guide(self) -> Ints: ...

    @property
    def weight(self) -> Floats: ...


def ride(rest: Floats, guide_rest: Floats, guide_now: Floats, weights: Weights) -> Floats:
    """rest + sum over k of w_k (guide_now - guide_rest)[guide_k], (strand_count, cv_count, 3).

    All in one space [m]; the result is float32. Guides at rest leave every strand bit for bit.

    Args:
        rest: (strand_count, cv_count, 3), strands carried by their own roots to now.
        guide_rest: (guide_count, cv_count, 3), guides carried by their own roots to now.
        guide_now: (guide_count, cv_count, 3), guides as simulated.
    """
    moved = np.array(rest, np.float32)
    width = rest.shape[1] * 3
    flat = moved.reshape(len(rest), width)
    motion = np.asarray(guide_now - guide_rest, np.float32).reshape(len(guide_rest), width)
    part = np.empty((min(_CHUNK, len(flat)), width), np.float32)
    for start in range(0, len(flat), _CHUNK):
        chunk = flat[start : start + _CHUNK]
        taken = part[: len(chunk)]
        stop = start + len(chunk)
        for guide, weight in zip(
            weights.guide[start:stop].T, weights.weight[start:stop].T, strict=True
        ):
            np.take(motion, guide, axis=0, out=taken, mode="clip")
            taken *= weight[:, None]
            chunk += taken
    return moved
