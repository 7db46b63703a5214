"""One HTML file that shows an asset anywhere, with the asset's files and a viewer embedded in it.

It loads nothing else: its own content security policy forbids that, and any script but the one
whose digest is in the policy.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

PAGE_SUFFIX = ".html"
_PARTS = Path(__file__).parent / "page"
_FIELD = re.compile(r"\{\{(\w+)\}\}")


@dataclass(frozen=True)
class CardPage:
    """What a page shows.

    name: of the hair, any text. version: of Hairloom.
    mesh: the name of the GLB among the files. files: name -> its bytes, by the names that the
        sidecar beside the GLB has; those of a head are named "head.*".
    levels: triangles and cards of each, the finest first.
    head: the materials of its triangles, one after the other; empty without one.
    corners: two opposite ones of the box that the first view shows, in the axes of the GLB.
    maps: title, file and meaning of each texture. sizes: rows of a table of two columns.
    """

    name: str
    version: str
    mesh: str
    files: Mapping[str, bytes]
    levels: Sequence[Mapping[str, int]]
    head: Sequence[Mapping[str, Any]]
    corners: Sequence[Sequence[float]]
    maps: Sequence[Mapping[str, str]]
    sizes: Sequence[tuple[str, str]]


def page_text(page: CardPage) -> str:
    """The whole file, to be written as UTF-8 with plain line ends."""
    script, style = _part("viewer.min.js"), _part("page.css")
    fields = {
        "policy": _policy(script, style),
        "name": html.escape(page.name),
        "version": html.escape(page.version),
        "style": style,
        "licence": html.escape(_part("three_license.txt")),
        "asset": _script_safe(
            {
                "mesh": page.mesh,
                "files": {name: _packed(name, data) for name, data in page.files.items()},
                "levels": list(page.levels),
                "head": list(page.head),
                "corners": [list(corner) for corner in page.corners],
                "maps": list(page.maps),
                "sizes": [list(row) for row in page.sizes],
            }
        ),
        "script": script,
    }
    return _FIELD.sub(lambda field: fields[field[1]], _part("page.html"))


@cache
def _part(name: str) -> str:
    return (_PARTS / name).read_text(encoding="utf-8")


def _policy(script: str, style: str) -> str:
    """The content security policy; "blob:" and "data:" are what is embedded in the page."""
    return (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src blob: data:; connect-src blob:; base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _script_safe(content: Any) -> str:
    """JSON that ends no element of HTML and begins no comment in it."""
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")


def _packed(name: str, data: bytes) -> dict[str, Any]:
    """A file as text; pictures are compressed already."""
    kind = name.rpartition(".")[2]
    if kind in ("png", "webp"):
        return {"type": f"image/{kind}", "data": base64.b64encode(data).decode()}
    small = gzip.compress(data, 9, mtime=0)
    return {"type": "", "data": base64.b64encode(small).decode(), "gzip": True}
