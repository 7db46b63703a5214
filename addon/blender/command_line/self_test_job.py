"""The verb `self-test`: whether a machine is fit."""

from __future__ import annotations

from dataclasses import asdict

from ...errors import HairloomError
from ...render.capabilities import capabilities
from ..setup import self_test as tests
from .job_steps import Job
from .verb import Verb


def self_test(job: Job) -> None:
    """Try out on this machine what Hairloom stands on: shaders, simulation, drawing and files."""
    with job.report.stage("self-test"):
        checks = tests.run()
    job.report.facts["checks"] = [
        {"name": check.name, "outcome": check.outcome, "text": check.text} for check in checks
    ]
    job.report.facts["capabilities"] = asdict(capabilities())
    print(tests.report_text(), end="")
    failed = [check for check in checks if check.outcome == "failed"]
    if failed:
        raise HairloomError(
            f"{len(failed)} of {len(checks)} checks failed, the first with: {failed[0].text}",
            place=failed[0].name,
            remedy="Update the GPU's driver, or run on another machine",
        )


SELF_TEST = Verb(
    "self-test",
    self_test,
    takes_hair=False,
    takes_settings=False,
    operators=("self_test", "copy_report"),
)
