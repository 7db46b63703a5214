"""Whether the dynamics can be broken: 1,000 seeded runs of two seconds, and a shake of ten minutes.

A run fails if anything is not finite, or if the length along a strand from its root to a CV exceeds
1.02 times that at rest, including what curls give. Lengths do not count with relaxation without
long-range attachment, which lets hair stretch. The scenes are those of
`_random_runs`. The last line is one JSON object; the exit status is 1 if anything
failed.

make bench NAME="endurance --runs 1000 --first 0 --minutes 10 --compute"
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
from dataclasses import dataclass, field

import numpy as np
from _random_runs import RandomRun, promises_length, random_run, reach_of, shaken
from _report import report, start
from _simulations import ComputeSimulation, NumpySimulation, Simulation, play

from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.state import DynamicsState

SECONDS, LIMIT = 2.0, 1.02
REFERENCE = "lengths at rest, with what curls give"
MAX_LIMITS = {"failures": 0, "reach_along_strand": LIMIT, "shake_failed": 0}


@dataclass
class Tally:
    """The results so far."""

    runs: int = 0
    worst_ratio: float = 0.0
    worst_seed: int = -1
    failures: dict[int, str] = field(default_factory=dict)


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("--runs", type=int, default=1000, help="number of seeded runs")
    options.add_argument("--first", type=int, default=0, help="the first seed")
    options.add_argument("--guides", type=int, default=12, help="guides in each run")
    options.add_argument("--minutes", type=float, default=10.0, help="of the shake; 0: none")
    options.add_argument("--compute", action="store_true", help="on the GPU instead of in numpy")
    arguments = options.parse_args()
    start()
    found: dict[str, object] = {"device": "compute" if arguments.compute else "numpy"}
    tally, begin = Tally(), time.perf_counter()
    for seed in range(arguments.first, arguments.first + arguments.runs):
        note(tally, seed, random_run(seed, arguments.guides), compute=arguments.compute)
        if tally.runs % 50 == 0:
            print(f"{tally.runs} runs, {len(tally.failures)} failed", flush=True)
    found |= {
        "runs": tally.runs,
        "failures": len(tally.failures),
        "failed_seeds": sorted(tally.failures),
        "reach_along_strand": round(tally.worst_ratio, 5),
        "worst_seed": tally.worst_seed,
    }
    if arguments.minutes:
        found |= shake(
            ComputeSimulation if arguments.compute else NumpySimulation, arguments.minutes
        )
    found["seconds"] = time.perf_counter() - begin
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


def note(tally: Tally, seed: int, run: RandomRun, *, compute: bool) -> None:
    """Play a run and record its result."""
    problem = None
    ratio = 0.0

    def watch(state: DynamicsState, _drive: Drive) -> None:
        nonlocal ratio, problem
        reach = reach_of(state, run.settings)
        if promises_length(run.settings) or not reach.is_finite:
            ratio = max(ratio, reach.along)
        if not reach.is_finite:
            problem = "not finite"

    state = run.begin()
    simulation: Simulation = ComputeSimulation(state) if compute else NumpySimulation(state)
    try:
        play(simulation, run.drives(SECONDS), run.settings, run.fps, watch)
    except Exception:  # any exception is a failure of this seed, and the others go on
        traceback.print_exc()
        problem = "raised"
    simulation.release()
    tally.runs += 1
    if ratio > tally.worst_ratio:
        tally.worst_ratio, tally.worst_seed = ratio, seed
    if problem or ratio > LIMIT:
        tally.failures[seed] = problem or f"a strand of {ratio:.3f} times its length"
        print(f"seed {seed}: {tally.failures[seed]}", flush=True)


def shake(
    make: type[NumpySimulation] | type[ComputeSimulation], minutes: float
) -> dict[str, object]:
    """Shake a head in gusts for minutes: hair must keep its length, and its top speed may grow by
    less than half from the first quarter of the time to the last."""
    run = shaken(guide_count=60)
    max_ratio, speeds = 0.0, []

    def watch(state: DynamicsState, _drive: Drive) -> None:
        nonlocal max_ratio
        max_ratio = max(max_ratio, reach_of(state).along)
        displacement = state.position - state.previous
        speeds.append(
            float(np.sqrt((displacement * displacement).sum(axis=0)).max()) / state.substep
        )

    simulation = make(run.begin())
    play(simulation, run.drives(60.0 * minutes), run.settings, run.fps, watch)
    simulation.release()
    quarter = len(speeds) // 4
    begin, end = max(speeds[:quarter]), max(speeds[-quarter:])
    return {
        "shake_minutes": minutes,
        "shake_worst_ratio": round(max_ratio, 5),
        "shake_fastest_begin": round(begin, 3),
        "shake_fastest_end": round(end, 3),
        "shake_failed": int(not (max_ratio <= LIMIT and np.isfinite(end) and end < 1.5 * begin)),
    }


if __name__ == "__main__":
    sys.exit(main())
