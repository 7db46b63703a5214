"""The verbs of the command line, each one screen of named steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import pipeline
from ..arrays import Floats
from ..dynamics.colliders import DistanceField
from ..dynamics.settings import DynamicsSettings
from ..errors import HairloomError
from ..exchange.card_formats import format_of
from ..exchange.tressfx import write_tfx
from ..pipeline import Pose, Rig
from ..render.card_snapshot import CardSnapshot
from ..shading.volume.settings import VolumeSettings
from .card_files import CardOutput, WrittenCards, write_cards
from .card_images import named_pictures
from .card_making import order_line
from .card_textures import TextureFiles
from .images import contact_sheet, write_png
from .inputs import Inputs
from .job_steps import Job, card_form, finish, moment_of, open_studio, read_rig, rest_of, tell_notes
from .report import Progress, Report
from .sheet import Sheet
from .studio import Studio
from .take import Take, TakeDrive, read_take, scene_drive, shaken_poses, write_take
from .take import simulate as simulate_take
from .turntable import Turntable, TurntableSettings

SHEET_COLUMNS, SHEET_ROWS = 4, 3


def simulate(job: Job) -> None:
    """Simulate the guides and write them as a take."""
    report = Report(job.verb)
    rig, inputs = read_rig(job, report)
    take = _simulate(job, rig, inputs, report)
    with report.stage("write take"):
        write_take(job.output, take)
    finish(job, report, job.output)


def render(job: Job) -> None:
    """Draw a still, at rest or at a frame of a take, and a contact sheet of the take."""
    if job.options.sheet and not job.options.take:
        raise HairloomError(
            "a contact sheet needs motion", place="--sheet", remedy="Give a take with --take"
        )
    if job.options.slices and job.set(VolumeSettings).shadows == "none":
        raise HairloomError(
            "there are no shadows whose layers could be shown",
            place="--slices",
            remedy="Add --set volume.shadows=slices, or deep",
        )
    if job.options.skin_shadow and job.set(VolumeSettings).shadows == "none":
        raise HairloomError(
            "there is no soft shadow on skin that could be shown",
            place="--skin-shadow",
            remedy="Add --set volume.shadows=deep, or slices",
        )
    report = Report(job.verb)
    rig, _ = read_rig(job, report)
    studio = open_studio(job, rig, report)
    if job.options.sheet:
        take = read_take(Path(job.options.take), rig)
        _write_sheet(Path(job.options.sheet), studio, rig, take, report)
    pose, points = moment_of(job, rig)
    _write_still(job, job.output, studio, pose, points, report)
    if job.options.slices:
        _write_slices(Path(job.options.slices), studio, pose, points, report)
    if job.options.skin_shadow:
        _write_skin_shadow(Path(job.options.skin_shadow), studio, pose, points, report)
    finish(job, report, job.output)


def cards(job: Job) -> None:
    """Turn hair into cards, sorted from inside to outside: GLB, FBX, USD or OBJ, and textures."""
    options, report = job.options, Report(job.verb)
    pictures = named_pictures(options.texture)
    path, _ = format_of(job.output, options.format)
    output = CardOutput(
        options.format,
        portable=options.portable,
        index_buffer=options.index_buffer,
        textures=TextureFiles(options.packing, options.textures),
    )
    rig, _ = read_rig(job, report)
    _write_cards(job, path, rig, pictures, report, output)
    finish(job, report, path)


def export(job: Job) -> None:
    """Write the strands, at rest or at a frame of a take, as TressFX."""
    report = Report(job.verb)
    rig, _ = read_rig(job, report)
    _, points = moment_of(job, rig)
    with report.stage("write strands"):
        write_tfx(job.output, rig.strands.with_points(points.reshape(-1, 3)))
    finish(job, report, job.output)


def turntable(job: Job) -> None:
    """Turn the groom once before the camera: a picture a frame, and a video of them."""
    options, report = job.options, Report(job.verb)
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
    rig, _ = read_rig(job, report)
    studio = open_studio(job, rig, report)
    pose, points = moment_of(job, rig)
    turn = Turntable(studio, pose, points, chosen, job.output)
    progress = Progress("drawing the turntable", chosen.frames)
    with report.stage("draw turntable"):
        for done in turn.steps():
            progress.show(done)
    tell_notes(turn.notes, report)
    for path in turn.files:
        report.add_output(path)
    finish(job, report, job.output)


def sheet(job: Job) -> None:
    """Draw a contact sheet: the groom from all sides, or in all looks."""
    options, report = job.options, Report(job.verb)
    rig, _ = read_rig(job, report)
    studio = open_studio(job, rig, report)
    size = options.width, options.height
    drawn = Sheet(studio, *moment_of(job, rig), size, options.samples, by_looks=options.looks)
    progress = Progress("drawing the contact sheet", drawn.count)
    with report.stage("draw contact sheet"):
        for done in drawn.steps():
            progress.show(done)
    write_png(job.output, drawn.picture)
    finish(job, report, job.output)


def demo(job: Job) -> None:
    """Do it all: simulate, stills, contact sheet, hair cards, strands and report.json."""
    report = Report(job.verb)
    folder, pictures = job.output, named_pictures(job.options.texture)
    rig, inputs = read_rig(job, report)
    take = _simulate(job, rig, inputs, report)
    studio = open_studio(job, rig, report)
    _write_still(job, folder / "still.png", studio, *rest_of(rig), report)
    _write_sheet(folder / "motion.png", studio, rig, take, report)
    written = _write_cards(job, folder / "cards.glb", rig, pictures, report)
    _write_card_still(job, folder / "cards.png", studio, written, report)
    with report.stage("write strands"):
        write_tfx(folder / "strands.tfx", rig.strands)
    report.add_output(folder / "strands.tfx")
    report.write(folder / "report.json")
    print(f"Wrote {', '.join(report.facts['outputs'])} and report.json into {folder}")


def _simulate(job: Job, rig: Rig, inputs: Inputs, report: Report) -> Take:
    """Run the dynamics under the scene's animation or the shake."""
    with report.stage("collider"):
        assert inputs.collider is not None, "simulate and demo refuse a groom without a head"
        name = job.sources.collider or job.sources.head or "built-in head"
        collider = DistanceField.from_surface(
            inputs.collider, job.set(DynamicsSettings), place=name
        )
    drive = _drive(job, rig, inputs)
    progress = Progress("simulating", len(drive.poses) - 1)
    take, worst = simulate_take(
        rig, collider, drive, job.set(DynamicsSettings), report.stage, progress.show
    )
    report.facts.update(
        frames=len(drive.poses),
        frame_rate=drive.frame_rate,
        stretch_max_percent=round(worst.stretch * 100.0, 4),
        penetration_max_mm=round(worst.penetration * 1000.0, 4),
    )
    return take


def _drive(job: Job, rig: Rig, inputs: Inputs) -> TakeDrive:
    """What moves the hair: the scene, when its animation is asked for, else the shake."""
    if not job.options.scene:
        rate = float(job.options.frame_rate)
        return TakeDrive(shaken_poses(rig, round(job.options.seconds * rate) + 1, rate), rate)
    if inputs.head_object is None:
        raise HairloomError(
            "only an object of the open scene is animated",
            place="--scene",
            remedy="Name the head's object with --head, or leave out --scene",
        )
    return scene_drive(inputs.head_object)


def _write_still(
    job: Job, path: Path, studio: Studio, pose: Pose, points: Floats, report: Report
) -> None:
    print("drawing the still", flush=True)
    options = job.options
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


def _write_sheet(path: Path, studio: Studio, rig: Rig, take: Take, report: Report) -> None:
    """Frames spread evenly over the take, as one picture."""
    count = min(SHEET_COLUMNS * SHEET_ROWS, take.frame_count)
    progress, pictures = Progress("drawing the contact sheet", count), []
    for frame in np.linspace(0, take.frame_count - 1, count).round().astype(int):
        pose = take.pose(frame)
        with report.stage("interpolate strands"):
            points = pipeline.strands_at(rig, pose, take.guides[frame])
        with report.stage("draw frame"):
            pictures.append(studio.picture(pose, points, 480, 360, samples=2))
        progress.show(len(pictures))
    write_png(path, contact_sheet(pictures, SHEET_COLUMNS))
    report.add_output(path)


def _write_slices(path: Path, studio: Studio, pose: Pose, points: Floats, report: Report) -> None:
    """The layers of the shadow maps."""
    with report.stage("draw slices"):
        picture = studio.slices(pose, points)
    write_png(path, picture)
    report.add_output(path)


def _write_skin_shadow(
    path: Path, studio: Studio, pose: Pose, points: Floats, report: Report
) -> None:
    """The map of the soft shadow on the head."""
    with report.stage("draw skin shadow"):
        picture = studio.skin_shadow(pose, points)
    write_png(path, picture)
    report.add_output(path)


def _write_cards(
    job: Job,
    path: Path,
    rig: Rig,
    pictures: Mapping[str, Floats],
    report: Report,
    output: CardOutput | None = None,
) -> WrittenCards:
    print("building hair cards", flush=True)
    levels = getattr(job.options, "levels", None)
    form = card_form(job)
    if levels is not None:
        form = replace(form, cards=replace(form.cards, levels=levels))
    written = write_cards(path, rig, form.choices(pictures), output, report.stage)
    report.facts.update(
        cards=written.mesh.card_count,
        card_triangles=len(written.mesh.triangles),
        card_levels=[len(level.triangles) for level in written.levels],
        card_order_wrong=round(written.build.wrong_share, 4),
    )
    print(order_line(written.build.wrong_share), flush=True)
    tell_notes(list(written.notes), report)
    for file in written.files:
        report.add_output(file)
    return written


def _write_card_still(
    job: Job, path: Path, studio: Studio, written: WrittenCards, report: Report
) -> None:
    """The cards where the strands are in the still."""
    options, maps, build = job.options, written.maps, written.build
    shown = CardSnapshot(
        build.finest,
        maps.textures,
        maps.has_tangent_map,
        build.backs[0],
        is_even=maps.is_even,
    )
    with report.stage("draw cards"):
        picture = studio.card_picture(shown, options.width, options.height, options.samples)
    write_png(path, picture)
    report.add_output(path)
