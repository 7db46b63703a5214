"""Kills a process while it writes a file, many times: the old file or the new one must be there.

python tools/in_package.py kill_writes FORMAT TRIALS [SEED]    a JSON line: trials, failures, amid

A child writes two versions in turn, as fast as it can, and is killed by SIGKILL at a random moment.
`amid` counts the kills that left a half-written file beside the target: those that came in time.
"""

from __future__ import annotations

import json
import os
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from damaged_files import sample

from hairloom.addon.exchange.atomic import write_text_atomic
from hairloom.addon.exchange.hair_file import write_hair_file
from hairloom.addon.exchange.tfxbone import strongest_bones, write_tfxbone
from hairloom.addon.exchange.tressfx import write_tfx

STRANDS = 3000
#: the child is killed within this time from its first write on [s]
LONGEST = 0.03


def _write_bones(path: Path, version: int) -> None:
    weights = np.random.default_rng(version).random((STRANDS, 5))
    write_tfxbone(path, strongest_bones(tuple("abcde"), weights))


def _write_text(path: Path, version: int) -> None:
    write_text_atomic(path, json.dumps({"values": [version] * 100_000}))


def _write_plainly(path: Path, version: int) -> None:
    """What all the others must not do; that this one is caught shows that the trials can fail."""
    path.write_bytes(bytes([version]) * 3_000_000)


GROOMS = [sample(STRANDS, seed) for seed in range(2)]
WRITERS: dict[str, Callable[[Path, int], object]] = {
    "tfx": lambda path, version: write_tfx(path, GROOMS[version]),
    "tfxbone": _write_bones,
    "hair": lambda path, version: write_hair_file(path, GROOMS[version], uv=True),
    "preset": _write_text,
    "plain": _write_plainly,
}


def main(arguments: list[str]) -> int:
    kind, trials, seed = arguments[0], int(arguments[1]), int((arguments[2:] or ["0"])[0])
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(killed(WRITERS[kind], Path(folder), trials, seed)))
    return 0


def killed(
    write: Callable[[Path, int], object], folder: Path, trials: int, seed: int
) -> dict[str, int]:
    """Kill a writer so many times and look at what it left."""
    random = np.random.default_rng(seed)
    target = folder / "target.file"
    versions = []
    for version in range(2):
        write(target, version)
        versions.append(target.read_bytes())
    failures = amid = 0
    for _ in range(trials):
        _kill_one(write, target, float(random.uniform(0.0, LONGEST)))
        failures += target.read_bytes() not in versions
        beside = [file for file in folder.iterdir() if file != target]
        amid += bool(beside)
        for file in beside:
            file.unlink()
        if target.read_bytes() not in versions:
            write(target, 0)
    return {"trials": trials, "failures": failures, "amid": amid}


def _kill_one(write: Callable[[Path, int], object], target: Path, delay: float) -> None:
    ready, told = os.pipe()
    child = os.fork()
    if child == 0:
        _write_for_ever(write, target, told)
    os.read(ready, 1)
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), "the writer ended by itself"
    os.close(ready)
    os.close(told)


def _write_for_ever(write: Callable[[Path, int], object], target: Path, told: int) -> None:
    try:
        os.write(told, b"x")
        version = 0
        while True:
            write(target, version)
            version = 1 - version
    finally:
        os._exit(1)
