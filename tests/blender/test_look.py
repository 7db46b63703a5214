"""A look in a session: quick tables while a slider moves, full tables when it stops. Panels show
only what has an effect."""

from __future__ import annotations

from typing import Any

import bpy
import pytest

from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.sessions import snapshots
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.shading.kajiya_kay_settings import KajiyaKaySettings
from hairloom.addon.shading.marschner.settings import MarschnerSettings
from hairloom.addon.shading.marschner.tables import DEFAULT_SIZE, PREVIEW_SIZE
from hairloom.addon.shading.settings import SharedSettings
from hairloom.addon.ui import sections


@pytest.fixture
def preview(new_hair: Any, sphere: Any, get_depsgraph: Any) -> Any:
    """(shading settings, session) of hair with the Marschner model."""
    hair = new_hair(sphere)
    hair.data.hairloom.shading.model = "marschner"
    return hair.data.hairloom.shading, previews.start(hair, get_depsgraph())


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pretend that there is a window, so that tables are refined later."""

    class App:
        background = False
        timers = bpy.app.timers

    class Blender:
        app = App

    monkeypatch.setattr(snapshots, "bpy", Blender)


def table_size(session: Any) -> int:
    """The table size of the drawn snapshot."""
    drawing = overlay.drawing_of(session.uid)
    assert drawing is not None
    size: int = drawing.snapshot.table_size
    return size


def test_a_slider_of_the_fibres_shape_is_quick_and_refined_when_it_rests(
    preview: Any, window: None
) -> None:
    shading, session = preview
    assert table_size(session) == DEFAULT_SIZE
    shading.width_r = 0.1
    assert table_size(session) == PREVIEW_SIZE
    assert bpy.app.timers.is_registered(scene_events._refine)
    shading.width_r = 0.2
    scene_events._refine()
    assert table_size(session) == DEFAULT_SIZE
    assert session.snapshot.shading.width_r == pytest.approx(0.2)


def test_colours_and_strengths_need_no_other_tables(preview: Any, window: None) -> None:
    shading, session = preview
    shading.base_color = (0.3, 0.1, 0.05)
    shading.pigment, shading.melanin = "melanin", 0.3
    shading.strength_trt = 2.0
    shading.sparkle = 0.0
    assert table_size(session) == DEFAULT_SIZE
    assert not bpy.app.timers.is_registered(scene_events._refine)


def test_kajiya_kay_has_no_tables_and_changing_to_marschner_makes_some(
    preview: Any, window: None
) -> None:
    shading, session = preview
    shading.model = "kajiya_kay"
    shading.width_r = 0.15
    assert table_size(session) == DEFAULT_SIZE
    shading.model = "marschner"
    assert table_size(session) == PREVIEW_SIZE


def test_without_a_window_tables_are_always_full(preview: Any) -> None:
    shading, session = preview
    shading.width_r = 0.1
    assert table_size(session) == DEFAULT_SIZE


def test_nothing_ticks_on_when_hairloom_is_disabled(preview: Any, window: None) -> None:
    shading, _ = preview
    shading.width_r = 0.1
    assert bpy.app.timers.is_registered(scene_events._refine)
    scene_events.clear()
    assert not bpy.app.timers.is_registered(scene_events._refine)


def drawn_in_look(hair: Any) -> tuple[list[str], set[str]]:
    """The parameters drawn by the section Look and its subsections, and the greyed-out ones."""
    found: list[str] = []
    grey: set[str] = set()

    class Layout:
        """Accepts any call of a layout, and records the properties of shading."""

        def __init__(self, *, active: bool = True) -> None:
            self.active = active

        def prop(self, group: Any, name: str, **_: Any) -> None:
            assert group == hair.data.hairloom.shading
            found.append(name)
            if not self.active:
                grey.add(name)

        def __getattr__(self, name: str) -> Any:
            return lambda *_, **__: Layout(active=self.active)

    for draw in (sections.draw_look, *(draw for _, _, draw in sections.SUB_SECTIONS["look"])):
        draw(Layout(), hair)
    return found, grey


KAJIYA_KAY = {parameter.name for parameter in KajiyaKaySettings.parameters()}
MARSCHNER = {parameter.name for parameter in MarschnerSettings.parameters()}
#: pigment of Marschner -> parameters that both models have, and that Marschner uses with this
#: pigment only
PIGMENTS = {
    "color": {"base_color"},
    "melanin": {"melanin", "redness"},
    "absorption": {"absorption"},
}


@pytest.mark.parametrize(
    ("model", "pigment"),
    [("kajiya_kay", "melanin"), *(("marschner", pigment) for pigment in PIGMENTS)],
)
def test_every_parameter_that_acts_is_drawn_once_and_no_other(
    new_hair: Any, model: str, pigment: str
) -> None:
    hair = new_hair()
    shading = hair.data.hairloom.shading
    shading.model, shading.pigment = model, pigment
    shared = {parameter.name for parameter in SharedSettings.parameters()}
    shared -= {"pigment"}.union(*PIGMENTS.values())
    if model == "marschner":
        acting = shared | MARSCHNER | {"pigment"} | PIGMENTS[pigment]
    else:
        acting = shared | KAJIYA_KAY | {"base_color"}
    drawn, _ = drawn_in_look(hair)
    assert sorted(drawn) == sorted(acting)
    assert drawn[0] == "model"


def test_colours_of_tips_are_grey_until_they_act(new_hair: Any) -> None:
    hair = new_hair()
    _, grey = drawn_in_look(hair)
    assert "tip_color" in grey and "tip_tint" not in grey
    hair.data.hairloom.shading.tip_tint = 0.5
    _, grey = drawn_in_look(hair)
    assert "tip_color" not in grey


def test_the_colour_of_brows_is_grey_until_they_have_one(new_hair: Any) -> None:
    hair = new_hair()
    assert "brow_color" in drawn_in_look(hair)[1]
    hair.data.hairloom.shading.brow_source = "natural"
    assert "brow_color" not in drawn_in_look(hair)[1]


def test_what_replaces_shadows_and_scattering_is_grey_where_they_are(new_hair: Any) -> None:
    hair = new_hair()
    groom = hair.data.hairloom
    groom.shading.model, groom.shading.tip_tint = "marschner", 1.0
    groom.shading.brow_source, groom.shading.dust = "natural", 0.1
    assert drawn_in_look(hair)[1] == {"fake_scattering", "volume_shadow"}, "a new groom has both"
    groom.volume.scattering = False
    assert drawn_in_look(hair)[1] == {"volume_shadow"}
    groom.volume.shadows = "none"
    assert drawn_in_look(hair)[1] == set()
