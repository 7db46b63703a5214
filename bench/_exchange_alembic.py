"""Groom Alembic with all attributes: time to write and to read, size, and memory.

Each action has its own process, so that its peak memory can be measured. The reader starts another
process, whose start counts.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from _exchange_memory import megabytes_beside
from extension_loader import REPOSITORY, load_package

load_package()

from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic  # noqa: E402
from hairloom.addon.exchange.alembic.groom_alembic_read import read_groom_alembic  # noqa: E402
from hairloom.addon.exchange.groom import Groom  # noqa: E402
from hairloom.addon.exchange.groom_presets import PRESETS  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

STRANDS, POINTS, GROUPS, ROUNDS = 100_000, 16, 3, 5
#: one strand in this many is a guide
GUIDES = 50


def alembic_figures() -> dict[str, float]:
    """Seconds, the minimum over ROUNDS; megabytes of the file, and of peak memory above what was
    used before. For reading, memory includes the groom, and not the other process."""
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "groom.abc"
        for preset in PRESETS:
            for act in ("write", "read"):
                command = [sys.executable, __file__, act, preset, str(path)]
                tools = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
                done = subprocess.run(
                    command, check=True, capture_output=True, text=True, env=tools
                )
                found = json.loads(done.stdout)
                figures |= {f"abc_{preset}_{act}_{name}": value for name, value in found.items()}
            figures[f"abc_{preset}_megabytes"] = path.stat().st_size / 1e6
    return figures


def full_groom() -> Groom:
    """Strands at random with every attribute that a groom can have."""
    random = np.random.default_rng(1)
    along = np.linspace(0.0, 0.2, POINTS)[:, None]
    roots = random.uniform(-0.1, 0.1, (STRANDS, 1, 3))
    points = roots + along * random.normal(size=(STRANDS, 1, 3))
    is_guide = np.arange(STRANDS) % GUIDES == 0
    strands = StrandSet(
        points.reshape(-1, 3),
        np.arange(STRANDS + 1) * POINTS,
        np.tile(np.linspace(4e-5, 1e-5, POINTS), STRANDS),
        random.integers(0, GROUPS, STRANDS),
        random.random((STRANDS, 2)),
        color=random.random((STRANDS * POINTS, 3)),
    )
    return Groom(
        strands,
        strand_id=np.arange(STRANDS),
        is_guide=is_guide,
        closest_guides=random.choice(np.flatnonzero(is_guide), (STRANDS, 3)),
        guide_weights=np.full((STRANDS, 3), 1.0 / 3.0),
        group_names={0: "scalp", 1: "fringe", 2: "nape"},
    )


def _act(act: str, preset: str, path: Path) -> dict[str, float]:
    """One action, ROUNDS times; memory is that of a first run, which is not timed."""
    groom = full_groom() if act == "write" else None

    def work() -> None:
        if groom is None:
            read_groom_alembic(path)
        else:
            write_groom_alembic(path, groom, PRESETS[preset])

    timings, processor, memory = [], [], megabytes_beside(work)
    for _ in range(ROUNDS):
        started, processed = time.perf_counter(), processor_seconds()
        work()
        timings.append(time.perf_counter() - started)
        processor.append(processor_seconds() - processed)
    return {"seconds": min(timings), "processor_seconds": min(processor), "memory": memory}


def processor_seconds() -> float:
    """Processor time of this process and of the children that it has waited for."""
    who = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    usage = [resource.getrusage(each) for each in who]
    return sum(each.ru_utime + each.ru_stime for each in usage)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(_act(sys.argv[1], sys.argv[2], Path(sys.argv[3]))))
    else:
        print(json.dumps(alembic_figures(), indent=1))
