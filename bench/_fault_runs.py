"""Seeded faults while files are written; afterwards the old result or the new one must be there.

The system causes faults where it can: a limit of file sizes acts as a full disk, a user without
rights as a read-only folder, an exit during the write as a killed process. The others are injected
at the n-th rename, flush or link: the file vanishes, the rename fails or is refused by Windows'
rules, another program writes the same files first. Nothing else is mocked.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import resource
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from damaged_files import sample

from hairloom.addon.blender.bakes.cache import Cache, CacheWriter, Facts
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.files import file_moves, subprocess_reader
from hairloom.addon.exchange.files.atomic import write_text_atomic
from hairloom.addon.exchange.files.file_set import atomic_file_set, back_up_foreign_files
from hairloom.addon.exchange.files.stale_temp_files import remove_stale_files
from hairloom.addon.exchange.hair_file import read_hair_file, write_hair_file
from hairloom.addon.exchange.tfxbone import strongest_bones, write_tfxbone
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.exchange.usd.groom_usd_read import read_usd

STRANDS = 300
GROOMS = [sample(STRANDS, seed) for seed in range(2)]
NOBODY = 65534
#: Folder of the files that verbs read, which are made once.
SOURCES = Path(tempfile.gettempdir()) / f"hairloom-fault-sources-{os.getpid()}"
#: the calls at which faults are injected
CALLS = (("replace", os), ("fsync", os), ("link", os))
FAULTS = ("full", "read-only", "killed", "vanishes", "fails", "another", "memory", "child")
WINDOWS = ("held", "held for a moment", "no links")


type Contents = dict[str, bytes]


class EndedError(BaseException):
    """The writing process was killed, so that nothing was tidied up."""


@dataclass(frozen=True)
class Verb:
    """write(path, version): one of two results. source: suffix of the file that it reads first, if
    any."""

    write: Callable[[Path, int], object]
    suffix: str
    source: str = ""


def _write_set(path: Path, version: int) -> None:
    with atomic_file_set(path) as folder:
        for name in (path.name, f"{path.stem}_base.png", f"{path.stem}.hairloom.json"):
            (folder / name).write_bytes(bytes([version]) * 50_000)
        back_up_foreign_files(folder, path, {f"{path.stem}_base.png", f"{path.stem}.hairloom.json"})


def _write_bake(path: Path, version: int) -> None:
    writer = CacheWriter(path)
    try:
        writer.add_constants({"value": np.full(1000, version)})
        for frame in (1, 2, 3):
            writer.add(frame, {"value": np.full(1000, version)}, "hair=00")
        writer.finish(Facts("Hair", 1, 3, 24.0, "numpy", "hair=00", "0.1.0"))
        writer.publish()
        writer.remove_previous()
    finally:
        writer.abandon()


def _write_bones(path: Path, version: int) -> None:
    weights = np.random.default_rng(version).random((STRANDS, 5))
    write_tfxbone(path, strongest_bones(tuple("abcde"), weights))


def _convert(read: Callable[[Path], Any], suffix: str) -> Callable[[Path, int], object]:
    def convert(path: Path, version: int) -> object:
        return write_hair_file(path, read(_source(suffix, version)).groom, uv=True)

    return convert


VERBS: dict[str, Verb] = {
    "export tfx": Verb(lambda path, version: write_tfx(path, GROOMS[version]), ".tfx"),
    "export bones": Verb(_write_bones, ".tfxbone"),
    "export hair": Verb(lambda p, version: write_hair_file(p, GROOMS[version], uv=True), ".hair"),
    "export alembic": Verb(lambda p, version: write_groom_alembic(p, GROOMS[version]), ".abc"),
    "export usd": Verb(lambda path, version: write_usd(path, GROOMS[version]), ".usdc"),
    "cards": Verb(_write_set, ".glb"),
    "report": Verb(lambda p, version: write_text_atomic(p, f"{version}" * 9999), ".json"),
    "bake": Verb(_write_bake, ""),
    "convert tfx": Verb(_convert(read_tfx, ".tfx"), ".hair", ".tfx"),
    "convert hair": Verb(_convert(read_hair_file, ".hair"), ".hair", ".hair"),
    "convert usd": Verb(_convert(read_usd, ".usdc"), ".hair", ".usdc"),
}
_SOURCES = {
    ".tfx": lambda path, version: write_tfx(path, GROOMS[version]),
    ".hair": lambda path, version: write_hair_file(path, GROOMS[version], uv=True),
    ".usdc": lambda path, version: write_usd(path, GROOMS[version]),
}


def _source(suffix: str, version: int) -> Path:
    """A file to read, made once."""
    path = SOURCES / f"{version}{suffix}"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        _SOURCES[suffix](path, version)
    return path


@dataclass
class Found:
    """Numbers of runs. broken: the fault interrupted the write; losses: neither the old result nor
    the new one; mixed: parts of both; untrue: a false message, or an error that is no
    HairloomError."""

    runs: int = 0
    broken: int = 0
    losses: int = 0
    mixed: int = 0
    untrue: int = 0


def fault_runs(count: int, seed: int) -> tuple[Found, list[str]]:
    """Run this many; also a line for each problem."""
    found, problems = Found(), list[str]()
    for verb in VERBS.values():
        for version in (0, 1):
            if verb.source:
                _source(verb.source, version)
    for number in range(count):
        random = np.random.default_rng([seed, number])
        name = list(VERBS)[number % len(VERBS)]
        faults = WINDOWS if number % 3 == 0 else FAULTS
        fault = faults[int(random.integers(len(faults)))]
        with tempfile.TemporaryDirectory() as folder:
            os.chmod(folder, 0o777)
            problem, is_broken = _run(VERBS[name], fault, Path(folder), random)
        found.runs += 1
        found.broken += is_broken
        if problem:
            kind, _, text = problem.partition(": ")
            setattr(found, kind, getattr(found, kind) + 1)
            problems.append(f"run {number}, {name}, {fault}: {text}")
    return found, problems


def _run(verb: Verb, fault: str, folder: Path, random: Any) -> tuple[str, bool]:
    """The problem, "" if none; and whether the fault interrupted the write."""
    path = folder / f"hair{verb.suffix}"
    results = []
    for version in (1, 0):  # the last one stays, as the old result
        verb.write(path, version)
        results.append(_contents(folder))
    new, old = results
    error = _write_with(verb, path, fault, random)
    if folder.is_dir():
        remove_stale_files(folder)  # as the next writer does
        if verb.suffix == "" and path.is_dir():
            CacheWriter(path).abandon()
    places = folder, SOURCES
    return judged(places, old, new, _contents(folder), error, is_second=fault == "another")


def judged(
    places: tuple[Path, ...],
    old: Contents,
    new: Contents,
    contents_after: Contents,
    error: BaseException | None,
    *,
    is_second: bool,
) -> tuple[str, bool]:
    """The problem, "" if none; and whether the fault interrupted the write.

    Args:
        places: paths, of which a message must name one.
        there: the files in the folder after the run.
        error: the exception that the run has raised, if any.
        is_second: whether another writer may have written last, so that its result is there.
    """
    kept_beside = {
        name: content
        for name, content in contents_after.items()
        if any(part.partition(".")[0].endswith(" new") for part in name.split(os.sep))
    }
    contents_after = {
        name: content for name, content in contents_after.items() if name not in kept_beside
    }
    if contents_after not in (old, new):
        kind = "mixed" if set(contents_after) == set(old) else "losses"
        return f"{kind}: {sorted(contents_after)} after {error!r}", True
    if error is None:
        is_fine = contents_after == new or is_second
        return ("" if is_fine else "losses: no error, and the old result"), False
    if isinstance(error, EndedError):
        return "", True
    if not isinstance(error, HairloomError):
        return f"untrue: {error!r} is no message", True
    return (
        f"untrue: {error}" if _is_untrue(error, contents_after == new, kept_beside, places) else ""
    ), True


def _is_untrue(
    error: HairloomError, is_new: bool, kept_beside: Contents, places: tuple[Path, ...]
) -> bool:
    """Whether a message is false, or has no remedy."""
    text = str(error)
    named = re.search(r"beside it (?:as|in) (.+?)\.?$", error.remedy)
    if named is not None:
        return named[1] not in {part for name in kept_beside for part in name.split(os.sep)}
    chosen = re.search(r"Choose (/.+?) as the folder", error.remedy)
    if chosen is not None:
        return Cache.find(Path(chosen[1])) is None
    is_placed = any(str(each) in text for each in places)
    return bool(kept_beside) or is_new or not error.remedy or not is_placed


def _write_with(verb: Verb, path: Path, fault: str, random: Any) -> BaseException | None:
    """Write the new result under a fault; the exception that was raised, if any."""
    at = int(random.integers(1, 7))
    try:
        with FAULT_MAKERS[fault](at, path, verb, random):
            verb.write(path, 1)
    except (Exception, EndedError) as error:
        return error
    return None


type Fault = Callable[[int, Path, Verb, Any], contextlib.AbstractContextManager[object]]


@contextlib.contextmanager
def _full(_at: int, path: Path, _verb: Verb, random: Any) -> Iterator[None]:
    sizes = [each.stat().st_size for each in path.parent.rglob("*") if each.is_file()]
    limit = int(random.integers(0, max(sizes)))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)


@contextlib.contextmanager
def _read_only(_at: int, path: Path, _verb: Verb, _random: Any) -> Iterator[None]:
    os.chmod(path.parent, 0o755)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@contextlib.contextmanager
def at_call(at: int, act: Callable[..., object]) -> Iterator[None]:
    """Call `act` before the n-th rename, flush or link."""
    left = [at]

    def watched(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            left[0] -= 1
            if left[0] == 0:
                act(*arguments)
            return real(*arguments, **options)

        return call

    with contextlib.ExitStack() as stack:
        for name, module in CALLS:
            stack.enter_context(mock.patch.object(module, name, watched(getattr(module, name))))
        yield


def _fails(
    at: int, _path: Path, _verb: Verb, _random: Any
) -> contextlib.AbstractContextManager[None]:
    def fail(*_: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    return at_call(at, fail)


def _vanishes(
    at: int, path: Path, _verb: Verb, _random: Any
) -> contextlib.AbstractContextManager[None]:
    def vanish(*_: object) -> None:
        hidden = [each for each in path.parent.rglob(".*.hl-*") if each.is_file()]
        for each in hidden:
            each.unlink()

    return at_call(at, vanish)


def _another(
    at: int, path: Path, verb: Verb, _random: Any
) -> contextlib.AbstractContextManager[None]:
    return at_call(at, lambda *_: verb.write(path, 0))


@contextlib.contextmanager
def _killed(at: int, path: Path, verb: Verb, _random: Any) -> Iterator[None]:
    """A child process writes and ends at that call without tidying up; the parent writes
    nothing."""
    child = os.fork()
    if child == 0:
        try:
            with at_call(at, lambda *_: os._exit(9)):
                verb.write(path, 1)
        finally:
            os._exit(0)
    _, status = os.waitpid(child, 0)
    raise EndedError(os.waitstatus_to_exitcode(status))
    yield


@contextlib.contextmanager
def _memory(at: int, _path: Path, _verb: Verb, _random: Any) -> Iterator[None]:
    """A reader runs out of memory."""
    real, left = np.fromfile, [at]

    def fromfile(*arguments: Any, **options: Any) -> Any:
        left[0] -= 1
        if not left[0]:
            raise MemoryError
        return real(*arguments, **options)

    with mock.patch.object(np, "fromfile", fromfile):
        yield


@contextlib.contextmanager
def _child(_at: int, _path: Path, _verb: Verb, _random: Any) -> Iterator[None]:
    """The reading subprocess is killed, as by a system that is short of memory."""
    ended = subprocess.CompletedProcess([], -9, b"", b"")
    with mock.patch.object(subprocess_reader, "run_child", lambda *_, **__: ended):
        yield


@contextlib.contextmanager
def _held(at: int, path: Path, _verb: Verb, random: Any) -> Iterator[None]:
    """Another program has one of the files open: Windows replaces neither it nor its folder."""
    files = sorted(each for each in path.parent.rglob("*") if each.is_file())
    held = files[int(random.integers(len(files)))]
    real = os.replace

    def replace(source: Any, target: Any) -> None:
        if held in (Path(source), Path(target)) or held.is_relative_to(Path(target)):
            raise PermissionError(errno.EACCES, "Access is denied", str(source), None, str(target))
        real(source, target)

    with mock.patch.object(os, "replace", replace):
        yield


@contextlib.contextmanager
def _held_for_a_moment(at: int, _path: Path, _verb: Verb, _random: Any) -> Iterator[None]:
    real, left = os.replace, [at]

    def replace(source: Any, target: Any) -> None:
        if left[0]:
            left[0] -= 1
            raise PermissionError(errno.EACCES, "Access is denied", str(source), None, str(target))
        real(source, target)

    with (
        mock.patch.object(file_moves, "MAX_WAIT", 10.0),
        mock.patch.object(file_moves, "_PAUSE", 0.0005),
        mock.patch.object(os, "replace", replace),
    ):
        yield


@contextlib.contextmanager
def _no_links(_at: int, _path: Path, _verb: Verb, _random: Any) -> Iterator[None]:
    def link(*_: object, **__: object) -> None:
        raise OSError(errno.EPERM, "no links here")

    with mock.patch.object(os, "link", link):
        yield


FAULT_MAKERS: dict[str, Fault] = {
    "full": _full,
    "read-only": _read_only,
    "killed": _killed,
    "vanishes": _vanishes,
    "fails": _fails,
    "another": _another,
    "memory": _memory,
    "child": _child,
    "held": _held,
    "held for a moment": _held_for_a_moment,
    "no links": _no_links,
}


def _contents(folder: Path) -> dict[str, bytes]:
    """The visible files, and of a bake the arrays of its frames."""
    contents = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir() and (path / "cache.json").is_file():
            cache = Cache(path)
            arrays = [cache.constants(), *(cache.frame(frame) for frame in (1, 2, 3))]
            contents[path.name] = repr([set(each["value"].tolist()) for each in arrays]).encode()
        elif path.is_dir():
            for file in path.rglob("*"):
                if file.is_file():
                    contents[str(file.relative_to(folder))] = file.read_bytes()
        else:
            contents[path.name] = _content(path)
    return contents


def _content(path: Path) -> bytes:
    """A file's bytes; of Alembic files, which contain a date, the size."""
    return str(path.stat().st_size).encode() if path.suffix == ".abc" else path.read_bytes()


def forget_sources() -> None:
    shutil.rmtree(SOURCES, ignore_errors=True)
