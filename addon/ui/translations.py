"""Translations of the interface, one file per language.

translations/template.json holds texts, {context: {text: ""}}: those of registered classes, and
literal texts in the code of panels and menus; tools/make_docs.py writes it. Texts with inserted
numbers or names, and reports, stay English. To add a language, copy the template, for example to
translations/de_DE.json, and fill in the texts.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy

from .preferences import ROOT_PACKAGE

FOLDER = Path(__file__).resolve().parents[2] / "translations"
TEMPLATE = "template"

#: function that draws a text -> the context in which Blender looks it up, and the index of the
#: first argument that is a text; for all others the context is "*"
_DRAWN = {"operator": ("Operator", 1), "draw_button": ("Operator", 2), "draw_idle": ("*", 3)}
#: keywords that are texts
_TEXTS = ("text", "heading", "idle")

type Table = dict[tuple[str, str], str]


def tables() -> dict[str, Table]:
    """language -> (context, text) -> translation, from all files."""
    found = {}
    for path in sorted(FOLDER.glob("*.json")):
        if path.stem != TEMPLATE:
            found[path.stem] = table_of(json.loads(path.read_text(encoding="utf-8")))
    return found


def table_of(content: dict[str, dict[str, str]]) -> Table:
    """A file's translations in Blender's form; texts without one stay English."""
    return {
        (context, text): translated
        for context, texts in content.items()
        for text, translated in texts.items()
        if translated
    }


def texts(classes: Iterable[type[Any]]) -> dict[str, dict[str, str]]:
    """All texts that the template holds: context -> text -> "", in order."""
    found = _drawn()
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


def _drawn() -> set[tuple[str, str]]:
    """The literal texts that code in this room draws."""
    found: set[tuple[str, str]] = set()
    for file in Path(__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                called = getattr(node.func, "attr", getattr(node.func, "id", ""))
                context, first = _DRAWN.get(called, ("*", len(node.args)))
                given = [each.value for each in node.keywords if each.arg in _TEXTS]
                for text in (*node.args[first:], *given):
                    found |= {(context, each) for each in _constants(text)}
    return found


def _constants(text: ast.expr) -> set[str]:
    """The text of a literal, or both texts of a conditional expression."""
    if isinstance(text, ast.IfExp):
        return _constants(text.body) | _constants(text.orelse)
    value = text.value if isinstance(text, ast.Constant) else ""
    return {value} if isinstance(value, str) and re.search("[a-z]", value) else set()


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
    """The base types of our class that are Blender's own, whose texts Blender translates itself."""
    return [] if rna.base is None else [rna.base, *_bases(rna.base)]


def register() -> None:
    bpy.app.translations.register(ROOT_PACKAGE, tables())


def unregister() -> None:
    bpy.app.translations.unregister(ROOT_PACKAGE)
