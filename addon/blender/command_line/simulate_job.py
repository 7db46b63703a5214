"""The verb `simulate`: guides moved by a shake or by the scene, written as a take."""

from __future__ import annotations

from ...dynamics.colliders import DistanceField
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...pipeline import Rig
from ..bakes.take import Take, TakeDrive, scene_drive, shaken_poses, write_take
from ..bakes.take import simulate as simulate_take
from .inputs import Inputs
from .job_options import add_motion_options
from .job_steps import Job, finish, read_rig
from .verb import Verb


def simulate(job: Job) -> None:
    """Simulate the guides and write them as a take."""
    rig, inputs = read_rig(job)
    take = simulated_take(job, rig, inputs)
    with job.report.stage("write take"):
        write_take(job.output, take)
    finish(job, job.output)


def simulated_take(job: Job, rig: Rig, inputs: Inputs) -> Take:
    """Run the dynamics under the scene's animation or the shake."""
    with job.report.stage("collider"):
        assert inputs.collider is not None, "simulate and demo refuse a groom without a head"
        name = job.sources.collider or job.sources.head or "built-in head"
        collider = DistanceField.from_surface(
            inputs.collider, job.settings[DynamicsSettings], place=name
        )
    drive = _drive(job, rig, inputs)
    progress = job.report.progress("simulating", len(drive.poses) - 1)
    take, worst = simulate_take(
        rig, collider, drive, job.settings[DynamicsSettings], job.report.stage, progress.show
    )
    job.report.facts.update(
        frames=len(drive.poses),
        frame_rate=drive.frame_rate,
        stretch_max_percent=round(worst.stretch * 100.0, 4),
        penetration_max_mm=round(worst.penetration * 1000.0, 4),
    )
    return take


def _drive(job: Job, rig: Rig, inputs: Inputs) -> TakeDrive:
    """What moves the hair: the scene, when its animation is asked for, else the shake."""
    if not job.options.animated:
        rate = float(job.options.frame_rate)
        return TakeDrive(shaken_poses(rig, round(job.options.seconds * rate) + 1, rate), rate)
    if inputs.head_object is None:
        raise HairloomError(
            "only an object of the scene is animated",
            place="--animated",
            remedy="Name the head's object with --head, or leave out --animated",
        )
    return scene_drive(inputs.head_object)


SIMULATE = Verb(
    "simulate", simulate, add_motion_options, output="take to write (.npz)", needs_head=True
)
