"""The verb `bake` of the command line: what the artist's Bake button does, for render farms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..errors import HairloomError
from ..parameters import ALL_SETTINGS
from ..params import Settings
from . import playback
from .bake import Bake, bakeable, show_in_renders
from .bake_settings import folder_of
from .job_steps import Job, tell_notes
from .overrides import overrides
from .presets import named_preset
from .properties import settings_of
from .report import Progress, Report


def bake(job: Job) -> None:
    """Simulate hair and fins of a scene frame by frame and keep the motion on disk."""
    report, options = Report(job.verb), job.options
    if options.scene:
        with report.stage("open scene"):
            _open(Path(options.scene))
    objects = _objects(options.object)
    for obj in objects:
        _take_settings(obj, options.preset, options.set)
    plan = Bake.of(
        objects, bpy.context.scene, frames=_frames(options.frames), folder=options.output
    )
    progress, steps = Progress("baking", plan.frame_count), plan.steps()
    for _ in range(plan.frame_count):
        with report.stage("bake frame"):
            progress.show(next(steps))
    for _ in steps:  # what is left is to put the bakes in place
        raise AssertionError("a bake has as many steps as frames")
    show_in_renders(objects, bpy.context.evaluated_depsgraph_get())
    tell_notes(plan.notes, report)
    _tell(objects, report)
    if options.save:
        bpy.ops.wm.save_mainfile()
    if options.report:
        report.write(Path(options.report))


def _open(path: Path) -> None:
    if not path.is_file():
        raise HairloomError("there is no such file", place=str(path), remedy="Check the path")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    except RuntimeError as error:
        raise HairloomError(
            f"Blender cannot open this file ({str(error).strip()})",
            place=str(path),
            remedy="Give a .blend file of this Blender or an older one",
        ) from error


def _objects(names: list[str]) -> list[bpy.types.Object]:
    """Those that were named, else all hair and fins of the view layer that are to be simulated."""
    layer = bpy.context.view_layer
    if not names:
        return [obj for obj in layer.objects if bakeable(obj) and _is_wanted(obj)]
    found = []
    for name in names:
        obj = layer.objects.get(name)
        if obj is None or not bakeable(obj):
            raise HairloomError(
                "this names neither hair curves nor a fin of the open scene",
                place=name,
                remedy="Check the name",
            )
        found.append(obj)
    return found


def _is_wanted(obj: bpy.types.Object) -> bool:
    return bool(obj.type == "CURVES" or obj.hairloom.fin.enabled)


def _frames(given: list[int] | None) -> range | None:
    if given is None:
        return None
    first, last = given
    if last < first:
        raise HairloomError(
            f"the last frame, {last}, comes before the first, {first}",
            place="--frames",
            remedy="Give the first frame, then the last",
        )
    return range(first, last + 1)


def _take_settings(obj: bpy.types.Object, presets: list[str], assignments: list[str]) -> None:
    """Change the object's own settings by --preset and --set, as the artist would."""
    chosen: dict[str, Settings] = {}
    for name in presets:
        chosen |= {settings.section: settings for settings in named_preset(name).all}
    for section in ALL_SETTINGS:
        group, values = _group(obj, section), overrides(assignments, section)
        settings = chosen.get(section)
        if group is None or (settings is None and not values):
            continue
        own = settings_of(group, ALL_SETTINGS[section]) if settings is None else settings
        changed = type(own).from_dict(own.as_dict() | values, "--set")
        for name, value in changed.as_dict().items():
            setattr(group, name, value)


def _group(obj: bpy.types.Object, section: str) -> Any:
    """The object's properties of a section; None where it has none."""
    owners = (obj.data.hairloom, obj.hairloom) if obj.type == "CURVES" else (obj.hairloom,)
    return next((g for owner in owners if (g := getattr(owner, section, None)) is not None), None)


def _tell(objects: list[bpy.types.Object], report: Report) -> None:
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
                "form": facts.form,
            }
        )
        report.add_output(folder)
        print(f"Baked {obj.name}, frames {facts.first} to {facts.last}, into {folder}")
    report.facts["baked"] = baked
