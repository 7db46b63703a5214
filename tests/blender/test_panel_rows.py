"""Panels have the same height in every state of the selected hair."""

from types import SimpleNamespace

import blf
import bpy
import numpy as np
import pytest
from panel_layout import Layout

from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.properties.properties import TRANSLATION_CONTEXT
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.ui import (
    card_sections,
    long_work,
    operators_bake,
    operators_card_export,
    operators_cards,
    operators_colliders,
    operators_export_check,
    operators_flow,
    operators_grow,
    operators_hairstyles,
    operators_make_real,
    operators_mirror,
    operators_partings,
    operators_settle,
    operators_show,
    operators_start,
    operators_trim,
    panels,
    sections,
    state,
    translations,
)
from hairloom.addon.ui.selection import make_active

pytestmark = pytest.mark.usefixtures("extension")
#: widths of the sidebar and of Properties [pixels], as Blender opens them
WIDTHS = (280, 340)
#: font size, and the widest label of a field in the sidebar [pixels], at UI scale 1: windows show
#: "Length Variation", of 88, and cut "Sag Correction", of 101
FONT_SIZE, LABEL_WIDTH = 11, 92
#: widest label beside a checkbox [pixels]: it has the other part of its row
TOGGLE_WIDTH = 118
#: sections that are drawn independently of the width
OTHERS = (
    operators_bake.draw_bake,
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
#: operators that replace their button by their progress
JOBS = (
    operators_bake.HAIRLOOM_OT_bake,
    operators_cards.HAIRLOOM_OT_make_cards,
    operators_colliders.HAIRLOOM_OT_fit_spheres,
    operators_flow.HAIRLOOM_OT_comb_flow,
    operators_mirror.HAIRLOOM_OT_mirror_hair,
    operators_partings.HAIRLOOM_OT_comb_parting,
    operators_start.HAIRLOOM_OT_use_groom,
    operators_start.HAIRLOOM_OT_add_groom,
    operators_hairstyles.HAIRLOOM_OT_add_hairstyle,
    operators_trim.HAIRLOOM_OT_trim_to_shape,
    operators_card_export.HAIRLOOM_OT_export_cards,
    operators_grow.HAIRLOOM_OT_grow_again,
    operators_hairstyles.HAIRLOOM_OT_fit_again,
    operators_export_check.HAIRLOOM_OT_check_export,
    operators_make_real.HAIRLOOM_OT_make_real,
    operators_settle.HAIRLOOM_OT_settle,
    operators_show.HAIRLOOM_OT_turntable,
)


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
    """Blender's context in a panel of this width."""
    return SimpleNamespace(
        space_data=None,
        region=SimpleNamespace(width=width),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        scene=bpy.context.scene,
        active_object=bpy.context.active_object,
        selected_objects=bpy.context.selected_objects,
        view_layer=bpy.context.view_layer,
        object=bpy.context.object,
    )


def states(hair, folder):
    """Bring hair into one state after another; yields their names."""
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
    hair.data.hairloom.card_drawing.shown_as = "strands"
    groom = hair.data.hairloom
    groom.cards.source, groom.cards.card_count, groom.atlas.source = "clusters", 12, "made"
    groom.card_occlusion.rays = 4
    bpy.ops.hairloom.make_cards()
    previews.play(bpy.context.evaluated_depsgraph_get())
    bpy.ops.hairloom.measure()
    yield "measured, with cards beside it"
    bake = hair.hairloom.bake
    bake.folder, bake.use_own_range, bake.last = str(folder), True, 3
    bpy.ops.hairloom.bake()
    yield "baked"
    hair.data.hairloom.guides.guide_count += 1
    bpy.context.view_layer.update()
    yield "with a bake that is out of date"
    for operator in JOBS:
        progress = long_work.Progress("Growing 4,000 strands", 0.5)
        long_work._running = SimpleNamespace(
            operator=operator, label=operator.bl_label, progress=progress
        )
        yield operator.bl_label
    long_work._running = None


def test_nothing_below_moves_whatever_happens_to_the_hair(hair, monkeypatch, tmp_path):
    heights = {}
    monkeypatch.setattr(long_work, "_running", None)
    for name in states(hair, tmp_path):
        for width in WIDTHS:
            context = context_of(width)
            monkeypatch.setattr(sections, "bpy", SimpleNamespace(context=context))
            heights[name, width] = (
                height(panels.draw_preview, context),
                height(sections.draw_strands, hair),
                height(sections.draw_children, hair),
                *(height(draw, hair) for draw in OTHERS),
            )
    for width in WIDTHS:
        expected = heights["not previewed", width]
        found = {key: each for key, each in heights.items() if key[1] == width and each != expected}
        assert found == {}, f"not {expected}"
    assert len(heights) == (11 + len(JOBS)) * len(WIDTHS)


def test_a_head_that_has_brows_gets_hair_from_the_same_panel():
    """Selected brows or their head offer it; without either, the button shows the reason."""
    bpy.ops.hairloom.add_hairstyle(style="brows", plays=False)
    brows = bpy.context.object
    head = brows.data.surface
    for chosen in (brows, head):
        make_active(bpy.context, [chosen])
        layout = Layout([])
        panels.draw_preview(layout, context_of(280))
        texts = [text for text, _ in layout.texts]
        assert "Add Hair" in texts and "hairloom.choose_hairstyle" in texts
        before = set(bpy.data.objects)
        assert bpy.ops.hairloom.add_groom(strand_count=50, plays=False) == {"FINISHED"}
        (made,) = set(bpy.data.objects) - before
        assert made.type == "CURVES" and made.data.surface == head
    make_active(bpy.context, [])
    bpy.context.view_layer.objects.active = None
    layout = Layout([])
    panels.draw_more(layout)
    assert "Select a Head" in [text for text, _ in layout.texts]


@pytest.mark.parametrize("language", ["English", *translations.tables()])
def test_no_label_is_cut(extension, language):
    """Labels of all panels fit into their part of a row, measured with Blender's own font."""
    blf.size(0, FONT_SIZE)
    table = translations.tables().get(language, {})
    cut, count = [], 0
    for section, settings in ALL_SETTINGS.items():
        for parameter in settings.parameters():
            if parameter.kind == "mask":
                continue  # it is beside its slider, without a label
            label = table.get((TRANSLATION_CONTEXT, parameter.label), parameter.label)
            width = blf.dimensions(0, label)[0]
            count += 1
            if width > (TOGGLE_WIDTH if parameter.kind == "toggle" else LABEL_WIDTH):
                cut.append(f"{section}, {label}: {width:.0f}")
    assert cut == [] and count > 200


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
    """The test's own layout: a row counts once, a column all its items."""
    layout = Layout([])
    row = layout.row()
    row.label(text="one")
    column = row.column()
    column.label(text="two")
    column.label(text="three")
    layout.prop(hair.hairloom, "debug_view")
    assert layout.height == 3.0
    assert np.isclose(sum(width for _, width in layout.texts), 4.0)
