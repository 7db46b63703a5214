"""Pages name buttons and places as panels and menus do."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
from panel_layout import Layout

from hairloom.addon.registration import CLASSES
from hairloom.addon.ui.engine_panels import HAIRLOOM_PT_engine_sampling, HAIRLOOM_PT_hair_scene
from hairloom.addon.ui.menus import HAIRLOOM_MT_object
from hairloom.addon.ui.sections import SECTIONS, SESSION_SECTIONS

pytestmark = pytest.mark.usefixtures("extension")

REPOSITORY = Path(__file__).parents[2]
#: pages for artists; decisions keep the names of their time
PAGES = [
    REPOSITORY / "README.md",
    *sorted((REPOSITORY / "docs").glob("*.md")),
    *sorted((REPOSITORY / "docs" / "tutorials").glob("*.md")),
]
OPERATORS = {
    each.bl_idname: each.bl_label for each in CLASSES if issubclass(each, bpy.types.Operator)
}


def buttons() -> dict[str, set[str]]:
    """Operator -> the texts of its buttons, except those with an icon alone. Operators with a text
    that is not constant in the code are left out."""
    found: dict[str, set[str]] = {}
    unknown = {""}
    for file in sorted((REPOSITORY / "addon" / "ui").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            names = [each.value for each in node.args if isinstance(each, ast.Constant)]
            operator = next((name for name in names if name in OPERATORS), "")
            called = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            is_helped = isinstance(node.func, ast.Name) and node.func.id == "draw_button"
            if called != "operator" and not is_helped:
                continue
            texts = [each.value for each in node.keywords if each.arg == "text"]
            texts += node.args[3:4] if is_helped else []
            text = texts[0] if texts else ast.Constant(OPERATORS.get(operator, ""))
            if not isinstance(text, ast.Constant):
                unknown.add(operator)
            elif text.value:
                found.setdefault(operator, set()).add(text.value)
    return {name: texts for name, texts in found.items() if name not in unknown}


def test_pages_name_buttons_by_their_labels() -> None:
    """Pages do not use an operator's name if its button shows another text."""
    texts = set().union(*buttons().values())
    unseen = {
        OPERATORS[name] for name, on in buttons().items() if OPERATORS[name] not in on | texts
    }
    assert "Look from Material" in unseen
    wrong = [
        (page.name, name)
        for page in PAGES
        for name in sorted(unseen)
        if f"*{name}*" in page.read_text(encoding="utf-8")
    ]
    assert wrong == []


def test_each_button_is_named_on_a_page() -> None:
    """By its text, or by its operator's name if it has only an icon. Buttons of dialogs and of the
    list of reports need no page."""
    icons = {f"hairloom.{name}" for name in ("bake_free", "fin_remove", "remove_spheres")}
    explained = ("hairloom.export_", "hairloom.import_", "hairloom.copy_reports")
    text = " ".join(
        " ".join(page.read_text(encoding="utf-8").split())
        for page in PAGES
        if page.name not in ("verbs.md", "parameters.md")
    )
    on_buttons = {name: {OPERATORS[name]} for name in icons} | buttons()
    unnamed = [
        name
        for name, labels in on_buttons.items()
        if name in OPERATORS and not name.startswith(explained)
        if not any(
            re.search(rf"\*([^*]* > )?{re.escape(each)}( > [^*]*)?\*", text)
            for each in labels | {OPERATORS[name]}
        )
    ]
    assert unnamed == []


def test_object_menu_has_the_entries_that_pages_name(sphere: bpy.types.Object) -> None:
    texts: list[tuple[str, float]] = []
    bpy.context.view_layer.objects.active = sphere
    HAIRLOOM_MT_object.draw(SimpleNamespace(layout=Layout(texts)), bpy.context)
    drawn = {OPERATORS.get(text, text) for text, _ in texts}
    cards = (REPOSITORY / "docs" / "cards.md").read_text(encoding="utf-8")
    (button,) = re.findall(r"^\*([^*]+)\* sorts .*\n.* in \*Object > Hairloom\*", cards, flags=re.M)
    assert button in drawn
    chains = [
        chain.split(" > ")[-1]
        for page in PAGES
        for chain in re.findall(r"\*(?:Object > )?Hairloom > ([^*]+)\*", page.read_text("utf-8"))
    ]
    assert chains and set(chains) <= drawn


def test_samples_have_one_name_in_both_panels_and_on_the_page() -> None:
    of_engine: list[tuple[str, float]] = []
    HAIRLOOM_PT_engine_sampling.draw(SimpleNamespace(layout=Layout(of_engine)), bpy.context)
    of_hair_scene: list[tuple[str, float]] = []
    HAIRLOOM_PT_hair_scene.draw(SimpleNamespace(layout=Layout(of_hair_scene)), bpy.context)
    page = (REPOSITORY / "docs" / "engine.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\| Sampling > ([^|]+) \|", page, flags=re.M))
    assert len(named) == 2 and named == {text for text, _ in of_engine}
    assert named <= {text for text, _ in of_hair_scene}


@pytest.mark.parametrize("name", ["quick_start.md", "styling.md"])
def test_pages_say_where_a_section_is_that_the_sidebar_lacks(name: str) -> None:
    text = (REPOSITORY / "docs" / name).read_text(encoding="utf-8")
    elsewhere = [label for section, label, _ in SECTIONS if section not in SESSION_SECTIONS]
    named = [each for each in elsewhere if f"*{each} > " in text]
    unsaid = [
        each for each in named if not re.search(rf"\*{each}\* is in\s+\*Properties > Data\*", text)
    ]
    assert unsaid == []
