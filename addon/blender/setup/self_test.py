"""A short test of everything Hairloom needs of this machine, for the Preferences page."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import numpy as np

from ... import rig_flow
from ...arrays import Floats
from ...exchange.tressfx import read_tfx, write_tfx
from ...groom.settings import GuideSettings
from ...refine.settings import DetailSettings
from ...render.camera import frame_camera
from ...render.capabilities import capabilities
from ...render.frame import render_image
from ...rig_flow import Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.lights import three_point_lights
from ...shading.settings import ShadingSettings
from ...shading.volume.settings import VolumeSettings
from ...strands import StrandSet
from ..base.gpu_context import ensure_gpu
from ..base.images import write_png
from ..base.report import environment
from ..sessions.prepared_groom import prepare_groom
from ..sessions.snapshots import snapshot_of
from ..sessions.solvers import compute_problem

type Outcome = Literal["passed", "absent", "failed"]

_PICTURE_SIZE = 96
_DIRECTION, _FIELD_OF_VIEW = (0.0, -1.0, 0.0), 0.5
#: package -> what it is needed for
_PACKAGES = {
    "OpenImageIO": "textures of 16 bits and EXR",
    "etcpak": "textures as BC7 in DDS",
    "pxr": "grooms as USD",
    "alembic3d": "grooms as Alembic",
}


@dataclass(frozen=True)
class Check:
    """What one check found.

    outcome: "absent" if something is missing that Hairloom can do without.
    """

    name: str
    outcome: Outcome
    text: str


_last_results: tuple[Check, ...] = ()


def last_report() -> tuple[Check, ...]:
    """The results of the last self-test; empty before the first."""
    return _last_results


def report_text() -> str:
    """The machine and the results of the last self-test as plain text."""
    lines = [f"{name}: {value or 'none'}" for name, value in environment().items()]
    return "\n".join([*lines, *(f"{c.outcome}  {c.name}: {c.text}" for c in _last_results)]) + "\n"


def run() -> tuple[Check, ...]:
    """Run all checks one after the other; takes a few seconds."""
    global _last_results
    ensure_gpu()
    _last_results = tuple(_checks())
    return _last_results


def _checks() -> Iterator[Check]:
    yield _check_compute()
    yield _run_check("GPU", _check_limits)
    yield _check_atomics()
    for name, settings in _looks().items():
        yield _run_check(f"Drawing, {name}", partial(_check_drawing, *settings))
    yield _run_check("Files", _check_files)
    for package, use in _PACKAGES.items():
        yield _check_package(package, use)


def _run_check(name: str, check: Callable[[], str]) -> Check:
    """Run a check; an exception of any kind is its failure."""
    try:
        return Check(name, "passed", check())
    except Exception as error:
        return Check(name, "failed", f"{type(error).__name__}: {error}")


def _check_compute() -> Check:
    """Whether motion on the GPU equals numpy's, see `solvers`; otherwise the CPU is used."""
    problem = compute_problem()
    name = "Simulation on the GPU"
    if problem:
        return Check(name, "absent", f"{problem}; the CPU simulates")
    return Check(name, "passed", "the same motion as by numpy")


def _check_limits() -> str:
    """The capabilities of the GPU that passes need; a missing texture format is a failure."""
    found = capabilities()
    if found.missing_formats:
        raise RuntimeError(
            f"textures of these formats are missing: {', '.join(found.missing_formats)}"
        )
    if found.dispatch_ms is None:
        raise RuntimeError("a small compute shader writes wrong values")
    groups = " x ".join(map(str, found.group_size))
    return (
        f"textures of {found.texture_size:,} texels and {found.texture_layers:,} layers, groups of "
        f"{groups}, {found.dispatch_ms:.1f} ms for a small dispatch; {found.probe_ms:.0f} ms to "
        "find out"
    )


def _check_atomics() -> Check:
    """Whether image atomics work, for lists of strands per pixel; else they are drawn hashed."""
    name, problem = "Image atomics", capabilities().atomics_problem
    if problem:
        return Check(name, "absent", f"{problem}; strands are drawn as Hashed")
    return Check(name, "passed", "all fragments were counted")


def _looks() -> dict[str, tuple[ShadingSettings, VolumeSettings]]:
    """Shading and shadows that each have their own shaders, by name."""
    plain = VolumeSettings(shadows="none")
    return {
        "Kajiya-Kay": (ShadingSettings(model="kajiya_kay"), plain),
        "Marschner": (ShadingSettings(model="marschner"), plain),
        "shadows": (ShadingSettings(model="marschner"), VolumeSettings(shadows="deep")),
    }


def _check_drawing(shading: ShadingSettings, volume: VolumeSettings) -> str:
    """Draw a brush of hair: it must be visible and finite, and leave the corners clear."""
    rig = _brush()
    snapshot = replace(
        snapshot_of(prepare_groom(rig, AmbientSettings(), with_occluders=False)),
        shading=shading,
        volume=volume,
        detail=DetailSettings(lod_size=0.0),
    )
    points = rig.strands.points
    box = points.min(axis=0), points.max(axis=0)
    camera = frame_camera(box, _DIRECTION, _FIELD_OF_VIEW, 1.0)
    lit = replace(snapshot, lights=three_point_lights(camera.view))
    return _check_picture(
        render_image(lit, camera, _PICTURE_SIZE, _PICTURE_SIZE, 1, background=(0.0, 0.0, 0.0, 0.0))
    )


def _check_picture(picture: Floats) -> str:
    alpha = picture[..., 3]
    covered = float((alpha > 0.5).mean())
    if not np.isfinite(picture).all():
        raise RuntimeError("the picture has values that are not numbers")
    if not 0.05 < covered < 0.95 or alpha[0, 0] > 0.0:
        raise RuntimeError(f"hair covers {covered:.0%} of the picture")
    if picture[..., :3].max() <= 0.0:
        raise RuntimeError("the hair is black")
    return f"hair covers {covered:.0%} of the picture"


def _brush() -> Rig:
    """Straight strands side by side, 10 cm long, in a bundle as wide as a finger."""
    across, along = np.linspace(-0.02, 0.02, 64), np.linspace(0.0, 0.1, 8)
    points = np.zeros((len(across), len(along), 3))
    points[..., 0], points[..., 2] = across[:, None], along
    strands = StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(len(across) + 1) * len(along),
        radius=np.full(points.shape[0] * points.shape[1], 4.0e-4),
        group=np.zeros(len(across), np.int32),
    )
    return rig_flow.prepare(strands, None, GuideSettings(), place="the self-test")


def _check_files() -> str:
    """Write a groom and a picture to the folder for temporary files, and read the groom again."""
    strands = _brush().strands
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "groom.tfx"
        write_tfx(path, strands)
        read = read_tfx(path).strands
        write_png(Path(folder) / "picture.png", np.ones((4, 4, 4), np.float32))
        if not (Path(folder) / "picture.png").stat().st_size:
            raise RuntimeError("the picture that was written is empty")
    apart = float(np.abs(read.points - strands.points).max())
    if apart > 1.0e-5:
        raise RuntimeError(f"a groom was read back {apart:.2g} m off")
    return "a groom and a picture written, the groom read again"


def _check_package(name: str, use: str) -> Check:
    """Look for a package, but do not load it: a second build of a library may crash the process."""
    if find_spec(name) is None:
        return Check(name, "absent", f"not here: no {use}")
    return Check(name, "passed", use)
