"""The verbs `settings` and `presets`: what the artist sets for hair, and keeps of it."""

from __future__ import annotations

import argparse

import bpy

from ...errors import HairloomError
from ...parameters import ALL_SETTINGS
from ..properties.presets import apply, delete_own, own, save_own, shipped
from ..properties.properties import settings_of
from ..scene.principled import look_from_material
from .job_options import add_object_option
from .job_steps import Job, tell_notes
from .object_settings import check_editable, named_grooms, named_objects, put_settings
from .verb import Verb


def settings(job: Job) -> None:
    """Change settings of hair and fins of a scene: presets, single values, a material's look."""
    options = job.options
    objects = named_objects(options.object, _has_settings, "hair curves or a mesh")
    objects = objects or named_grooms([])
    for obj in objects:
        check_editable(obj)
        if options.look_from_material:
            _take_look(obj, job)
        put_settings(obj, options.preset, options.set)
    job.report.facts["objects"] = [obj.name for obj in objects]


def _take_look(hair: bpy.types.Object, job: Job) -> None:
    """As the button Look from Material."""
    if hair.type != "CURVES":
        raise HairloomError(
            "only hair curves have a look", place=hair.name, remedy="Leave it out, or the option"
        )
    group = hair.data.hairloom.shading
    depsgraph = bpy.context.evaluated_depsgraph_get()
    look, notes = look_from_material(hair, depsgraph, settings_of(group, group.settings))
    apply(look, hair)
    tell_notes([f"{hair.name}: {note}" for note in notes], job.report)


def presets(job: Job) -> None:
    """List presets; keep the look of a scene's hair as one of your own, or delete one."""
    options = job.options
    if options.keep:
        (hair, *_) = named_grooms([options.object] if options.object else [])
        group = hair.data.hairloom.shading
        path = save_own(options.keep, settings_of(group, group.settings))
        print(f"Kept the look of {hair.name}: {path}")
    if options.delete:
        delete_own(options.delete)
        print(f"Deleted {options.delete}")
    listed, problems = [], dict[str, None]()
    for section in ALL_SETTINGS:
        entries, warnings = own(section)
        problems |= dict.fromkeys(warnings)  # each section tells of all files
        listed += [(entry.name, section, entry.title) for entry in (*shipped(section), *entries)]
    for name, section, title in listed:
        print(f"{name:32} {section:16} {title}")
    tell_notes(list(problems), job.report)
    job.report.facts["presets"] = [
        {"name": name, "section": section, "title": title} for name, section, title in listed
    ]


def _has_settings(obj: bpy.types.Object) -> bool:
    return obj.type in {"CURVES", "MESH"}


def _add_settings_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what is changed")
    add_object_option(what, "hair curves or a fin; can be given again (default: all hair)")
    what.add_argument(
        "--look-from-material",
        action="store_true",
        help="take the Principled Hair of each one's material as its look; --preset and --set go "
        "over it",
    )


def _add_preset_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("your own presets")
    what.add_argument("--keep", metavar="TITLE", help="keep the look of hair as a preset")
    what.add_argument(
        "--object", metavar="NAME", help="the hair curves of --keep (default: the scene's first)"
    )
    what.add_argument("--delete", metavar="NAME", help="delete one, such as own/mine, for good")


SETTINGS = Verb(
    "settings",
    settings,
    _add_settings_options,
    takes_hair=False,
    saves_scene=True,
    operators=("apply_preset", "look_from_material"),
)
PRESETS = Verb(
    "presets",
    presets,
    _add_preset_options,
    takes_hair=False,
    takes_settings=False,
    operators=("save_preset", "delete_preset"),
)
