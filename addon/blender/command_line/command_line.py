"""Hairloom without a window: `blender -b --command hairloom VERB ...`.

Exit codes: 0 done, 1 bad input (one line on stderr says what, where and what to do), 2 wrong usage,
128 plus the signal's number when interrupted (130 for Ctrl-C). Every file is written completely or
not at all.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import bpy

from ...errors import HairloomError
from ...params import SettingsMap
from ..base.gpu_context import converted_gpu_errors
from ..base.interruption import Interrupted, interruptible
from ..base.objects import objects_in
from ..base.parts import run_parts
from ..base.report import Report
from ..setup.hairstyles import add_hairstyle, add_head, named_hairstyle
from .arguments import VerbParser, check_empty_values
from .bake_job import BAKE
from .cards_job import CARDS
from .demo_job import DEMO
from .export_job import EXPORT
from .grow_job import GROW
from .idle_options import check_idle_options, has_scene
from .import_job import IMPORT
from .inputs import Sources
from .job_options import check_numbers, name_grooms, settings_from_options
from .job_steps import Job, report_notes
from .object_settings import find_hair, is_groom, named_objects, usable_objects
from .output_checks import check_outputs, check_report
from .render_job import RENDER
from .run_job import RUN
from .scene_files import check_scene_output, open_scene, remove_startup_cube, save_scene
from .self_test_job import SELF_TEST
from .show_jobs import SHEET, TURNTABLE
from .simulate_job import SIMULATE
from .stamp import Stamp
from .verb import Verb

VERBS: tuple[Verb, ...] = (
    GROW,
    IMPORT,
    RUN,
    SIMULATE,
    BAKE,
    RENDER,
    TURNTABLE,
    SHEET,
    EXPORT,
    CARDS,
    DEMO,
    SELF_TEST,
)


def run(arguments: list[str]) -> int:
    """Run the arguments after `--command hairloom`; called by Blender. Returns the exit code."""
    try:
        options = parser().parse_args(arguments)
    except SystemExit as stop:  # argparse has printed its message or the help
        return int(stop.code or 0)
    (verb,) = (each for each in VERBS if each.name == options.verb)
    report = Report(verb.name, options.progress)
    try:
        check_report(options)
    except HairloomError as error:
        print(f"hairloom: {error}", file=sys.stderr)
        return 1
    if not _write_report(report, options.report):
        return 1
    try:
        code = _run_and_report(verb, options, arguments, report)
    except Exception as fault:
        report.fail(_internal_error(fault))
        _write_report(report, options.report)
        raise  # so that Blender prints the traceback and exits with 1
    return code if _write_report(report, options.report) else code or 1


def parser() -> argparse.ArgumentParser:
    """The verbs and their options."""
    top = argparse.ArgumentParser(
        prog="hairloom",
        description="Groom, simulate, render and export real-time hair.",
        epilog="'VERB --help' lists the options of a verb. Exit codes: 0 done, 1 bad input, "
        "2 wrong usage, 130 interrupted.",
    )
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=VerbParser)
    for verb in VERBS:
        verb.add_all_options(
            verbs.add_parser(verb.name, help=verb.summary, description=verb.summary)
        )
    return top


def _run_and_report(
    verb: Verb, options: argparse.Namespace, arguments: list[str], report: Report
) -> int:
    """Run a verb, and report errors; returns the exit code."""
    try:
        check_empty_values(arguments)
        with interruptible(), converted_gpu_errors():
            _run_unless_done(verb, options, report)
    except HairloomError as error:
        print(f"hairloom: {error}", file=sys.stderr)
        report.fail(error)
        return 1
    except Interrupted as stop:
        print(f"hairloom: interrupted ({stop.name})", file=sys.stderr)
        report.interrupt(stop.name)
        return stop.exit_code
    return 0


def _write_report(report: Report, path: str | None) -> bool:
    """Write the report if requested, also before the work, so that an older one cannot be mistaken
    for this run's; returns whether that worked."""
    if path is None:
        return True
    try:
        report.write(Path(path))
    except HairloomError as error:
        print(f"hairloom: {error}", file=sys.stderr)
        return False
    return True


def _internal_error(fault: Exception) -> HairloomError:
    return HairloomError(
        f"{type(fault).__name__}: {fault}",
        place="Hairloom itself",
        remedy="Report it, with the lines above it in the log",
    )


def _run_unless_done(verb: Verb, options: argparse.Namespace, report: Report) -> None:
    """Run a verb, unless --skip-existing finds that it is done already."""
    check_numbers(options)
    check_outputs(verb, options)
    stamp = Stamp(options) if getattr(options, "skip_existing", False) else None
    if stamp is not None:
        reason = stamp.reason_to_run()
        if not reason:
            report.facts |= stamp.reported
            report.finish("skipped")
            print(f"Nothing to do: {options.output} exists, made from the same inputs and options")
            return
        print(f"to be done: {reason}", flush=True)
    verb.run(_job(verb, options, report))
    if verb.saves_scene:
        with report.stage("save scene"):
            saved = save_scene(options.output)
        report.add_output(saved)
        print(f"Wrote {saved}")
    if stamp is not None:
        stamp.write(report)
    report.finish("done")


def _job(verb: Verb, options: argparse.Namespace, report: Report) -> Job:
    """Open the scene, and gather the inputs of the verb."""
    if verb.opens_scene and options.scene:
        with report.stage("open scene"):
            open_scene(Path(options.scene))
    elif not bpy.data.filepath and (verb.saves_scene or verb is RUN):
        named = getattr(options, "object", None) or ()
        remove_startup_cube([*named, getattr(options, "head", None)])
    name_grooms(options)
    check_idle_options(verb, options)
    if verb.takes_hair and not (options.groom or options.style):
        if getattr(options, "bake", None):
            options.groom = _groom_of_bake(options, report)
        elif verb.takes_several:
            options.grooms = _grooms_of_scene(options, report)
            options.groom = options.grooms[0] if options.grooms else None
        elif not hasattr(options, "object"):
            options.groom = _only_groom(options, report)
    if verb.takes_hair and options.style:
        with report.stage("add hairstyle"):
            options.groom = _add_hairstyle(options, report)
    output = getattr(options, "output", None)
    if verb.saves_scene:
        check_scene_output(output, overwrites=options.save)
    groom = getattr(options, "groom", None)
    first, *others = (getattr(options, "grooms", None) or [groom]) if groom else [groom]
    job = _job_on(first, verb, options, report)
    return replace(job, others=tuple(_job_on(each, verb, options, report) for each in others))


def _job_on(groom: str | None, verb: Verb, options: argparse.Namespace, report: Report) -> Job:
    """The job on one groom."""
    output = getattr(options, "output", None)
    has_settings = verb.takes_settings
    return Job(
        verb=verb.name,
        sources=_sources(groom, verb, options) if verb.takes_hair else Sources(),
        stored_settings=settings_from_options(options, groom) if has_settings else SettingsMap(),
        output=Path() if output is None else output,
        options=options,
        report=report,
    )


def _sources(groom: str | None, verb: Verb, options: argparse.Namespace) -> Sources:
    return Sources(
        groom=groom,
        head=options.head,
        collider=options.collider,
        groom_scale=options.groom_scale,
        groom_up=options.groom_up,
        head_scale=options.head_scale,
        need_head=verb.needs_head,
        need_uv=options.strict,
        density_group=options.density_group,
        length_group=options.length_group,
        children_density=options.children_density or _children_density(groom),
        skin=options.skin,
        with_face=bool(options.style),
    )


def _add_hairstyle(options: argparse.Namespace, report: Report) -> str:
    """Add the hair of --style to the open scene, as the artist's button does; returns its name.

    Raises:
        HairloomError: other hair is named too, or the hairstyle does not fit the head.
    """
    if options.groom:
        raise HairloomError(
            "give either a hairstyle or a groom, not both",
            place="--style",
            remedy="Leave out --groom",
        )
    collection = bpy.context.collection
    if options.head:
        (head,) = named_objects([options.head], lambda obj: bool(obj.type == "MESH"), "a mesh")
    else:
        head = run_parts(add_head(collection, options.skin))
    style, depsgraph = named_hairstyle(options.style), bpy.context.evaluated_depsgraph_get()
    added = run_parts(
        add_hairstyle(style, head, depsgraph, collection, hairline=options.children_density or "")
    )
    report_notes([*added.warnings, *added.done], report)
    bpy.context.view_layer.update()
    return str(added.hair.name)


def _only_groom(options: argparse.Namespace, report: Report) -> str | None:
    """The only hair of the scene, if no option names another source of hair; else None.

    Raises:
        HairloomError: there are several, there is none, or it is hidden or empty.
    """
    grooms = _grooms_of_scene(options, report)
    if len(grooms) > 1:
        together = "bake them together with the verb bake"
        raise HairloomError(
            f"this scene has hair in several objects: {', '.join(sorted(grooms))}",
            place="--scene",
            remedy=f"Name one of them with --groom, or {together}",
        )
    return grooms[0] if grooms else None


def _grooms_of_scene(options: argparse.Namespace, report: Report) -> list[str]:
    """The hair of the scene, if no option names another source of hair; else none.

    Raises:
        HairloomError: there is none, or all of it is hidden or empty.
    """
    if not has_scene(options) or options.head:
        return []
    found, notes = usable_objects(is_groom, "--groom")
    report_notes(list(notes), report)
    grooms = [obj.name for obj in found]
    if not grooms:
        raise HairloomError(
            "there is no hair in this scene",
            place=options.scene or bpy.data.filepath,
            remedy="Name a file with --groom, a hairstyle with --style, or with --head a mesh on"
            " which hair is grown",
        )
    return grooms


def _groom_of_bake(options: argparse.Namespace, report: Report) -> str | None:
    """The only hair of the scene, which gives a bake from a folder its look, and the UVs and the
    materials of its head; None if there is none or several, or if a head is named."""
    if not has_scene(options) or options.head:
        return None
    grooms = sorted(obj.name for obj in objects_in(bpy.context.view_layer) if is_groom(obj))
    if len(grooms) > 1:
        note = (
            f"this scene has hair in several objects ({', '.join(grooms)}), so the bake has the "
            "default look. Name its hair with --groom."
        )
        report_notes([note], report)
    return grooms[0] if len(grooms) == 1 else None


def _children_density(groom: str | None) -> str:
    """The density of children that is set on the hair object of this name, if it is one."""
    hair = find_hair(groom)
    return str(hair.hairloom.children_density) if hair is not None else ""
