"""Translatable texts are all in the template, and a language file reaches Blender."""

import json
import re

import bpy
import pytest

import hairloom
from hairloom.addon import registration
from hairloom.addon.ui import translations

#: context -> texts of operators and settings
DECLARED = {
    "*": ("Play at Once", "Light Shafts", "Colour and shine of the strands"),
    "Hairloom": ("Levels of Detail", "Crossed Pairs"),
    "Hairloom Button": ("Make Cards",),
    "Skin": ("Light", "Dark"),
}

PLACEHOLDER = re.compile(r"%[a-z]|[{}]")

#: context -> texts that panels draw besides names of operators and settings: a text, either of two,
#: the reason on an idle button or field, a heading
DRAWN = {
    "*": ("No problems", "Hairstyles", "as the scene", "Cryptomatte"),
    "Hairloom": ("Drawn",),
    "Hairloom Button": ("Add Hair", "To Material", "Select a Head", "Stop Preview"),
}


def test_the_template_is_current(extension):
    path = translations.FOLDER / f"{translations.TEMPLATE}.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    assert found == translations.texts(registration.CLASSES), "run make docs"


@pytest.mark.parametrize("language", translations.tables())
def test_a_language_has_the_texts_that_there_are(extension, language):
    """No translation is of a text that has changed since; placeholders are as in the English."""
    content = json.loads((translations.FOLDER / f"{language}.json").read_text(encoding="utf-8"))
    template = translations.texts(registration.CLASSES)
    assert content == translations.updated(content, template), "run make docs"
    table = translations.tables()[language]
    assert len(table) > 0.9 * sum(len(texts) for texts in template.values())
    for (_, text), translated in table.items():
        assert PLACEHOLDER.findall(text) == PLACEHOLDER.findall(translated), text


def test_a_changed_text_loses_its_translation_and_the_others_keep_theirs():
    content = {"*": {"Look": "Aussehen", "gone": "weg"}, "Gone": {"x": "y"}}
    template = {"*": {"Look": "", "new": ""}, "Operator": {"Look": ""}}
    assert translations.updated(content, template) == {
        "*": {"Look": "Aussehen", "new": ""},
        "Operator": {"Look": ""},
    }


def test_texts_of_every_kind_are_found(extension):
    found = translations.texts(registration.CLASSES)
    for context, texts in (*DECLARED.items(), *DRAWN.items()):
        assert set(texts) <= set(found[context])
    assert "" not in found["*"]
    assert "Bl Label" not in found["*"], "Blender translates its own"


def test_a_language_reaches_blender_and_goes_again(no_extension, monkeypatch, tmp_path):
    template = {
        "*": {"Play at Once": "Gleich abspielen", "Look": ""},
        "Hairloom": {"Width": "Breite"},
        "Hairloom Button": {"Make Cards": "x", "Width": "Breiter"},
    }
    (tmp_path / "de_DE.json").write_text(json.dumps(template))
    (tmp_path / "template.json").write_text("{}")
    monkeypatch.setattr(translations, "FOLDER", tmp_path)
    table = translations.tables()["de_DE"]
    for context in template:
        assert table[context, "Play at Once"] == "Gleich abspielen", "no context lacks a text"
    assert table["Hairloom", "Width"] == "Breite" and table["Hairloom Button", "Width"] == "Breiter"
    assert ("*", "Look") not in table
    view, language = bpy.context.preferences.view, bpy.context.preferences.view.language
    hairloom.register()
    try:
        try:
            view.language = "de_DE"
        except TypeError:
            pytest.skip("this Blender is built without languages")
        assert bpy.app.translations.pgettext("Play at Once") == "Gleich abspielen"
    finally:
        hairloom.unregister()
    assert bpy.app.translations.pgettext("Play at Once") == "Play at Once"
    view.language = language
