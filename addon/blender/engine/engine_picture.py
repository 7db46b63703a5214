"""The picture that Blender's own engine has just rendered, for hair that is laid over it.

Blender renders the artist's scene first, then hair scenes, and composites last. Until then the
picture is in *Render Result*, whose pixels can only be written to files. So it goes through a
temporary file, scene-linear in 32-bit floats, and the scene's own file format is restored at once.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from ...arrays import Floats
from ...errors import HairloomError
from ..base.images import read_texture

#: settings of the file format, in an order in which each can be set
_FORMAT = {
    "media_type": "IMAGE",
    "file_format": "OPEN_EXR",
    "color_management": "FOLLOW_SCENE",
    "color_mode": "RGBA",
    "color_depth": "32",
    "exr_codec": "NONE",
}


def engine_picture(
    scene: bpy.types.Scene,
    full_size: tuple[int, int],
    corner: tuple[int, int],
    size: tuple[int, int],
) -> Floats | None:
    """The picture of a scene before compositing, (height, width, 4) scene-linear, premultiplied,
    row 0 at the bottom; None where there is none.

    Args:
        full_size: width and height of the full picture [pixels].
        corner, size: of the part to return [pixels].
    """
    result = next((each for each in bpy.data.images if each.type == "RENDER_RESULT"), None)
    if result is None or scene.render.use_multiview:
        return None
    with tempfile.TemporaryDirectory(prefix="hairloom") as folder:
        path = Path(folder) / "picture.exr"
        try:
            with _float_format(scene.render.image_settings):
                result.save_render(str(path), scene=scene)
        except RuntimeError:  # nothing was rendered
            return None
        picture = _read(path) if path.is_file() else None
    if picture is None or picture.shape[:2] == size[::-1]:
        return picture
    if picture.shape[:2] != full_size[::-1]:
        return None
    left, bottom = corner
    return picture[bottom : bottom + size[1], left : left + size[0]]


@contextmanager
def _float_format(settings: Any) -> Iterator[None]:
    original = {name: getattr(settings, name) for name in _FORMAT}
    try:
        _set(settings, _FORMAT)
        yield
    finally:
        _set(settings, original)


def _set(settings: Any, values: dict[str, str]) -> None:
    for name, value in values.items():
        if getattr(settings, name) != value:
            setattr(settings, name, value)


def _read(path: Path) -> Floats | None:
    try:
        picture = read_texture(path, is_color=True)
    except HairloomError:
        return None
    if picture.shape[2] != 4:
        return None
    picture[..., :3] *= picture[..., 3:]
    return picture
