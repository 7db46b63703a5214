"""Translations of the interface, one file per language.

translations/template.json holds all texts, {context: {text: ""}}; tools/make_docs.py writes it. To
add a language, copy it, for example to translations/de_DE.json, and fill in texts.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy

from .preferences import ROOT_PACKAGE

FOLDER = Path(__file__).resolve().parents[2] / "translations"
TEMPLATE = "template"

type Table = dict[tuple[str, str], str]


def tables() -> dict[str, Table]:
    """language -> (context, text) -> translation, from all files."""
    found = {}
    for path in sorted(FOLDER.glob("*.json")):
        if path.stem != TEMPLATE:
            found[path.stem] = table_of(json.loads(path.read_text(encoding="utf-8")))
    return found


def table_of(content: dict[str, dict[str, str]]) -> Table:
    """In Blender's form; texts without a translation stay English."""
    return {
        (context, text): translated
        for context, texts in content.items()
        for text, translated in texts.items()
        if translated
    }


def texts(classes: Iterable[type[Any]]) -> dict[str, dict[str, str]]:
    """All texts of registered classes that Blender shows: context -> text -> "", in order."""
    found: set[tuple[str, str]] = set()
    for each in classes:
        found |= _of_class(each)
    for name in dir(bpy.ops.hairloom):
        rna = getattr(bpy.ops.hairloom, name).get_rna_type()
        found |= {("Operator", rna.name), ("*", rna.description)} | _of_properties(rna)
    ordered: dict[str, dict[str, str]] = {}
    for context, text in sorted(found):
        if text:
            ordered.setdefault(context, {})[text] = ""
    return ordered


def _of_class(each: Any) -> set[tuple[str, str]]:
    label = ("*", getattr(each, "bl_label", ""))
    return {label, ("*", each.bl_rna.description)} | _of_properties(each.bl_rna)


def _of_properties(rna: Any) -> set[tuple[str, str]]:
    own = {prop.identifier for base in _bases(rna) for prop in base.properties}
    found = set()
    for prop in rna.properties:
        if prop.identifier in own:
            continue
        found |= {("*", prop.name), ("*", prop.description)}
        for item in getattr(prop, "enum_items_static", ()):
            found |= {("*", item.name), ("*", item.description)}
    return found


def _bases(rna: Any) -> list[Any]:
    """Blender's own types below a class of ours, whose texts Blender translates itself."""
    return [] if rna.base is None else [rna.base, *_bases(rna.base)]


def register() -> None:
    bpy.app.translations.register(ROOT_PACKAGE, tables())


def unregister() -> None:
    bpy.app.translations.unregister(ROOT_PACKAGE)
