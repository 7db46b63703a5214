"""The budget of GPU memory, and what is reduced when it is exceeded.

Blender does not report to scripts how much memory a GPU has. So the budget is a gibibyte, unless
the preferences or HAIRLOOM_GPU_MEMORY [MB] in the environment set another one. Code that allocates
much queries this module first. These are reduced, in this order:

    lists of strands    a quarter of the budget, less if other data needs it: strands are drawn in
                        more parts, which takes longer and looks the same (strand_layers.py)
    soft shadows        omitted in a view at rest if they exceed the budget (soft_picture.py)
    kept pictures       omitted while the budget is exceeded: a view at rest is drawn again
                        (kept_picture.py)
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
DEFAULT = 1024
#: environment variable [MB]; overrides the choice in Blender
MEMORY_VARIABLE = "HAIRLOOM_GPU_MEMORY"
#: fractions of the budget: most and least for lists of strands; shadow maps of hair, and of meshes
_LISTS, _MIN_LISTS, _MAPS, _MESH_MAPS = 1 / 4, 1 / 32, 1 / 2, 1 / 4

_chosen = DEFAULT
_GROOMS: ContextVar[int] = ContextVar("grooms of the picture that is drawn", default=1)


def choose_budget(megabytes: int) -> None:
    """Set the budget [MB], from the next draw on."""
    global _chosen
    _chosen = megabytes


def budget() -> int:
    """The budget in bytes."""
    try:
        asked = int(os.environ.get(MEMORY_VARIABLE, ""))
    except ValueError:
        asked = 0
    return (asked if asked > 0 else _chosen) * MEGABYTE


@contextmanager
def shared_by(groom_count: int) -> Iterator[None]:
    """A context in which a picture of this many grooms is drawn."""
    token = _GROOMS.set(max(groom_count, 1))
    try:
        yield
    finally:
        _GROOMS.reset(token)


def maps_room() -> int:
    """Bytes for the shadow maps of one groom. Depends only on the number of grooms in the picture,
    not on other allocations, since it affects the picture."""
    return int(_MAPS * budget()) // _GROOMS.get()


def mesh_maps_room() -> int:
    """Bytes for the shadow maps of all meshes."""
    return int(_MESH_MAPS * budget())


def lists_room(held: int) -> int:
    """Bytes for the lists of strands, which take `held` bytes now."""
    gpu_objects.free_unused()
    left = budget() - (gpu_objects.bytes_in_use() - held)
    return int(min(_LISTS * budget(), max(left, _MIN_LISTS * budget())))


def is_short(more: int = 0) -> bool:
    """Whether the budget would be exceeded with this many more bytes. In a thread that draws."""
    gpu_objects.free_unused()
    return gpu_objects.bytes_in_use() + more > budget()
