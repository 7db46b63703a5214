"""The verb `bake`: what the artist's buttons Bake and Delete Bake do, for render farms."""

from __future__ import annotations

import argparse
from contextlib import closing
from pathlib import Path

import bpy

from ...errors import HairloomError
from ..bakes import playback
from ..bakes.bake_settings import folder_of
from ..base.objects import OVERRIDE
from ..base.report import Report
from ..preview.bake import Bake, free, is_bakeable, show_in_renders
from .job_options import add_frames_option, add_object_option, frames_of_option
from .job_steps import Job, report_notes
from .object_settings import (
    change_settings,
    check_sections,
    check_settings_are_saved,
    named_objects,
    usable_objects,
)
from .scene_files import save_scene
from .verb import Verb


def bake(job: Job) -> None:
    """Simulate hair and cloth of a scene frame by frame and keep the motion on disk."""
    report, options = job.report, job.options
    objects, notes = _objects_to_bake(options.object)
    report_notes(list(notes), report)
    if options.delete:
        _delete(objects, report)
    else:
        _bake(objects, job)
    if options.save or options.save_as:
        with report.stage("save scene"):
            report.add_output(save_scene(options.save_as))


def _check_not_linked(objects: list[bpy.types.Object]) -> None:
    """Refuse linked objects, whose bakes a saved scene would not play: Blender does not save them.

    Raises:
        HairloomError: naming the first of them.
    """
    for obj in objects:
        if obj.library is not None:
            raise HairloomError(
                "it is linked from another file, so the saved scene would not play its bake",
                place=obj.name,
                remedy=f"{OVERRIDE}, or do not save the scene and export with --bake FOLDER",
            )


def _bake(objects: list[bpy.types.Object], job: Job) -> None:
    report, options = job.report, job.options
    if options.save or options.save_as:
        _check_not_linked(objects)
        check_settings_are_saved(objects, options.preset, options.set)
    check_sections(objects, options.preset, options.set)
    for obj in objects:
        change_settings(obj, options.preset, options.set)
    folder = None if options.output is None else options.output.resolve()
    plan = Bake.of(
        objects, bpy.context.scene, frames=frames_of_option(options.frames), folder=folder
    )
    write_bake(plan, report, "baking", "bake frame")
    show_in_renders(objects, bpy.context.evaluated_depsgraph_get())
    report_notes(plan.notes, report)
    _report_bakes(objects, report)


def write_bake(plan: Bake, report: Report, label: str, stage: str) -> None:
    """Bake frame by frame, with progress under this label."""
    progress, steps = report.progress(label, plan.frame_count), plan.steps()
    with closing(steps):  # if interrupted, the earlier bake stays
        for _ in range(plan.frame_count):
            with report.stage(stage):
                done = next(steps)
            progress.show(done)
        for _ in steps:  # runs the rest of the generator, which publishes the bakes
            raise AssertionError("a bake has as many steps as frames")


def _delete(objects: list[bpy.types.Object], report: Report) -> None:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for obj in objects:
        free(obj, depsgraph)
        print(f"Deleted the bake of {obj.name}", flush=True)
    report.facts["deleted"] = [obj.name for obj in objects]


def _objects_to_bake(names: list[str]) -> tuple[list[bpy.types.Object], tuple[str, ...]]:
    """The named objects, else all hair and cloth of the view layer to be simulated; and notes on
    objects that are left out.

    Raises:
        HairloomError: there are none, or a name is wrong.
    """
    if names:
        return named_objects(names, is_bakeable, "hair curves or cloth"), ()
    found, notes = usable_objects(lambda obj: is_bakeable(obj) and _is_wanted(obj))
    if not found:
        raise HairloomError(
            "there is nothing to bake",
            place=bpy.context.scene.name,
            remedy="Name a scene that has hair or cloth with --scene",
        )
    return found, notes


def _is_wanted(obj: bpy.types.Object) -> bool:
    return bool(obj.type == "CURVES" or obj.hairloom.fin.enabled)


def _report_bakes(objects: list[bpy.types.Object], report: Report) -> None:
    baked = []
    for obj in objects:
        folder, cache = folder_of(obj), playback.cache_of(obj)
        assert folder is not None and cache is not None, "it has just been baked"
        facts = cache.facts
        baked.append(
            {
                "object": obj.name,
                "folder": str(folder),
                "first": facts.first,
                "last": facts.last,
                "frame_rate": facts.frame_rate,
                "device": facts.device,
                "figures": None if facts.figures is None else facts.figures.as_dict(),
            }
        )
        report.add_output(folder)
        print(f"Baked {obj.name}, frames {facts.first} to {facts.last}, into {folder}")
    report.facts["baked"] = baked


def _add_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what to bake")
    add_object_option(
        what,
        "hair curves or cloth to bake; can be repeated (default: all that are set to be simulated)",
    )
    add_frames_option(what, "frames to bake (default: those of the objects, else of the scene)")
    what.add_argument(
        "--delete", action="store_true", help="delete the bakes from disk instead of baking"
    )
    saving = parser.add_mutually_exclusive_group()
    saving.add_argument(
        "--save", action="store_true", help="overwrite the scene file with one that plays the bakes"
    )
    saving.add_argument(
        "--save-as",
        type=Path,
        metavar="FILE.blend",
        help="write a new scene file that plays the bakes",
    )


BAKE = Verb(
    "bake",
    bake,
    _add_options,
    output="folder for the bake; several objects get a subfolder each (default: the objects' own "
    "folders)",
    writes_folder=True,
    needs_output=False,
    takes_hair=False,
    operators=("bake", "bake_free"),
)
