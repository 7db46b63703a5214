"""Greyed-out fields and buttons show the reason in their own text, within the width they have."""

from __future__ import annotations

from types import SimpleNamespace

import blf
import bpy
import pytest
from panel_layout import Layout

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.ui import (
    drawing,
    operators_bake,
    operators_flow,
    operators_mirror,
    operators_partings,
    operators_settle,
    operators_trim,
    panels,
    sections,
)

pytestmark = pytest.mark.usefixtures("extension")
#: text widths [pixels at UI scale 1] in a number's field beside its value, and on a button of half
#: a row; font size
IN_FIELD, ON_BUTTON, FONT_SIZE = 118, 102, 11


@pytest.fixture
def hair(sphere):
    bpy.ops.hairloom.grow(strand_count=30, length=0.1, cv_count=8)
    sphere.data.uv_layers.new()
    return bpy.context.object


def texts(draw, *arguments):
    layout = Layout([])
    draw(layout, *arguments)
    return [text for text, _ in layout.texts], layout.height


def test_a_field_says_what_it_needs_and_stays_where_it_is(hair):
    groom = hair.data.hairloom
    groom.children.method, groom.children.clump = "multi", 0.5
    before, height = texts(drawing.draw_section, groom, "children")
    groom.children.clump = groom.children.curl = 0.0
    after, height_after = texts(drawing.draw_section, groom, "children")
    assert height == height_after
    assert "needs Clump" not in before and "needs Clump" in after
    assert "Clump Along: needs Clump" in after and "Clump Size" in after
    tips, _ = texts(drawing.draw_section, groom, "shading", "Tips & Brows")
    assert tips.count("needs Tip Tint") == 3 and "as the hair" in tips


def fields(draw, *arguments):
    """(owner, name, whether it can be set) of each field that is drawn."""

    class Fields(Layout):
        drawn = ()
        enabled = True

        def prop(self, data, name, **how):
            Fields.drawn = (*Fields.drawn, (data, name, self.enabled))
            super().prop(data, name, **how)

    layout = Fields([])
    layout._inner = lambda **_: layout
    draw(layout, *arguments)
    return Fields.drawn


def test_a_field_that_is_idle_can_be_set_all_the_same(hair):
    groom = hair.data.hairloom
    groom.children.method, groom.children.clump = "multi", 0.0
    drawn = fields(drawing.draw_section, groom, "children")
    for name in ("clump_size", "clump_along"):
        assert (groom.children, name, True) in drawn


def test_a_bake_of_the_scenes_frames_shows_those(hair):
    scene, bake = bpy.context.scene, hair.hairloom.bake
    drawn = fields(operators_bake.draw_bake, hair)
    assert {(scene, "frame_start", False), (scene, "frame_end", False)} < set(drawn)
    assert (bake, "last", True) not in drawn
    bake.use_own_range = True
    drawn = fields(operators_bake.draw_bake, hair)
    assert (bake, "last", True) in drawn and (scene, "frame_end", False) not in drawn


def test_buttons_say_why_they_can_do_nothing(hair):
    assert texts(operators_trim.draw_trim, hair)[0][-2:] == ["Select a Shape", "Not Trimmed"]
    assert texts(operators_flow.draw_flow, hair)[0][-2:] == ["No Strokes Yet", "Not Combed"]
    assert texts(operators_partings.draw_partings, hair)[0][-1] == "No Partings Yet"
    assert texts(operators_settle.draw_settle)[0] == ["hairloom.settle", "Not Settled"]
    assert "not baked" in texts(operators_bake.draw_bake, hair)[0]
    assert "Measure: Press Play First" in texts(sections.draw_dynamics, hair)[0]
    bpy.ops.hairloom.add_stroke()
    bpy.context.view_layer.objects.active = hair
    hair.select_set(True)
    assert texts(operators_flow.draw_flow, hair)[0][-2] == "hairloom.comb_flow"


def test_in_other_modes_buttons_say_that_these_are_why(hair):
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    try:
        found = [
            *texts(operators_mirror.draw_mirror)[0],
            *texts(operators_settle.draw_settle)[0],
            texts(panels.draw_preview, bpy.context)[0][0],
        ]
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert found == ["Object Mode Only"] * 4 + ["Preview"]


def test_without_hair_preview_says_what_to_do(extension):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    bpy.context.view_layer.objects.active = None
    assert texts(panels.draw_preview, bpy.context)[0][0] == "Preview: Select Hair First"


def test_no_reason_is_cut(extension):
    """Reasons fit in all fields, and texts on buttons of half a row."""
    blf.size(0, FONT_SIZE)
    defaults = SimpleNamespace(**{section: kind() for section, kind in ALL_SETTINGS.items()})
    cut = []
    for settings in ALL_SETTINGS.values():
        for parameter in settings.parameters():
            condition = parameter.active_when
            lack = "" if condition is None else condition.unmet_reason(defaults)
            wide = blf.dimensions(0, lack)[0]
            is_beside = parameter.kind in {"color", "choice"}
            if wide > (IN_FIELD * 0.75 if is_beside else IN_FIELD):
                cut.append(f"{parameter.name}: {lack} ({wide:.0f})")
    for text in ("Select a Shape", "Not Trimmed", "No Strokes Yet", "Object Mode Only"):
        if blf.dimensions(0, text)[0] > ON_BUTTON:
            cut.append(text)
    assert cut == []
