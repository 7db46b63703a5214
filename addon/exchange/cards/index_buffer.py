"""NAME.indices.bin: the sorted indices alone, for engines that keep their own vertices.

Raw little-endian unsigned integers, three a triangle: all levels one after the other, then all
levels in the order for back faces, if there is one. The sidecar stores where each begins. Indices
count the vertices of each level from 0, in the order of the file beside this one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Ints
from ...cards.card_mesh import CardMesh

#: Maximum vertices for uint16: its largest value means the end of a strip to some engines.
_MAX_SHORT = 0xFFFF


@dataclass(frozen=True)
class IndexBuffer:
    """content: the file. type: "uint16" or "uint32" of all indices in it.

    first, back_first: of each level, where its indices begin, counted in indices; back_first is
    empty without an order for back faces.
    """

    content: bytes
    type: str
    first: tuple[int, ...]
    back_first: tuple[int, ...]

    def back_orders_only(self) -> IndexBuffer:
        """The buffer without the first orders, which the mesh has: `first` is that of the second
        ones, too."""
        begin = self.back_first[0]
        size = 2 if self.type == "uint16" else 4
        back = tuple(each - begin for each in self.back_first)
        return IndexBuffer(self.content[begin * size :], self.type, back, back)


def index_buffer(levels: Sequence[CardMesh], back: Sequence[Ints] = ()) -> IndexBuffer:
    """The indices of all levels.

    Args:
        back: of each level (triangle_count, 3), the order for back faces; empty: there is none.
    """
    parts = [np.asarray(part).ravel() for part in (*(mesh.triangles for mesh in levels), *back)]
    is_short = max((len(mesh.positions) for mesh in levels), default=0) <= _MAX_SHORT
    first = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    content = np.concatenate(parts).astype("<u2" if is_short else "<u4").tobytes()
    return IndexBuffer(
        content,
        "uint16" if is_short else "uint32",
        tuple(first[: len(levels)]),
        tuple(first[len(levels) : -1]),
    )
