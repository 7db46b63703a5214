"""The budget of GPU memory, and what is reduced when it is exceeded.

Blender does not report to scripts how much memory a GPU has. So the budget is a gibibyte, unless
the preferences or HAIRLOOM_GPU_MEMORY [MB] in the environment set another one. Code that allocates
much queries this module first. These are reduced, in this order:

    lists of strands    a quarter of the budget, less if other data needs it: strands are drawn in
                        more parts, which takes longer and looks the same (strand_layers.py)
    soft shadows        omitted in a view at rest if they exceed the budget (soft_picture.py)
    cached pictures     omitted while the budget is exceeded: a view at rest is drawn again
                        (cached_picture.py)
    shadow maps         half the budget, shared by all grooms of a picture, and a quarter for
                        meshes: fewer texels (map_size.py), with a note to the artist

The hair itself and the picture cannot be reduced: the panel shows by how much they exceed the
budget.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from . import gpu_objects

MEGABYTE = 1 << 20
#: default budget [MB]
DEFAULT_MEGABYTES = 1024
#: environment variable [MB]; overrides the choice in Blender
MEMORY_VARIABLE = "HAIRLOOM_GPU_MEMORY"
#: maximum and minimum fraction of the budget for lists of strands; shadow maps of hair, and of
#: meshes
_LIST_FRACTION, _MIN_LIST_FRACTION, _MAP_FRACTION, _MESH_MAP_FRACTION = 1 / 4, 1 / 32, 1 / 2, 1 / 4

_chosen_megabytes = DEFAULT_MEGABYTES
_GROOMS: ContextVar[int] = ContextVar("grooms of the picture that is drawn", default=1)


def choose_budget(megabytes: int) -> None:
    """Set the budget [MB], from the next draw on."""
    global _chosen_megabytes
    _chosen_megabytes = megabytes


def budget() -> int:
    """The budget in bytes."""
    try:
        requested = int(os.environ.get(MEMORY_VARIABLE, ""))
    except ValueError:
        requested = 0
    return (requested if requested > 0 else _chosen_megabytes) * MEGABYTE


@contextmanager
def shared_by(groom_count: int) -> Iterator[None]:
    """A context in which a picture of this many grooms is drawn."""
    token = _GROOMS.set(max(groom_count, 1))
    try:
        yield
    finally:
        _GROOMS.reset(token)


def shadow_map_budget() -> int:
    """Bytes for the shadow maps of one groom. Depends only on the number of grooms in the picture,
    not on other allocations, since it affects the picture."""
    return int(_MAP_FRACTION * budget()) // _GROOMS.get()


def mesh_shadow_map_budget() -> int:
    """Bytes for the shadow maps of all meshes."""
    return int(_MESH_MAP_FRACTION * budget())


def fragment_list_budget(held_bytes: int) -> int:
    """Bytes for the lists of strands, which take `held_bytes` now."""
    gpu_objects.free_unused()
    left = budget() - (gpu_objects.bytes_in_use() - held_bytes)
    return int(min(_LIST_FRACTION * budget(), max(left, _MIN_LIST_FRACTION * budget())))


def exceeds_budget(extra_bytes: int = 0) -> bool:
    """Whether the budget would be exceeded with `extra_bytes` more. In a thread that draws."""
    gpu_objects.free_unused()
    return gpu_objects.bytes_in_use() + extra_bytes > budget()
