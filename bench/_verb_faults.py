"""Seeded faults while verbs run as users call them: `hairloom VERB ...`, in a Blender without a
window.

The faults are those of `_fault_runs`, but a process that is killed, and another one that writes the
same files, are separate Blenders. Two more faults are the GPU's: there is no driver, or its memory
is full. A verb's message is the line that it prints; a failure without one counts as untrue.

    _verb_faults.py VERB PATH VERSION NUMBER    run a verb and end at its NUMBERth call
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

from extension_loader import load_package

hairloom = load_package()

import bpy  # noqa: E402
import gpu  # noqa: E402
import numpy as np  # noqa: E402
from _fault_runs import (  # noqa: E402
    FAULT_MAKERS,
    WINDOWS,
    Contents,
    EndedError,
    Fault,
    Found,
    at_call,
    judged,
)

from hairloom.addon.blender.bakes.cache import Cache  # noqa: E402
from hairloom.addon.blender.base import gpu_context  # noqa: E402
from hairloom.addon.blender.base.report import Report  # noqa: E402
from hairloom.addon.blender.command_line import command_line  # noqa: E402
from hairloom.addon.blender.properties import presets  # noqa: E402
from hairloom.addon.blender.scene.curves import write_curves  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic  # noqa: E402
from hairloom.addon.exchange.files.stale_temp_files import remove_stale_files  # noqa: E402
from hairloom.addon.exchange.groom import Groom  # noqa: E402
from hairloom.addon.exchange.tressfx import write_tfx  # noqa: E402
from hairloom.addon.exchange.usd.groom_usd import write_usd  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

#: Files that verbs read, made once, and shared with child processes.
_HANDED_ON = "HAIRLOOM_FAULT_SOURCES"
SOURCES = Path(
    os.environ.get(_HANDED_ON)
    or Path(tempfile.gettempdir()) / f"hairloom-verb-sources-{os.getpid()}"
)
#: strands of the two results
COUNTS = (30, 40)
_SMALL = (
    "--set=guides.guide_count=12",
    "--set=children.method=none",
    "--set=dynamics.device=numpy",
)
_CARDS = ("--set=cards.card_count=12", "--set=cards.levels=1", "--set=atlas.size=512")
_PICTURE = ("--width", "32", "--height", "32", "--samples", "1", *_SMALL)
WRITING = ("full", "read-only", "killed", "vanishes", "fails", "another")
GPU = ("no gpu", "gpu memory")
DRAWING = (*WRITING, *GPU)


@dataclass(frozen=True)
class Verb:
    """arguments: the command line that writes one of two results to a path.

    prepares: creates files that must exist before it runs, if any.
    """

    arguments: Callable[[Path, int], list[str]]
    suffix: str
    faults: tuple[str, ...] = WRITING
    prepares: Callable[[Path, int], object] = lambda _path, _version: None

    def write(self, path: Path, version: int) -> None:
        """Raises:
        HairloomError: the verb's message.
        """
        self.prepares(path, version)
        run_verb(self.arguments(path, version))


def run_verb(arguments: list[str]) -> None:
    """Run a verb; raise the error whose message it prints."""
    failures: list[HairloomError] = []
    output = io.StringIO()

    def fail(_report: Report, error: HairloomError) -> None:
        failures.append(error)

    with (
        mock.patch.object(Report, "fail", fail),
        _quiet(),
        contextlib.redirect_stderr(output),
    ):
        code = command_line.run(arguments)
    if code == 0:
        assert not output.getvalue(), f"it is done, and says: {output.getvalue()}"
        return
    (error,) = failures
    assert f"hairloom: {error}\n" in output.getvalue(), "it does not say why"
    raise error


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Discard what Blender prints: written to a file, it could hit the size limit that acts as a
    full disk, which ends Blender."""
    sys.stdout.flush()
    old_stdout, null_file = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null_file, 1)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(old_stdout, 1)
        os.close(old_stdout)
        os.close(null_file)


def _groom(version: int, suffix: str = ".tfx") -> str:
    return str(SOURCES / f"{version}{suffix}")


def _scene(version: int) -> str:
    return str(SOURCES / f"{version}.blend")


def _hair(version: int) -> list[str]:
    return ["--groom", _groom(version), "--head", str(SOURCES / "head.obj")]


def _into(path: Path) -> list[str]:
    return ["--output", str(path)]


def _export(suffix: str, *faults: str) -> Verb:
    return Verb(
        lambda path, version: ["export", "--scene", _scene(version), *_into(path)],
        suffix,
        (*WRITING, *faults),
    )


def _import(suffix: str) -> Verb:
    def arguments(path: Path, version: int) -> list[str]:
        scene = ["--scene", _scene(0), "--head", "Head"]
        return ["import", _groom(version, suffix), *scene, *_into(path)]

    return Verb(arguments, ".blend", (*WRITING, "child" if suffix != ".tfx" else "memory"))


def _over_itself(path: Path, _version: int) -> None:
    """Put the artist's scene at the path, for a verb that overwrites it."""
    if not path.exists():
        shutil.copy(_scene(0), path)


VERBS: dict[str, Verb] = {
    "grow": Verb(
        lambda path, version: [
            "grow",
            *("--scene", _scene(0), "--head", "Head", "--name", f"New {version}"),
            *(f"--set=grow.strand_count={COUNTS[version]}", "--set=grow.method=normals"),
            *_into(path),
        ],
        ".blend",
    ),
    "import tfx": _import(".tfx"),
    "import alembic": _import(".abc"),
    "import usd": _import(".usdc"),
    "run": Verb(
        lambda path, version: [
            *("run", "apply_preset", "--scene", str(path), "--object", "Hair"),
            *(f"--set=name=looks/{('blond', 'black')[version]}", "--save"),
        ],
        ".blend",
        prepares=_over_itself,
    ),
    "run make_cards": Verb(
        lambda path, version: [
            *("run", "make_cards", "--scene", _scene(version), "--object", "Hair"),
            *(*_CARDS, *_into(path)),
        ],
        ".blend",
        DRAWING,
    ),
    "simulate": Verb(
        lambda path, version: [
            *("simulate", *_hair(version), "--seconds", "0.1", "--frame-rate", "30"),
            *(*_SMALL, *_into(path)),
        ],
        "",
        (*WRITING, "memory"),
    ),
    "bake": Verb(
        lambda path, version: [
            *("bake", "--scene", _scene(version), "--object", "Hair", *_SMALL, *_into(path))
        ],
        "",
    ),
    "render": Verb(
        lambda path, version: ["render", *_hair(version), *_PICTURE, *_into(path)], ".png", DRAWING
    ),
    "turntable": Verb(
        lambda path, version: [
            *("turntable", *_hair(version), "--frames", "3", *_PICTURE, *_into(path))
        ],
        "",
        DRAWING,
    ),
    "sheet": Verb(
        lambda path, version: ["sheet", *_hair(version), *_PICTURE, *_into(path)], ".png", DRAWING
    ),
    "export tfx": _export(".tfx"),
    "export hair": _export(".hair"),
    "export alembic": _export(".abc"),
    "export usd": _export(".usdc"),
    "cards": Verb(
        lambda path, version: ["cards", *_hair(version), *_CARDS, *_SMALL, *_into(path)],
        ".glb",
        DRAWING,
    ),
    "save preset": Verb(
        lambda _path, version: [
            *("run", "save_preset", "--scene", _scene(version), "--object", "Hair"),
            *("--set=title=Mine", f"--set=shading.primary_strength={version + 1}"),
        ],
        ".json",
    ),
}


def make_sources() -> None:
    """Scenes, grooms and a head."""
    SOURCES.mkdir(exist_ok=True)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=24, ring_count=12)
    head = bpy.context.object
    head.name = "Head"
    bpy.ops.wm.obj_export(filepath=str(SOURCES / "head.obj"))
    bpy.context.scene.frame_end = 3
    for version, count in enumerate(COUNTS):
        outward = np.random.default_rng(version).normal(size=(count, 3))
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        points = outward[:, None] * np.linspace(0.1, 0.18, 8)[:, None]
        offsets, radius = np.arange(count + 1) * 8, np.full(count * 8, 5.0e-5)
        strands = StrandSet(points.reshape(-1, 3), offsets, radius, np.zeros(count, np.int32))
        groom = Groom(strands)
        write_tfx(SOURCES / f"{version}.tfx", groom)
        write_groom_alembic(SOURCES / f"{version}.abc", groom)
        write_usd(SOURCES / f"{version}.usdc", groom)
        hair = write_curves("Hair", strands, head, bpy.context.collection)
        hair.data.hairloom.children.method = "none"
        bpy.ops.wm.save_as_mainfile(filepath=_scene(version), copy=True)
        bpy.data.hair_curves.remove(hair.data)


def verb_fault_runs(count: int, seed: int) -> tuple[Found, list[str]]:
    """Run this many; also a line for each problem."""
    hairloom.register()
    os.environ[_HANDED_ON] = str(SOURCES)
    found, problems = Found(), list[str]()
    try:
        make_sources()
        for number in range(count):
            random = np.random.default_rng([seed, number])
            name = list(VERBS)[number % len(VERBS)]
            faults = WINDOWS if random.random() < 1.0 / 3.0 else VERBS[name].faults
            fault = faults[int(random.integers(len(faults)))]
            problem, is_broken = _run(name, fault, random)
            found.runs += 1
            found.broken += is_broken
            if problem:
                kind, _, text = problem.partition(": ")
                setattr(found, kind, getattr(found, kind) + 1)
                problems.append(f"run {number}, {name}, {fault}: {text}")
    finally:
        shutil.rmtree(SOURCES, ignore_errors=True)
        hairloom.unregister()
    return found, problems


def _run(name: str, fault: str, random: Any) -> tuple[str, bool]:
    """The problem, "" if none; and whether the fault interrupted the write."""
    verb, at = VERBS[name], int(random.integers(1, 7))
    old, new = _result(name, 0), _result(name, 1, fault == "no gpu")
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        shutil.copytree(old, folder, dirs_exist_ok=True)
        os.chmod(folder, 0o777)
        path, error = folder / f"hair{verb.suffix}", None
        with mock.patch.object(presets, "own_folder", lambda: folder):
            try:
                with _FAULTS[fault](at, path, Running(name), random):
                    verb.write(path, 1)
            except (Exception, EndedError) as raised:
                error = raised
        for each in (folder, path):
            if each.is_dir():
                remove_stale_files(each)  # as the next writer does
        contents_after = contents(folder)
        places = folder, SOURCES, Path(tempfile.gettempdir())
        if fault in GPU:
            places = (Path("render"),)  # no file is at fault
        results = contents(old), contents(new)
        return judged(places, *results, contents_after, error, is_second=fault == "another")


@functools.cache
def _result(name: str, version: int, is_refused: bool = False) -> Path:
    """A folder with a verb's result without faults; without a GPU, cards are made differently, and
    files that need drawing are missing."""
    verb, folder = VERBS[name], SOURCES / f"{name} {version} {is_refused}"
    folder.mkdir()
    path = folder / f"hair{verb.suffix}"
    with contextlib.ExitStack() as stack:
        stack.enter_context(mock.patch.object(presets, "own_folder", lambda: folder))
        if is_refused:
            stack.enter_context(_no_gpu(0, path, Running(name), None))
            stack.enter_context(contextlib.suppress(HairloomError))
        verb.write(path, version)
    return folder


def contents(folder: Path) -> Contents:
    """The visible files: of bakes a digest of their arrays, of scenes a summary of their data, of
    files that contain a date the size."""
    found: Contents = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        is_hidden = any(part.startswith((".", "frames-hl-")) for part in Path(name).parts)
        if is_hidden or not path.is_file() or path.suffix == ".blend1":
            continue
        if path.name == "cache.json":
            found[name] = _of_bake(path.parent)
        elif path.suffix == ".blend":
            found[name] = _of_scene(path)
        elif path.suffix in (".abc", ".mp4", ".exr"):
            found[name] = str(path.stat().st_size).encode()
        else:
            found[name] = path.read_bytes()
    return found


def _of_bake(folder: Path) -> bytes:
    cache, digest = Cache(folder), hashlib.sha256()
    frames = range(cache.facts.first, cache.facts.last + 1)
    for arrays in (cache.constants(), *(cache.frame(frame) for frame in frames)):
        for name in sorted(arrays):
            digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.digest()


def _of_scene(path: Path) -> bytes:
    """A summary of a scene's data, or the error if a truncated file cannot be opened."""
    with bpy.data.temp_data() as data, tempfile.TemporaryDirectory() as folder:
        copy = shutil.copy(path, folder)  # Blender cannot load from the file that is open
        try:
            with data.libraries.load(str(copy)) as (there, here):
                here.objects = there.objects
        except OSError as error:
            return str(error).encode()
        hair = [(each.name, len(each.curves), _look(each)) for each in data.hair_curves]
        meshes = [(each.name, len(each.vertices), len(each.uv_layers)) for each in data.meshes]
        names = [each.name for each in data.objects]
        return repr((sorted(names), sorted(hair), sorted(meshes))).encode()


def _look(curves: bpy.types.Curves) -> list[float]:
    return [round(value, 5) for value in curves.hairloom.shading.base_color]


@dataclass(frozen=True)
class Running:
    """A verb, for the faults that run it a second time."""

    name: str

    def apart(self, path: Path, version: int, at: int) -> subprocess.CompletedProcess[bytes]:
        """Run it in another Blender."""
        command = [sys.executable, __file__, self.name, str(path), str(version), str(at)]
        return subprocess.run(command, capture_output=True, check=False)


@contextlib.contextmanager
def _killed(at: int, path: Path, verb: Any, _random: Any) -> Iterator[None]:
    raise EndedError(verb.apart(path, 1, at).returncode)
    yield


def _another(
    at: int, path: Path, verb: Any, _random: Any
) -> contextlib.AbstractContextManager[None]:
    return at_call(at, lambda *_: verb.apart(path, 0, 0))


@contextlib.contextmanager
def _no_gpu(_at: int, _path: Path, _verb: Any, _random: Any) -> Iterator[None]:
    nothing = {"backend": "", "renderer": "", "driver": ""}
    with (
        mock.patch.object(gpu_context, "gpu_info", lambda: nothing),
        mock.patch.object(gpu_context, "can_draw", lambda: False),
    ):
        yield


@contextlib.contextmanager
def _gpu_memory(at: int, _path: Path, _verb: Any, _random: Any) -> Iterator[None]:
    """From the n-th texture or target on, GPU memory is full."""
    left = [at]

    def refusing(real: Callable[..., Any]) -> Callable[..., Any]:
        def make(*arguments: Any, **options: Any) -> Any:
            left[0] -= 1
            if left[0] <= 0:
                raise RuntimeError("gpu.offscreen.new(...) failed with 'GPU out of memory'")
            return real(*arguments, **options)

        return make

    with contextlib.ExitStack() as stack:
        for name in ("GPUTexture", "GPUOffScreen"):
            real = getattr(gpu.types, name)
            stack.enter_context(mock.patch.object(gpu.types, name, refusing(real)))
        yield


_FAULTS: dict[str, Fault] = FAULT_MAKERS | {
    "killed": _killed,
    "another": _another,
    "no gpu": _no_gpu,
    "gpu memory": _gpu_memory,
}


def _main(name: str, path: str, version: str, at: str) -> int:
    hairloom.register()
    folder = Path(path).parent
    with (
        mock.patch.object(presets, "own_folder", lambda: folder),
        at_call(int(at), lambda *_: os._exit(9)),
    ):
        VERBS[name].write(Path(path), int(version))
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
