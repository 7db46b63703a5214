"""The verbs `turntable` and `sheet`: the groom from all sides."""

from __future__ import annotations

import argparse

from ..pictures.sheet import Sheet
from ..pictures.turntable import LIGHTS, Turntable, TurntableSettings
from .job_options import add_bake_frame_options, add_picture_options
from .job_steps import Job, finish, open_studio_of, posed_grooms, report_notes
from .verb import Verb


def turntable(job: Job) -> None:
    """Turn the groom once in front of the camera: a picture for each frame, and a video."""
    options, report = job.options, job.report
    chosen = TurntableSettings(
        frames=options.frames,
        width=options.width,
        height=options.height,
        samples=options.samples,
        lights=options.lights,
        transparent=options.transparent,
        video=not options.no_video,
        frame_rate=options.frame_rate,
    )
    grooms = posed_grooms(job)
    hair, studio = grooms[0], open_studio_of(job, grooms)
    turn = Turntable(studio, hair.pose, hair.points, chosen, job.output, guides=hair.guides)
    progress = report.progress("drawing the turntable", chosen.frames)
    with report.stage("draw turntable"):
        for done in turn.steps():
            progress.show(done)
    report_notes([*turn.notes, *studio.notes], report)
    for path in turn.files:
        report.add_output(path)
    finish(job, job.output)


def sheet(job: Job) -> None:
    """Draw a contact sheet: the groom from all sides, or in all looks."""
    options, report = job.options, job.report
    grooms = posed_grooms(job)
    hair, studio = grooms[0], open_studio_of(job, grooms)
    size, samples = (options.width, options.height), options.samples
    contact_sheet = Sheet(
        studio,
        hair.pose,
        hair.points,
        size,
        samples,
        by_looks=options.looks,
        guides=hair.guides,
    )
    progress = report.progress("drawing the contact sheet", contact_sheet.count)
    with report.stage("draw contact sheet"):
        for done in contact_sheet.steps():
            progress.show(done)
    studio.write(job.output, contact_sheet.picture)
    report_notes(list(studio.notes), report)
    finish(job, job.output)


def _add_turntable_options(parser: argparse.ArgumentParser) -> None:
    add_bake_frame_options(parser)
    add_picture_options(parser, 720, 720)
    turn = parser.add_argument_group("the turn")
    turn.add_argument(
        "--frames",
        type=int,
        default=48,
        metavar="COUNT",
        help="number of pictures in a full turn (default: 48)",
    )
    turn.add_argument(
        "--frame-rate",
        type=float,
        default=24.0,
        metavar="COUNT",
        help="frames per second of the video (default: 24)",
    )
    turn.add_argument(
        "--lights",
        choices=[name for name, _, _ in LIGHTS],
        default="camera",
        help="whether lights turn with the camera (default) or stay with the groom",
    )
    turn.add_argument("--transparent", action="store_true", help="render without a backdrop")
    turn.add_argument("--no-video", action="store_true", help="write pictures only")


def _add_sheet_options(parser: argparse.ArgumentParser) -> None:
    add_bake_frame_options(parser)
    add_picture_options(parser, 480, 480)
    parser.add_argument(
        "--looks", action="store_true", help="show all shipped looks instead of all sides"
    )


TURNTABLE = Verb(
    "turntable",
    turntable,
    _add_turntable_options,
    output="folder for the pictures and the video",
    writes_folder=True,
    takes_several=True,
    operators=("turntable",),
)
SHEET = Verb(
    "sheet",
    sheet,
    _add_sheet_options,
    output="picture to write (.png); --width and --height apply to each picture in it",
    suffix=".png",
    takes_several=True,
    operators=("contact_sheet",),
)
