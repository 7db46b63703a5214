"""An asset made smaller for a page: vertices on a grid, no textures in the GLB, small maps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arrays import Bools, Floats
from ...cards.atlas_grid import AtlasGrid
from ..textures.mip_maps import mip_levels
from ..textures.srgb import srgb_decoded, srgb_encoded
from .glb_file import GlbFile
from .glb_plain import LOD
from .glb_springs import SPRINGS

#: Steps to which values are rounded, for positions as a fraction of the largest extent. They cannot
#: be seen: a fifth of a degree, and with UVs a sixteenth of one of 1,024 texels.
_STEPS = {"POSITION": 2.0**-14, "NORMAL": 2.0**-8, "TANGENT": 2.0**-8}
_UV_STEP = 2.0**-14
#: Steps of values that are stored in 8 bits. Fewer steps compress better, and differences of single
#: strands are lost among many. 128, which means no direction, is one of the steps, as is 255.
_MAP_STEPS = {"base": 4, "alpha": 4, "tangent": 4, "normal": 8, "shift": 4, "noise": 16}


def small_glb(data: bytes, place: str) -> bytes:
    """The same meshes, joints and motion without material and springs; vertices are rounded, so
    that they can be compressed."""
    file = GlbFile.of(data, place)
    attributes = [
        (name, number)
        for mesh in file.content["meshes"]
        for primitive in mesh["primitives"]
        for name, number in primitive["attributes"].items()
    ]
    values = {
        number: rounded(name, np.asarray(file.values(number), np.float32))
        for name, number in attributes
        if name in _STEPS or name.startswith("TEXCOORD")
    }
    for mesh in file.content["meshes"]:
        for primitive in mesh["primitives"]:
            primitive.pop("material", None)
    for kind in ("materials", "textures", "images", "samplers"):
        file.content.pop(kind, None)
    file.content.get("extensions", {}).pop(SPRINGS, None)
    used = file.content.pop("extensionsUsed", [])
    if LOD in used:
        file.content["extensionsUsed"] = [LOD]
    return _with_values(file, values).data()


def rounded(name: str, values: Floats) -> Floats:
    """Values of vertices (n, ...) of this attribute of a GLB, rounded to compress better."""
    step = _STEPS.get(name, _UV_STEP)
    if name == "POSITION":
        extent = float(np.ptp(values, axis=0).max())
        step *= 2.0 ** np.ceil(np.log2(extent)) if extent > 0.0 else 1.0
    return (np.round(values / step) * step).astype(np.float32)


def _with_values(file: GlbFile, values: Mapping[int, Floats]) -> GlbFile:
    """The file with only the bytes that accessors point to, and other values for some of these."""
    old_binary, old_views = bytes(file.binary), file.content["bufferViews"]
    file.binary, file.content["bufferViews"] = bytearray(), []
    moved: dict[int, int] = {}
    for number, accessor in enumerate(file.content["accessors"]):
        old = accessor["bufferView"]
        if number in values:
            accessor["bufferView"] = file.add_bytes(values[number].tobytes())
            accessor.pop("byteOffset", None)
            if "min" in accessor:
                accessor["min"] = values[number].min(axis=0).tolist()
                accessor["max"] = values[number].max(axis=0).tolist()
            continue
        if old not in moved:
            begin = old_views[old].get("byteOffset", 0)
            moved[old] = file.add_bytes(old_binary[begin : begin + old_views[old]["byteLength"]])
        accessor["bufferView"] = moved[old]
    return file


def small_maps(maps: Mapping[str, Floats], grid: AtlasGrid, size: int) -> dict[str, Floats]:
    """Maps (height, width, ...) of at most `size` texels a side, in as few different values as they
    need.

    Where there is no hair, maps of alpha's size get their own mean over the hair.
    """
    alpha = maps["alpha"]
    same_size = {name: each for name, each in maps.items() if each.shape[:2] == alpha.shape}
    small = _with_size(same_size, grid, size)
    hair = small["alpha"] > 0.0
    for name, values in small.items():
        # normals change most across the edge of a strand, where filters sample beyond it
        mask = _dilated(hair) if name == "normal" else hair
        if name != "alpha" and mask.any():
            small[name] = np.where(
                mask.reshape(*mask.shape, *(1,) * (values.ndim - 2)),
                values,
                values[hair].mean(axis=0),
            )
    for name in maps.keys() - same_size.keys():
        small |= _with_size({name: maps[name]}, AtlasGrid(), size)
    return {name: _quantized(name, small[name]) for name in maps}


def _with_size(maps: Mapping[str, Floats], grid: AtlasGrid, size: int) -> dict[str, Floats]:
    levels = mip_levels(maps, grid=grid, threshold=None)
    return next(level for level in levels if max(next(iter(level.values())).shape[:2]) <= size)


def _dilated(mask: Bools) -> Bools:
    """A mask extended by the four neighbours of each texel."""
    wide = np.pad(mask, 1)
    dilated: Bools = mask | wide[2:, 1:-1] | wide[:-2, 1:-1] | wide[1:-1, 2:] | wide[1:-1, :-2]
    return dilated


def _quantized(name: str, values: Floats) -> Floats:
    """Values rounded to steps of what is stored, which for colours is sRGB."""
    step = _MAP_STEPS[name] / 255.0
    stored = np.clip(values, 0.0, 1.0)
    if name == "base":
        stored = srgb_encoded(stored)
    stored = np.minimum(np.round(stored / step) * step, 1.0).astype(np.float32)
    return srgb_decoded(stored) if name == "base" else stored


def half_floats(table: Floats) -> bytes:
    """A look-up table (side, side, 4), row 0 first, as little-endian halves."""
    return np.ascontiguousarray(table, "<f2").tobytes()


def size_rows(glb: int, textures: Mapping[str, int], levels: list[dict[str, int]]) -> list[Any]:
    """The rows of the page's table.

    Args:
        glb: bytes of the mesh's file. textures: file -> bytes.
    """
    rows = [(f"Triangles, level {n}", f"{each['triangles']:,}") for n, each in enumerate(levels)]
    return [
        *rows,
        ("Cards", f"{levels[0]['cards']:,}"),
        ("Mesh", _megabytes(glb)),
        (f"{len(textures)} textures", _megabytes(sum(textures.values()))),
    ]


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f} MB"
