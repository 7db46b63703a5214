"""`self-test --benchmark`: figures of a machine, each timed until the GPU has finished."""

from __future__ import annotations

import json
from argparse import Namespace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hairloom.addon.blender.base.report import Report, environment
from hairloom.addon.blender.command_line import self_test_job
from hairloom.addon.blender.setup import benchmark
from hairloom.addon.render.strand_layers import is_software

pytestmark = pytest.mark.usefixtures("gpu_context")


def test_the_file_has_the_machine_and_all_times(tmp_path: Path, monkeypatch: Any) -> None:
    sizes, whole = ((64, 48), (96, 64), (128, 96)), benchmark.run_benchmark
    monkeypatch.setattr(benchmark, "_MAX_SECONDS", 0.0)
    monkeypatch.setattr(benchmark, "run_benchmark", lambda: whole(sizes, 200))
    monkeypatch.setattr(self_test_job.tests, "run", lambda: ())
    path, report = tmp_path / "frames.json", Report("self-test")
    job = SimpleNamespace(report=report, options=Namespace(benchmark=str(path)))
    self_test_job.self_test(job)
    found = json.loads(path.read_text())
    assert report.facts["outputs"] == ["frames.json"]
    assert found.items() >= environment().items() and found["renderer"] == found["device"] != ""
    assert found["strands"] == 200 and found["simulated_on"].startswith(("GPU (", "CPU ("))
    assert found["transparency"] in ("layers", "hashed")
    assert [(each["width"], each["height"]) for each in found["frames"]] == list(sizes)
    times = [found["simulation_ms"], found["maps_ms"]]
    times += [each[name] for each in found["frames"] for name in ("at_rest_ms", "frame_ms")]
    assert all(0.0 < each < 60_000.0 for each in times)
    assert all(each["main_thread_ms"] > 0.0 for each in found["frames"])


def test_without_the_option_nothing_is_measured(monkeypatch: Any) -> None:
    monkeypatch.setattr(benchmark, "run_benchmark", lambda: pytest.fail("it measures"))
    monkeypatch.setattr(self_test_job.tests, "run", lambda: ())
    job = SimpleNamespace(report=Report("self-test"), options=Namespace(benchmark=None))
    self_test_job.self_test(job)


def test_a_time_ends_with_the_work_of_the_gpu() -> None:
    """The time of a long dispatch includes its work on the GPU, not only its submission."""
    import time

    import gpu

    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(8, 8)
    info.push_constant("INT", "rounds")
    info.image(0, "R32F", "FLOAT_2D", "found", qualifiers={"WRITE"})
    info.compute_source(
        "void main() { float x = 0.0; for (int i = 0; i < rounds; i++) { x = sin(x + float(i)); }"
        " imageStore(found, ivec2(gl_GlobalInvocationID.xy), vec4(x)); }"
    )
    shader = gpu.shader.create_from_info(info)
    target = gpu.types.GPUTexture((256, 256), format="R32F")
    bench = benchmark._Bench(benchmark.hair_ball(10), None, None, None, None)  # type: ignore[arg-type]

    def work() -> None:
        shader.bind()
        shader.image("found", target)
        # long compared with the wait for the result, on a GPU too
        shader.uniform_int("rounds", 400 if is_software() else 40_000)
        gpu.compute.dispatch(shader, 32, 32, 1)
        gpu.shader.unbind()

    def with_its_end() -> float:
        begin = time.perf_counter()
        work()
        target.read()
        return 1000.0 * (time.perf_counter() - begin)

    taken = bench.time(work)
    whole = min(with_its_end() for _ in range(3))  # the minimum, because other load only adds time
    assert taken > 0.3 * whole > 0.3


def test_the_ball_is_even_and_long_enough() -> None:
    rig = benchmark.hair_ball(500)
    roots = rig.strands.grid[:, 0]
    assert abs(roots.mean(axis=0)).max() < 0.002
    assert len(rig.strands.grid) == 500 and rig.strands.grid.shape[1] == benchmark.POINTS
