"""Benchmarks: their printed figures, exit status and comparisons."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import figures
import pytest
from tiers import few_in_commits

sys.path.append(str(Path(__file__).parents[2] / "bench"))
from _report import chosen, report
from _turns import in_turns


@pytest.mark.parametrize(
    ("found", "max_limits", "min_limits", "missed"),
    [
        ({"a": 1.0}, {"a": 1.0}, {}, []),
        ({"a": 1.1}, {"a": 1.0}, {}, ["a"]),
        ({"a": 0.9}, {}, {"a": 1.0}, ["a"]),
        ({"a": float("nan")}, {"a": 1.0}, {}, ["a"]),
        ({"a": float("nan")}, {}, {"a": 1.0}, ["a"]),
        ({"a": None}, {"a": 1.0}, {}, []),
        ({"b": 5.0}, {"a": 1.0}, {}, []),
        ({"x_ms": 1.0, "y_ms": 3.0, "ms": 9.0}, {"*_ms": 2.0}, {}, ["y_ms"]),
        ({"a": 1.0, "b": 1.0}, {"a": 0.0}, {"b": 2.0}, ["a", "b"]),
    ],
)
def test_missed_limits_set_the_exit_code(
    found: dict[str, Any],
    max_limits: dict[str, float],
    min_limits: dict[str, float],
    missed: list[str],
    capsys: pytest.CaptureFixture[str],
    gpu_context: object,
) -> None:
    status = report(found, "one", max_limits=max_limits, min_limits=min_limits)
    *lines, last = capsys.readouterr().out.splitlines()
    content = json.loads(last)
    assert status == int(bool(missed))
    assert content["missed"] == missed
    assert [line.split()[0] for line in lines if line.endswith("missed")] == missed
    assert content["reference"] == "one"
    assert {"backend", "renderer", "blender", "python", "numpy"} <= set(content)


def test_the_json_has_the_limits_in_words(
    capsys: pytest.CaptureFixture[str], gpu_context: object
) -> None:
    report({"bytes": 5, "kept": 0.9}, "", max_limits={"bytes": 6e6}, min_limits={"kept": 0.8})
    content = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert content["limits"] == {"bytes": "at most 6,000,000", "kept": "at least 0.8"}


def test_a_benchmark_that_measured_nothing_has_failed(
    capsys: pytest.CaptureFixture[str], gpu_context: object
) -> None:
    assert report({}, "") == 1


def test_a_part_that_is_unknown_ends_a_benchmark() -> None:
    assert chosen([], ("one", "two")) == ["one", "two"]
    assert chosen(["two"], ("one", "two")) == ["two"]
    with pytest.raises(SystemExit, match="no part too; there are one, two"):
        chosen(["two", "too"], ("one", "two"))


@pytest.mark.parametrize(
    "name",
    few_in_commits(sorted(name for name, short in figures.BENCHES.items() if short.arguments)),
)
def test_each_benchmark_refuses_an_unknown_part(name: str) -> None:
    """A mistyped part is an error; the benchmark does not measure everything or nothing."""
    command = [sys.executable, str(figures.REPOSITORY / "tools" / "bench.py"), name, "mistyped"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode != 0, done.stdout


def test_contestants_are_timed_equally_often_in_each_round() -> None:
    played = []

    def plays(name: str) -> float:
        played.append(name)
        return float(len(played))

    contestants = {name: lambda name=name: plays(name) for name in ("ours", "peer")}
    assert in_turns(contestants, 3) == {"ours": [1.0, 3.0, 5.0], "peer": [2.0, 4.0, 6.0]}
    assert played == ["ours", "peer"] * 3
