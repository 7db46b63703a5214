"""How long the program of dynamics takes to compile, beside the programs that draw hair.

Each scene is compiled in its own process, without the cache of Mesa's drivers. A time is the
processor time, of all threads, of the first dispatch less that of the second. The reference is
measured in the same way in that process: the first picture of a ball of hair as the preview draws
it at rest, with its shading, layers and deep maps, less the second picture. Limits are for a
software driver; on a GPU, seconds are only reported. Exit code 1: a limit is missed.

make bench NAME=compile             a minute
tools/bench.py compile head         some scenes (head, plate, fields)
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from _report import report
from _report import start as start_bench
from extension_loader import REPOSITORY

from hairloom.addon.blender.sessions.prepared_groom import prepare_groom
from hairloom.addon.blender.sessions.snapshots import snapshot_of
from hairloom.addon.blender.setup.benchmark import hair_ball
from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
)
from hairloom.addon.dynamics.force_fields import (
    NO_FIELDS,
    Falloff,
    ForceField,
    ForceFields,
)
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.render.accumulation import Target
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.dynamics_pass import DynamicsPass
from hairloom.addon.render.strand_layers import is_software
from hairloom.addon.render.strand_pass import StrandPass, ViewState
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.lights import three_point_lights

REFERENCE = "the programs of a picture of hair at rest, compiled in the same process"
GUIDES, CVS, STRANDS, WIDTH, HEIGHT = 40, 16, 200, 64, 36
GRAVITY, FRAME = np.array([0.0, 0.0, -9.81]), 1.0 / 60.0
#: scene -> upper limit of its ratio, 1.5 times the median of three runs under other load
LIMITS = {"head": 2.0, "plate": 3.5, "fields": 1.6}
#: argument of a process that measures one scene
_ONE = "--one"
_ABOVE = {"center": (0.05, -0.1, 0.35), "axis": (0.48, 0.6, 0.64)}
_FIELDS = (
    ForceField("wind", **_ABOVE, strength=12.0, shape="plane", flow=1.0, across_fraction=1.0),
    ForceField("wind", strength=-6.0, falloff="tube", radial=Falloff(0.5, 0.02, 0.3)),
    ForceField("force", **_ABOVE, strength=8.0, distance=Falloff(1.7, 0.1, 0.5), side=-1),
    ForceField("force", strength=5.0, falloff="cone", radial=Falloff(0.4, 10.0, 60.0)),
    ForceField("vortex", **_ABOVE, strength=9.0, shape="plane"),
    ForceField("magnet", **_ABOVE, strength=30.0, shape="line"),
    ForceField("harmonic", **_ABOVE, strength=60.0, damping=0.2, size=0.1),
    ForceField("turbulence", **_ABOVE, strength=9.0, size=0.2),
    ForceField("drag", **_ABOVE, strength=2.0, damping=1.5, distance=Falloff(1.0)),
)


@dataclass(frozen=True)
class Scene:
    colliders: tuple[Collider, ...] = ()
    force_fields: ForceFields = NO_FIELDS


def main(arguments: list[str]) -> int:
    if arguments[:1] == [_ONE]:
        print(json.dumps(compiled(SCENES[arguments[1]]())))
        return 0
    start_bench()
    found: dict[str, float] = {}
    for name in arguments or SCENES:
        seconds, reference = in_own_process(name)
        found |= {
            f"{name}_seconds": seconds,
            f"{name}_reference_seconds": reference,
            f"{name}_ratio": seconds / reference,
        }
    limits = (
        {f"{name}_ratio": max_ratio for name, max_ratio in LIMITS.items()} if is_software() else {}
    )
    return report(found, REFERENCE, max_limits=limits)


def in_own_process(name: str) -> tuple[float, float]:
    """Seconds of a scene's program and of the reference, by a driver that has compiled neither."""
    command = [sys.executable, str(REPOSITORY / "tools" / "bench.py"), "compile", _ONE, name]
    environment = os.environ | {"MESA_SHADER_CACHE_DISABLE": "true"}
    done = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True)
    seconds, reference = json.loads(done.stdout.splitlines()[-1])
    return seconds, reference


def compiled(scene: Scene) -> tuple[float, float]:
    start_bench()
    reference = first_of(_picture())
    return first_of(_frames(scene)), reference


def first_of(work: Callable[[], None]) -> float:
    """The seconds by which the first run takes longer than the second."""
    times = []
    for _ in range(2):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return times[0] - times[1]


def _picture() -> Callable[[], None]:
    """A function that draws a ball of hair and reads it back."""
    rig = hair_ball(STRANDS)
    snapshot = snapshot_of(prepare_groom(rig, AmbientSettings(), with_occluders=False))
    points = rig.strands.points
    box = points.min(axis=0), points.max(axis=0)
    camera = frame_camera(box, (0.0, -1.0, 0.2), 0.5, WIDTH / HEIGHT)
    strands, target = StrandPass(), Target()

    def draw() -> None:
        lit = replace(snapshot, lights=three_point_lights(camera.view))
        target.sized(WIDTH, HEIGHT).clear((0.0, 0.0, 0.0, 0.0))
        with target.drawing():
            strands.draw(lit, camera, WIDTH, HEIGHT, view=ViewState("compile"))
        target.color.read()

    return draw


def _frames(scene: Scene) -> Callable[[], None]:
    """A function that simulates a frame of guides on a ball that turns with its colliders."""
    out = np.random.default_rng(GUIDES).normal([0.0, 0.0, 1.5], 1.0, (GUIDES, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    grid = (out[:, None] * np.linspace(0.1, 0.3, CVS)[:, None]).astype(np.float32)
    turned = np.eye(4)
    turned[:2, :2] = [[np.cos(0.02), -np.sin(0.02)], [np.sin(0.02), np.cos(0.02)]]
    after = (grid @ turned[:3, :3].T).astype(np.float32)
    colliders = tuple(PosedCollider(each, np.eye(4), turned) for each in scene.colliders)
    drive = Drive(grid, after, colliders, GRAVITY, force_fields=scene.force_fields)
    dynamics = DynamicsPass(start(grid))

    def advance() -> None:
        dynamics.advance(drive, DynamicsSettings(), FRAME)
        dynamics.read()

    return advance


def head() -> Scene:
    """A box as large as a head, as a distance field."""
    return Scene((_box_field((0.095, 0.095, 0.095), (0.0, 0.0, 0.0), 0.01),))


def plate() -> Scene:
    """A plate of 8 mm that stands in the hair, and a finger so thin that segments touch it."""
    finger = CapsuleCollider(np.array([-0.2, 0.1, 0.2]), np.array([0.2, 0.12, 0.24]), 0.006)
    return Scene((_box_field((0.1, 0.004, 0.05), (0.0, -0.06, 0.22), 0.005), finger))


def fields() -> Scene:
    """Force fields of all kinds."""
    permutation = np.random.default_rng(3).permutation(256)
    return Scene(force_fields=ForceFields(_FIELDS, permutation))


def _box_field(half: tuple[float, ...], centre: tuple[float, ...], cell: float) -> DistanceField:
    axes = [np.arange(-each - 3 * cell, each + 3 * cell, cell) for each in half]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    away = np.abs(nodes) - np.array(half)
    outside = np.linalg.norm(np.maximum(away, 0.0), axis=-1)
    values = outside + np.minimum(away.max(axis=-1), 0.0)
    return DistanceField(values, nodes[0, 0, 0] + np.array(centre), cell)


SCENES: dict[str, Callable[[], Scene]] = {"head": head, "plate": plate, "fields": fields}

sys.exit(main(sys.argv[1:]))
