"""A panel keeps still: it is as high in every state of the selected hair."""

from types import SimpleNamespace

import blf
import bpy
import numpy as np
import pytest
from panel_layout import Layout

from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.ui import panels, sections, state

pytestmark = pytest.mark.usefixtures("extension")
#: [pixels] of the sidebar and of Properties, as Blender opens them
WIDTHS = (280, 340)
#: of texts, and how wide labels of fields in the sidebar may be [pixels], at UI scale 1; a window
#: shows "Length Variation", of 88, and cuts "Sag Correction", of 101
FONT_SIZE, LABEL_WIDTH = 11, 92


@pytest.fixture
def hair(sphere):
    bpy.ops.hairloom.grow(strand_count=60, length=0.1, cv_count=8)
    sphere.data.uv_layers.new()
    return bpy.context.object


def height(draw, *arguments):
    layout = Layout([])
    draw(layout, *arguments)
    return layout.height


def context_of(width):
    """Blender's context, as a panel of this width has it."""
    return SimpleNamespace(
        region=SimpleNamespace(width=width),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        scene=bpy.context.scene,
        active_object=bpy.context.active_object,
        selected_objects=bpy.context.selected_objects,
        view_layer=bpy.context.view_layer,
        object=bpy.context.object,
    )


def states(hair):
    """Brings hair into one state after another; gives their names."""
    yield "not previewed"
    bpy.ops.hairloom.preview()
    yield "at rest"
    depsgraph = bpy.context.evaluated_depsgraph_get()
    previews.play(depsgraph)
    previews.advance(depsgraph, 1.0 / 24.0)
    yield "playing"
    previews.pause(True)
    yield "paused"
    previews.rest(depsgraph, keep_playing=False)
    hair.data.add_curves([1, 1])
    bpy.context.view_layer.update()
    scene_events.catch_up(bpy.context.evaluated_depsgraph_get())
    yield "with curves that cannot be used"
    hair.scale.x = 1.4
    bpy.context.view_layer.update()
    yield "unevenly scaled"
    hair.scale.x = 1.0
    previews.previews.notice = f"Preview of {hair.name} ended. It is gone, and more is said of it"
    yield "with a notice"
    previews.previews.notice = ""
    hair.data.hairloom.card_drawing.shown_as = "cards"
    bpy.context.view_layer.update()
    yield "as cards"


def test_nothing_below_moves_whatever_happens_to_the_hair(hair, monkeypatch):
    heights = {}
    for name in states(hair):
        for width in WIDTHS:
            context = context_of(width)
            monkeypatch.setattr(sections, "bpy", SimpleNamespace(context=context))
            heights[name, width] = (
                height(panels.draw_preview, context),
                height(sections.draw_strands, hair),
                height(sections.draw_children, hair),
            )
    for width in WIDTHS:
        wanted = heights["not previewed", width]
        found = {key: each for key, each in heights.items() if key[1] == width and each != wanted}
        assert found == {}, f"not {wanted}"
    assert len(heights) == 8 * len(WIDTHS)


def test_no_label_of_the_sidebar_is_cut(extension):
    """Measured by Blender's own font, in the part of a panel that labels of fields have."""
    blf.size(0, FONT_SIZE)
    cut = [
        f"{parameter.label}: {blf.dimensions(0, parameter.label)[0]:.0f}"
        for section in ("shading", "grow", "dynamics")
        for parameter in ALL_SETTINGS[section].parameters()
        if not parameter.panel and parameter.kind not in {"toggle", "curve"}
        if blf.dimensions(0, parameter.label)[0] > LABEL_WIDTH
    ]
    assert cut == []


def test_all_problems_are_counted_and_the_worst_has_its_button(hair):
    bpy.ops.hairloom.preview()
    (session,) = previews.sessions()
    layout = Layout([])
    state.draw_problems_row(layout, hair, session)
    assert [text for text, _ in layout.texts] == ["No problems"]
    hair.data.surface, hair.parent = None, None
    bpy.ops.hairloom.preview()
    bpy.ops.hairloom.preview()
    (session,) = previews.sessions()
    layout = Layout([])
    state.draw_problems_row(layout, hair, session)
    texts = [text for text, _ in layout.texts]
    assert texts == ["1 problem", "Set Surface"]
    problems = state.problems_of(hair, session)
    assert len(problems) == 1 and problems[0].operator == "hairloom.set_surface"
    popup = Layout([])
    state.draw_problems(popup, context_of(280), hair, session, 320.0)
    assert "No surface" in popup.texts[0][0] and popup.texts[-1][0] == "Set Surface"


def test_rows_are_counted(hair):
    """Of the layout that counts: a row counts once, a column all."""
    layout = Layout([])
    row = layout.row()
    row.label(text="one")
    column = row.column()
    column.label(text="two")
    column.label(text="three")
    layout.prop(hair.hairloom, "debug_view")
    assert layout.height == 3.0
    assert np.isclose(sum(width for _, width in layout.texts), 4.0)
