"""Depth of field: a picture's samples look through different places of the lens.

All of them see what lies in the plane of focus at the same place of the picture.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats
from .camera import Camera
from .halton import radical_inverse

_FEWEST_BLADES = 3


@dataclass(frozen=True)
class Lens:
    """radius: of the aperture [m]; focus: distance along the view that is sharp [m].

    blades: corners of the aperture, below three a circle, which the corners lie on.
    rotation: of the corners [rad]. ratio: how many times higher than wide the aperture is.
    """

    radius: float
    focus: float
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0

    def places(self, count: int) -> Floats:
        """Where `count` samples look through, (count, 2) [m] right and up of its middle.

        Evenly over the aperture. The first is the middle; more samples begin with those of fewer.
        """
        number = np.arange(count)
        turn, out = radical_inverse(number, 2), np.sqrt(radical_inverse(number, 3))
        if self.blades < _FEWEST_BLADES:
            angle = 2.0 * np.pi * turn
            unit = out[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        else:
            unit = self._in_corners(turn, out)
        return np.asarray(self.radius * unit * [1.0 / self.ratio, 1.0])

    def _in_corners(self, turn: Floats, out: Floats) -> Floats:
        """Of a disk cut into one triangle for each side, (n, 2)."""
        corner, along = np.divmod(turn * self.blades, 1.0)
        step = 2.0 * np.pi / self.blades
        ends = self.rotation + step * np.stack([corner, corner + 1.0])
        one, other = np.stack([np.cos(ends), np.sin(ends)], axis=-1)
        side = one + along[:, None] * (other - one)
        return np.asarray(out[:, None] * side)


def through(camera: Camera, lens: Lens, place: Floats) -> Camera:
    """The camera that looks through this place (2,) [m] of a lens around its eye."""
    right, up = float(place[0]), float(place[1])
    moved, sheared = np.eye(4), np.eye(4)
    moved[:2, 3] = -right, -up
    sheared[:2, 2] = -right / lens.focus, -up / lens.focus
    view = moved @ np.asarray(camera.view, np.float64)
    return replace(camera, view=view, projection=np.asarray(camera.projection) @ sheared)
