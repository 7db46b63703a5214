"""The verbs `self-test` and `sample`: whether a machine is fit, and a scene to try things with."""

from __future__ import annotations

import argparse

import bpy

from ...errors import HairloomError
from ..setup import self_test as tests
from ..setup.sample_scene import add_sample_scene
from .job_steps import Job
from .verb import Verb


def self_test(job: Job) -> None:
    """Try out on this machine what Hairloom stands on: shaders, simulation, drawing and files."""
    with job.report.stage("self-test"):
        checks = tests.run()
    job.report.facts["checks"] = [
        {"name": check.name, "outcome": check.outcome, "text": check.text} for check in checks
    ]
    print(tests.report_text(), end="")
    failed = [check for check in checks if check.outcome == "failed"]
    if failed:
        raise HairloomError(
            f"{len(failed)} of {len(checks)} checks failed, the first with: {failed[0].text}",
            place=failed[0].name,
            remedy="Update the GPU's driver, or run on another machine",
        )


def sample(job: Job) -> None:
    """Add a scene to try things with: a head that turns, long hair, lights and a camera."""
    scene, hair = add_sample_scene(tuple(job.options.preset))
    bpy.context.window.scene = scene  # the one that is shown when the file is opened
    job.report.facts.update(object=hair.name, frames=[scene.frame_start, scene.frame_end])
    print(f"Added the scene {scene.name} with {hair.name}", flush=True)


def _add_sample_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--preset",
        action="append",
        default=[],
        metavar="NAME",
        help="a preset for the hair, such as looks/blond; can be given again",
    )


SAMPLE = Verb(
    "sample",
    sample,
    _add_sample_options,
    takes_hair=False,
    takes_settings=False,
    saves_scene=True,
    operators=("sample_scene",),
)
SELF_TEST = Verb(
    "self-test",
    self_test,
    takes_hair=False,
    takes_settings=False,
    operators=("self_test", "copy_report"),
)
