"""What verbs of the command line share: what a job is, and the steps from files to a picture."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from ... import pipeline
from ...arrays import Floats
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GrowSettings, GuideSettings
from ...params import SettingsMap
from ...pipeline import Pose, Rig
from ...shading.ambient_settings import AmbientSettings
from ..bakes.take import read_take
from ..base.report import Report
from ..pictures.studio import Studio
from ..properties.groom_settings import GroomSettings
from .inputs import Inputs, Sources, read_inputs


@dataclass(frozen=True)
class Job:
    """One call of a verb: what to work on, how, where the result goes, and what is told of it."""

    verb: str
    sources: Sources
    settings: SettingsMap
    output: Path
    options: argparse.Namespace
    report: Report


def read_rig(job: Job) -> tuple[Rig, Inputs]:
    """Read what the job names and make it ready to move."""
    report = job.report
    print("reading", job.sources.groom or "(a groom grown here)", flush=True)
    with report.stage("read inputs"):
        inputs = read_inputs(job.sources, job.settings[GrowSettings])
    _tell_drops(job, inputs)
    tell_notes(list(inputs.notes), report)
    with report.stage("bind roots, choose guides"):
        rig = pipeline.prepare(
            inputs.strands,
            inputs.head,
            job.settings[GuideSettings],
            place=inputs.groom_name,
            children=job.settings[ChildrenSettings],
            density=inputs.density,
        )
    tell_notes([f"{inputs.groom_name}: {note}" for note in rig.notes], report)
    tell_rig(report, rig, inputs.groom_name)
    report.facts["dropped"] = inputs.dropped
    return rig, inputs


def tell_rig(report: Report, rig: Rig, name: str) -> None:
    """What hair there is."""
    low, high = rig.strands.bounds()
    report.facts.update(
        groom=Path(name).name,
        strands=rig.strands.strand_count,
        guides=len(rig.guides),
        children=rig.strands.strand_count - len(rig.guides),
        cv_count=rig.strands.grid.shape[1],
        bounds_m=[low.round(5).tolist(), high.round(5).tolist()],
    )


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
    report.facts["notes"] = [*report.facts.get("notes", ()), *notes]


def rest_of(rig: Rig) -> tuple[Pose, Floats]:
    return rig.rest_pose, rig.strands.grid


def moment_of(job: Job, rig: Rig) -> tuple[Pose, Floats]:
    """The pose and all strands at the frame of the take that was asked for; else at rest."""
    if not job.options.take:
        return rest_of(rig)
    take = read_take(Path(job.options.take), rig)
    if not 0 <= job.options.frame < take.frame_count:
        raise HairloomError(
            f"frame {job.options.frame} is not in this take",
            place=job.options.take,
            remedy=f"Use a frame from 0 to {take.frame_count - 1}",
        )
    pose = take.pose(job.options.frame)
    return pose, pipeline.strands_at(rig, pose, take.guides[job.options.frame])


def open_studio(job: Job, rig: Rig) -> Studio:
    """What draws this job's hair in its look."""
    with job.report.stage("ambient occlusion"):
        occlusion = pipeline.rest_occlusion(rig, job.settings[AmbientSettings])
        head_occlusion = pipeline.head_occlusion(rig, job.settings[AmbientSettings])
    studio = Studio(rig, occlusion, head_occlusion, GroomSettings(job.settings))
    tell_notes(list(studio.warnings), job.report)
    return studio


def finish(job: Job, output: Path) -> None:
    """Name the result."""
    if not job.report.facts["outputs"]:
        job.report.add_output(output)
    print(f"Wrote {output}")
