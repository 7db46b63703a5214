"""NAME.hairloom.json beside a mesh: what its file cannot store about how to draw its hair.

For the engine programmer who writes the hair material. Plain data, by docs/sidecar.schema.json; all
lengths and vectors in the file's own units and axes.
"""

from __future__ import annotations

import json
import math
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...cards.card_mesh import CardMesh
from . import sidecar_texts as texts
from .card_formats import CardFormat
from .draw_ranges import card_ranges, group_ranges
from .index_buffer import IndexBuffer

#: Raise it when a reader of the version before would misread a sidecar.
SIDECAR_VERSION = 2
#: name of the sidecar of NAME.glb
SUFFIX = ".hairloom.json"

#: From this alpha on a pixel counts as opaque: nearly 1, for textures that were compressed.
OPAQUE_ALPHA = 0.99
#: Below it a pixel cannot be seen in 8 bits, and must not hide what is drawn after it.
MIN_ALPHA = 0.004


@dataclass(frozen=True)
class DrawPass:
    """One of the passes in which cards are drawn; tests and culling in the words of the GPU.

    pixels: which of them it draws, by a test of alpha; "all": without a test.
    """

    name: str
    pixels: str
    color_write: bool
    depth_write: bool
    depth_test: str
    cull: str

    @property
    def is_blended(self) -> bool:
        return "transparent" in self.name

    @property
    def alpha_range(self) -> tuple[float, float] | None:
        """Alpha of the pixels drawn, from the first to below the second; None without a test."""
        if self.pixels == "all":
            return None
        minimum = {_OPAQUE: OPAQUE_ALPHA, _REST: 0.0}.get(self.pixels, MIN_ALPHA)
        return minimum, OPAQUE_ALPHA if _REST in self.pixels else math.inf

    def as_dict(self) -> dict[str, Any]:
        blend = "source alpha, one minus source alpha" if self.is_blended else "off"
        return {**asdict(self), "blend": blend}


_OPAQUE = "alpha >= opaque_alpha"
_REST = "alpha < opaque_alpha"
_VISIBLE = "alpha >= min_alpha"
#: Scheuermann 2004, where only the first pass tests alpha, so that the others keep early depth
#: tests. Here the last one, which writes depth, tests alpha, too: otherwise a card's clear pixels
#: hide what is drawn after it, which doubles the difference to hair that is sorted for each view.
FOUR_PASSES = (
    DrawPass("prime depth", _OPAQUE, False, True, "less", "none"),
    DrawPass("opaque", "all", True, False, "equal", "none"),
    DrawPass("transparent back faces", "all", True, False, "less", "front"),
    DrawPass("transparent front faces", _VISIBLE, True, True, "less", "back"),
)
#: The simpler scheme of the same author, with an alpha test in every pass.
THREE_PASSES = (
    DrawPass("opaque", _OPAQUE, True, True, "less", "none"),
    DrawPass("transparent back faces", _REST, True, False, "less", "front"),
    DrawPass("transparent front faces", f"{_VISIBLE} and {_REST}", True, True, "less", "back"),
)


@dataclass(frozen=True)
class CardFile:
    """A file of cards that was written.

    levels: as they were written, world space, Z up [m], the finest first; nodes: their names there.
    errors: of each level [m], how far it is from the strands' own paths; empty: not known.
    portable: without custom attributes.
    textures: role -> {"file", "channels"} of those that lie beside it; texture_files: file -> what
        its channels hold. highlights: which of them breaks up the highlights, "shift" or "tangent".
    base_gain: factor on the base texture.
    view_compensated_alpha: mean_facing and min_facing where alpha is that of baked strands,
        else empty.
    material: model, values, units, fibre and tables, see blender/cards/files.py.
    indices: the index buffer and its file, or None.
    motion: what moves, see exchange/cards/sidecar_motion.py; empty: nothing.
    page: the web page beside it; empty: none.
    generator: version of Hairloom.
    """

    name: str
    format: CardFormat
    levels: tuple[CardMesh, ...]
    nodes: tuple[str, ...]
    errors: tuple[float, ...] = ()
    portable: bool = True
    textures: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    texture_files: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    base_gain: float = 1.0
    highlights: str = "shift"
    view_compensated_alpha: Mapping[str, float] = field(default_factory=dict)
    material: Mapping[str, Any] = field(default_factory=dict)
    indices: tuple[str, IndexBuffer] | None = None
    motion: Mapping[str, Any] = field(default_factory=dict)
    page: str = ""
    generator: str = ""


def sidecar_text(cards: CardFile) -> str:
    """The whole sidecar, with each list of numbers in one line."""
    text = json.dumps(sidecar_content(cards), indent=2, ensure_ascii=False)
    texts_or_lists = re.compile(r'"(?:[^"\\]|\\.)*"|\[\s+(-?[\d.][^\[\]{}"]*?)\s+\]')
    return texts_or_lists.sub(_in_one_line, text) + "\n"


def _in_one_line(found: re.Match[str]) -> str:
    """A list of numbers; texts stay as they are."""
    return found[0] if found[1] is None else f"[{' '.join(found[1].split())}]"


def files_of_earlier_export(path: Path) -> set[str]:
    """The names of the files that an earlier export of this mesh has written beside it.

    path: of the mesh. Without a sidecar of ours the set is empty.
    """
    owner, texts = _read(path)
    if owner != path.name:
        return set()
    of_formats = {f"{path.stem}{suffix}" for suffix in (".mtl", ".bin")}
    return {path.stem + SUFFIX, *of_formats, *texts}


def conflicting_owner(path: Path) -> str:
    """The name of another mesh beside this one whose sidecar has the name that this one's would
    have; "" where there is none.

    path: of the mesh.
    """
    owner, _ = _read(path)
    return owner if owner != path.name and (path.parent / owner).is_file() else ""


def _read(path: Path) -> tuple[str, set[str]]:
    """The mesh of the sidecar of this name, and all texts in it; empty where it is not ours."""
    try:
        content = json.loads(path.with_name(path.stem + SUFFIX).read_text(encoding="utf-8"))
        owner = str(content["file"]) if "hairloom_sidecar" in content else ""
        return Path(owner).name, set(_texts(content))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return "", set()


def _texts(content: object) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict):
        yield from _texts(list(content.values()))
    elif isinstance(content, list):
        for each in content:
            yield from _texts(each)


def sidecar_content(cards: CardFile) -> dict[str, Any]:
    """The sidecar as plain data."""
    atlas, finest = cards.levels[0].atlas, cards.levels[0]
    content = {
        "hairloom_sidecar": SIDECAR_VERSION,
        "generator": {"name": "Hairloom", "version": cards.generator},
        "file": cards.name,
        "format": cards.format.name,
        "space": cards.format.space,
        "counts": _counts(finest),
        "bounds": _bounds(cards.format, *cards.levels),
        "attributes": {**cards.format.attributes, **({} if cards.portable else cards.format.extra)},
        "levels": [_level(cards, number) for number in range(len(cards.levels))],
        "atlas": {
            "columns": atlas.columns,
            "rows": atlas.rows,
            "padding": list(atlas.padding),
            **texts.ATLAS,
        },
        "draw_order": {**texts.DRAW_ORDER, **_back_order(cards)},
        "opaque_alpha": OPAQUE_ALPHA,
        "min_alpha": MIN_ALPHA,
        "passes": [each.as_dict() for each in FOUR_PASSES],
        "passes_fallback": [each.as_dict() for each in THREE_PASSES],
        "textures": _textures(cards),
        "texture_files": dict(cards.texture_files),
        "material": {**cards.material, **texts.MATERIAL} if cards.material else {},
        "shading": texts.SHADING,
        "engines": texts.ENGINES,
    }
    if cards.page:
        content["page"] = cards.page
    if cards.motion:
        content["motion"] = dict(cards.motion)
    if cards.indices is not None:
        file, buffer = cards.indices
        content["index_buffer"] = {
            "file": file,
            "type": buffer.type,
            "byte_order": "little-endian",
            "vertices": "of each level counted from 0, as the file lists them",
        }
    return content


def _level(cards: CardFile, number: int) -> dict[str, Any]:
    mesh, scale = cards.levels[number], cards.format.units_per_metre
    card_table = card_ranges(mesh)
    level: dict[str, Any] = {
        "node": cards.nodes[number],
        **_counts(mesh),
        "bounds": _bounds(cards.format, mesh),
        **({"error": cards.errors[number] * scale} if cards.errors else {}),
        "indices": len(mesh.triangles) * 3,
        "indices_adler32": zlib.adler32(mesh.triangles.astype("<u4").tobytes()),
        "ranges": group_ranges(mesh, by_layer=card_table is not None),
        **({} if card_table is None else {"cards_in_order": card_table}),
    }
    if cards.indices is not None:
        buffer = cards.indices[1]
        level["buffer_first"] = buffer.first[number]
        if buffer.back_first:
            level["buffer_back_first"] = buffer.back_first[number]
    return level


def _counts(mesh: CardMesh) -> dict[str, int]:
    return {
        "cards": mesh.card_count,
        "triangles": len(mesh.triangles),
        "vertices": len(mesh.positions),
    }


def _bounds(file_format: CardFormat, *meshes: CardMesh) -> dict[str, list[float]]:
    corners = file_format.to_file_space(np.concatenate([mesh.positions for mesh in meshes]))
    return {"minimum": corners.min(axis=0).tolist(), "maximum": corners.max(axis=0).tolist()}


def _back_order(cards: CardFile) -> dict[str, str]:
    has_one = cards.indices is not None and cards.indices[1].back_first
    return {"back_faces": texts.BACK_ORDER} if has_one else {}


def _textures(cards: CardFile) -> dict[str, Any]:
    """Role -> file, channels and how to read them."""
    if not cards.textures:
        return {}
    roles = {}
    for role, where in cards.textures.items():
        space, meaning = texts.ROLES[role]
        gain = {"gain": cards.base_gain} if role == "base" else {}
        roles[role] = {"color_space": space, **where, **gain, "meaning": meaning}
    compensation = (
        {
            "view_compensated_alpha": {
                **cards.view_compensated_alpha,
                "is": texts.VIEW_COMPENSATED_ALPHA,
            }
        }
        if cards.view_compensated_alpha
        else {}
    )
    return {**texts.TEXTURES, "highlights_by": cards.highlights, **compensation, **roles}
