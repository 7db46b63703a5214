"""Damaged files of all formats that can be read, and writers that are killed while they write.

`bench/_exchange_files.py` does the same with 10,000 files and 100 kills of each format.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import damaged_files
import fuzz_files
import pytest
from extension_loader import REPOSITORY
from tiers import few_in_commits

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files.child_process import same_packages


def with_library(kind: str, package: str) -> Any:
    has_it = importlib.util.find_spec(package) is not None
    return pytest.param(kind, marks=pytest.mark.skipif(not has_it, reason=f"no {package} here"))


FORMATS = ("tfx", "hair", "preset")
#: formats that libraries parse, slowly, in another process
SUBPROCESS_FORMATS = tuple(
    with_library(kind, package)
    for kind, package in (("abc", "alembic3d"), ("usdc", "pxr"), ("usda", "pxr"))
)
WRITTEN = (*FORMATS, "tfxbone", "glb", *SUBPROCESS_FORMATS[:2])
FILES, SUBPROCESS_FILES, KILLS = 150, 6, 6


def report(tool: str, *arguments: str) -> dict[str, Any]:
    """The report of a tool that runs in its own process, since it may crash."""
    in_package = str(REPOSITORY / "tools" / "in_package.py")
    command = [sys.executable, in_package, tool, *arguments]
    environment = {**os.environ, **same_packages(), "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


@pytest.mark.parametrize("kind", FORMATS)
def test_no_damage_ends_in_anything_but_a_groom_or_a_message(kind: str) -> None:
    found = report("fuzz_files", kind, str(FILES))
    assert found["failures"] == []
    assert min(found["read"], found["refused"]) > FILES // 20, found


@pytest.mark.parametrize("kind", few_in_commits(SUBPROCESS_FORMATS))
def test_damage_to_files_that_libraries_parse_is_reported(kind: str) -> None:
    found = report("fuzz_files", kind, str(SUBPROCESS_FILES))
    assert found["failures"] == []
    assert found["read"] + found["refused"] == SUBPROCESS_FILES


@pytest.mark.parametrize("kind", few_in_commits(WRITTEN))
def test_a_killed_writer_leaves_the_old_file_or_the_new_one(kind: str) -> None:
    """The next write removes its temporary files."""
    found = report("kill_writes", kind, str(KILLS))
    assert (found["trials"], found["failures"], found["leftovers"]) == (KILLS, 0, 0)
    assert found["mixed"] == 0


def test_killing_a_plain_writer_is_seen() -> None:
    """A writer that is not atomic makes the trials above fail."""
    assert report("kill_writes", "plain", str(KILLS))["failures"] > 0


def test_kills_come_in_the_midst_of_writing() -> None:
    assert report("kill_writes", "hair", str(3 * KILLS))["amid"] > 0


@pytest.mark.parametrize(
    ("read", "seen"),
    [
        (lambda path: path.read_bytes()[10**9], "IndexError"),
        (lambda path: bytearray(20 * 10**6), "memory"),
        (lambda path: "something else", "a str"),
        (lambda path: _raise(HairloomError("bad", place="somewhere", remedy="Do")), "unclear"),
        (lambda path: _raise(HairloomError("bad", place=str(path), remedy="")), "unclear"),
        (lambda path: _wait(), " s"),
    ],
)
def test_readers_that_fail_are_seen(monkeypatch: pytest.MonkeyPatch, read: Any, seen: str) -> None:
    """Bad readers make the fuzzing above fail."""
    monkeypatch.setitem(fuzz_files.READERS, "tfx", read)
    monkeypatch.setattr(fuzz_files, "MAX_SECONDS", 0.5)
    (failure,) = fuzz_files.fuzz("tfx", 1)["failures"]
    assert seen in failure


def _raise(error: Exception) -> None:
    raise error


def _wait() -> None:
    while True:
        pass


def test_damage_is_the_same_for_the_same_number() -> None:
    assert damaged_files.damaged_content("hair", 3, 7) == damaged_files.damaged_content(
        "hair", 3, 7
    )
    assert len({damaged_files.damaged_content("hair", 3, number) for number in range(50)}) > 45


@pytest.mark.parametrize("kind", (*FORMATS, *SUBPROCESS_FORMATS))
def test_the_files_to_be_damaged_are_sound(kind: str, tmp_path: Path) -> None:
    small, large = damaged_files.originals(kind)
    path = tmp_path / f"sound.{kind}"
    for content in (*small, *large):
        path.write_bytes(content)
        assert fuzz_files.fault_of(fuzz_files.READERS[kind](path)) == ""


def test_a_large_preset_is_refused_before_it_is_read(tmp_path: Path) -> None:
    """In memory, JSON takes twenty times its size and more."""
    path = tmp_path / "damaged.tfx"
    path.write_text("[" + "[]," * 400_000 + "[]]")
    fuzz_files.tracemalloc.start()
    outcome, _, peak = fuzz_files.read_and_judge(fuzz_files.read_preset_file, path)
    fuzz_files.tracemalloc.stop()
    assert outcome == "refused" and peak < 100_000


@pytest.mark.parametrize("value", ["9" * 400, "Infinity", "-1e999", "9" * 5000, "[" * 100_000])
def test_implausible_preset_values_are_refused(tmp_path: Path, value: str) -> None:
    """Each of these raises another error in Python; all become messages."""
    path = tmp_path / "preset.json"
    values = f'{{"cv_count": {value}}}'
    path.write_text(f'{{"hairloom": 1, "section": "guides", "values": {values}}}')
    with pytest.raises(HairloomError) as caught:
        fuzz_files.read_preset_file(path)
    assert path.name in caught.value.place and caught.value.remedy
