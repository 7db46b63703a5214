"""The maps of hair cards as texture files, packed and in the format that an engine needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...arrays import Floats
from ...cards.atlas_grid import AtlasGrid
from ...errors import HairloomError
from . import texture_files
from .dds import write_dds
from .mip_maps import mip_levels
from .texture_packing import TextureLayout, texture_layouts

#: File format -> its suffix; "dds_plain" is DDS without compression.
FORMATS = {"png": ".png", "exr": ".exr", "dds": ".dds", "dds_plain": ".dds"}


@dataclass(frozen=True)
class WrittenTexture:
    """A texture file, and what its channels hold."""

    path: Path
    layout: TextureLayout

    @property
    def color_space(self) -> str:
        """How programs are to read it: half floats are always linear."""
        return "linear" if self.path.suffix == FORMATS["exr"] else self.layout.color_space


def write_card_textures(
    asset: Path,
    maps: Mapping[str, Floats],
    preset: str,
    *,
    file_format: str = "png",
    grid: AtlasGrid | None = None,
    threshold: float = 0.5,
    write: Callable[..., None] = texture_files.write_texture,
) -> list[WrittenTexture]:
    """Write all textures of a preset; each is there complete, or what was there before.

    Args:
        asset: folder and name, to which the suffixes of the preset are added; dots in the name
            stay.
        maps: see `texture_packing.pack_textures`.
        preset: one of PRESETS.
        file_format: one of FORMATS; DDS files hold all mip maps, see `mip_levels`.
        grid: the tiles of the atlas.
        threshold: of the alpha test for which mip maps keep coverage.
        write: writes PNG and EXR files as `texture_files.write_texture` does.

    Raises:
        HairloomError: as `layouts` does; no such format, or nothing can be written there.
    """
    if file_format not in FORMATS:
        raise HairloomError(
            f"textures cannot be written as '{file_format}'",
            place="Texture format",
            remedy=f"Choose one of {', '.join(FORMATS)}",
        )
    written = []
    for layout in texture_layouts(preset, maps):
        path = asset.with_name(f"{asset.name}{layout.suffix}{FORMATS[file_format]}")
        if file_format.startswith("dds"):
            is_compressed = file_format == "dds"
            _write_dds(path, layout, maps, grid, threshold, is_compressed=is_compressed)
            if is_compressed and layout.is_normal_map:
                layout = replace(layout, channels=layout.channels[:2])
        else:
            depth = layout.depth if file_format == "png" else "half"
            write(path, layout.pack(maps), is_color=layout.is_color, depth=depth, is_packed=True)
        written.append(WrittenTexture(path, layout))
    return written


def resized_to_largest(maps: Mapping[str, Floats]) -> dict[str, Floats]:
    """All maps (height, width, ...) in the largest size; pixels are repeated."""
    height, width = np.max([image.shape[:2] for image in maps.values()], axis=0)
    row, column = np.arange(height)[:, None], np.arange(width)
    return {
        name: image
        if image.shape[:2] == (height, width)
        else image[row * len(image) // height, column * image.shape[1] // width]
        for name, image in maps.items()
    }


def _write_dds(
    path: Path,
    layout: TextureLayout,
    maps: Mapping[str, Floats],
    grid: AtlasGrid | None,
    threshold: float,
    *,
    is_compressed: bool,
) -> None:
    needed = layout.sources | {"alpha"}  # the weight of all others
    needed_maps = {name: values for name, values in maps.items() if name in needed}
    levels = mip_levels(needed_maps, grid=grid, threshold=threshold)
    write_dds(
        path,
        [layout.pack(level) for level in levels],
        is_color=layout.is_color,
        is_normal_map=layout.is_normal_map,
        has_coverage=layout.has_coverage,
        is_compressed=is_compressed,
    )
