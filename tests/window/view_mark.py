"""Tells whether what a 3D view has drawn is on the screen: each drawing is numbered by a mark.

Drawing and showing are two things: on Vulkan a picture may come to the screen later. So every 3D
view draws a number, eight squares that are black or white, at two places of its left edge, where
the toolbar lies over it. A popup may cover one of them.
"""

from collections.abc import Iterator
from typing import Any

import bpy
import gpu
import numpy as np
import screen
from gpu_extras.batch import batch_for_shader

BITS, SIDE = 8, 4
#: where the marks are, as fractions of the view's height
HEIGHTS = (0.0, 0.45)
BLACK, WHITE = (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0)


class ViewMark:
    def __init__(self) -> None:
        self._number, self._is_wanted = 0, False
        self._shader: Any = None
        bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")

    def draw_again(self) -> None:
        """Have all 3D views drawn again, with a number that none of them has shown lately."""
        self._number, self._is_wanted = self._number % 255 + 1, True
        for _, region in _views():
            region.tag_redraw()

    def is_shown(self) -> bool:
        """Whether all 3D views that can be seen show that drawing."""
        shown = screen.pixels()
        if not all(self._is_marked(shown, window, region) for window, region in _views()):
            return False
        self._is_wanted = False
        return True

    def _bits(self) -> list[bool]:
        return [bool(self._number >> bit & 1) for bit in range(BITS)]

    def _is_marked(self, shown: np.ndarray, window: Any, region: Any) -> bool:
        x = window.x + region.x + SIDE // 2
        rows = [
            len(shown) - 1 - (window.y + region.y + int(height * region.height) + SIDE // 2)
            for height in HEIGHTS
        ]
        if (
            x < 0
            or x + BITS * SIDE > shown.shape[1]
            or not 0 <= min(rows) <= max(rows) < len(shown)
        ):
            return True  # beyond the screen
        found = [shown[row, x : x + BITS * SIDE : SIDE, 1] > 127 for row in rows]
        return any(each.tolist() == self._bits() for each in found)

    def _draw(self) -> None:
        if not self._is_wanted:
            return
        self._shader = self._shader or gpu.shader.from_builtin("FLAT_COLOR")
        corners, colours = [], []
        for height in HEIGHTS:
            low = int(height * bpy.context.region.height)
            for number, bit in enumerate(self._bits()):
                left, right, high = number * SIDE, (number + 1) * SIDE, low + SIDE
                corners += [(left, low), (right, low), (right, high)]
                corners += [(left, low), (right, high), (left, high)]
                colours += [WHITE if bit else BLACK] * 6
        batch = batch_for_shader(self._shader, "TRIS", {"pos": corners, "color": colours})
        gpu.state.blend_set("NONE")
        batch.draw(self._shader)


def _views() -> Iterator[tuple[Any, Any]]:
    """The 3D views of all windows that no other window may cover, each with its window."""
    windows = list(bpy.context.window_manager.windows)
    for window in windows:
        if any(_meet(window, other) for other in windows if other != window):
            continue
        for area in window.screen.areas:
            for region in area.regions:
                if (
                    area.type == "VIEW_3D"
                    and region.type == "WINDOW"
                    and region.width > BITS * SIDE
                ):
                    yield window, region


def _meet(one: Any, other: Any) -> bool:
    across = one.x < other.x + other.width and other.x < one.x + one.width
    return across and one.y < other.y + other.height and other.y < one.y + one.height
