"""Registers all of Hairloom with Blender when it is enabled, and unregisters it when disabled.

Nothing here touches the GPU: that starts with the first draw.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from .blender.command_line.command_line import run
from .blender.engine import engine, hair_scene
from .blender.preview import handlers, scene_events
from .blender.properties import groups, previews
from .blender.properties.properties import BUTTON_CONTEXT
from .blender.scene import look_materials
from .blender.strands import growing
from .ui import (
    engine_panels,
    gizmos,
    help,
    long_work,
    menus,
    object_lists,
    operators_adopted,
    operators_bake,
    operators_card_edits,
    operators_card_export,
    operators_cards,
    operators_colliders,
    operators_export_check,
    operators_fins,
    operators_fix,
    operators_flow,
    operators_grow,
    operators_hairstyles,
    operators_make_real,
    operators_measure,
    operators_mirror,
    operators_partings,
    operators_presets,
    operators_preview,
    operators_problems,
    operators_reports,
    operators_self_test,
    operators_settle,
    operators_show,
    operators_slices,
    operators_start,
    operators_strand_export,
    operators_strand_import,
    operators_ties,
    operators_trim,
    panels,
    preferences,
    preset_chooser,
    translations,
)

#: the extension's package, above this one; its name depends on the repository it is installed from
ROOT_PACKAGE = __package__.rpartition(".")[0]
COMMAND = "hairloom"

CLASSES: tuple[type[Any], ...] = (
    *groups.CLASSES,
    *engine.CLASSES,
    *operators_preview.CLASSES,
    *operators_problems.CLASSES,
    *operators_bake.CLASSES,
    *operators_colliders.CLASSES,
    *operators_ties.CLASSES,
    *operators_partings.CLASSES,
    *operators_flow.CLASSES,
    *operators_trim.CLASSES,
    *operators_mirror.CLASSES,
    *operators_measure.CLASSES,
    *operators_settle.CLASSES,
    *operators_grow.CLASSES,
    *operators_strand_import.CLASSES,
    *operators_strand_export.CLASSES,
    *operators_export_check.CLASSES,
    *operators_make_real.CLASSES,
    *operators_card_export.CLASSES,
    *operators_cards.CLASSES,
    *operators_card_edits.CLASSES,
    *operators_presets.CLASSES,
    *operators_show.CLASSES,
    *operators_slices.CLASSES,
    *preset_chooser.CLASSES,
    *object_lists.CLASSES,
    *operators_fix.CLASSES,
    *operators_reports.CLASSES,
    *help.CLASSES,
    *operators_self_test.CLASSES,
    *preferences.CLASSES,
    *operators_start.CLASSES,
    *operators_hairstyles.CLASSES,
    *menus.CLASSES,
    *panels.CLASSES,
    *gizmos.CLASSES,
    *operators_fins.CLASSES,
    *operators_adopted.CLASSES,
    *operators_bake.FIN_CLASSES,
    *engine_panels.CLASSES,
)

type Step = tuple[Callable[[], Any], Callable[[], Any]]

_command: Any = None


def register() -> None:
    """Run all steps or none: if one fails, those before it are undone and its error is raised."""
    done: list[Step] = []
    try:
        for step in _steps():
            step[0]()
            done.append(step)
    except BaseException:
        for _, undo in reversed(done):
            undo()
        raise


def unregister() -> None:
    """End all that runs, then undo the steps in reverse order.

    Raises:
        ExceptionGroup: the errors of steps that failed; all others are undone nevertheless, so that
            Hairloom can be registered again.
    """
    errors = []
    for undo in (end_all, *(undo for _, undo in reversed(_steps()))):
        try:
            undo()
        except Exception as error:
            errors.append(error)
    if errors:
        raise ExceptionGroup("Hairloom could not be disabled completely", errors)


def end_all() -> None:
    """End previews and long work, and drop all that is deferred."""
    operators_preview.stop_ticking()
    long_work.cancel_running()
    scene_events.clear()


def _steps() -> tuple[Step, ...]:
    """Each step of registration with its undo, in order."""
    return (
        *(_class_step(each) for each in CLASSES),
        (preferences.register, preferences.unregister),
        (groups.register, groups.unregister),
        (engine_panels.register, engine_panels.unregister),
        (previews.pictures, previews.unregister),
        (operators_preview.register, operators_preview.unregister),
        (preset_chooser.register, preset_chooser.unregister),
        (object_lists.register, object_lists.unregister),
        (menus.register, menus.unregister),
        (help.register, help.unregister),
        (translations.register, translations.unregister),
        (handlers.register, handlers.unregister),
        (growing.register, growing.unregister),
        (look_materials.register, look_materials.unregister),
        (hair_scene.register, hair_scene.unregister),
        (engine.register, engine.unregister),
        (_register_command, _unregister_command),
    )


def _class_step(each: type[Any]) -> Step:
    if issubclass(each, bpy.types.Operator):
        each.bl_translation_context = BUTTON_CONTEXT

    return (
        lambda: bpy.utils.register_class(each),
        lambda: bpy.utils.unregister_class(each),
    )


def _register_command() -> None:
    global _command
    _command = bpy.utils.register_cli_command(COMMAND, run)


def _unregister_command() -> None:
    bpy.utils.unregister_cli_command(_command)
