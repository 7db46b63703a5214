"""The next write removes temporary files of killed writers, and keeps those of running ones."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hairloom.addon.exchange.files import stale_temp_files
from hairloom.addon.exchange.files.atomic import write_bytes_atomic
from hairloom.addon.exchange.files.file_set import atomic_file_set
from hairloom.addon.exchange.files.stale_temp_files import remove_stale_files, temporary_path


@pytest.fixture
def ended() -> int:
    """The id of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def left_by(process: int, path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str | None) -> Path:
    with monkeypatch.context() as patched:
        patched.setattr(stale_temp_files.os, "getpid", lambda: process)
        return temporary_path(path, suffix)


def write_set(path: Path) -> None:
    with atomic_file_set(path) as folder:
        (folder / path.name).write_bytes(b"new")


@pytest.mark.parametrize("write", [lambda path: write_bytes_atomic(path, b"new"), write_set])
def test_the_next_write_removes_files_of_killed_writers(
    write, tmp_path: Path, ended: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "cards.v2.glb"
    file = left_by(ended, path, monkeypatch, None)
    file.write_bytes(b"half")
    folder = left_by(ended, path, monkeypatch, "")
    (folder / "old").mkdir(parents=True)
    (folder / "old" / "cards.png").write_bytes(b"half")
    assert (file.suffix, folder.suffix[:4]) == (".glb", ".hl-")
    write(path)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"new"


def test_files_of_other_writers_and_users_stay(
    tmp_path: Path, ended: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "groom.abc"
    ours = temporary_path(path)
    another = left_by(os.getppid(), path, monkeypatch, None)
    monkeypatch.setattr(stale_temp_files, "_host_id", lambda: "0" * 8)
    elsewhere = left_by(ended, path, monkeypatch, None)
    monkeypatch.undo()
    foreign = [tmp_path / name for name in (".groom.abc", ".hl-1-2-3", f".a.hl-{ended}", "b.hl-1")]
    kept = [ours, another, elsewhere, *foreign]
    for each in kept:
        each.write_bytes(b"kept")
    write_bytes_atomic(path, b"new")
    assert sorted(tmp_path.iterdir()) == sorted([path, *kept])


def test_what_a_power_cut_or_another_machine_left_goes_after_a_day(
    tmp_path: Path, ended: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine that was restarted counts as another one."""
    with monkeypatch.context() as patched:
        patched.setattr(stale_temp_files, "_host_id", lambda: "0" * 8)
        file, folder = (left_by(os.getpid(), tmp_path / "a.glb", patched, s) for s in (None, ""))
    file.write_bytes(b"half")
    folder.mkdir()
    for name in ("a.glb", "a_base.png", ".complete"):
        (folder / name).write_bytes(b"new")
    remove_stale_files(tmp_path)
    assert file.exists() and folder.exists()
    for each in (file, folder):
        then = each.stat().st_mtime - 86_500
        os.utime(each, (then, then))
    remove_stale_files(tmp_path)
    left = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    assert left == {"a.glb": b"new", "a_base.png": b"new"}, "a complete set is put in place"


def test_where_no_process_can_be_asked_for_a_day_must_pass(
    tmp_path: Path, ended: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = left_by(ended, tmp_path / "groom.abc", monkeypatch, None)
    left.write_bytes(b"half")
    monkeypatch.setattr(stale_temp_files.os, "name", "nt")
    monkeypatch.setattr(stale_temp_files.os, "kill", lambda *_: pytest.fail("that would end it"))
    remove_stale_files(tmp_path)
    assert left.exists()
    a_day_ago = left.stat().st_mtime - 86_500
    os.utime(left, (a_day_ago, a_day_ago))
    remove_stale_files(tmp_path)
    assert not left.exists()
