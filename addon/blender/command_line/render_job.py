"""The verb `render`: a still at rest or at a frame of a bake, and pictures that explain it: shadow
maps, the shadow on skin, and frames of the motion."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...shading.volume.settings import VolumeSettings
from ..bakes.guide_motion import BakedGuides
from ..base.images import contact_sheet, write_png
from ..pictures.group_studio import GroupStudio
from ..pictures.studio import Studio
from .arguments import option_name
from .job_options import add_bake_frame_options, add_picture_options
from .job_steps import (
    Job,
    PosedHair,
    common_frames,
    finish,
    motions_of_grooms,
    open_studio_of,
    posed_grooms,
    report_notes,
)
from .verb import Verb

SHEET_COLUMNS, SHEET_ROWS = 4, 3
#: size of each picture of a sheet [pixels]
SHEET_SIZE = 360, 270


def render(job: Job) -> None:
    """Draw a still at rest or in a frame of a bake, and a contact sheet of the motion."""
    options = job.options
    _check(job)
    grooms = posed_grooms(job)
    hair, studio = grooms[0], open_studio_of(job, grooms)
    if options.sheet:
        write_sheet(job, Path(options.sheet), studio, motions_of_grooms(_in_all_frames(job)))
        place_companions(studio, grooms[1:])
    write_still(job, job.output, studio, hair)
    if options.slices:
        _write_slices(job, Path(options.slices), studio, hair)
    if options.skin_shadow:
        _write_skin_shadow(job, Path(options.skin_shadow), studio, hair)
    report_notes(list(studio.notes), job.report)
    finish(job, job.output)


def write_still(job: Job, path: Path, studio: Studio, hair: PosedHair) -> Floats:
    """Write a picture of the strands, and report how much was drawn; returns the picture,
    see `Studio.picture`."""
    options, report = job.options, job.report
    progress = report.progress("drawing the still", studio.sample_count(options.samples))
    with report.stage("draw still"):
        picture = studio.picture(
            hair.pose,
            hair.points,
            options.width,
            options.height,
            options.samples,
            guides=hair.guides,
            on_sample=progress.show,
        )
    drawn = studio.statistics
    report.facts["drawn"] = {
        "strands": drawn.strands,
        "pieces": drawn.pieces,
        "vertices": drawn.vertices,
        "parts": drawn.layers.parts,
    }
    with report.stage("write still"):
        studio.write(path, picture)
    report.add_output(path)
    return picture


def write_sheet(job: Job, path: Path, studio: Studio, motions: Sequence[BakedGuides]) -> None:
    """Write frames spread evenly over the motion of all grooms, as one picture."""
    frames = common_frames(job, motions)
    count = min(SHEET_COLUMNS * SHEET_ROWS, len(frames))
    progress, pictures = job.report.progress("drawing the contact sheet", count), []
    for place in np.linspace(0, len(frames) - 1, count).round().astype(int):
        with job.report.stage("interpolate strands"):
            hair, *others = (PosedHair.of_motion(m, m.rig, frames[place]) for m in motions)
            place_companions(studio, others)
        with job.report.stage("draw frame"):
            picture = studio.picture(
                *(hair.pose, hair.points, *SHEET_SIZE), 2, guides=hair.guides, is_soft=False
            )
        pictures.append(picture)
        progress.show(len(pictures))
    studio.write(path, contact_sheet(pictures, SHEET_COLUMNS))
    job.report.add_output(path)


def place_companions(studio: Studio, hair: Sequence[PosedHair]) -> None:
    """Put the other grooms of a studio where they are in another frame."""
    if isinstance(studio, GroupStudio):
        studio.companions = tuple(
            replace(each, pose=posed.pose, points=posed.points, guides=posed.guides)
            for each, posed in zip(studio.companions, hair, strict=True)
        )


def _in_all_frames(job: Job) -> Job:
    """The job without --frame, for the frames of a contact sheet."""
    options = argparse.Namespace(**{**vars(job.options), "frame": None})
    others = tuple(replace(each, options=options) for each in job.others)
    return replace(job, options=options, others=others)


def _check(job: Job) -> None:
    """Refuse pictures that cannot be drawn, before inputs are read."""
    for name in ("slices", "skin_shadow") if job.others else ():
        if getattr(job.options, name):
            raise HairloomError(
                f"it shows the shadow of one groom, and several are drawn: {', '.join(job.names)}",
                place=option_name(name),
                remedy="Name one of them with --groom",
            )
    if job.options.sheet and job.options.bake is None:
        raise HairloomError(
            "a contact sheet needs motion", place="--sheet", remedy="Give a bake with --bake"
        )
    if job.settings[VolumeSettings].shadows != "none":
        return
    if job.options.slices:
        raise HairloomError(
            "there are no shadows whose layers could be shown",
            place="--slices",
            remedy="Add --set volume.shadows=slices, or deep",
        )
    if job.options.skin_shadow:
        raise HairloomError(
            "there is no soft shadow on skin that could be shown",
            place="--skin-shadow",
            remedy="Add --set volume.shadows=deep, or slices",
        )


def _write_slices(job: Job, path: Path, studio: Studio, hair: PosedHair) -> None:
    """Write the layers of the shadow maps."""
    with job.report.stage("draw slices"):
        picture = studio.slices(hair.pose, hair.points)
    write_png(path, picture)
    job.report.add_output(path)


def _write_skin_shadow(job: Job, path: Path, studio: Studio, hair: PosedHair) -> None:
    """Write the map of the soft shadow on the head."""
    with job.report.stage("draw skin shadow"):
        picture = studio.skin_shadow(hair.pose, hair.points)
    write_png(path, picture)
    job.report.add_output(path)


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_bake_frame_options(parser)
    add_picture_options(parser, 960, 720)
    more = parser.add_argument_group("more pictures")
    more.add_argument(
        "--look-from-material",
        action="store_true",
        help="start from the Principled Hair BSDF in the material of the hair object --groom",
    )
    more.add_argument(
        "--slices",
        metavar="FILE.png",
        help="also write the layers of the lights' shadow maps, side by side",
    )
    more.add_argument(
        "--skin-shadow",
        metavar="FILE.png",
        help="also write the soft shadow on the head, laid out as the head's UV map",
    )
    more.add_argument(
        "--sheet", metavar="FILE.png", help="also write a contact sheet of the bake to this file"
    )


RENDER = Verb(
    "render",
    render,
    _add_options,
    output="picture to write (.png)",
    suffix=".png",
    takes_several=True,
    operators=("show_slices", "show_skin_shadow"),
)
