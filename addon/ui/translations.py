"""Translations of the interface, one file per language.

translations/template.json holds texts, {context: {text: ""}}: those of registered classes, and
literal texts in the code of panels and menus, and titles of presets; tools/make_docs.py writes it.
Reports stay English. To add a language, copy the template, for example to
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

from ..blender.properties.presets import shipped_presets
from ..blender.properties.properties import BUTTON_CONTEXT, TRANSLATION_CONTEXT
from .preferences import ROOT_PACKAGE
from .preset_chooser import CUSTOM, KINDS

FOLDER = Path(__file__).resolve().parents[2] / "translations"
TEMPLATE = "template"

#: function that draws a text -> the context in which Blender looks it up, and the index of the
#: first argument that is a text; for all others the context is "*"
_DRAW_FUNCTIONS = {
    "operator": (BUTTON_CONTEXT, 1),
    "draw_button": (BUTTON_CONTEXT, 2),
    "draw_inactive": ("*", 3),
    "Statistic": (TRANSLATION_CONTEXT, 0),
    "translated": (TRANSLATION_CONTEXT, 0),
}
#: keywords that are texts
_TEXT_KEYWORDS = ("text", "heading", "disabled_text")

type Table = dict[tuple[str, str], str]
#: context -> text -> translation, "" if there is none
type Texts = dict[str, dict[str, str]]


def tables() -> dict[str, Table]:
    """language -> (context, text) -> translation, from all files."""
    result = {}
    for path in sorted(FOLDER.glob("*.json")):
        if path.stem != TEMPLATE:
            result[path.stem] = table_of(json.loads(path.read_text(encoding="utf-8")))
    return result


def table_of(content: Texts) -> Table:
    """A file's translations in Blender's form; texts without one stay English.

    A text that a context lacks is that of another, such as of a setting whose name a label shows.
    """
    own = {
        (context, text): translated
        for context, texts in content.items()
        for text, translated in texts.items()
        if translated
    }
    borrowed = {
        (context, text): translated for (_, text), translated in own.items() for context in content
    }
    return borrowed | own


def updated(content: Texts, template: Texts) -> Texts:
    """A file's translations of the template's texts; those of others are gone."""
    return {
        context: {text: content.get(context, {}).get(text, "") for text in texts}
        for context, texts in template.items()
    }


def texts(classes: Iterable[type[Any]]) -> Texts:
    """All texts that the template holds: context -> text -> "", in order."""
    found = _drawn_texts() | _preset_texts()
    for each in classes:
        found |= _class_texts(each)
    for name in dir(bpy.ops.hairloom):
        rna = getattr(bpy.ops.hairloom, name).get_rna_type()
        found |= {(rna.translation_context, rna.name), ("*", rna.description)}
        found |= _property_texts(rna)
    ordered: Texts = {}
    for context, text in sorted(found):
        if text:
            ordered.setdefault(context, {})[text] = ""
    return ordered


def _drawn_texts() -> set[tuple[str, str]]:
    """The literal texts that code in this room draws."""
    texts: set[tuple[str, str]] = set()
    for file in Path(__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                context, first = _DRAW_FUNCTIONS.get(name, ("*", len(node.args)))
                keyword_texts = [each.value for each in node.keywords if each.arg in _TEXT_KEYWORDS]
                for text in (*node.args[first:], *keyword_texts):
                    texts |= {(context, each) for each in _constants(text)}
    return texts


def _preset_texts() -> set[tuple[str, str]]:
    """The titles of presets that come with Hairloom, and the text where none matches."""
    titles = {entry.title for section in KINDS for entry in shipped_presets(section)}
    _, custom, about, *_ = CUSTOM
    return {*((TRANSLATION_CONTEXT, title) for title in (*titles, custom)), ("*", about)}


def _constants(text: ast.expr) -> set[str]:
    """The text of a literal, or both texts of a conditional expression."""
    if isinstance(text, ast.IfExp):
        return _constants(text.body) | _constants(text.orelse)
    value = text.value if isinstance(text, ast.Constant) else ""
    return {value} if isinstance(value, str) and re.search("[a-z]", value) else set()


def _class_texts(each: Any) -> set[tuple[str, str]]:
    label = ("*", getattr(each, "bl_label", ""))
    return {label, ("*", each.bl_rna.description)} | _property_texts(each.bl_rna)


def _property_texts(rna: Any) -> set[tuple[str, str]]:
    inherited = {prop.identifier for base in _bases(rna) for prop in base.properties}
    texts = set()
    for prop in rna.properties:
        if prop.identifier in inherited:
            continue
        context = prop.translation_context
        texts |= {(context, prop.name), ("*", prop.description)}
        for item in getattr(prop, "enum_items_static", ()):
            texts |= {(context, item.name), ("*", item.description)}
    return texts


def _bases(rna: Any) -> list[Any]:
    """The base types of our class that are Blender's own, whose texts Blender translates itself."""
    return [] if rna.base is None else [rna.base, *_bases(rna.base)]


def register() -> None:
    bpy.app.translations.register(ROOT_PACKAGE, tables())


def unregister() -> None:
    bpy.app.translations.unregister(ROOT_PACKAGE)
