"""Translatable texts are all in the template, and a language file reaches Blender."""

import ast
import inspect
import json
import re

import bpy
import pytest
from panel_layout import Layout

import hairloom
from hairloom.addon import registration
from hairloom.addon.blender.bakes import groom_hashes
from hairloom.addon.blender.cards import build as blender_card_build
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.properties import presets
from hairloom.addon.blender.properties.properties import TRANSLATION_CONTEXT
from hairloom.addon.blender.sessions import fins as session_fins
from hairloom.addon.blender.strands import growing
from hairloom.addon.cards import build as card_build
from hairloom.addon.ui import (
    operators_bake,
    operators_colliders,
    operators_grow,
    preferences,
    preset_chooser,
    state,
    texts,
    translations,
)

#: context -> texts of operators and settings
DECLARED = {
    "*": ("Play at Once", "Light Shafts", "Colour and shine of the strands"),
    "Hairloom": ("Levels of Detail", "Crossed Pairs"),
    "Hairloom Button": ("Make Cards",),
    "Skin": ("Light", "Dark"),
}

PLACEHOLDER = re.compile(r"%[a-z]|{[^}]*}|[{}]")

#: context -> texts that panels draw besides names of operators and settings: a text, either of two,
#: the reason on an idle button or field, a heading
DRAWN = {
    "*": ("No problems", "Hairstyles", "as the scene", "Cryptomatte"),
    "Hairloom": ("Drawn", "at rest, {device}", "{count:,} strands", "Under Water", "Custom"),
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
    for context, expected in (*DECLARED.items(), *DRAWN.items()):
        assert set(expected) <= set(found[context])
    assert "" not in found["*"]
    assert "Bl Label" not in found["*"], "Blender translates its own"


@pytest.mark.parametrize("language", translations.tables())
def test_state_counts_and_names_of_presets_are_in_the_language(language, new_hair, monkeypatch):
    table = translations.tables()[language]
    monkeypatch.setattr(texts, "pgettext_iface", lambda text, context: table[context, text])
    hair = new_hair()
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    layout = Layout([])
    state.draw_state(layout, session)
    values = [text for text, _ in layout.texts]
    at_rest = table[TRANSLATION_CONTEXT, "at rest, {device}"].format(device="CPU")
    counts = table[TRANSLATION_CONTEXT, "{count:,} strands"].format(count=0)
    assert at_rest in values and counts in values
    for section in preset_chooser.KINDS:
        for entry in presets.shipped_presets(section):
            assert (TRANSLATION_CONTEXT, entry.title) in table


@pytest.mark.parametrize("language", translations.tables())
def test_facts_of_the_machine_and_its_colliders_are_in_the_language(
    language, new_hair, sphere, monkeypatch
):
    table = translations.tables()[language]
    monkeypatch.setattr(texts, "pgettext_iface", lambda text, context: table[context, text] + "!")
    nothing = dict.fromkeys(("backend", "renderer", "driver"), "")
    monkeypatch.setattr(preferences, "gpu_info", lambda: nothing)
    monkeypatch.setattr(preferences, "compute_problem", lambda: "Blender runs without a GPU")
    layout = Layout([])
    preferences.draw_machine(layout, bpy.context)
    assert [text.count("!") for text, _ in layout.texts][:4] == [2, 2, 2, 2], layout.texts
    layout = Layout([])
    operators_colliders.draw_colliders(layout, new_hair(sphere))
    as_what = table[TRANSLATION_CONTEXT, "{name} As"].format(name=sphere.name) + "!"
    assert as_what in [text for text, _ in layout.texts]


@pytest.mark.parametrize("language", translations.tables())
def test_names_within_a_translated_line_are_in_the_language(language, new_hair, monkeypatch):
    """Stages of building cards, inputs of a bake, and what growing again loses."""
    table = translations.tables()[language]
    monkeypatch.setattr(texts, "pgettext_iface", lambda text, context: table[context, text] + "!")
    for stage in stages_of_cards():
        assert state._card_stage(stage).endswith("!"), stage
    for name in inputs_of_bakes():
        assert operators_bake._inputs((name,)).endswith("!"), name
    curves = new_hair().data
    assert operators_grow._listed(curves, ()).endswith("!")
    assert operators_grow._listed(curves, growing.lost_by_regrowing(curves)).endswith("!")
    curves.hairloom.grow.shape = "another"
    combed = growing.lost_by_regrowing(curves)[0]
    assert operators_grow._listed(curves, (combed,)).endswith("!")
    assert operators_grow._listed(curves, (combed, "a", "b")).count("!") == 2


def stages_of_cards():
    """The texts that building cards yields and reports."""
    code = inspect.getsource(card_build) + inspect.getsource(blender_card_build)
    stages = re.findall(r'(?:Step|work\.report)\("([^"]+)"', code)
    assert len(stages) >= 8, stages
    return stages


def inputs_of_bakes():
    """The names of the parts of rig hashes and frame hashes."""
    names = {*groom_hashes.RIG_PARTS, "other_grooms", "selection"}
    for module in (groom_hashes, session_fins):
        for node in ast.walk(ast.parse(inspect.getsource(module))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "hashes":
                names |= {each.arg for each in node.keywords if each.arg}
    assert {"pins", "forces", "solver"} < names
    return [name.replace("_", " ") for name in names - {"groom"}]


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
