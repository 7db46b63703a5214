"""Writing and reading 100,000 strands of 16 points as USD, with all primvars that a groom can have.

`usd_bare_seconds` is usd-core's time for positions, counts and widths alone, which no writer can
save. Memory is the peak above what was used before.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from _exchange_memory import megabytes_beside
from pxr import Usd, UsdGeom, Vt

from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
from hairloom.addon.strands import StrandSet

STRANDS, POINTS, ROUNDS = 100_000, 16, 5


def usd_figures() -> dict[str, float]:
    """The figures by name: seconds as medians, megabytes of the file and of memory."""
    groom = full_groom()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hair.usdc"

        def write() -> None:
            write_usd(path, groom, up="Y", scale=0.01)

        figures = {
            "usd_write_memory_mb": megabytes_beside(write),
            "usd_write_seconds": _median_seconds(write),
            "usd_read_memory_mb": megabytes_beside(lambda: read_usd(path)),
            "usd_read_seconds": _median_seconds(lambda: read_usd(path)),
            "usd_file_mb": path.stat().st_size / 2**20,
            "usd_bare_seconds": _median_seconds(lambda: _write_bare(path, groom)),
        }
        assert read_usd(path).dropped == {}
    return {name: round(value, 3) for name, value in figures.items()}


def full_groom() -> Groom:
    """Random strands with every attribute that a groom can have."""
    random = np.random.default_rng(9)
    step = random.normal(0.0, 0.01, (STRANDS, POINTS, 3))
    strands = StrandSet(
        points=np.cumsum(step, axis=1, dtype=np.float32).reshape(-1, 3),
        offsets=np.arange(STRANDS + 1) * POINTS,
        radius=np.tile(np.linspace(5.0e-5, 1.0e-5, POINTS), STRANDS),
        group=random.integers(0, 4, STRANDS),
        root_uv=random.random((STRANDS, 2)),
        color=random.random((STRANDS * POINTS, 3)),
    )
    weights = random.random((STRANDS, 3))
    return Groom(
        strands,
        strand_id=random.permutation(STRANDS),
        is_guide=random.random(STRANDS) < 0.02,
        closest_guides=random.integers(0, STRANDS, (STRANDS, 3)),
        guide_weights=weights / weights.sum(axis=1, keepdims=True),
        group_names={0: "scalp", 1: "fringe"},
    )


def _write_bare(path: Path, groom: Groom) -> None:
    path.unlink(missing_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    curves = UsdGeom.BasisCurves.Define(stage, "/hair")
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(groom.strands.points))
    curves.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(groom.strands.point_counts))
    curves.CreateWidthsAttr(Vt.FloatArray.FromNumpy(groom.strands.radius))
    stage.Save()


def _median_seconds(work: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)
