"""The bust that ships, as arrays: head, neck and shoulders of MakeHuman's base mesh (CC0).

`tools/make_bust.py` writes the file. The bust is upright and faces -Y; the origin is the middle of
its skull.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ...arrays import Floats, Ints, number_in_piece, piece_starts

_FILE = Path(__file__).with_name("bust.npz")
#: vertex groups, each from 0 to 1: where hair grows
HAIR_GROUPS = ("scalp", "brows", "lashes", "beard")
#: values of `Bust.material`
SKIN, EYES = 0, 1


@dataclass(frozen=True, eq=False)
class Bust:
    """Polygons, most of them quads, stored one after the other; to be subdivided once.

    positions: (vertex_count, 3) [m]. uv: (uv_count, 2), without overlaps, from 0 to 1.
    sizes: (polygon_count,) corners of each polygon; material: SKIN or EYES of each.
    corner_vertex, corner_uv: (corner_count,) indices.
    weights: by name, (vertex_count,) from 0 to 1: HAIR_GROUPS; lips; cavity, the fraction of
        ambient light that folds leave.
    makehuman: (vertex_count,) index in MakeHuman's base mesh; -1 for vertices of the eyes and of
        the cap that closes the cut.
    """

    positions: Floats
    uv: Floats
    sizes: Ints
    material: Ints
    corner_vertex: Ints
    corner_uv: Ints
    weights: dict[str, Floats]
    makehuman: Ints

    @property
    def triangulated(self) -> tuple[Ints, Ints]:
        """Triangles of the polygons: their corners (triangle_count, 3), and their materials."""
        first = piece_starts(self.sizes)
        count = self.sizes - 2
        polygon = np.repeat(np.arange(len(count)), count)
        step = number_in_piece(count)
        start = first[polygon]
        corners = np.stack([start, start + step + 1, start + step + 2], axis=1)
        return corners, self.material[polygon]


@cache
def load_bust() -> Bust:
    """The bust; cached, so it must not be changed."""
    with np.load(_FILE, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    integers = {
        name: arrays[name].astype(np.int32)
        for name in ("sizes", "material", "corner_vertex", "corner_uv", "makehuman")
    }
    weights = {
        name: arrays[name].astype(np.float32) / 255.0 for name in (*HAIR_GROUPS, "lips", "cavity")
    }
    return Bust(positions=arrays["positions"], uv=arrays["uv"], weights=weights, **integers)
