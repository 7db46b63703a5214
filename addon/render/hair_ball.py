"""The sphere around the hair of a snapshot. Pure numpy: importable without gpu."""

from __future__ import annotations

from ..arrays import Floats
from ..shading.volume.light_frame import Ball, ball_around, max_reach, quantized_ball
from .snapshot import Snapshot


class HairBall:
    """Computes the sphere, and caches the result for one array of points."""

    def __init__(self) -> None:
        self._extent: tuple[Floats | None, Ball | float] = (None, 0.0)

    def ball(self, snapshot: Snapshot) -> Ball:
        """The sphere around all strands; for strands on the GPU, around all places that they can
        reach."""
        device = snapshot.device_points
        kept, found = self._extent
        if kept is not snapshot.points or isinstance(found, float) != (device is not None):
            points, offsets = snapshot.points, snapshot.layout.offsets
            found = ball_around(points) if device is None else max_reach(points, offsets)
            self._extent = points, found
        return quantized_ball(snapshot.root_center, found) if isinstance(found, float) else found
