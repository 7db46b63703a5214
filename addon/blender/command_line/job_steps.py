"""What verbs of the command line share: what a job is, and the steps from files to a picture."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from ... import pipeline
from ...arrays import Floats
from ...cards.atlas_settings import AtlasSettings
from ...cards.drawing_settings import CardDrawingSettings
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GrowSettings, GuideSettings
from ...params import Settings
from ...pipeline import Pose, Rig
from ...refine.settings import DetailSettings
from ...shading.ambient import AmbientSettings
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.shafts_settings import ShaftSettings
from ...shading.skin.settings import SkinSettings
from ...shading.textures import TextureSettings
from ...shading.volume.settings import VolumeSettings
from ..bakes.take import read_take
from ..base.report import Report
from ..pictures.studio import Look, Studio
from ..properties.card_form import CardForm
from .inputs import Inputs, Sources, read_inputs


@dataclass(frozen=True)
class Job:
    """One call of a verb: what to work on, how, where the result goes, and what is told of it."""

    verb: str
    sources: Sources
    settings: dict[str, Settings]
    output: Path
    options: argparse.Namespace
    report: Report

    def set[S: Settings](self, kind: type[S]) -> S:
        """This job's values of one parameter set."""
        values = self.settings[kind.section]
        assert isinstance(values, kind)
        return values


def read_rig(job: Job) -> tuple[Rig, Inputs]:
    """Read what the job names and make it ready to move."""
    report = job.report
    print("reading", job.sources.groom or "(a groom grown here)", flush=True)
    with report.stage("read inputs"):
        inputs = read_inputs(job.sources, job.set(GrowSettings))
    _tell_drops(job, inputs)
    tell_notes(list(inputs.notes), report)
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
        occlusion = pipeline.rest_occlusion(rig, job.set(AmbientSettings))
        head_occlusion = pipeline.head_occlusion(rig, job.set(AmbientSettings))
    look = Look(
        job.set(ShadingSettings),
        job.set(StrandSettings),
        job.set(DetailSettings),
        volume=job.set(VolumeSettings),
        skin=job.set(SkinSettings),
        shafts=job.set(ShaftSettings),
        card_drawing=job.set(CardDrawingSettings),
        card_form=card_form(job),
    )
    studio = Studio(rig, occlusion, head_occlusion, look)
    tell_notes(list(studio.warnings), job.report)
    return studio


def card_form(job: Job) -> CardForm:
    """What cards are built by."""
    return CardForm(
        job.set(CardSettings),
        job.set(AtlasSettings),
        job.set(CardOcclusionSettings),
        job.set(TextureSettings),
        job.set(StrandSettings),
        shading=job.set(ShadingSettings),
        ambient=job.set(AmbientSettings),
    )


def finish(job: Job, output: Path) -> None:
    """Name the result."""
    if not job.report.facts["outputs"]:
        job.report.add_output(output)
    print(f"Wrote {output}")
