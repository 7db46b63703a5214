"""The add-on's Preferences page: defaults, the GPU, and a self-test."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..blender.base import gpu_preferences
from ..blender.base.gpu_context import gpu_info
from ..blender.base.redraw import redraw_views
from ..blender.properties.groups import operator_properties
from ..blender.properties.presets import names_by_title
from ..blender.sessions.solvers import compute_problem
from ..blender.setup.self_test import last_report
from .menus import draw_shortcuts
from .messages import draw_message
from .texts import translated

#: the extension's package by Blender's name, above this one
ROOT_PACKAGE = __package__.rpartition(".addon")[0]
#: default presets of new grooms, by title
LOOK, DYNAMICS = "Brown", "Breeze"


def _search_looks(_owner: Any, _context: bpy.types.Context, edit_text: str) -> list[str]:
    return [name for name in names_by_title("shading") if edit_text.lower() in name.lower()]


def _search_motions(_owner: Any, _context: bpy.types.Context, edit_text: str) -> list[str]:
    return [name for name in names_by_title("dynamics") if edit_text.lower() in name.lower()]


#: choices for a new groom; in the `__annotations__` of the page, and of operators that make one
NEW_GROOM: dict[str, Any] = {
    "look": StringProperty(
        name="Look",
        description="Look preset of new grooms. If empty, the plain defaults are used",
        default=LOOK,
        search=_search_looks,
        search_options={"SUGGESTION"},
    ),
    "motion": StringProperty(
        name="Dynamics",
        description="Motion preset of new grooms. If empty, the plain defaults are used",
        default=DYNAMICS,
        search=_search_motions,
        search_options={"SUGGESTION"},
    ),
    "plays": BoolProperty(
        name="Play at Once",
        description="Simulate new grooms as soon as they are created. If off, they stay at rest",
        default=True,
    ),
}
_DEVICE = operator_properties("dynamics")["device"]


def _apply_gpu_preferences(page: Any, _context: Any) -> None:
    gpu_preferences.apply(image_atomics=page.image_atomics, memory=page.gpu_memory)
    redraw_views()


#: settings of this machine, as opposed to defaults of new grooms
_MACHINE: dict[str, Any] = {
    "image_atomics": EnumProperty(
        name="Image Atomics",
        description="Whether the GPU sorts the strands of each pixel in lists. If hair is missing "
        "or broken, choose Never and send us the text of Copy Report",
        items=gpu_preferences.ATOMICS,
        update=_apply_gpu_preferences,
    ),
    "gpu_memory": IntProperty(
        name="GPU Memory (MB)",
        description="Amount of GPU memory that hair may use. With less, strands are drawn in more "
        "parts and shadow maps have fewer texels. Blender does not report how much memory the GPU "
        "has",
        default=gpu_preferences.DEFAULT_MEMORY,
        min=gpu_preferences.MIN_MEMORY,
        max=1 << 17,
        soft_max=1 << 14,
        update=_apply_gpu_preferences,
    ),
}


class HAIRLOOM_AP_preferences(bpy.types.AddonPreferences):
    """Defaults of new grooms, and a test of this machine"""

    bl_idname = ROOT_PACKAGE

    __annotations__ = {
        **_MACHINE,
        **NEW_GROOM,
        "device": _DEVICE,
        "follows": BoolProperty(
            name="Simulate on Playback",
            description="Simulate new grooms during Blender's playback. If off, only Play does",
            default=True,
        ),
        "show_counts": BoolProperty(
            name="Counts in the Viewport",
            description="Show counts and times of new grooms in the viewport",
            default=False,
        ),
    }

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        header, body = layout.panel("hairloom_new_grooms")
        header.label(text="New Grooms")
        if body:
            for name in self.__annotations__:
                if name not in _MACHINE:
                    body.prop(self, name)
        header, body = layout.panel("hairloom_shortcuts", default_closed=True)
        header.label(text="Shortcuts")
        if body:
            draw_shortcuts(body, context)
        header, body = layout.panel("hairloom_this_machine")
        header.label(text="This Machine")
        if body:
            for name in _MACHINE:
                body.prop(self, name)
            draw_machine(body, context)


def draw_machine(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the GPU, and the results of the last self-test."""
    for line in _gpu_lines():
        layout.label(text=line, translate=False)
    problem = compute_problem()
    on_cpu = translated("Simulates on the CPU: {problem}", problem=_compute_problem(problem))
    text = on_cpu if problem else translated("Simulates on the GPU")
    layout.label(text=text, icon="INFO" if problem else "CHECKMARK", translate=False)
    row = layout.row(align=True)
    row.operator("hairloom.self_test", icon="CHECKMARK")
    row.operator("hairloom.copy_report", text="", icon="COPYDOWN")
    for check in last_report():
        icon = {"passed": "CHECKMARK", "absent": "INFO", "failed": "ERROR"}[check.outcome]
        if check.outcome == "failed":
            draw_message(layout, context, f"{check.name}: {check.text}", icon)
        else:
            layout.label(text=f"{check.name}: {check.text}", icon=icon)


def _gpu_lines() -> tuple[str, str, str]:
    info = {name: value or translated("none") for name, value in gpu_info().items()}
    return (
        translated("Backend: {backend}", backend=info["backend"]),
        translated("Renderer: {renderer}", renderer=info["renderer"]),
        translated("Driver: {driver}", driver=info["driver"]),
    )


def _compute_problem(problem: str) -> str:
    """The problem that occurs without a fault of a GPU; others are errors, as it reports them."""
    texts = {"Blender runs without a GPU": translated("Blender runs without a GPU")}
    return texts.get(problem, problem)


def preferences(context: bpy.types.Context) -> Any:
    """The artist's preferences; defaults if Hairloom is not installed as an extension."""
    entry = context.preferences.addons.get(ROOT_PACKAGE)
    if entry is not None and entry.preferences is not None:
        return entry.preferences
    return SimpleNamespace(
        look=LOOK,
        motion=DYNAMICS,
        plays=True,
        device="automatic",
        follows=True,
        show_counts=False,
    )


def chosen_presets(options: Any) -> tuple[str, ...]:
    """The presets of a new groom, by name.

    Args:
        options: preferences, or an operator with NEW_GROOM; presets are given by title or name.
    """
    presets = {"shading": options.look, "dynamics": options.motion}
    return tuple(
        names_by_title(section).get(text, text) for section, text in presets.items() if text
    )


def register() -> None:
    """Apply the saved settings of this machine."""
    entry = bpy.context.preferences.addons.get(ROOT_PACKAGE)
    if entry is not None and entry.preferences is not None:
        _apply_gpu_preferences(entry.preferences, None)


def unregister() -> None:
    """Restore the defaults, as the page to change the settings is gone."""
    gpu_preferences.apply()


CLASSES: tuple[type[Any], ...] = (HAIRLOOM_AP_preferences,)
