"""The verb `render`: a still, and what explains it: shadow maps, the shadow on skin, a take.

At rest, or at a frame of a take or of a bake.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ... import pipeline
from ...arrays import Floats
from ...errors import HairloomError
from ...pipeline import Pose, Rig
from ...shading.volume.settings import VolumeSettings
from ..bakes.bake_settings import folder_of
from ..bakes.take import Take, read_take
from ..base.images import contact_sheet, write_png
from ..base.objects import head_of
from ..cards.motion import GuideMotion, baked_motion
from ..pictures.studio import Studio
from ..scene.surfaces import read_surface
from .job_options import add_moment_options, add_picture_options
from .job_steps import Job, finish, moment_of, open_studio, read_rig, tell_notes, tell_rig
from .verb import Verb

SHEET_COLUMNS, SHEET_ROWS = 4, 3


def render(job: Job) -> None:
    """Draw a still, at rest or at a frame of a take or bake, and a contact sheet of the take."""
    options = job.options
    _check(job)
    motion = _baked(job) if options.baked else None
    rig = read_rig(job)[0] if motion is None else motion.rig
    studio = open_studio(job, rig)
    if options.sheet:
        write_sheet(job, Path(options.sheet), studio, rig, read_take(Path(options.take), rig))
    pose, points = moment_of(job, rig) if motion is None else _moment(motion)
    write_still(job, job.output, studio, pose, points)
    if options.slices:
        _write_slices(job, Path(options.slices), studio, pose, points)
    if options.skin_shadow:
        _write_skin_shadow(job, Path(options.skin_shadow), studio, pose, points)
    finish(job, job.output)


def write_still(job: Job, path: Path, studio: Studio, pose: Pose, points: Floats) -> None:
    """One picture of the strands, and how much was drawn."""
    print("drawing the still", flush=True)
    options, report = job.options, job.report
    with report.stage("draw still"):
        picture = studio.picture(pose, points, options.width, options.height, options.samples)
    drawn = studio.statistics
    report.facts["drawn"] = {
        "strands": drawn.strands,
        "pieces": drawn.pieces,
        "vertices": drawn.vertices,
    }
    with report.stage("write still"):
        write_png(path, picture)
    report.add_output(path)


def write_sheet(job: Job, path: Path, studio: Studio, rig: Rig, take: Take) -> None:
    """Frames spread evenly over the take, as one picture."""
    count = min(SHEET_COLUMNS * SHEET_ROWS, take.frame_count)
    progress, pictures = job.report.progress("drawing the contact sheet", count), []
    for frame in np.linspace(0, take.frame_count - 1, count).round().astype(int):
        pose = take.pose(frame)
        with job.report.stage("interpolate strands"):
            points = pipeline.strands_at(rig, pose, take.guides[frame])
        with job.report.stage("draw frame"):
            pictures.append(studio.picture(pose, points, 480, 360, samples=2))
        progress.show(len(pictures))
    write_png(path, contact_sheet(pictures, SHEET_COLUMNS))
    job.report.add_output(path)


def _check(job: Job) -> None:
    """Refuse what cannot be drawn before anything is read."""
    if job.options.sheet and not job.options.take:
        raise HairloomError(
            "a contact sheet needs motion", place="--sheet", remedy="Give a take with --take"
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


def _baked(job: Job) -> GuideMotion:
    """The bake of the hair object that --groom names, at the one frame that is asked for."""
    options, hair = job.options, bpy.data.objects.get(job.sources.groom or "")
    if options.take or hair is None or hair.type != "CURVES":
        raise HairloomError(
            "it says already what moves the hair" if options.take else "this is no hair object",
            place="--take" if options.take else f"--groom {job.sources.groom or ''}".strip(),
            remedy="Name the baked hair of the scene with --groom, and give no take",
        )
    motion = baked_motion(hair, range(options.frame, options.frame + 1))
    folder = folder_of(hair)
    assert folder is not None, "it has a bake"
    job.report.add_input(folder)
    tell_notes(list(motion.notes), job.report)
    tell_rig(job.report, motion.rig, hair.name)
    return replace(motion, rig=_with_uvs(motion.rig, hair))


def _with_uvs(rig: Rig, hair: bpy.types.Object) -> Rig:
    """A bake's rig with the UVs of the head, which bakes have not; the hair's shadow on the head
    is laid out by them. Without where the head has other triangles by now."""
    head = head_of(hair)
    if rig.head is None or head is None:
        return rig
    depsgraph = bpy.context.evaluated_depsgraph_get()
    now = read_surface(head, depsgraph, need_uv=False, place=head.name)
    if not np.array_equal(now.triangles, rig.head.triangles):
        return rig
    return replace(rig, head=replace(rig.head, corner_uv=now.corner_uv))


def _moment(motion: GuideMotion) -> tuple[Pose, Floats]:
    pose, guides = motion.moment(motion.frames[0])
    return pose, pipeline.strands_at(motion.rig, pose, guides)


def _write_slices(job: Job, path: Path, studio: Studio, pose: Pose, points: Floats) -> None:
    """The layers of the shadow maps."""
    with job.report.stage("draw slices"):
        picture = studio.slices(pose, points)
    write_png(path, picture)
    job.report.add_output(path)


def _write_skin_shadow(job: Job, path: Path, studio: Studio, pose: Pose, points: Floats) -> None:
    """The map of the soft shadow on the head."""
    with job.report.stage("draw skin shadow"):
        picture = studio.skin_shadow(pose, points)
    write_png(path, picture)
    job.report.add_output(path)


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_moment_options(parser)
    add_picture_options(parser, 960, 720)
    parser.add_argument(
        "--baked",
        action="store_true",
        help="draw the bake of --groom, a hair object; --frame is a frame of the scene then",
    )
    more = parser.add_argument_group("more pictures")
    more.add_argument(
        "--look-from-material",
        action="store_true",
        help="start from the Principled Hair of the material of --groom, a hair object",
    )
    more.add_argument(
        "--slices",
        metavar="FILE.png",
        help="write the layers of the lights' shadow maps side by side too",
    )
    more.add_argument(
        "--skin-shadow",
        metavar="FILE.png",
        help="write the soft shadow on the head too, laid out as the head's UV map",
    )
    more.add_argument(
        "--sheet", metavar="FILE.png", help="write a contact sheet of the take to this file too"
    )


RENDER = Verb(
    "render",
    render,
    _add_options,
    output="picture to write (.png)",
    operators=("show_slices", "show_skin_shadow"),
)
