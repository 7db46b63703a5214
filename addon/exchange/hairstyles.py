"""A hairstyle as data: guides on the built-in head, Blender's own node modifiers, settings.

NAME.json describes the style, NAME.npz beside it holds the guides:

{"hairloom_style": 1, "title": "Bob", "source": "Hairloom", "order": 50,
 "masks": {"children": "scalp"},
 "modifiers": [{"nodes": "Clump Hair Curves", "inputs": {"Factor": 0.5}}],
 "presets": ["looks/brown"], "settings": {"children": {"method": "multi"}}}

Fur has no NAME.npz: its settings have a section `grow`, by which it grows on any mesh.

All are data, checked and never executed.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Ints
from ..errors import HairloomError
from ..params import Settings
from ..strands.rooted_shapes import RootedShapes
from .files.atomic import write_bytes_atomic, write_text_atomic

STYLE_VERSION = 1
#: maximum bytes of a style's text and of its unpacked guides, far above those of any style
_MAX_TEXT_BYTES, _MAX_GUIDE_BYTES = 1 << 16, 1 << 26
#: shapes are stored in steps of this [m]: finer than any hair is wide, and 65 cm fit into 16 bits
_STEP = 2.0e-5
#: the section of settings by which fur grows, which has no guides
GROW_SECTION = "grow"
#: what masks may be for: where children grow
MASKS = ("children",)
#: what numpy and zipfile raise for damaged files, which may seem to be encrypted
_UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    RuntimeError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
#: array of the file -> its type and dimensions
_ARRAYS = {
    "root_uv": (np.float32, 2),
    "differences": (np.uint8, 3),
    "counts": (np.int32, 1),
    "group": (np.int32, 1),
}

type InputValue = bool | int | float | str


@dataclass(frozen=True)
class NodeModifier:
    """nodes: name of one of Blender's node groups for hair.
    inputs: by the name that the artist sees; inputs that are not named keep their defaults.
    """

    nodes: str
    inputs: Mapping[str, InputValue]


@dataclass(frozen=True, eq=False)
class Hairstyle:
    """guides: None: it grows on any mesh, by the section `grow` of its settings.
    order: its place among others, the lowest first.
    masks: one of MASKS -> vertex group of the head.
    presets: names of presets; later ones override earlier ones.
    settings: section -> values, which override the presets.
    name: by which it is found again; a file's is its path. Not written.
    """

    title: str
    guides: RootedShapes | None
    source: str = ""
    order: int = 0
    masks: Mapping[str, str] = field(default_factory=dict)
    modifiers: tuple[NodeModifier, ...] = ()
    presets: tuple[str, ...] = ()
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    name: str = ""


def read_hairstyle(path: Path, kinds: Mapping[str, type[Settings]]) -> Hairstyle:
    """Read and check a style, NAME.json, with its guides, NAME.npz.

    Args:
        kinds: the sections whose settings it may hold.

    Raises:
        HairloomError: a file is missing, damaged or of a newer version, or has unknown sections or
            masks.
    """
    data, place = _text(path), str(path)
    version = data.get("hairloom_style")
    if version != STYLE_VERSION:
        raise HairloomError(
            f"style version {version!r} is not supported by this Hairloom (it supports "
            f"{STYLE_VERSION})",
            place=place,
            remedy="Update Hairloom, or choose another style",
        )
    settings = _dictionary(data, "settings", place)
    for section, values in settings.items():
        if section not in kinds or not isinstance(values, Mapping):
            raise _damaged(f"it sets '{section}', which is not a section of settings", place)
        kinds[section].from_dict(values, place)
    masks = _dictionary(data, "masks", place)
    if not set(masks) <= set(MASKS) or not all(isinstance(name, str) for name in masks.values()):
        raise _damaged(f"it has masks other than {', '.join(MASKS)}", place)
    presets, order = data.get("presets", []), data.get("order", 0)
    if not isinstance(presets, list) or not all(isinstance(name, str) for name in presets):
        raise _damaged("its presets are not a list of names", place)
    if not isinstance(order, int):
        raise _damaged("its order is not a whole number", place)
    return Hairstyle(
        title=str(data.get("title") or path.stem),
        guides=None if GROW_SECTION in settings else _guides(path.with_suffix(".npz")),
        source=str(data.get("source", "")),
        order=order,
        masks=masks,
        modifiers=_modifiers(data.get("modifiers", []), place),
        presets=tuple(presets),
        settings=settings,
    )


def read_title(path: Path) -> tuple[int, str]:
    """Order and title of a style, without its guides; see `read_hairstyle`."""
    data = _text(path)
    order = data.get("order", 0)
    return (order if isinstance(order, int) else 0), str(data.get("title") or path.stem)


def write_hairstyle(path: Path, style: Hairstyle) -> None:
    """Write NAME.json and NAME.npz, the guides first; the same style gives the same bytes.

    Raises:
        HairloomError: a shape is longer than the file can hold, or a file cannot be written.
    """
    data = {
        "hairloom_style": STYLE_VERSION,
        "title": style.title,
        "source": style.source,
        "order": style.order,
        "masks": dict(style.masks),
        "modifiers": [{"nodes": one.nodes, "inputs": dict(one.inputs)} for one in style.modifiers],
        "presets": list(style.presets),
        "settings": {section: dict(values) for section, values in style.settings.items()},
    }
    if style.guides is not None:
        write_bytes_atomic(path.with_suffix(".npz"), _packed(style.guides, str(path)))
    write_text_atomic(path, json.dumps(data, indent=2) + "\n")


def _packed(guides: RootedShapes, place: str) -> bytes:
    steps = np.round(guides.shape / _STEP)
    if len(steps) and np.abs(steps).max() > np.iinfo(np.int16).max:
        raise HairloomError(
            "a guide is longer than 65 cm", place=place, remedy="Make the style shorter"
        )
    content = io.BytesIO()
    np.savez_compressed(
        content,
        root_uv=guides.root_uv.astype(np.float32),
        differences=_packed_steps(steps.astype(np.int16)),
        counts=np.diff(guides.offsets).astype(np.int32),
        group=guides.group.astype(np.int32),
    )
    return content.getvalue()


def _packed_steps(steps: Ints) -> Ints:
    """Points (point_count, 3) int16 as bytes (2, 3, point_count): low bytes, then high ones, by
    axes.

    They are stored as second differences, which wrap around and have their sign in the lowest bit.
    Side by side, similar bytes of these compress a tenth better than those of first differences.
    """
    change = steps.copy()
    for _ in range(2):
        change[1:] -= change[:-1].copy()
    folded = (change << 1) ^ (change >> 15)
    pairs = np.ascontiguousarray(folded.T, "<i2").view(np.uint8).reshape(3, -1, 2)
    return np.ascontiguousarray(pairs.transpose(2, 0, 1))


def _unpacked_steps(packed: Ints) -> Ints:
    pairs = np.ascontiguousarray(packed.transpose(1, 2, 0))
    folded = pairs.view("<u2")[..., 0].T
    change = ((folded >> 1) ^ (0 - (folded & 1))).astype(np.int16)
    for _ in range(2):
        change = np.cumsum(change, axis=0, dtype=np.int16)
    return change


def _text(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > _MAX_TEXT_BYTES:
            raise ValueError(f"it has more than {_MAX_TEXT_BYTES:,} bytes")
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(f"this style cannot be read ({error})", str(path)) from error
    if not isinstance(data, dict):
        raise _damaged("this is not a hairstyle", str(path))
    return data


def _dictionary(data: Mapping[str, Any], name: str, place: str) -> dict[str, Any]:
    values = data.get(name, {})
    if not isinstance(values, dict):
        raise _damaged(f"its {name} are not a table", place)
    return values


def _modifiers(data: Any, place: str) -> tuple[NodeModifier, ...]:
    if not isinstance(data, list) or not all(map(_is_modifier, data)):
        raise _damaged("its modifiers are not node groups with values", place)
    return tuple(NodeModifier(one["nodes"], one.get("inputs", {})) for one in data)


def _is_modifier(one: Any) -> bool:
    inputs = one.get("inputs", {}) if isinstance(one, dict) else None
    return (
        isinstance(inputs, dict)
        and isinstance(one.get("nodes"), str)
        and all(isinstance(value, bool | int | float | str) for value in inputs.values())
    )


def _guides(path: Path) -> RootedShapes:
    place = str(path)
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(info.file_size for info in archive.infolist()) > _MAX_GUIDE_BYTES:
                raise ValueError("it has too many guides")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in _ARRAYS}
    except _UNREADABLE as error:
        raise _damaged(f"the guides of this style cannot be read ({error})", place) from error
    for name, (dtype, dimensions) in _ARRAYS.items():
        if arrays[name].dtype != dtype or arrays[name].ndim != dimensions:
            raise _damaged(f"the array '{name}' has the wrong type", place)
    counts, count = arrays["counts"], len(arrays["counts"])
    fits = (
        count > 0
        and arrays["root_uv"].shape == (count, 2)
        and arrays["group"].shape == (count,)
        and arrays["differences"].shape == (2, 3, counts.sum(dtype=np.int64))
        and bool((counts >= 2).all())
        and bool(np.isfinite(arrays["root_uv"]).all())
    )
    if not fits:
        raise _damaged("the arrays of this style's guides do not match each other", place)
    places = _unpacked_steps(arrays["differences"])
    return RootedShapes(
        arrays["root_uv"],
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
        places.astype(np.float32) * np.float32(_STEP),
        arrays["group"],
    )


def _damaged(problem: str, place: str) -> HairloomError:
    return HairloomError(
        problem, place=place, remedy="Install Hairloom again, or make the style again"
    )
