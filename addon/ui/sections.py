"""The sections of the panels: the settings of the selected hair, with their tools."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy

from ..blender.preview import previews
from ..parameters import ALL_SETTINGS
from ..params import Owner
from .card_sections import CARD_SECTIONS, draw_cards
from .drawing import Draw, draw_button, draw_section
from .long_work import draw_progress
from .messages import draw_lines
from .operators_bake import draw_bake
from .operators_card_export import HAIRLOOM_OT_export_cards
from .operators_colliders import draw_colliders
from .operators_export_check import HAIRLOOM_OT_check_export
from .operators_flow import draw_flow
from .operators_grow import draw_grow
from .operators_make_real import HAIRLOOM_OT_make_real
from .operators_measure import draw_measure
from .operators_mirror import draw_mirror
from .operators_partings import draw_partings
from .operators_settle import draw_settle
from .operators_show import draw_show
from .operators_ties import draw_ties
from .operators_trim import draw_trim
from .preset_chooser import draw_preset_row

#: letters reserved for a line of the preview about strands, guides or children
_RESERVED_LETTERS = 140
#: name, label, function that draws it
type Section = tuple[str, str, Draw]


def _groom(hair: bpy.types.Object) -> Any:
    return hair.data.hairloom


def _character(hair: bpy.types.Object) -> Any:
    return hair.hairloom


_OWNERS: dict[Owner, Callable[[bpy.types.Object], Any]] = {
    "groom": _groom,
    "character": _character,
}


def _panel(section: str, panel: str = "") -> Draw:
    """A function that draws the parameters declared for a panel and nothing else."""
    settings = ALL_SETTINGS[section]
    owner, switch = _OWNERS[settings.owner], {settings.header_toggle}

    def draw(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
        if settings.panel_note and not panel:
            draw_lines(layout.column(align=True), bpy.context, settings.panel_note)
        draw_section(layout, owner(hair), section, panel, exclude=switch)

    return draw


def _insert_declared(sections: Iterable[Section]) -> tuple[Section, ...]:
    """These sections, with those inserted that only draw declared parameters."""
    result = list(sections)
    for name, settings in ALL_SETTINGS.items():
        if settings.panel_after:
            index = next(i for i, each in enumerate(result) if each[0] == settings.panel_after)
            result.insert(index + 1, (name, settings.title, _panel(name)))
    return tuple(result)


def _look_panel(panel: str) -> Draw:
    def draw(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
        if panel in _MARSCHNER_PANELS and hair.data.hairloom.shading.model != "marschner":
            layout.label(text="Only in the model Marschner")
        draw_section(layout, hair.data.hairloom, "shading", panel)

    return draw


def draw_look(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_preset_row(layout, hair)
    draw_section(layout, hair.data.hairloom, "shading")


def _preview_line(hair: bpy.types.Object, line_of: Callable[[Any], str]) -> str:
    """A line of the preview about its strands; empty before they are made."""
    session = previews.session_of(hair)
    text = "" if session is None or not session.is_made else line_of(session.rig)
    return f"{text}." if text else ""


def draw_strands(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Lines about widths and guides, their settings, and the menu of Blender's hair nodes."""
    column = layout.column(align=True)
    for text in (
        _preview_line(hair, lambda rig: rig.widths.line),
        _preview_line(hair, lambda rig: rig.guides_line),
    ):
        draw_lines(column, bpy.context, text, reserved_letters=_RESERVED_LETTERS)
    draw_section(layout, hair.data.hairloom, "widths")
    draw_section(layout, hair.data.hairloom, "strands")
    layout.label(text=ALL_SETTINGS["ambient"].title)
    draw_section(layout, hair.data.hairloom, "ambient")
    if bpy.context.object == hair:  # Blender's menu acts on the active object
        layout.menu("OBJECT_MT_modifier_add", text="Add Modifier", icon="MODIFIER")


def draw_volume(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_preset_row(layout, hair, "volume")
    draw_section(layout, hair.data.hairloom, "volume")
    if hair.data.hairloom.volume.shadows != "none":
        draw_button(layout, "hairloom.show_slices", "Opacity Map: Preview First", in_all_modes=True)


def draw_skin(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    groom = hair.data.hairloom
    _panel("skin")(layout, hair)
    column = layout.column()
    column.active = groom.skin.soft_shadow and groom.volume.shadows != "none"
    disabled_text, text = (
        "Skin Shadow: Preview First",
        None if column.active else "Hair Has No Skin Shadow",
    )
    draw_button(column, "hairloom.show_skin_shadow", text or disabled_text, text, in_all_modes=True)


def draw_medium(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Air, water and wind, and which force fields act."""
    _panel("dynamics", "Medium & Wind")(layout, hair)
    column = layout.column()
    column.prop(hair.hairloom, "field_collection")


def draw_children(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """A line about the preview's children and their settings; without children, only the method."""
    groom = hair.data.hairloom
    if groom.children.method == "auto":
        text = _preview_line(hair, lambda rig: rig.children_line)
        draw_lines(layout.column(align=True), bpy.context, text, reserved_letters=_RESERVED_LETTERS)
    layout.prop(groom.children, "method")
    if groom.children.method != "none":
        layout.prop(hair.hairloom, "children_density")
        draw_section(layout, groom, "children", exclude={"method"})


def draw_trim_and_mirror(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_trim(layout, hair)
    draw_mirror(layout)


def draw_dynamics(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_preset_row(layout, hair, "dynamics")
    draw_section(layout, hair.hairloom, "dynamics")
    draw_settle(layout)
    draw_measure(layout, hair)


def draw_collisions(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_colliders(layout, hair)
    draw_section(layout, hair.hairloom, "dynamics", "Collisions")


def draw_export(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    if not draw_progress(layout, HAIRLOOM_OT_export_cards):
        layout.operator("hairloom.export_cards", icon="EXPORT")
    layout.menu("HAIRLOOM_MT_export_strands", icon="EXPORT")
    if not draw_progress(layout, HAIRLOOM_OT_check_export):
        layout.operator("hairloom.check_export", icon="CHECKMARK")
    if not draw_progress(layout, HAIRLOOM_OT_make_real):
        draw_button(layout, "hairloom.make_real", icon="OUTLINER_OB_CURVES")
    disabled_text = "No Reports Yet"
    draw_button(layout, "hairloom.show_reports", disabled_text, in_all_modes=True, icon="TEXT")


#: panels below Look whose settings only act in the model Marschner
_MARSCHNER_PANELS = ("Rim Light", "Fibre")
SECTIONS = _insert_declared(
    (
        ("look", "Look", draw_look),
        ("shadows", "Shadows", draw_volume),
        ("grow", "Grow", draw_grow),
        ("strands", "Strands", draw_strands),
        ("children", "Children", draw_children),
        ("dynamics", "Dynamics", draw_dynamics),
        ("show", "Show", draw_show),
        ("cards", "Cards", draw_cards),
        ("export", "Export", draw_export),
    )
)
#: sections that the sidebar has too: tools for hair, not its properties
SESSION_SECTIONS = frozenset(
    {"look", "grow", "dynamics", "ties", "bake", "show", "cards", "export"}
)


def _switch(section: str) -> tuple[Callable[[bpy.types.Object], Any], str]:
    settings = ALL_SETTINGS[section]
    owner = _OWNERS[settings.owner]
    return lambda hair: getattr(owner(hair), section), settings.header_toggle


#: section with a checkbox in its header -> owner of the checkbox's property, and its name
SWITCHES: dict[str, tuple[Callable[[bpy.types.Object], Any], str]] = {
    **{name: _switch(name) for name, each in ALL_SETTINGS.items() if each.header_toggle},
    "shadows": (_groom, "use_shadows"),
    "children": (_groom, "use_children"),
    "cards": (_groom, "use_cards"),
}
#: section -> sections below it
SUB_SECTIONS: dict[str, tuple[Section, ...]] = {
    "look": tuple(
        (f"look_{panel.split()[0].lower()}", panel, _look_panel(panel))
        for panel in ALL_SETTINGS["shading"].panels
    ),
    "shadows": (("skin", "Soft Shadow on Skin", draw_skin),),
    "children": (
        ("partings", "Partings", draw_partings),
        ("flow", "Flow", draw_flow),
        ("trim", "Trim & Mirror", draw_trim_and_mirror),
    ),
    "dynamics": (
        ("style", "Style", _panel("dynamics", "Style")),
        ("medium", "Medium & Wind", draw_medium),
        ("lengths", "Lengths", _panel("dynamics", "Lengths")),
        ("shot", "Shot", _panel("dynamics", "Shot")),
        ("collisions", "Collisions", draw_collisions),
        ("ties", "Ties", draw_ties),
        ("bake", "Bake", draw_bake),
    ),
    "cards": CARD_SECTIONS,
}
