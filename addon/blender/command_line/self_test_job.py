"""The verb `self-test`: checks whether a machine can run Hairloom."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from ...errors import HairloomError
from ...exchange.files.atomic import write_text_atomic
from ...render.capabilities import capabilities
from ..setup import benchmark
from ..setup import self_test as tests
from .job_steps import Job
from .verb import Verb


def self_test(job: Job) -> None:
    """Check that this machine has what Hairloom needs: shaders, simulation, drawing and files."""
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
    if job.options.benchmark:
        _write_benchmark(job, Path(job.options.benchmark))


def _write_benchmark(job: Job, path: Path) -> None:
    with job.report.stage("benchmark"):
        found = benchmark.run_benchmark()
    write_text_atomic(path, json.dumps(found, indent=2) + "\n")
    job.report.add_output(path)
    print(f"Wrote {path}")


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--benchmark",
        metavar="FILE",
        help="also measure frame times on this machine (takes minutes without a GPU), and write "
        "device, driver and milliseconds as JSON",
    )


SELF_TEST = Verb(
    "self-test",
    self_test,
    _add_options,
    takes_hair=False,
    takes_settings=False,
    operators=("self_test", "copy_report"),
)
