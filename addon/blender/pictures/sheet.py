"""The contact sheet of a groom: all sides, or all looks, in one picture."""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce

import blf
import imbuf
import numpy as np

from ...arrays import Floats
from ...params import SettingsMap
from ...render.camera import Camera
from ...rig_flow import Pose
from ...shading.settings import ShadingSettings
from ...shading.shafts_settings import ShaftSettings
from ...wet_flow import effective_settings
from ..base.images import contact_sheet
from ..properties.presets import named_preset, shipped_presets
from .studio import Studio

#: name of a view, and its angle from the front [degrees] and height, see GoodSide.turned; None:
#: the direction from which the groom is best seen
VIEWS = (
    ("Front", (0.0, 0.08)),
    ("Three-quarter", None),
    ("Side", (90.0, 0.08)),
    ("Back", (180.0, 0.08)),
    ("Top", (0.0, 20.0)),
)
CLOSE_UP = "Close-up"
COLUMNS = 3
#: for a close-up: the fraction of the groom's size that it shows, and the fraction of all strands
#: that counts as near the eye
_CLOSE_FRACTION, _NEAREST_FRACTION = 0.2, 0.1


class Sheet:
    """A contact sheet, drawn one picture at a time.

    Args:
        pose, points, guides: see Studio.picture.
        size: width and height of each picture [pixels].
        by_looks: one view in all shipped looks, instead of all views.
    """

    def __init__(
        self,
        studio: Studio,
        pose: Pose,
        points: Floats,
        size: tuple[int, int],
        samples: int,
        *,
        by_looks: bool = False,
        guides: Floats | None = None,
    ) -> None:
        self._studio, self._pose, self._points = studio, pose, points
        self._guides = guides
        self._size, self._samples, self._by_looks = size, samples, by_looks
        self._framed_points = studio.framed_points(pose, points)
        self._pictures: list[Floats] = []

    @property
    def count(self) -> int:
        return len(shipped_presets("shading")) if self._by_looks else len(VIEWS) + 1

    def steps(self) -> Iterator[int]:
        """Draw everything; yields the number of finished pictures."""
        for name, picture in self._looks() if self._by_looks else self._views():
            self._pictures.append(labelled(picture, name))
            yield len(self._pictures)

    @property
    def picture(self) -> Floats:
        """The complete sheet, (height, width, 4)."""
        return contact_sheet(self._pictures, COLUMNS)

    def _views(self) -> Iterator[tuple[str, Floats]]:
        side = self._studio.side
        for name, turn in VIEWS:
            direction = side.three_quarter if turn is None else side.turned(*turn)
            yield name, self._draw(self._camera(direction, self._framed_points))
        yield CLOSE_UP, self._draw(self._camera(side.three_quarter, self._close_up_points()))

    def _looks(self) -> Iterator[tuple[str, Floats]]:
        camera = self._camera(self._studio.side.three_quarter, self._framed_points)
        try:
            for entry in shipped_presets("shading"):
                look = effective_settings(SettingsMap(*named_preset(entry.name).all))
                self._studio.show_look(look[ShadingSettings], look[ShaftSettings])
                yield entry.title, self._draw(camera)
        finally:
            self._studio.show_look()

    def _draw(self, camera: Camera) -> Floats:
        hair = self._pose, self._points
        return self._studio.picture(*hair, *self._size, self._samples, camera, guides=self._guides)

    def _camera(self, direction: Floats, points: Floats) -> Camera:
        return self._studio.framing_camera(points, direction, self._size[0] / self._size[1])

    def _close_up_points(self) -> Floats:
        """Points around the hair nearest to the eye in the three-quarter view."""
        middles = self._studio.strand_middles(self._points)
        depth = middles @ self._studio.side.three_quarter
        count = max(round(_NEAREST_FRACTION * len(middles)), 1)
        middle = middles[np.argsort(depth)[-count:]].mean(axis=0)
        reach = 0.5 * _CLOSE_FRACTION * float(np.ptp(self._framed_points, axis=0).max())
        return middle + reach * np.concatenate([np.eye(3), -np.eye(3)])


_FONT = 0
#: height of text, and its distance from the border, as fractions of the shorter side
_SIZE, _MARGIN = 0.045, 0.035
_MIN_SIZE = 9
_BRIGHTNESS = 0.8
#: width of the dark outline that makes text legible on bright skin, as a fraction of its height
_OUTLINE = 0.1


def labelled(picture: Floats, text: str) -> Floats:
    """A picture with a line of bright text with a dark outline in its lower left corner.

    Args:
        picture: (height, width, 4) scene-linear, premultiplied, row 0 at the bottom.
    """
    height, width, _ = picture.shape
    size = max(_SIZE * min(width, height), _MIN_SIZE)
    letters = _text_coverage(width, height, text, size)
    for coverage, brightness in ((_widened(letters, size), 0.0), (letters, _BRIGHTNESS)):
        alpha = coverage[..., None]
        color = np.array([*[brightness] * 3, 1.0], np.float32)
        picture = picture * (1.0 - alpha) + alpha * color
    return picture


def _widened(coverage: Floats, size: float) -> Floats:
    """The coverage of letters of this size [pixels] with their outline."""
    reach = max(round(_OUTLINE * size), 1)
    for axis in (0, 1):
        shifted = (np.roll(coverage, shift, axis) for shift in range(-reach, reach + 1))
        coverage = reduce(np.maximum, shifted)
    return coverage


def _text_coverage(width: int, height: int, text: str, size: float) -> Floats:
    """The coverage of each pixel by letters of this size [pixels], (height, width)."""
    shorter = min(width, height)
    buffer = imbuf.new((width, height))
    blf.size(_FONT, size)
    blf.color(_FONT, 1.0, 1.0, 1.0, 1.0)
    with blf.bind_imbuf(_FONT, buffer):
        blf.position(_FONT, _MARGIN * shorter, _MARGIN * shorter, 0.0)
        blf.draw_buffer(_FONT, text)
    with buffer.with_buffer() as pixels:
        alpha = np.frombuffer(pixels, np.uint8).reshape(height, width, 4)[..., 3]
        return alpha.astype(np.float32) / 255.0
