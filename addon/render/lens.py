"""Depth of field: the samples of a picture look through different points of the lens.

All of them see points in the plane of focus at the same place of the picture.

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
    """A lens. radius: of the aperture [m]; focus: distance along the view that is sharp [m].

    blades: number of corners of the aperture, which lie on a circle; below three, it is the circle.
    rotation: of the corners [rad]. ratio: height of the aperture over its width.
    """

    radius: float
    focus: float
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0

    def places(self, count: int) -> Floats:
        """Points of the lens for `count` samples, (count, 2) [m] to the right and up from its
        middle.

        Evenly over the aperture. The first is the middle; more samples begin with those of fewer.
        """
        number = np.arange(count)
        turn, out = radical_inverse(number, 2), np.sqrt(radical_inverse(number, 3))
        if self.blades < _FEWEST_BLADES:
            angle = 2.0 * np.pi * turn
            unit = out[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        else:
            unit = self._polygon_points(turn, out)
        return np.asarray(self.radius * unit * [1.0 / self.ratio, 1.0])

    def _polygon_points(self, turn: Floats, out: Floats) -> Floats:
        """Points of a regular polygon, one triangle for each side, (n, 2)."""
        corner, along = np.divmod(turn * self.blades, 1.0)
        step = 2.0 * np.pi / self.blades
        ends = self.rotation + step * np.stack([corner, corner + 1.0])
        one, other = np.stack([np.cos(ends), np.sin(ends)], axis=-1)
        side = one + along[:, None] * (other - one)
        return np.asarray(out[:, None] * side)


def camera_through_lens(camera: Camera, lens: Lens, place: Floats) -> Camera:
    """The camera that looks through this point (2,) [m] of a lens centred at its eye."""
    right, up = float(place[0]), float(place[1])
    moved, sheared = np.eye(4), np.eye(4)
    moved[:2, 3] = -right, -up
    sheared[:2, 2] = -right / lens.focus, -up / lens.focus
    view = moved @ np.asarray(camera.view, np.float64)
    return replace(camera, view=view, projection=np.asarray(camera.projection) @ sheared)
