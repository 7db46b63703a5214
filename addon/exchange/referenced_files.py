"""The files that a file of a mesh or groom refers to, which its content depends on."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ..errors import HairloomError
from .usd.usd_library import SUFFIXES as USD_SUFFIXES
from .usd.usd_library import usd_library

#: lines of .obj and .mtl that end with the name of a file
_MATERIALS, _PICTURE = (
    re.compile(rb"^mtllib\s(.*)$", re.M),
    re.compile(rb"^\s*map_\w+\s(.*)$", re.M),
)


def referenced_files(path: Path) -> list[Path]:
    """The files that a readable file refers to: buffers and pictures of a .gltf, materials of an
    .obj and their pictures, and layers and pictures of USD; also missing ones, which may appear
    later."""
    suffix = path.suffix.lower()
    if suffix == ".gltf":
        found = _files_of_gltf(path)
    elif suffix == ".obj":
        materials = list(_files_of_lines(path, _MATERIALS))
        found = [
            *materials,
            *(
                each
                for file in materials
                if os.path.isfile(file)
                for each in _files_of_lines(file, _PICTURE)
            ),
        ]
    elif suffix in USD_SUFFIXES:
        found = _files_of_usd(path)
    else:
        found = []
    return list(dict.fromkeys(each for each in found if not os.path.isdir(each)))


def missing_materials(path: Path) -> list[str]:
    """The names of material files that an .obj file refers to and that do not exist."""
    names = list[str]()
    if path.suffix.lower() == ".obj":
        for found, missing in _names_of_lines(path, _MATERIALS):
            names += missing if found else missing[:1]
    return list(dict.fromkeys(names))


def _files_of_gltf(path: Path) -> list[Path]:
    try:
        content: Any = json.loads(path.read_bytes())
        entries = [*content.get("buffers", ()), *content.get("images", ())]
        uris = [each["uri"] for each in entries if "uri" in each]
    except (ValueError, AttributeError, TypeError):  # whoever read it has reported what is wrong
        return []
    return [path.parent / unquote(uri) for uri in uris if not uri.startswith("data:")]


def _files_of_lines(path: Path, line: re.Pattern[bytes]) -> Iterator[Path]:
    for found, missing in _names_of_lines(path, line):
        yield from (path.parent / name for name in (*found, *missing))


def _names_of_lines(path: Path, line: re.Pattern[bytes]) -> Iterator[tuple[list[str], list[str]]]:
    """The names of existing files that each line may mean, and those of missing ones: names may
    have spaces, and follow options or other names."""
    for match in line.finditer(path.read_bytes()):
        words = match[1].decode("utf-8", "replace").split()
        ends = [" ".join(words[first:]) for first in range(len(words))]
        found = [name for name in (*ends, *words) if os.path.isfile(path.parent / name)]
        missing = [
            name
            for name in (words if found else ends)
            if _has_suffix(name) and not any(name in other for other in found)
        ]
        yield found, missing


def _has_suffix(name: str) -> bool:
    """Whether it is a file's name rather than an option or a number."""
    suffix = Path(name).suffix[1:]
    return bool(suffix) and not suffix.isdecimal()


def _files_of_usd(path: Path) -> list[Path]:
    try:
        usd_library(path)
    except HairloomError:  # then it cannot have been read
        return []
    from pxr import Tf, UsdUtils

    try:
        layers, assets, _ = UsdUtils.ComputeAllDependencies(str(path))
    except Tf.ErrorException:
        return []
    files = [Path(layer.realPath) for layer in layers] + [Path(asset) for asset in assets]
    return [file for file in files if file != path.resolve()]
