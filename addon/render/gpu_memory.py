"""How many bytes of the GPU's memory Hairloom takes, and what gives way where they are too few.

Blender does not tell scripts how much memory a GPU has. So there is a budget of a gibibyte, unless
the preferences or HAIRLOOM_GPU_MEMORY [MB] in the environment say otherwise. Who makes something
large asks here first. In this order they give way:

    lists of strands    a quarter of the budget, less where other things need it: strands are drawn
                        in more parts, which takes longer and looks the same (strand_layers.py)
    soft shadows        none in a view at rest for which the budget has no room (soft_picture.py)
    kept pictures       none while more than the budget is taken: a view at rest is drawn again
                        (kept_picture.py)
    shadow maps         half the budget for all grooms of a picture alike, a quarter for meshes:
                        fewer texels (map_size.py), of which a note tells

What remains is the hair itself and the picture, for which there is no substitute: the panel says
by how much they are beyond the budget.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from . import gpu_objects

MEGABYTE = 1 << 20
#: [MB] where nobody says otherwise
DEFAULT = 1024
#: in the environment [MB]; stronger than what is chosen in Blender
MEMORY_VARIABLE = "HAIRLOOM_GPU_MEMORY"
#: fractions of the budget: lists of strands at most, and at least; shadow maps of hair, and of
#: meshes
_LISTS, _MIN_LISTS, _MAPS, _MESH_MAPS = 1 / 4, 1 / 32, 1 / 2, 1 / 4

_chosen = DEFAULT
_GROOMS: ContextVar[int] = ContextVar("grooms of the picture that is drawn", default=1)


def choose_budget(megabytes: int) -> None:
    """From the next draw on."""
    global _chosen
    _chosen = megabytes


def budget() -> int:
    """How many bytes may be taken."""
    try:
        asked = int(os.environ.get(MEMORY_VARIABLE, ""))
    except ValueError:
        asked = 0
    return (asked if asked > 0 else _chosen) * MEGABYTE


@contextmanager
def shared_by(groom_count: int) -> Iterator[None]:
    """While a picture of this many grooms is drawn."""
    token = _GROOMS.set(max(groom_count, 1))
    try:
        yield
    finally:
        _GROOMS.reset(token)


def maps_room() -> int:
    """Bytes of the shadow maps of one groom. The same in every picture of as many grooms, whatever
    else is there: what they show depends on it."""
    return int(_MAPS * budget()) // _GROOMS.get()


def mesh_maps_room() -> int:
    """Bytes of the shadow maps of all meshes."""
    return int(_MESH_MAPS * budget())


def lists_room(held: int) -> int:
    """Bytes of the lists of strands, which hold this many now."""
    gpu_objects.free_unused()
    left = budget() - (gpu_objects.bytes_in_use() - held)
    return int(min(_LISTS * budget(), max(left, _MIN_LISTS * budget())))


def is_short(more: int = 0) -> bool:
    """Whether more is taken than may be, with this many bytes more; in a thread that draws."""
    gpu_objects.free_unused()
    return gpu_objects.bytes_in_use() + more > budget()
