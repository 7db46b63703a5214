"""Kills a process while it writes, many times: afterwards the old or the new files must be there.

python tools/in_package.py kill_writes FORMAT TRIALS [SEED]    a JSON line, see `kill_and_check`

A child writes two versions in turn, as fast as it can, and is killed by SIGKILL at a random moment.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from damaged_files import sample

from hairloom.addon.exchange.alembic.groom_alembic import is_complete_alembic, write_groom_alembic
from hairloom.addon.exchange.files.atomic import write_text_atomic
from hairloom.addon.exchange.files.file_set import atomic_file_set
from hairloom.addon.exchange.files.stale_temp_files import remove_stale_files
from hairloom.addon.exchange.hair_file import write_hair_file
from hairloom.addon.exchange.tfxbone import strongest_bones, write_tfxbone
from hairloom.addon.exchange.tressfx import write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd

STRANDS = 3000
#: the child is killed within the time that this many writes take
MAX_DELAY_IN_WRITES = 4.0
#: files that are exported as a set with the target
OTHER_FILES = ("hair_base.png", "hair_normal.png", "hair.json")


def _write_bones(path: Path, version: int) -> None:
    weights = np.random.default_rng(version).random((STRANDS, 5))
    write_tfxbone(path, strongest_bones(tuple("abcde"), weights))


def _write_text(path: Path, version: int) -> None:
    write_text_atomic(path, json.dumps({"values": [version] * 100_000}))


def _write_set(path: Path, version: int) -> None:
    with atomic_file_set(path) as folder:
        for name in (path.name, *OTHER_FILES):
            (folder / name).write_bytes(bytes([version]) * 500_000)


def _write_without_atomicity(path: Path, version: int) -> None:
    """A writer that is not atomic; that it is caught shows that the trials can fail."""
    path.write_bytes(bytes([version]) * 3_000_000)


GROOMS = [sample(STRANDS, seed) for seed in range(2)]
WRITERS: dict[str, Callable[[Path, int], object]] = {
    "tfx": lambda path, version: write_tfx(path, GROOMS[version]),
    "tfxbone": _write_bones,
    "hair": lambda path, version: write_hair_file(path, GROOMS[version], uv=True),
    "preset": _write_text,
    "abc": lambda path, version: write_groom_alembic(path, GROOMS[version]),
    "usdc": lambda path, version: write_usd(path, GROOMS[version]),
    "glb": _write_set,
    "plain": _write_without_atomicity,
}
#: imported once, not in every child
LIBRARIES = {"abc": ("imath", "alembic3d"), "usdc": ("pxr.Usd", "pxr.UsdGeom", "pxr.Vt")}


def main(arguments: list[str]) -> int:
    kind, trials, seed = arguments[0], int(arguments[1]), int((arguments[2:] or ["0"])[0])
    for library in LIBRARIES.get(kind, ()):
        importlib.import_module(library)
    with tempfile.TemporaryDirectory() as folder:
        print(
            json.dumps(kill_and_check(WRITERS[kind], Path(folder) / f"hair.{kind}", trials, seed))
        )
    return 0


def kill_and_check(
    write: Callable[[Path, int], object], target: Path, trials: int, seed: int
) -> dict[str, int]:
    """Kill a writer this many times, and check the files that it left.

    Returns:
        trials; failures: a file that is neither the old one nor the new one; amid: kills during a
        write, which left temporary files beside the target; mixed: sets with old and new files,
        after the next writer's removal of stale files; leftovers: files that are still beside the
        target after one more write.
    """
    random = np.random.default_rng(seed)
    folder, versions, seconds = target.parent, [], 0.0
    for version in (0, 1):
        start = time.perf_counter()
        _write_in_child(write, target, version)
        seconds = max(seconds, time.perf_counter() - start)
        versions.append(_folder_content(folder))
    counts = {"trials": trials, "failures": 0, "amid": 0, "mixed": 0, "leftovers": 0}
    stale_names: set[str] = set()
    for _ in range(trials):
        _kill_one(write, target, float(random.uniform(0.0, MAX_DELAY_IN_WRITES * seconds)))
        temporary_names = {name for name in os.listdir(folder) if name.startswith(".")}
        counts["amid"] += bool(temporary_names - stale_names)
        remove_stale_files(folder)  # as the next writer does
        stale_names = {name for name in os.listdir(folder) if name.startswith(".")}
        content = _folder_content(folder)
        is_whole = all(content.get(n) in [v[n] for v in versions] for n in versions[0])
        counts["failures"] += not is_whole
        counts["mixed"] += is_whole and content not in versions
        if not is_whole:
            _write_in_child(write, target, 0)
    _write_in_child(write, target, 0)
    counts["leftovers"] = len(set(os.listdir(folder)) - set(versions[0]))
    return counts


def _folder_content(folder: Path) -> dict[str, bytes]:
    """The visible files of a folder; of Alembic files, which hold a date, size and completeness."""
    files = [path for path in folder.iterdir() if not path.name.startswith(".")]
    return {
        path.name: repr((path.stat().st_size, is_complete_alembic(path))).encode()
        if path.suffix == ".abc"
        else path.read_bytes()
        for path in files
    }


def _write_in_child(write: Callable[[Path, int], object], target: Path, version: int) -> None:
    """Write in a child too: threads that libraries start here would be lost in the next fork."""
    child = os.fork()
    if child == 0:
        try:
            write(target, version)
            os._exit(0)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert status == 0, "the writer failed"


def _kill_one(write: Callable[[Path, int], object], target: Path, delay: float) -> None:
    ready_reader, ready_writer = os.pipe()
    child = os.fork()
    if child == 0:
        _write_forever(write, target, ready_writer)
    os.read(ready_reader, 1)
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), "the writer ended by itself"
    os.close(ready_reader)
    os.close(ready_writer)


def _write_forever(write: Callable[[Path, int], object], target: Path, ready_writer: int) -> None:
    try:
        os.write(ready_writer, b"x")
        version = 0
        while True:
            write(target, version)
            version = 1 - version
    finally:
        os._exit(1)
