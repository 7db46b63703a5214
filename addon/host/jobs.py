"""The verbs of the command line, each one screen of named steps."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import pipeline
from ..arrays import Floats
from ..cards.settings import CardSettings
from ..dynamics.colliders import DistanceField
from ..dynamics.settings import DynamicsSettings
from ..errors import HairloomError
from ..exchange.tressfx import write_tfx
from ..groom.children_settings import ChildrenSettings
from ..groom.settings import GrowSettings, GuideSettings
from ..params import Settings
from ..pipeline import Pose, Rig
from ..refine.settings import DetailSettings
from ..render.card_snapshot import CardSnapshot
from ..shading.ambient import AmbientSettings
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.textures import TextureSettings
from ..shading.volume.settings import VolumeSettings
from .card_files import CardChoices, WrittenCards, write_cards
from .card_images import named_pictures
from .images import contact_sheet, write_png
from .inputs import Inputs, Sources, read_inputs
from .report import Progress, Report
from .studio import Look, Studio
from .take import Take, TakeDrive, read_take, scene_drive, shaken_poses, write_take
from .take import simulate as simulate_take

SHEET_COLUMNS, SHEET_ROWS = 4, 3


@dataclass(frozen=True)
class Job:
    """One call of a verb: what to work on, how, and where the result goes."""

    verb: str
    sources: Sources
    settings: dict[str, Settings]
    output: Path
    options: argparse.Namespace

    def set[S: Settings](self, kind: type[S]) -> S:
        """This job's values of one parameter set."""
        values = self.settings[kind.section]
        assert isinstance(values, kind)
        return values


def simulate(job: Job) -> None:
    """Simulate the guides and write them as a take."""
    report = Report(job.verb)
    rig, inputs = _rig(job, report)
    take = _simulate(job, rig, inputs, report)
    with report.stage("write take"):
        write_take(job.output, take)
    _finish(job, report, job.output)


def render(job: Job) -> None:
    """Draw a still, at rest or at a frame of a take, and a contact sheet of the take."""
    if job.options.sheet and not job.options.take:
        raise HairloomError(
            "a contact sheet needs motion", place="--sheet", remedy="Give a take with --take"
        )
    report = Report(job.verb)
    rig, _ = _rig(job, report)
    studio = _studio(job, rig, report)
    if job.options.sheet:
        take = read_take(Path(job.options.take), rig)
        _write_sheet(Path(job.options.sheet), studio, rig, take, report)
    pose, points = _moment(job, rig)
    _write_still(job, job.output, studio, pose, points, report)
    _finish(job, report, job.output)


def cards(job: Job) -> None:
    """Turn the guides into hair cards, sorted from inside to outside: a GLB and its textures."""
    report = Report(job.verb)
    pictures = named_pictures(job.options.texture)
    rig, _ = _rig(job, report)
    _write_cards(job, job.output, rig, pictures, report)
    _finish(job, report, job.output)


def export(job: Job) -> None:
    """Write the strands, at rest or at a frame of a take, as TressFX."""
    report = Report(job.verb)
    rig, _ = _rig(job, report)
    _, points = _moment(job, rig)
    with report.stage("write strands"):
        write_tfx(job.output, rig.strands.with_points(points.reshape(-1, 3)))
    _finish(job, report, job.output)


def demo(job: Job) -> None:
    """Do it all: simulate, stills, contact sheet, hair cards, strands and report.json."""
    report = Report(job.verb)
    folder, pictures = job.output, named_pictures(job.options.texture)
    rig, inputs = _rig(job, report)
    take = _simulate(job, rig, inputs, report)
    studio = _studio(job, rig, report)
    _write_still(job, folder / "still.png", studio, *_rest(rig), report)
    _write_sheet(folder / "motion.png", studio, rig, take, report)
    written = _write_cards(job, folder / "cards.glb", rig, pictures, report)
    _write_card_still(job, folder / "cards.png", studio, written, report)
    with report.stage("write strands"):
        write_tfx(folder / "strands.tfx", rig.strands)
    report.add_output(folder / "strands.tfx")
    report.write(folder / "report.json")
    print(f"Wrote {', '.join(report.facts['outputs'])} and report.json into {folder}")


def _rig(job: Job, report: Report) -> tuple[Rig, Inputs]:
    """Read what the job names and make it ready to move."""
    print("reading", job.sources.groom or "(a groom grown here)", flush=True)
    with report.stage("read inputs"):
        inputs = read_inputs(job.sources, job.set(GrowSettings))
    _tell_drops(job, inputs)
    with report.stage("bind roots, choose guides"):
        rig = pipeline.prepare(
            inputs.strands,
            inputs.head,
            job.set(GuideSettings),
            place=inputs.groom_name,
            children=job.set(ChildrenSettings),
            density=inputs.density,
        )
    tell_notes([f"{inputs.groom_name}: {note}" for note in rig.notes], report)
    low, high = rig.strands.bounds()
    report.facts.update(
        groom=Path(inputs.groom_name).name,
        strands=rig.strands.strand_count,
        guides=len(rig.guides),
        children=rig.strands.strand_count - len(rig.guides),
        cv_count=rig.strands.grid.shape[1],
        bounds_m=[low.round(5).tolist(), high.round(5).tolist()],
        dropped=inputs.dropped,
    )
    return rig, inputs


def _tell_drops(job: Job, inputs: Inputs) -> None:
    """Say what was dropped; with --strict that is an error."""
    if not inputs.dropped:
        return
    reasons = ", ".join(f"{count} with {reason}" for reason, count in inputs.dropped.items())
    if job.options.strict:
        raise HairloomError(
            f"strands would be dropped: {reasons}",
            place=inputs.groom_name,
            remedy="Mend the groom, or leave out --strict",
        )
    print(f"hairloom: {inputs.groom_name}: dropped strands: {reasons}", flush=True)


def tell_notes(notes: list[str], report: Report) -> None:
    """Say what the artist should know, and put it into the report."""
    for note in notes:
        print(f"hairloom: {note}", flush=True)
    report.facts["notes"] = notes


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


def _rest(rig: Rig) -> tuple[Pose, Floats]:
    return rig.rest_pose, rig.strands.grid


def _moment(job: Job, rig: Rig) -> tuple[Pose, Floats]:
    """The pose and all strands at the frame of the take that was asked for; else at rest."""
    if not job.options.take:
        return _rest(rig)
    take = read_take(Path(job.options.take), rig)
    if not 0 <= job.options.frame < take.frame_count:
        raise HairloomError(
            f"frame {job.options.frame} is not in this take",
            place=job.options.take,
            remedy=f"Use a frame from 0 to {take.frame_count - 1}",
        )
    pose = take.pose(job.options.frame)
    return pose, pipeline.strands_at(rig, pose, take.guides[job.options.frame])


def _studio(job: Job, rig: Rig, report: Report) -> Studio:
    with report.stage("ambient occlusion"):
        occlusion = pipeline.rest_occlusion(rig, job.set(AmbientSettings))
        head_occlusion = pipeline.head_occlusion(rig, job.set(AmbientSettings))
    look = Look(
        job.set(ShadingSettings),
        job.set(StrandSettings),
        job.set(DetailSettings),
        volume=job.set(VolumeSettings),
    )
    return Studio(rig, occlusion, head_occlusion, look)


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


def _write_cards(
    job: Job, path: Path, rig: Rig, pictures: Mapping[str, Floats], report: Report
) -> WrittenCards:
    print("building hair cards", flush=True)
    choices = CardChoices(
        job.set(CardSettings),
        job.set(TextureSettings),
        job.set(AmbientSettings),
        job.set(ShadingSettings),
        pictures,
    )
    written = write_cards(path, rig, choices, report.stage)
    report.facts.update(cards=written.mesh.card_count, card_triangles=len(written.mesh.triangles))
    for file in written.files:
        report.add_output(file)
    return written


def _write_card_still(
    job: Job, path: Path, studio: Studio, written: WrittenCards, report: Report
) -> None:
    """The cards where the strands are in the still."""
    options, has_map = job.options, job.set(TextureSettings).highlights == "tangent"
    shown = CardSnapshot(written.mesh, written.textures, has_map)
    with report.stage("draw cards"):
        picture = studio.card_picture(shown, options.width, options.height, options.samples)
    write_png(path, picture)
    report.add_output(path)


def _finish(job: Job, report: Report, output: Path) -> None:
    """Name the result, and write the report where one was asked for."""
    if not report.facts["outputs"]:
        report.add_output(output)
    if job.options.report:
        report.write(Path(job.options.report))
    print(f"Wrote {output}")
