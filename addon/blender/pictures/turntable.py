"""A turntable: the camera circles a groom once, with a picture for each frame, and a video.

Pictures are written into a temporary folder and moved together when all are done, so that a
cancelled or failed turntable leaves no partial files and does not change an earlier one.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count, takewhile
from pathlib import Path

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...exchange.files.atomic import folder_write_error, write_error
from ...exchange.files.file_set import atomic_file_set
from ...render.camera import Camera
from ...rig_flow import Pose
from ...shading.lights import Light
from ...strands.affine import rotation_about
from .studio import Studio
from .video import write_video

#: choices of what lights move with: identifier, label, description
LIGHTS = (
    (
        "camera",
        "Turn with Camera",
        "Look as if the groom turned in front of a fixed camera and fixed lights",
    ),
    ("groom", "Stay on Groom", "Look as if the camera circled a fixed groom with fixed lights"),
)
#: frame count and sides of pictures [pixels], min and max
FRAME_LIMITS, SIDE_LIMITS = (1, 10_000), (16, 4096)
#: sub-pixels along each side of a pixel, min and max
SAMPLE_LIMITS = 1, 4
#: height of the camera: z of a direction whose horizontal length is 1
_CAMERA_Z = 0.14
#: number of layers of the turning points, and number of corners of the circle around each
_LAYERS, _CORNERS = 48, 64


@dataclass(frozen=True)
class TurntableSettings:
    """Settings of a turntable.

    frames: in a full turn.
    width, height: of the pictures [pixels].
    samples: sub-pixels along each side of a pixel.
    lights: one of LIGHTS.
    transparent: no backdrop.
    video: write a video as well.
    frame_rate: of the video [frames / s].

    Raises:
        HairloomError: no frames, or sizes or a frame rate out of range.
    """

    frames: int = 48
    width: int = 720
    height: int = 720
    samples: int = 3
    lights: str = "camera"
    transparent: bool = False
    video: bool = True
    frame_rate: float = 24.0

    def __post_init__(self) -> None:
        check_limit("turntable", "frames", self.frames, FRAME_LIMITS)
        check_limit("turntable", "width", self.width, SIDE_LIMITS)
        check_limit("turntable", "height", self.height, SIDE_LIMITS)
        check_limit("turntable", "samples", self.samples, SAMPLE_LIMITS)
        if not 0.0 < self.frame_rate < np.inf:
            raise HairloomError(
                f"a frame rate cannot be {self.frame_rate}",
                place="turntable",
                remedy="Use a number above 0, such as 24",
            )


def check_limit(place: str, name: str, value: int, limits: tuple[int, int]) -> None:
    """Check a number.

    Raises:
        HairloomError: it is out of its limits.
    """
    low, high = limits
    if not low <= value <= high:
        raise HairloomError(
            f"{name} cannot be {value}", place=place, remedy=f"Use a number from {low} to {high}"
        )


@dataclass
class Turntable:
    """A groom on a turntable.

    pose, points, guides: see Studio.picture; the groom does not move while the camera circles it.
    folder, name: pictures become folder/name_0001.png and so on, the video folder/name.mp4.
    notes: warnings, complete after the last step.
    """

    studio: Studio
    pose: Pose
    points: Floats
    settings: TurntableSettings
    folder: Path
    name: str = "turntable"
    guides: Floats | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def has_video(self) -> bool:
        return self.settings.video and not self.notes

    @property
    def files(self) -> tuple[Path, ...]:
        """The files after the last step: the pictures, and the video if there is one."""
        pictures = [self._picture_path(number) for number in range(1, self.settings.frames + 1)]
        return (*pictures, *([self.folder / f"{self.name}.mp4"] if self.has_video else []))

    def _picture_path(self, number: int) -> Path:
        return self.folder / f"{self.name}_{number:04}.png"

    def picture(self, frame: int) -> Floats:
        """The picture of a frame, from 0, (height, width, 4); the same after a full turn."""
        settings = self.settings
        return self.studio.picture(
            self.pose,
            self.points,
            settings.width,
            settings.height,
            settings.samples,
            self.camera(frame),
            lights=self._lights(frame),
            guides=self.guides,
            is_transparent=settings.transparent,
        )

    def camera(self, frame: int) -> Camera:
        """The camera of a frame, on a circle around the groom, from its front to its right."""
        first, middle = self._first_camera
        turns = frame / self.settings.frames % 1.0  # exactly 0 after full turns
        return replace(first, view=first.view @ rotation_about(middle, 2.0 * np.pi * turns))

    @cached_property
    def _first_camera(self) -> tuple[Camera, Floats]:
        """The camera of frame 0, which frames the groom in all its rotations; and their centre."""
        points = self.studio.framed_points(self.pose, self.points).astype(np.float64)
        middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
        aspect = self.settings.width / self.settings.height
        direction = self.studio.side.turned(0.0, _CAMERA_Z)
        rings = enclosing_rings(points, middle)
        return self.studio.framing_camera(rings, direction, aspect), middle

    def steps(self) -> Generator[int]:
        """Write everything; yields the number of finished pictures.

        Raises:
            HairloomError: the folder cannot be written.
        """
        settings = self.settings
        with _atomic_folder(self.files[0]) as temporary:
            frames = [temporary / path.name for path in self.files[: settings.frames]]
            for index, path in enumerate(frames):
                self.studio.write(path, self.picture(index))
                yield index + 1
            if settings.video:
                self._write_video(temporary, frames)
        self._remove_superseded_files()

    def _remove_superseded_files(self) -> None:
        """Remove further pictures and the video of an earlier turntable, which look like ours."""
        numbers = count(self.settings.frames + 1)
        more = map(self._picture_path, numbers)
        videos = [] if self.has_video else [self.folder / f"{self.name}.mp4"]
        for path in (*takewhile(Path.is_file, more), *filter(Path.is_file, videos)):
            try:
                path.unlink()
            except OSError as error:
                raise write_error(path, error.strerror or str(error)) from error

    def _write_video(self, temporary: Path, frames: list[Path]) -> None:
        """Write a video, or note why there is none; the pictures are written in any case."""
        settings = self.settings
        try:
            size = settings.width, settings.height
            write_video(temporary / f"{self.name}.mp4", frames, size, settings.frame_rate)
        except HairloomError as error:
            self.notes.append(f"{error.problem}. {error.remedy}")

    def _lights(self, frame: int) -> tuple[Light, ...]:
        turns_with_camera = self.settings.lights == "camera"
        return self.studio.lights(self.camera(frame if turns_with_camera else 0))


def enclosing_rings(points: Floats, middle: Floats) -> Floats:
    """Points (n, 3) that enclose points (m, 3) in all rotations about the vertical through the
    middle (3,): in each of _LAYERS layers, circles at the lowest and the highest point."""
    distance = np.hypot(*(points - middle)[:, :2].T)
    low, high = points[:, 2].min(), points[:, 2].max()
    layer_height = max(float(high - low), 1.0e-30) / _LAYERS
    layer = np.minimum((points[:, 2] - low) // layer_height, _LAYERS - 1).astype(int)
    radius = np.zeros(_LAYERS)
    np.maximum.at(radius, layer, distance)
    used = np.flatnonzero(np.bincount(layer, minlength=_LAYERS))
    angle = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) / np.cos(
        np.pi / _CORNERS
    )
    rings = []
    for each in used:
        heights = points[layer == each, 2]
        for height in (heights.min(), heights.max()):
            rings.append(radius[each] * circle + [middle[0], middle[1], height])
    return np.concatenate(rings)


@contextmanager
def _atomic_folder(first: Path) -> Iterator[Path]:
    """An empty folder whose files, one of which is named as `first`, move into its folder when the
    block succeeds. If it fails, that folder is removed again if it was new."""
    folder = first.parent
    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise folder_write_error(folder, error.strerror or str(error)) from error
    try:
        with atomic_file_set(first) as temporary:
            yield temporary
    except BaseException:
        if is_new and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise
