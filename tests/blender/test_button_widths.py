"""Buttons of the sidebar show their whole text, in each language, at Blender's default width."""

from types import SimpleNamespace
from typing import Any

import blf
import bpy
import pytest
from panel_layout import Layout

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.properties.properties import TRANSLATION_CONTEXT
from hairloom.addon.ui import (
    card_sections,
    operators_bake,
    operators_fins,
    operators_flow,
    operators_grow,
    operators_partings,
    operators_show,
    panels,
    sections,
    texts,
    translations,
)

pytestmark = pytest.mark.usefixtures("extension")
#: width of a row in the sidebar as Blender opens it, and the parts of a button that are not text:
#: its icon, and its margins [pixels] at UI scale 1
ROW_WIDTH, ICON_WIDTH, MARGINS, FONT_SIZE = 230, 20, 8, 11
CONTEXTS = ("Operator", TRANSLATION_CONTEXT, "*")
DRAWN = (
    operators_bake.draw_bake,
    sections.draw_strands,
    sections.draw_children,
    sections.draw_dynamics,
    sections.draw_export,
    sections.draw_collisions,
    sections.draw_trim_and_mirror,
    operators_flow.draw_flow,
    operators_partings.draw_partings,
    card_sections.draw_cards,
    operators_show.draw_show,
    operators_grow.draw_grow,
)


class Rows(Layout):
    """A layout that measures its buttons.

    buttons: text and width of those directly in it.
    """

    table: Any = None

    def _inner(self, **kind: Any) -> "Rows":
        inner = Rows(self.texts, is_row=kind["is_row"])
        inner.table = self.table
        self.parts.append(inner)
        return inner

    def operator(self, name: str, text: str | None = None, icon: str = "NONE", **_: Any) -> Any:
        group, _, short = name.partition(".")
        kind = getattr(getattr(bpy.ops, group), short).get_rna_type()
        self._button(kind.name if text is None else text, icon)
        return super().operator(name, text)

    def menu(self, name: str, text: str = "", icon: str = "NONE", **_: Any) -> None:
        self._button(text or getattr(bpy.types, name).bl_label, icon)
        super().menu(name, text)

    def _button(self, text: str, icon: str) -> None:
        found = (self.table.get((each, text)) for each in CONTEXTS)
        shown = next(filter(None, found), text)
        width = blf.dimensions(0, shown)[0] + MARGINS if shown else 0.0
        width += ICON_WIDTH if icon != "NONE" or not shown else 0.0
        vars(self).setdefault("buttons", []).append((shown, width))

    def cut(self) -> list[str]:
        """The rows that are too wide, as text."""
        buttons = vars(self).get("buttons", [])
        rows = [buttons] if self.is_row else [[each] for each in buttons]
        found = [
            f"{' | '.join(text for text, _ in row)}: {sum(width for _, width in row):.0f}"
            for row in rows
            if sum(width for _, width in row) > ROW_WIDTH
        ]
        inner = [each for each in self.parts if isinstance(each, Rows)]
        return found + [text for each in inner for text in each.cut()]


def context() -> Any:
    return SimpleNamespace(
        space_data=None,
        region=SimpleNamespace(width=280),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        scene=bpy.context.scene,
        active_object=bpy.context.active_object,
        selected_objects=bpy.context.selected_objects,
        view_layer=bpy.context.view_layer,
        object=bpy.context.object,
    )


@pytest.mark.parametrize("language", ["English", *translations.tables()])
def test_no_button_is_cut(language, sphere, monkeypatch):
    blf.size(0, FONT_SIZE)
    table = translations.tables().get(language, {})
    monkeypatch.setattr(texts, "pgettext_iface", lambda text, where: table.get((where, text), text))
    monkeypatch.setattr(sections, "bpy", SimpleNamespace(context=context()))
    cut: list[str] = []

    def measure(draw: Any, *given: Any) -> None:
        layout = Rows([])
        layout.table = table
        draw(layout, *given)
        cut.extend(layout.cut())

    measure(panels.draw_more)
    measure(panels.draw_preview, context())
    bpy.ops.hairloom.grow(strand_count=60, length=0.1, cv_count=8)
    hair = bpy.context.object
    bpy.ops.hairloom.preview()
    measure(panels.draw_preview, context())
    for draw in DRAWN:
        measure(draw, hair)
    previews.stop_all()
    measure(lambda layout: operators_fins._draw_buttons(layout.row(), None))
    assert cut == []
