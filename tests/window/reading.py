"""Words on the screen, found by comparison with words that Blender's own font draws.

So a session can click the words of a documentation page where Blender shows them, and fails if a
button has another name.
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

import blf
import bpy
import gpu
import numpy as np
import screen
from driver import wait_until
from mathutils import Matrix

#: correlation, from -1 to 1, above which words are recognized; menus underline a letter
MIN_CORRELATION = 0.9
#: [pixels] margin of words, and the gaps before and after them in which other words of the line
#: would be; on the left, checkboxes are nearer than words
WORD_MARGIN, GAP_BEFORE, GAP_AFTER = 1, 3, 5
#: fraction of the letters' contrast by which the space beside them may vary
MAX_GAP_CONTRAST = 0.3
#: [levels of 255] smaller differences are no letters
MIN_DEVIATION = 6.0

#: left, bottom, width, height, in pixels of the window
Box = tuple[int, int, int, int]


@cache
def _draw_words(words: str, is_turned: bool) -> np.ndarray:
    """The letters' coverage of each pixel, (height, width), top row first."""
    size = bpy.context.preferences.ui_styles[0].widget.points
    blf.size(0, size * bpy.context.preferences.system.ui_scale)
    width, height = int(blf.dimensions(0, words)[0]) + 24, 40
    buffer = gpu.types.GPUOffScreen(width, height)
    with buffer.bind():
        frame = gpu.state.active_framebuffer_get()
        frame.clear(color=(0.0, 0.0, 0.0, 1.0))
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.matrix.load_matrix(Matrix.Identity(4))
            to_clip = Matrix.Diagonal((2.0 / width, 2.0 / height, -1.0, 1.0))
            to_clip.translation = (-1.0, -1.0, 0.0)
            gpu.matrix.load_projection_matrix(to_clip)
            blf.color(0, 1.0, 1.0, 1.0, 1.0)
            blf.position(0, 12.0, 16.0, 0.0)
            blf.draw(0, words)
        read = frame.read_color(0, 0, width, height, 4, 0, "UBYTE")
        read.dimensions = width * height * 4
        letters = np.array(read, np.float64).reshape(height, width, 4)[::-1, :, 0]
    buffer.free()
    rows, columns = (np.flatnonzero(letters.max(axis=axis)) for axis in (1, 0))
    assert len(rows), f"'{words}' has no letters"
    part = letters[
        rows[0] - WORD_MARGIN : rows[-1] + WORD_MARGIN + 1,
        columns[0] - WORD_MARGIN : columns[-1] + WORD_MARGIN + 1,
    ]
    return np.rot90(part, -1) if is_turned else part


def _correlation(picture: np.ndarray, letters: np.ndarray) -> np.ndarray:
    """Normalized cross-correlation, from -1 to 1, for each place of the upper left corner."""
    (height, width), (rows, columns) = picture.shape, letters.shape
    pattern = letters - letters.mean()
    pattern /= np.sqrt((pattern**2).sum())
    spectrum = np.fft.rfft2(picture) * np.fft.rfft2(pattern[::-1, ::-1], picture.shape)
    matched = np.fft.irfft2(spectrum, picture.shape)[rows - 1 :, columns - 1 :]

    def window_sums(values: np.ndarray) -> np.ndarray:
        sums = np.zeros((height + 1, width + 1))
        sums[1:, 1:] = values.cumsum(0).cumsum(1)
        return (
            sums[rows:, columns:]
            - sums[:-rows, columns:]
            - sums[rows:, :-columns]
            + sums[:-rows, :-columns]
        )

    count = rows * columns
    deviation = window_sums(picture**2) - window_sums(picture) ** 2 / count
    return matched / np.sqrt(np.maximum(deviation, count * MIN_DEVIATION**2))


def _is_separate(picture: np.ndarray, letters: np.ndarray, y: int, x: int, is_turned: bool) -> bool:
    """Whether words at a place are not part of a longer text."""
    if is_turned:
        picture, letters, y, x = picture.T, letters.T, x, y
    rows, columns = letters.shape
    lines = picture[y : y + rows]
    contrast = np.polyfit(letters.ravel(), lines[:, x : x + columns].ravel(), 1)[0] * 255.0
    ground = np.median(lines[:, x : x + columns])
    beside = np.hstack(
        (lines[:, max(x - GAP_BEFORE, 0) : x], lines[:, x + columns :][:, :GAP_AFTER])
    )
    return bool(np.abs(beside - ground).max(initial=0.0) < MAX_GAP_CONTRAST * abs(contrast))


def find_words(words: str, box: Box, *, is_turned: bool = False) -> list[tuple[float, int, int]]:
    """Words found in a part of the window: correlation, x and y of their middle; best first."""
    left, bottom, width, height = box
    top = screen.size()[1] - (bottom + height)
    picture = screen.part(left, top, width, height).astype(np.float64).mean(axis=2)
    letters = _draw_words(words, is_turned)
    rows, columns = letters.shape
    if rows > height or columns > width:
        return []
    likeness = np.abs(_correlation(picture, letters))
    found = []
    for y, x in np.argwhere(likeness > MIN_CORRELATION):
        if not _is_separate(picture, letters, int(y), int(x), is_turned):
            continue
        middle = left + int(x) + columns // 2, bottom + height - int(y) - rows // 2
        found.append((float(likeness[y, x]), *middle))
    best: list[tuple[float, int, int]] = []
    for each in sorted(found, reverse=True):  # once each
        if all(abs(each[1] - other[1]) > 4 or abs(each[2] - other[2]) > 4 for other in best):
            best.append(each)
    return best


def width_of(words: str) -> int:
    """Width of words [pixels], from the first letter to the last."""
    return int(_draw_words(words, False).shape[1]) - 2 * WORD_MARGIN


def whole_window() -> Box:
    return 0, 0, bpy.context.window.width, bpy.context.window.height


def box_of(region: Any) -> Box:
    return region.x, region.y, region.width, region.height


def wait_for_words(words: str, box: Box | None = None, **options: bool) -> Iterator[int]:
    """Wait until words are shown; returns x and y of their middle."""
    found: list[tuple[float, int, int]] = []

    def is_shown() -> bool:
        found[:] = find_words(words, box or whole_window(), **options)
        return bool(found)

    yield from wait_until(is_shown, f"'{words}' is not to be read")
    return found[0][1:]
