"""The sections of the panels: the settings of the selected hair, and what belongs to them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from .card_sections import CARD_SECTIONS, draw_cards
from .drawing import Draw, draw_group, draw_named, draw_titled
from .look import LOOK, is_idle, look_names
from .operators_bake import draw_bake
from .operators_colliders import draw_colliders
from .operators_show import draw_show
from .preset_chooser import draw_preset_row


def draw_look(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_preset_row(layout, hair)
    _look_section("")(layout, hair)


def _look_section(label: str) -> Draw:
    """Only what acts in the model, in the order in which it stands in LOOK."""

    def draw(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
        group = hair.data.hairloom.shading
        names = look_names(label, group)
        if not names:
            layout.label(text="Only in the model Marschner")
        for name in names:
            column = layout.column()
            column.active = not is_idle(name, group, hair.data.hairloom.volume)
            draw_named(column, group, (name,))

    return draw


def draw_strands(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_group(layout, hair.data.hairloom.strands)
    draw_titled(layout, hair.data.hairloom.ambient)


def draw_volume(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Only what acts in this form; scattering only where the model has it."""
    draw_preset_row(layout, hair, "volume")
    group = hair.data.hairloom.volume
    hidden = {name for form, names in VOLUME.items() if form != group.shadows for name in names}
    for parameter in group.settings.parameters():
        if parameter.name in hidden or (group.shadows == "none" and parameter.name != "shadows"):
            continue
        column = layout.column()
        scatters = hair.data.hairloom.shading.model == "marschner"
        column.active = (parameter.name != "scattering" or scatters) and (
            parameter.name != "density" or (scatters and group.scattering)
        )
        draw_named(column, group, (parameter.name,))
    if group.shadows != "none":
        layout.operator("hairloom.show_slices")


def draw_skin(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Where hair throws no shadow there is none on skin."""
    group = hair.data.hairloom.skin
    column = layout.column()
    column.active = group.soft_shadow and hair.data.hairloom.volume.shadows != "none"
    draw_named(column, group, [p.name for p in group.settings.parameters()[1:]])
    column.operator("hairloom.show_skin_shadow")


def draw_shafts(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    group = hair.data.hairloom.shafts
    column = layout.column()
    column.active = group.use_shafts
    draw_named(column, group, [p.name for p in group.settings.parameters()[1:]])


def draw_guides(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_group(layout, hair.data.hairloom.guides)


def draw_children(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Where there are none, only how to get some."""
    group = hair.data.hairloom.children
    layout.prop(group, "way")
    if group.way == "none":
        return
    layout.prop(hair.hairloom, "children_density")
    idle = {
        name for ruler, names in _RULED_BY.items() if not getattr(group, ruler) for name in names
    }
    if group.way == "single" and not group.clump:
        idle.add("parting")
    for parameter in group.settings.parameters():
        if parameter.name != "way":
            column = layout.column()
            column.active = parameter.name not in idle
            draw_named(column, group, (parameter.name,))


def draw_detail(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Only what acts in this mode."""
    group = hair.data.hairloom.detail
    hidden = {name for mode, names in DETAIL.items() if mode != group.mode for name in names}
    hidden -= set(DETAIL[group.mode])
    names = [p.name for p in group.settings.parameters() if p.name not in hidden]
    if not group.full_size:
        names.remove("least_share")
    draw_named(layout, group, names)


def draw_dynamics(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """What the sections below leave out."""
    draw_preset_row(layout, hair, "dynamics")
    group = hair.hairloom.dynamics
    below = {name for names in DYNAMICS.values() for name in names}
    names = [p.name for p in group.settings.parameters() if p.name not in below]
    draw_named(layout, group, names)


def draw_collisions(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    draw_colliders(layout, hair)
    draw_named(layout, hair.hairloom.dynamics, DYNAMICS["Collisions"])


def _dynamics_section(label: str) -> Draw:
    def draw(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
        draw_named(layout, hair.hairloom.dynamics, DYNAMICS[label])

    return draw


def draw_export(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    layout.operator("hairloom.export_cards", icon="EXPORT")
    layout.menu("HAIRLOOM_MT_export_strands", icon="EXPORT")
    layout.operator("hairloom.check_export", icon="CHECKMARK")


#: a parameter of children -> those that do nothing while it is 0
_RULED_BY: dict[str, tuple[str, ...]] = {
    "clump": ("clump_along", "clump_size"),
    "frizz": ("frizz_along", "frizz_length"),
}
#: mode of detail -> the parameters that act in it alone
DETAIL: dict[str, tuple[str, ...]] = {
    "adaptive": ("error", "most"),
    "heuristic": ("piece_length", "most"),
    "fixed": ("subdivisions",),
}
#: form of shadows -> the parameters that act in it alone
VOLUME: dict[str, tuple[str, ...]] = {"deep": ("layers", "layer_depth"), "slices": ("slices",)}
#: section below Dynamics -> its parameters; all others stand in Dynamics itself
DYNAMICS: dict[str, tuple[str, ...]] = {
    "Style": ("style_root", "style_tip", "style_along", "style_damping", "bend", "bend_along"),
    "Medium & Wind": ("buoyancy", "damping", "drag", "wind_speed", "wind_direction", "wind_rise")
    + ("gusts", "gust_size", "gust_seed"),
    "Lengths": ("length_solver", "relaxations", "long_range", "length_tolerance")
    + ("length_iterations",),
    "Collisions": ("contact_passes", "friction", "radius_root", "radius_tip", "push_speed")
    + ("collider_resolution",),
}
SECTIONS: tuple[tuple[str, str, Draw], ...] = (
    ("look", "Look", draw_look),
    ("shadows", "Shadows", draw_volume),
    ("shafts", "Light Shafts", draw_shafts),
    ("strands", "Strands", draw_strands),
    ("detail", "Detail", draw_detail),
    ("guides", "Guides", draw_guides),
    ("children", "Children", draw_children),
    ("dynamics", "Dynamics", draw_dynamics),
    ("show", "Show", draw_show),
    ("cards", "Cards", draw_cards),
    ("export", "Export", draw_export),
)
#: those that the sidebar has too: what is done to the hair, not what it is
SESSION_SECTIONS = frozenset({"look", "dynamics", "bake", "show", "cards", "export"})


def _groom(hair: bpy.types.Object) -> Any:
    return hair.data.hairloom


#: section that is on or off -> what holds the property of the checkbox in its header, its name
SWITCHES: dict[str, tuple[Callable[[bpy.types.Object], Any], str]] = {
    "shadows": (_groom, "use_shadows"),
    "skin": (lambda hair: hair.data.hairloom.skin, "soft_shadow"),
    "shafts": (lambda hair: hair.data.hairloom.shafts, "use_shafts"),
    "children": (_groom, "use_children"),
    "cards": (_groom, "use_cards"),
}
#: section -> those below it
SUB_SECTIONS: dict[str, tuple[tuple[str, str, Draw], ...]] = {
    "look": tuple(
        (f"look_{label.split()[0].lower()}", label, _look_section(label)) for label in LOOK if label
    ),
    "shadows": (("skin", "Soft Shadow on Skin", draw_skin),),
    "dynamics": (
        ("style", "Style", _dynamics_section("Style")),
        ("medium", "Medium & Wind", _dynamics_section("Medium & Wind")),
        ("lengths", "Lengths", _dynamics_section("Lengths")),
        ("collisions", "Collisions", draw_collisions),
        ("bake", "Bake", draw_bake),
    ),
    "cards": CARD_SECTIONS,
}
