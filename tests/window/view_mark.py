"""A mark in each 3D view that numbers its redraws, to detect whether a redraw is on the screen.

On Vulkan a picture can reach the screen later than it is drawn. So every 3D view draws a number:
eight black or white squares, one above the other at its left edge. Popups and the buttons of the
toolbar leave that edge free.
"""

from collections.abc import Iterator
from typing import Any

import bpy
import gpu
import numpy as np
import screen
from gpu_extras.batch import batch_for_shader

BIT_COUNT, SQUARE_SIZE = 8, 4
#: its place: pixels from the left edge of the view, and a fraction of its height
LEFT_MARGIN, BOTTOM_FRACTION = 2, 0.3
BLACK, WHITE = (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0)


class ViewMark:
    def __init__(self) -> None:
        self._number, self._is_drawing = 0, False
        self._shader: Any = None
        bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")

    def draw_again(self) -> None:
        """Redraw all 3D views, with a number that none of them has shown lately."""
        self._number, self._is_drawing = self._number % 255 + 1, True
        for _, region in _views():
            region.tag_redraw()

    def is_shown(self) -> bool:
        """Whether all visible 3D views show that redraw."""
        if not all(self._is_marked(window, region) for window, region in _views()):
            return False
        self._is_drawing = False
        return True

    def without_marks(self, shown: np.ndarray) -> np.ndarray:
        """The screen with marks replaced by the pixels beside them."""
        shown = shown.copy()
        for window, region in _views():
            # one more pixel on each side: backends differ by half a pixel
            left = window.x + region.x + LEFT_MARGIN - 1
            right = left + SQUARE_SIZE + 2
            bottom = len(shown) - (window.y + region.y + int(BOTTOM_FRACTION * region.height)) + 1
            rows = slice(max(bottom - SQUARE_SIZE * BIT_COUNT - 2, 0), max(bottom, 0))
            if left >= 0 and right < shown.shape[1]:
                shown[rows, left:right] = shown[rows, right : right + 1]
        return shown

    def _bits(self) -> list[bool]:
        return [bool(self._number >> bit & 1) for bit in range(BIT_COUNT)]

    def _is_marked(self, window: Any, region: Any) -> bool:
        width, height = screen.size()
        column = window.x + region.x + LEFT_MARGIN + SQUARE_SIZE // 2
        lowest = (
            height
            - 1
            - (window.y + region.y + int(BOTTOM_FRACTION * region.height) + SQUARE_SIZE // 2)
        )
        rows = SQUARE_SIZE * (BIT_COUNT - 1) + 1
        highest = lowest - rows + 1
        if not (0 <= column < width and highest >= 0 and lowest < height):
            return True  # beyond the screen
        shown = screen.part(column, highest, 1, rows)
        return (shown[::-SQUARE_SIZE, 0, 1] > 127).tolist() == self._bits()

    def _draw(self) -> None:
        if not self._is_drawing:
            return
        self._shader = self._shader or gpu.shader.from_builtin("FLAT_COLOR")
        corners, colours, right = [], [], LEFT_MARGIN + SQUARE_SIZE
        for number, bit in enumerate(self._bits()):
            low = int(BOTTOM_FRACTION * bpy.context.region.height) + number * SQUARE_SIZE
            high = low + SQUARE_SIZE
            corners += [(LEFT_MARGIN, low), (right, low), (right, high)]
            corners += [(LEFT_MARGIN, low), (right, high), (LEFT_MARGIN, high)]
            colours += [WHITE if bit else BLACK] * 6
        batch = batch_for_shader(self._shader, "TRIS", {"pos": corners, "color": colours})
        gpu.state.blend_set("NONE")
        batch.draw(self._shader)


def _views() -> Iterator[tuple[Any, Any]]:
    """The 3D views of all windows that no other window overlaps, each with its window."""
    windows = list(bpy.context.window_manager.windows)
    for window in windows:
        if any(_overlap(window, other) for other in windows if other != window):
            continue
        for area in window.screen.areas:
            for region in area.regions:
                if (
                    area.type == "VIEW_3D"
                    and region.type == "WINDOW"
                    and region.height > 4 * BIT_COUNT * SQUARE_SIZE
                ):
                    yield window, region


def _overlap(one: Any, other: Any) -> bool:
    across = one.x < other.x + other.width and other.x < one.x + one.width
    return across and one.y < other.y + other.height and other.y < one.y + one.height
