"""Names of the interface that user pages set in italics are those that an artist finds there."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import bpy
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PAGES = [
    REPOSITORY / "README.md",
    *sorted((REPOSITORY / "docs").glob("*.md")),
    *sorted((REPOSITORY / "docs" / "tutorials").glob("*.md")),
]

#: what is in italics and starts with a capital, but is neither a label nor a text of our code
EXCEPTIONS = {
    # Blender's own, from its menus, assets and node sockets, not from its types
    *("All Transforms", "Bezier", "Curl Hair Curves", "IOR Level", "Online Manual"),
    *("Render Animation", "Render Method", "Show Gizmos", "Viewport Overlays"),
    # of engines
    *("Plugins", "Project Settings", "Import Groom Cache"),
    # after the name of an object: "{object} As", "{scene} Hair", "{file} Guides"
    *("Head As", "Head Hair", "Scene Hair", "NAME Guides"),
    # messages with other numbers or signs in their place
    *("Import it with Z up", "Import it with a scale of 0.01 (--groom-scale 0.01)"),
    "It has 2 UV maps, and hair and its shadow use the active one",
    "Scale both by 0.01 (…) or by 0.1",
    # terms at the start of a sentence, and a column of a table on the same page
    *("Deep layers", "Occluder spheres", "Allowed"),
}

_CODE = re.compile(r"```.*?```|`[^`\n]*`", re.S)
_ITALICS = re.compile(r"(?<![*\w])\*(?![*\s])([^*\n]+(?:\n[^*\n]+)?)(?<![\s*])\*(?![*\w])")
#: strings in code on several lines are one
_SEAM = re.compile(r'"\s*\n\s*f?"')
_STRING = re.compile(r'"([^"\n]{3,})"')


def italics(text: str) -> Iterator[tuple[str, int]]:
    """The names in italics that start with a capital, each step of a path by itself, and their
    lines."""
    text = _CODE.sub(lambda code: re.sub(r"[^\n]", "", code[0]), text)
    for found in _ITALICS.finditer(text):
        for name in " ".join(found[1].split()).split(" > "):
            if name[0].isupper():
                yield name, text.count("\n", 0, found.start()) + 1


@cache
def labels() -> frozenset[str]:
    """The labels of our interface and of Blender's, without units."""
    template = json.loads((REPOSITORY / "translations" / "template.json").read_text("utf-8"))
    ours = {text.partition(" (")[0] for texts in template.values() for text in texts}
    types = (getattr(bpy.types, name, None) for name in dir(bpy.types))
    blenders = {name for each in types if hasattr(each, "bl_rna") for name in _names(each)}
    tools = {
        getattr(getattr(bpy.ops, module), name).get_rna_type().name
        for module in ("object", "curves", "curve", "sculpt_curves", "mesh", "wm")
        for name in dir(getattr(bpy.ops, module))
    }
    return frozenset(
        ours | {text for texts in template.values() for text in texts} | blenders | tools
    )


def _names(each: Any) -> Iterator[str]:
    yield from (each.bl_rna.name, getattr(each, "bl_label", ""))
    for prop in each.bl_rna.properties:
        yield prop.name
        yield from (item.name for item in getattr(prop, "enum_items_static", ()))


@cache
def strings() -> str:
    """The strings of our code, and the page beside exported cards: messages, and names of what
    is made."""
    files = [*(REPOSITORY / "addon").rglob("*.py"), *(REPOSITORY / "addon").rglob("*.html")]
    text = "\n".join(file.read_text(encoding="utf-8") for file in files)
    quoted = _STRING.findall(_SEAM.sub("", text))
    return "\n".join(("", *quoted, *re.findall(r">([A-Z][^<\n]+)<", text))) + "\n"


def is_said(name: str) -> bool:
    """Whether our code has a string that is this name, or a message with these words in it."""
    if any(f"\n{name}{end}" in strings() for end in ("\n", ":")):
        return True
    parts = [part for part in re.split(r"\W*…\W*", name) if part]
    is_message = len(name.split()) > 2 and not name.istitle()
    return is_message and all(
        each in strings() or each[0].lower() + each[1:] in strings() for each in parts
    )


def unknown(text: str) -> list[tuple[str, int]]:
    return [
        (name, line)
        for name, line in italics(text)
        if name not in EXCEPTIONS and name not in labels() and not is_said(name)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_names_in_italics_are_labels(page):
    assert unknown(page.read_text(encoding="utf-8")) == [], "neither a label nor a message"


def test_wrong_names_are_found():
    text = (
        "*Add Parting*, *Add a Parting*,\n*Dynamics > Bakery*, `*Code*`, *Hair\nTies*, *GPU Memory*"
    )
    assert unknown(text) == [("Add a Parting", 1), ("Bakery", 2), ("Hair Ties", 2)]


def test_no_exception_is_left_over():
    used = {name for page in PAGES for name, _ in italics(page.read_text(encoding="utf-8"))}
    assert EXCEPTIONS - used == set()
    assert {each for each in EXCEPTIONS if each in labels() or is_said(each)} == set()
