"""Cameras for another window: a part of the picture, or one shifted by a fraction of a pixel.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats
from .camera import Camera

#: left, bottom, right, top; fractions of the picture
type Window = tuple[float, float, float, float]


def cropped(camera: Camera, window: Window) -> Camera:
    """The camera that shows only this part of the picture, filling the target.

    Raises:
        ValueError: a window without a size.
    """
    left, bottom, right, top = window
    if not (left < right and bottom < top):
        raise ValueError(f"no picture of the window {window}")
    projection = np.array(camera.projection, np.float64)
    for axis, (low, high) in enumerate(((left, right), (bottom, top))):
        # in clip space the picture goes from -1 to 1
        projection[axis] = (projection[axis] - (low + high - 1.0) * projection[3]) / (high - low)
    return replace(camera, projection=projection)


def jittered(camera: Camera, offset: Floats, width: int, height: int, sample: int = 0) -> Camera:
    """The camera whose pixels are sampled at an offset (2,) [pixels] from their centres.

    Args:
        width, height: of the target [pixels].
        sample: index of the sample.
    """
    projection = np.array(camera.projection, np.float64)
    for axis, side in enumerate((width, height)):
        projection[axis] -= 2.0 * float(offset[axis]) / side * projection[3]
    return replace(camera, projection=projection, sample=sample)


def sample_place(sample: int, samples: int) -> Floats:
    """The place (2,) [pixels] of a sample from the middle of its pixel, for `samples` along each
    side of a pixel; further ones start again."""
    return (np.array(divmod(sample % samples**2, samples)) + 0.5) / samples - 0.5


def view_depth(camera: Camera, depth: Floats) -> Floats:
    """Distance along the view [m] of depth buffer values in [0, 1]."""
    clip = 2.0 * np.asarray(depth, np.float64) - 1.0
    scale, offset = camera.projection[2, 2], camera.projection[2, 3]
    if camera.projection[3, 3] == 0.0:
        return np.asarray(offset / (clip + scale))
    return np.asarray((offset - clip) / scale)
