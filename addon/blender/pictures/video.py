"""Pictures as a video, written by Blender itself without other programs.

The pictures become a strip in the sequencer of a temporary scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...errors import HairloomError
from ...exchange.files.atomic import atomic_write, write_failure_reason

#: codecs that Blender may have been built with, the most widely supported first
_CODECS = ("H264", "MPEG4")
_USE_OFFICIAL_BUILD = "make a video of them with an official build of Blender"
_FREE_SPACE = "free some space there and try again, or make a video of them elsewhere"


def can_write_video() -> bool:
    """Whether this Blender can write videos."""
    return bool(bpy.app.build_options.codec_ffmpeg)


def write_video(
    path: Path, frames: Sequence[Path], size: tuple[int, int], frame_rate: float
) -> None:
    """Write pictures as an .mp4. Sides are made even, as codecs require.

    Args:
        frames: pictures of one folder and one size, in order.
        size: width and height [pixels].
        frame_rate: [frames / s].

    Raises:
        HairloomError: this Blender cannot write videos, or the file cannot be written.
    """
    if not can_write_video():
        raise _video_error(path, "this Blender was built without FFmpeg")
    reason = "it has neither of the codecs " + " and ".join(_CODECS)
    with atomic_write(path) as temporary, _sequence_of(frames, size, frame_rate) as scene:
        scene.render.filepath = str(temporary)
        for codec in _CODECS:
            scene.render.ffmpeg.codec = codec
            try:
                bpy.ops.render.render(animation=True, scene=scene.name)
            except RuntimeError as error:
                reason = str(error).strip()
            if temporary.is_file() and temporary.stat().st_size:
                if not is_complete(temporary):
                    raise _video_error(
                        path, write_failure_reason(path, "it was cut short"), _FREE_SPACE
                    )
                return
        raise _video_error(path, reason)


def is_complete(path: Path) -> bool:
    """Whether an .mp4 has been written to its end; Blender reports no error if the disk is full.

    The file is a sequence of boxes, each with its size and type, one of which (moov) is the index
    of all frames (ISO base media file format).
    """
    end, position, box_types = path.stat().st_size, 0, set[bytes]()
    with path.open("rb") as file:
        while position < end:
            file.seek(position)
            head = file.read(16)
            if len(head) < 8:
                return False
            size, box_type = int.from_bytes(head[:4]), head[4:8]
            if size == 1:
                size = int.from_bytes(head[8:])
            if size < 8:
                return False
            box_types.add(box_type)
            position += size
    return position == end and b"moov" in box_types


@contextmanager
def _sequence_of(
    frames: Sequence[Path], size: tuple[int, int], frame_rate: float
) -> Iterator[bpy.types.Scene]:
    """A scene that renders to these pictures without changing their colours."""
    scene = bpy.data.scenes.new("Hairloom Video")
    try:
        strip = scene.sequence_editor_create().strips.new_image(
            "Frames", str(frames[0]), 1, 1, fit_method="ORIGINAL"
        )
        for frame in frames[1:]:
            strip.elements.append(frame.name)
        strip.right_handle = 1 + len(frames)
        scene.frame_start, scene.frame_end = 1, len(frames)
        scene.view_settings.view_transform = "Standard"
        render = scene.render
        render.resolution_x, render.resolution_y = (max(side // 2 * 2, 2) for side in size)
        render.resolution_percentage = 100
        render.fps = max(round(frame_rate), 1)
        render.fps_base = render.fps / frame_rate
        render.use_file_extension = False
        render.image_settings.media_type = "VIDEO"
        render.image_settings.file_format = "FFMPEG"
        render.ffmpeg.format = "MPEG4"
        render.ffmpeg.constant_rate_factor = "HIGH"
        render.ffmpeg.audio_codec = "NONE"
        yield scene
    finally:
        bpy.data.scenes.remove(scene)


def _video_error(path: Path, reason: str, remedy: str = _USE_OFFICIAL_BUILD) -> HairloomError:
    return HairloomError(
        f"no video was written ({reason})",
        place=str(path),
        remedy=f"The pictures are complete: {remedy}",
    )
