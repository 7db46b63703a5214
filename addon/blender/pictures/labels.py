"""Text on pictures, in Blender's own font."""

from __future__ import annotations

import blf
import imbuf
import numpy as np

from ...arrays import Floats

_FONT = 0
#: height of letters, and their distance from the border, as fractions of the shorter side
_SIZE, _MARGIN = 0.045, 0.035
_MIN_SIZE = 9
_BRIGHTNESS = 0.8


def labelled(picture: Floats, text: str) -> Floats:
    """A picture with a line of text in its lower left corner.

    Args:
        picture: (height, width, 4) scene-linear, premultiplied, row 0 at the bottom.
    """
    coverage = _letters(picture.shape[1], picture.shape[0], text)[..., None]
    return (picture * (1.0 - coverage) + coverage * (*[_BRIGHTNESS] * 3, 1.0)).astype(np.float32)


def _letters(width: int, height: int, text: str) -> Floats:
    """The coverage of each pixel by letters, (height, width)."""
    shorter = min(width, height)
    buffer = imbuf.new((width, height))
    blf.size(_FONT, max(_SIZE * shorter, _MIN_SIZE))
    blf.color(_FONT, 1.0, 1.0, 1.0, 1.0)
    with blf.bind_imbuf(_FONT, buffer):
        blf.position(_FONT, _MARGIN * shorter, _MARGIN * shorter, 0.0)
        blf.draw_buffer(_FONT, text)
    with buffer.with_buffer() as pixels:
        alpha = np.frombuffer(pixels, np.uint8).reshape(height, width, 4)[..., 3]
        return alpha.astype(np.float32) / 255.0
