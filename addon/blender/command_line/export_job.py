"""The verb `export`: strands as a file for engines, still or in motion, or only a check of it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ...arrays import Floats
from ...errors import HairloomError
from ...exchange.groom import Groom
from ...exchange.strand_check import check_lines
from ...exchange.strand_export_settings import StrandExportSettings, layout_of
from ...exchange.strand_formats import STRAND_FORMATS, StrandFormat, format_of
from ...groom.size_notes import object_size_note, size_note
from ...groom.widths import with_widths_of
from ...rig_flow import Rig
from ...shading.settings import ShadingSettings
from ..bakes.bake_settings import folder_of
from ..base.objects import head_of
from ..scene.source import check_density
from ..scene.surfaces import read_surface
from ..strands.groom_motion import BakedMotion
from ..strands.read_hair import export_strands_of_rig
from ..strands.strand_export import StrandExport, request_of
from .arguments import option_name
from .idle_options import exports_scene_hair
from .inputs import Inputs
from .job_options import (
    add_bake_frame_options,
    add_frames_option,
    add_max_frames_option,
    add_object_option,
    add_parameter_options,
    frames_of_option,
    section_from_options,
)
from .job_steps import (
    Job,
    job_colors,
    read_baked_motion,
    read_hair,
    read_rig,
    report_dropped_strands,
    report_notes,
)
from .object_settings import change_settings, check_sections, grooms_to_export
from .output_checks import check_not_an_input
from .verb import Verb


def export(job: Job) -> None:
    """Export strands for an engine: at rest, in a frame of a bake, or over several frames."""
    options, report = job.options, job.report
    path, kind = format_of(job.output, options.format)
    if not options.preflight:
        check_not_an_input(path, options)
    settings = section_from_options(options, job.settings[StrandExportSettings])
    _check_layout(kind, settings)
    frames = frames_of_option(options.frames, options.max_frames)
    if exports_scene_hair(options):
        plan = _plan_of_objects(job, kind, settings, frames)
    else:
        plan = _plan_of_rig(job, kind, settings, frames)
    facts = plan.check()
    facts["warnings"] += _size_warnings(job, plan)
    report.facts.update(preflight=facts, dropped=plan.dropped)
    if options.preflight:
        report_notes(list(plan.notes), report)
        _print_check(facts, options.preflight)
        return
    with report.stage("write strands"):
        outcome = plan.write(path, None if frames is None else _with_progress(job, plan))
    report_notes(list(outcome.warnings), report)
    for file in plan.files:
        report.add_output(file)
    print(outcome.result)


def _size_warnings(job: Job, plan: StrandExport) -> list[str]:
    """Warnings about hair whose numbers cannot be metres."""
    hair, head, points = job.sources.groom, job.sources.head, plan.groom.strands.points
    if exports_scene_hair(job.options) or job.options.bake is not None or job.hair is not None:
        note = object_size_note(plan.groom.name, points)
    elif hair is not None:
        note = size_note((Path(hair).name, points), None)
    else:  # it was grown, in the unit of its head
        note = size_note(None, (Path(head).name, points) if head else None)
    return [note.rstrip(".")] if note else []


def _check_layout(kind: StrandFormat, settings: StrandExportSettings) -> None:
    """Raises:
    HairloomError: an option that the format does not have, by its name on the command line.
    """
    try:
        layout_of(kind, settings)
    except HairloomError as error:
        option = option_name(error.place)
        is_choice = error.place == "engine"  # the format has this option, but not this value
        problem = error.problem if is_choice else f"it is not an option of {kind.title}"
        raise HairloomError(problem, place=option, remedy=error.remedy) from error


def _plan_of_objects(
    job: Job, kind: StrandFormat, settings: StrandExportSettings, frames: range | None
) -> StrandExport:
    """Hair of the scene, as the artist's operators write it."""
    options, depsgraph = job.options, bpy.context.evaluated_depsgraph_get()
    hair, notes = grooms_to_export(options.object)
    report_notes(list(notes), job.report)
    section = StrandExportSettings.section
    check_sections(hair, options.preset, options.set, job_section=section)
    for each in hair:
        change_settings(each, options.preset, options.set)
        if options.children_density:
            each.hairloom.children_density = options.children_density
            check_density(each, depsgraph)
        head = head_of(each)
        if options.strict and head is not None:
            read_surface(head, depsgraph, need_uv=True, place=head.name)
    still = frames is None and options.frame is not None
    with job.report.stage("read hair"):
        at = range(options.frame, options.frame + 1) if still else frames
        plan = StrandExport.of(hair, depsgraph, kind, settings, frames=at)
        if options.use_bake:
            _check_baked(plan)
        for folder in filter(None, map(folder_of, hair if plan.moving else ())):
            job.report.add_input(folder)  # also an empty one, as a later bake may fill it
        plan = plan.as_still() if still else plan
    report_dropped_strands(job, plan.dropped, ", ".join(each.name for each in hair))
    return plan


def _check_baked(plan: StrandExport) -> None:
    """Raises:
    HairloomError: hair that has no bake, although --use-bake requires one.
    """
    for part in plan.moving:
        if not isinstance(part, BakedMotion):
            raise HairloomError(
                "it has no bake",
                place=part.export.groom.name,
                remedy="Bake it, or omit --use-bake to write the motion of Blender's own animation",
            )


def _plan_of_rig(
    job: Job, kind: StrandFormat, settings: StrandExportSettings, frames: range | None
) -> StrandExport:
    """The hair of --groom or --bake, or hair that is grown here."""
    needs, look = request_of(kind, settings), job.settings[ShadingSettings]
    if job.options.bake is None:
        if frames is not None:
            raise HairloomError(
                "only one frame of this hair is read",
                place="--frames",
                remedy="Give a bake with --bake, or hair of the scene with --object. To bring the "
                "motion of a groom file into a scene, use the verb import",
            )
        rig, inputs = read_rig(job)
        own = _groom(rig, inputs)
        groom = export_strands_of_rig(rig, own, needs, look, job_colors(job, rig)).groom
        return StrandExport(groom, settings, kind, inputs.dropped)
    at = frames if job.options.frame is None else range(job.options.frame, job.options.frame + 1)
    motion = read_baked_motion(job, at)
    rig, read = motion.rig, read_hair(job) if job.sources.groom else None
    groom = Groom(rig.strands, Path(motion.cache.facts.owner).stem)
    if read is not None:
        groom = replace(groom, name=Path(read.groom_name).stem)
        if read.groom is not None and read.strands.strand_count == rig.strands.strand_count:
            groom = replace(groom, **_values_of_strands(read.groom))
    if frames is None:
        _, points = motion.strands(motion.frames[0])
        groom = replace(groom, strands=rig.strands.with_points(points.reshape(-1, 3)))
    colors = job_colors(job, rig)
    moving = BakedMotion(export_strands_of_rig(rig, groom, needs, look, colors), motion.cache)
    plan = StrandExport(moving.export.groom, settings, kind, frames=frames)
    if frames is not None:
        plan.moving, plan.rate = (moving,), moving.rate
    return plan


def _groom(rig: Rig, inputs: Inputs) -> Groom:
    """The strands with their own points; the rig's strands if it has children."""
    name = Path(inputs.groom_name).stem
    if inputs.strands.strand_count != rig.strands.strand_count:
        return Groom(rig.strands, name)
    own = with_widths_of(inputs.strands, rig.strands) if rig.widths.is_found else inputs.strands
    if inputs.groom is None:
        return Groom(own, name)
    return replace(inputs.groom, name=name, strands=own)


def _values_of_strands(groom: Groom) -> dict[str, Any]:
    """The values of a groom that belong to whole strands."""
    names = ("strand_id", "is_guide", "closest_guides", "guide_weights", "group_names")
    return {name: getattr(groom, name) for name in names}


def _with_progress(job: Job, plan: StrandExport) -> Iterator[Floats]:
    progress = job.report.progress("writing frames", plan.frame_count)
    for points in plan.positions():
        yield points
        progress.show(plan.frames_read + 1)


def _print_check(facts: dict[str, Any], form: str) -> None:
    if form == "json":
        print(json.dumps(facts, indent=2))
        return
    for line in check_lines(facts):
        print(line)
    for warning in facts["warnings"]:
        print(f"Warning: {warning}")


def add_export_options(parser: argparse.ArgumentParser) -> None:
    """Add the artist's export settings, and options for frames."""
    add_bake_frame_options(parser, "; for --object, or all hair of the scene, a frame of the scene")
    hair = parser.add_argument_group("hair of the scene")
    add_object_option(
        hair,
        "hair curves to export; can be repeated to write several into one file (default: all hair "
        "of the scene)",
    )
    add_frames_option(
        hair,
        "write the motion in these frames, of --object or of --bake (Alembic and USD only)",
    )
    add_max_frames_option(hair)
    file = parser.add_argument_group("the file")
    file.add_argument(
        "--format",
        choices=[each.name for each in STRAND_FORMATS],
        help="of the file (default: by its suffix)",
    )
    file.add_argument(
        "--preflight",
        nargs="?",
        const="text",
        choices=("text", "json"),
        help="report what the engine will receive, and write nothing",
    )
    add_parameter_options(file, StrandExportSettings)


EXPORT = Verb(
    "export",
    export,
    add_export_options,
    output="strands to write (.abc, .usdc, .usd, .usda, .tfx or .hair)",
    operators=(
        "export_alembic",
        "export_usd",
        "export_tressfx",
        "export_hair",
        "check_export",
    ),
)
