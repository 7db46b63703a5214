"""Guides in files, in the manner of engines: curves of their own beside the strands that are seen.

Unreal does not draw what is marked as a guide, so a strand that is a guide is there twice.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats, Ints
from .groom import Groom

_LARGEST_ID = np.iinfo(np.int32).max


def with_guide_copies(groom: Groom, guides: Ints, guide: Ints, weight: Floats) -> Groom:
    """The groom, and behind its strands a marked copy of each guide.

    Args:
        guides: (guide_count,) indices of the strands that are guides.
        guide: (strand_count, 3) indices into the guides, nearest first.
        weight: (strand_count, 3), their sum is 1.
    """
    count, copies = groom.strands.strand_count, len(guides)
    ids = np.arange(count) if groom.strand_id is None else groom.strand_id.astype(np.int64)
    if count and int(ids.max()) + copies > _LARGEST_ID:
        ids = np.arange(count)
    guide_ids = np.arange(copies) + (int(ids.max()) + 1 if count else 0)
    itself = np.zeros((copies, 3), np.float32)
    itself[:, 0] = 1.0
    plain = replace(groom, closest_guides=None, guide_weights=None)
    return replace(
        plain.take(np.concatenate([np.arange(count), guides])),
        strand_id=np.concatenate([ids, guide_ids]),
        is_guide=np.arange(count + copies) >= count,
        closest_guides=np.concatenate([guide_ids[guide], np.repeat(guide_ids[:, None], 3, axis=1)]),
        guide_weights=np.concatenate([weight, itself]),
    )
