"""Finding objects of a scene and changing their settings, for jobs without a window."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ...errors import HairloomError, did_you_mean
from ...parameters import ALL_SETTINGS
from ...params import Settings, SettingsMap
from ..base.objects import OVERRIDE, objects_in, without_hidden
from ..properties.presets import named_preset
from ..properties.properties import settings_of
from ..scene.fin_modifier import fin_modifier
from ..strands.growing import is_outdated, lost_by_regrowing
from .overrides import overrides


def named_objects(
    names: list[str], is_wanted: Callable[[bpy.types.Object], bool], what: str
) -> list[bpy.types.Object]:
    """Objects of the view layer by their names, each once, at its last place in the list, since the
    last one becomes active in `run`.

    Args:
        what: such as "a mesh", for the message.

    Raises:
        HairloomError: there is no such object, or it is something else.
    """
    found = []
    for name in reversed(dict.fromkeys(reversed(names))):
        obj = bpy.context.view_layer.objects.get(name)
        if obj is None or not is_wanted(obj):
            own = objects_in(bpy.context.view_layer)
            wanted = [each.name for each in own if is_wanted(each)]
            raise HairloomError(
                f"this is not {what} of the open scene",
                place=name,
                remedy=f"{did_you_mean(name, wanted)}Check the name",
            )
        found.append(obj)
    return found


def is_groom(obj: bpy.types.Object) -> bool:
    """Whether an object is hair, but not a copy that shows a bake."""
    return bool(obj.type == "CURVES" and not obj.data.hairloom.baked_in)


def find_hair(name: str | None) -> bpy.types.Object | None:
    """The hair of this name in the open file; None where there is none."""
    named = bpy.data.objects.get(name or "")
    return named if named is not None and is_groom(named) else None


def grooms_to_export(names: list[str]) -> tuple[list[bpy.types.Object], tuple[str, ...]]:
    """The named grooms, else all of the view layer; and notes on grooms that are left out.

    Raises:
        HairloomError: there are none, or a name is wrong.
    """
    if names:
        return named_objects(names, is_groom, "hair curves"), ()
    grooms, notes = usable_objects(is_groom)
    if not grooms:
        raise HairloomError(
            "there is no hair in the open scene",
            place="--object",
            remedy="Name a scene that has some with --scene",
        )
    return grooms, notes


def usable_objects(
    is_wanted: Callable[[bpy.types.Object], bool], option: str = "--object"
) -> tuple[list[bpy.types.Object], tuple[str, ...]]:
    """The wanted objects of the view layer, without hidden or only instanced ones and hair without
    curves; and notes on these.

    Args:
        option: the one that names an object, for messages.

    Raises:
        HairloomError: all of them are left out.
    """
    own = objects_in(bpy.context.view_layer)
    found = [obj for obj in own if is_wanted(obj)]
    taken, left_out = without_hidden(found, bpy.context.evaluated_depsgraph_get())
    if left_out and not taken:
        raise HairloomError(
            f"nothing in this scene can be used ({'; '.join(left_out)})",
            place="--scene",
            remedy=f"Show it in Blender, or name it with {option}",
        )
    there = set(own)
    instances = [
        each for each in own if _instances_any(each, lambda of: of not in there and is_wanted(of))
    ]
    if instances and not taken:
        raise _only_instanced(instances)
    remark = f"and is left out. Name it with {option} to have it."
    notes = [f"{each}, {remark}" for each in left_out]
    if instances:
        notes.append(f"{_only_instanced(instances)}")
    return taken, tuple(notes)


def _instances_any(obj: bpy.types.Object, is_wanted: Callable[[bpy.types.Object], bool]) -> bool:
    """Whether an Empty shows wanted objects by an instance of their collection."""
    if obj.instance_type != "COLLECTION" or obj.instance_collection is None:
        return False
    objects = obj.instance_collection.all_objects
    return any(is_wanted(each) or _instances_any(each, is_wanted) for each in objects)


def _only_instanced(instances: list[bpy.types.Object]) -> HairloomError:
    is_linked = any(obj.instance_collection.library is not None for obj in instances)
    return HairloomError(
        "its hair or cloth is an instance, and only objects of the scene can be used",
        place=", ".join(obj.name for obj in instances),
        remedy=OVERRIDE if is_linked else "Link its collection into the scene instead",
    )


def settings_of_object(obj: bpy.types.Object) -> dict[str, Settings]:
    """The artist's settings of an object, by section."""
    groups = {section: _group(obj, section) for section in ALL_SETTINGS}
    return {
        section: settings_of(group, ALL_SETTINGS[section])
        for section, group in groups.items()
        if group is not None
    }


def change_settings(
    obj: bpy.types.Object, presets: list[str], assignments: list[str], *, grows_again: bool = False
) -> None:
    """Change an object's own settings by --preset and --set, as the artist would.

    Args:
        grows_again: whether combed hair is going to grow again afterwards, with these settings.

    Raises:
        HairloomError: no such preset or parameter, or a value out of range; or settings of growth
            that combed hair does not follow.
    """
    chosen: dict[str, Settings] = {}
    for name in presets:
        chosen |= {settings.section: settings for settings in named_preset(name).all}
    for section in ALL_SETTINGS:
        group, values = _group(obj, section), overrides(assignments, section)
        settings = chosen.get(section)
        if group is None or (settings is None and not values):
            continue
        own = settings_of(group, ALL_SETTINGS[section])
        if settings is not None:
            own = settings.with_masks_of(own)
        changed = type(own).from_dict(own.as_dict() | values, "--set")
        _write_section(group, changed)
        if section == "grow" and not grows_again:
            _check_growth(obj)


def _check_growth(obj: bpy.types.Object) -> None:
    """Raises:
    HairloomError: the hair has not followed its new settings of growth.
    """
    problem = obj.data.hairloom.grow.problem
    if not problem and is_outdated(obj.data):
        problem = f"growing again would lose: {', '.join(lost_by_regrowing(obj.data))}"
    if problem:
        raise HairloomError(
            f"the hair cannot be grown with these settings ({problem})",
            place=obj.name,
            remedy="Omit --set grow, or use `run grow_again` with it",
        )


def check_sections(
    objects: list[bpy.types.Object],
    presets: list[str],
    assignments: list[str],
    *,
    job_section: str = "",
) -> None:
    """Refuse settings that act on none of these objects, and presets of such settings only.

    Args:
        job_section: settings of the job itself, which it uses beside those of the objects.

    Raises:
        HairloomError: naming the first of them.
    """
    hair = [obj for obj in objects if _is_simulated(obj)]
    used = {name for name in ALL_SETTINGS if any(_group(obj, name) is not None for obj in hair)}
    used.add(job_section)
    for sections in _requested_sections(presets, assignments):
        if used.isdisjoint(sections):
            raise _no_settings(objects, sections[0])


def check_settings_are_saved(
    objects: list[bpy.types.Object], presets: list[str], assignments: list[str]
) -> None:
    """Refuse settings of linked curves, which a library override of their object alone leaves
    linked: Blender does not save them.

    Raises:
        HairloomError: naming the first such object.
    """
    sections = {each for found in _requested_sections(presets, assignments) for each in found}
    if not any(ALL_SETTINGS[section].owner == "groom" for section in sections):
        return
    for obj in objects:
        if obj.type == "CURVES" and obj.data.library is not None:
            raise HairloomError(
                "its curves are linked from another file, so the saved scene would not have these "
                "settings",
                place=obj.name,
                remedy="Make a library override of the curves too (in Properties > Data, "
                "Shift-click the icon beside their name), or do not save the scene",
            )


def _requested_sections(presets: list[str], assignments: list[str]) -> list[list[str]]:
    """The sections of each setting and of each preset that is given."""
    requested = [[section] for section in ALL_SETTINGS if overrides(assignments, section)]
    return requested + [[each.section for each in named_preset(name).all] for name in presets]


def _no_settings(objects: list[bpy.types.Object], section: str) -> HairloomError:
    owner, names = ALL_SETTINGS[section].owner, ", ".join(obj.name for obj in objects)
    whose = {
        "groom": ", which are those of hair",
        "character": ", which are those of hair or cloth",
    }
    return HairloomError(
        f"it has no settings of '{section}'{whose.get(owner, '')}",
        place=names,
        remedy="Name the hair curves with --object" if owner in whose else "Omit them",
    )


def _is_simulated(obj: bpy.types.Object) -> bool:
    return obj.type == "CURVES" or fin_modifier(obj) is not None


def write_settings(obj: bpy.types.Object, chosen: SettingsMap) -> None:
    """Set all of an object's own settings."""
    for section, kind in ALL_SETTINGS.items():
        group = _group(obj, section)
        if group is not None:
            _write_section(group, chosen[kind])


def _write_section(group: Any, settings: Settings) -> None:
    for name, value in settings.as_dict().items():
        setattr(group, name, value)


def _group(obj: bpy.types.Object, section: str) -> Any:
    """An object's properties of a section; None where it has none."""
    owners = (obj.data.hairloom, obj.hairloom) if obj.type == "CURVES" else (obj.hairloom,)
    return next((g for owner in owners if (g := getattr(owner, section, None)) is not None), None)
