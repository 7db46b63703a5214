"""Work in several threads: numpy releases the interpreter lock while it computes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

THREADS = min(4, os.cpu_count() or 1)


def parallel_map[T, R](make: Callable[[T], R], parts: Iterable[T]) -> list[R]:
    """The results of `make` for each part, in order, computed in parallel; calls must be
    independent."""
    all_parts = list(parts)
    if len(all_parts) < 2 or THREADS < 2:
        return [make(part) for part in all_parts]
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(make, all_parts))


def even_slices(count: int, min_size: int) -> list[slice]:
    """`count` rows split into at most one slice per thread, of at least `min_size` rows each if
    there are several."""
    slice_count = max(min(THREADS, count // min_size), 1)
    bounds = [count * i // slice_count for i in range(slice_count + 1)]
    return [slice(*ends) for ends in pairwise(bounds)]
