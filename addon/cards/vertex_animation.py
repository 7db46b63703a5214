"""Vertices in motion as a texture: a texel for each vertex and frame.

Frame 0 has the upper rows, frame 1 those below, and so on; within a frame vertices run along the
rows, the first one at the left of the top row. Vertices of all levels follow each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError

#: Widths that are tried [texels]; the first is chosen whose height is no larger.
_WIDTHS = (1024, 2048, 4096, 8192)


@dataclass(frozen=True)
class MotionLayout:
    """The layout of the texture.

    width: [texels]. rows: per frame.
    """

    vertex_count: int
    frame_count: int
    width: int
    rows: int

    @property
    def height(self) -> int:
        return self.rows * self.frame_count

    @property
    def frame_step(self) -> float:
        """Offset to the next frame, downwards, as a fraction of the height."""
        return self.rows / self.height


def motion_layout(vertex_count: int, frame_count: int, place: str) -> MotionLayout:
    """A layout that wastes little.

    Raises:
        HairloomError: the motion does not fit into a texture that engines can hold.
    """
    for max_width in _WIDTHS:
        rows = -(-vertex_count // max_width)
        if rows * frame_count <= max_width:
            return MotionLayout(vertex_count, frame_count, -(-vertex_count // rows), rows)
    raise HairloomError(
        f"{vertex_count:,} vertices in {frame_count:,} frames do not fit into a texture of "
        f"{_WIDTHS[-1]} x {_WIDTHS[-1]} texels",
        place=place,
        remedy="Write fewer frames, levels of detail or cards, or choose joints",
    )


def vertex_texels(layout: MotionLayout) -> Floats:
    """The texture coordinate of each vertex in frame 0, (vertex_count, 2) in 0 to 1; the second
    one from the top of the picture.
    """
    number = np.arange(layout.vertex_count)
    column, row = number % layout.width, number // layout.width
    return np.stack([(column + 0.5) / layout.width, (row + 0.5) / layout.height], axis=1)


def rounding_errors(values: Floats, depth: str) -> Floats:
    """Rounding errors of stored values, of any shape.

    Args:
        depth: "half" or "float".
    """
    stored = values.astype(np.float16 if depth == "half" else np.float32)
    return stored.astype(np.float32) - values


def motion_texture(values: Floats, layout: MotionLayout) -> Floats:
    """The texture, (height, width, 3) with row 0 at the bottom; 0 where no vertex is.

    Args:
        values: (vertex_count, frame_count, 3).
    """
    texels = np.zeros((layout.frame_count, layout.rows * layout.width, 3), np.float32)
    texels[:, : layout.vertex_count] = values.transpose(1, 0, 2)
    return texels.reshape(layout.height, layout.width, 3)[::-1]
