"""How deep guides enter colliders, between their points too, and how many pass through.

Depths are measured at the triangles of the collider at that moment, not in its distance field,
which the simulation uses. Every guide is sampled densely along its segments; samples that are
inside at rest do not count. Exit code 1: a limit is missed.

make bench NAME=contacts
tools/bench.py contacts thin compute     some parts (thin, sintel, built_in), on the GPU
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from _cards_groom import sintel_rig
from _report import chosen, report
from _report import start as start_bench
from _simulations import ComputeSimulation, NumpySimulation, Simulation, has_compute
from shaken import GRAVITY

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.blender.command_line.simulate_job import shake_matrix
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
)
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.groom.face_hair import grow_with_face
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import closest_point

REFERENCE = "the triangles of the colliders"
FPS, SAMPLES = 60.0, 6
#: guides that pass through thin solids; depth in a head [mm]
MAX_LIMITS = {"*_passed": 0, "*_demo_depth_worst_mm": 0.5, "*_fast_depth_worst_mm": 1.0}
#: Speeds of thin solids [m/s].
SPEEDS = (1.0, 2.0, 2.8, 4.0, 5.6)
#: A head at 5 Hz and 5.6 m/s.
FAST_RATE, FAST_SWAY = 5.0, 0.178
Motion = Callable[[float], np.ndarray]


@dataclass
class Depths:
    """The worst of all frames: depths of samples outside at rest [mm], and percentages of
    guides."""

    surface: Surface
    field: DistanceField
    inside_at_rest: np.ndarray
    worst: dict[str, float] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, grid: np.ndarray, surface: Surface) -> Depths:
        points = dense(grid)
        field = DistanceField.from_surface(surface, DynamicsSettings())
        depth = depth_in(points.reshape(-1, 3), surface, field).reshape(points.shape[:2])
        return cls(surface, field, depth > 0.0)

    def note(self, grid: np.ndarray, matrix: np.ndarray) -> None:
        """Add a frame of guides (n, cv_count, 3); `matrix` moves the collider from rest."""
        local = moved(np.linalg.inv(matrix), dense(grid))
        depth = depth_in(local.reshape(-1, 3), self.surface, self.field).reshape(local.shape[:2])
        depth[self.inside_at_rest] = 0.0
        at_points = depth[:, ::SAMPLES]
        for name, value in (
            ("depth_worst_mm", 1000.0 * depth.max()),
            ("depth_of_points_mm", 1000.0 * at_points.max()),
            ("inside_percent", 100.0 * (depth > 1.0e-5).any(axis=1).mean()),
            ("inside_1mm_percent", 100.0 * (depth > 1.0e-3).any(axis=1).mean()),
        ):
            self.worst[name] = max(self.worst.get(name, 0.0), float(value))


def dense(grid: np.ndarray) -> np.ndarray:
    """Points evenly along the free segments, (n, m, 3); every SAMPLES-th is a CV."""
    free = grid[:, 1:]
    fraction = np.linspace(0.0, 1.0, SAMPLES, endpoint=False)[:, None]
    between = free[:, :-1, None] * (1.0 - fraction) + free[:, 1:, None] * fraction
    return np.concatenate([between.reshape(len(grid), -1, 3), free[:, -1:]], axis=1)


def depth_in(points: np.ndarray, surface: Surface, field: DistanceField) -> np.ndarray:
    """The exact depth [m] of points (n, 3) in a closed mesh; 0 outside.

    The field only preselects points: it places points inside the mesh at most half a cell's
    diagonal outside.
    """
    rough, _ = field.distance(np.ascontiguousarray(points.T, np.float32))
    within = np.flatnonzero(rough < field.cell)
    depth = np.zeros(len(points))
    if within.size:
        inside = within[np.abs(winding_number(points[within], surface)) > 0.5]
        if inside.size:
            depth[inside] = closest_point(points[inside], surface).distance
    return depth


def moved(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def demo_shake(centre: np.ndarray) -> Motion:
    return lambda time: shake_matrix(centre, time)


def fast_shake(centre: np.ndarray) -> Motion:
    """5 Hz: a turn by 10 degrees, and a sway that reaches 5.6 m/s."""

    def matrix(time: float) -> np.ndarray:
        ease = min(time / 0.25, 1.0)
        result = shake_matrix(centre, time * FAST_RATE)
        angle = ease * np.radians(10.0) * np.sin(2.0 * np.pi * FAST_RATE * time)
        cosine, sine = np.cos(angle), np.sin(angle)
        result = np.eye(4)
        result[:2, :2] = [[cosine, -sine], [sine, cosine]]
        result[:3, 3] = centre - result[:3, :3] @ centre
        result[0, 3] += ease * FAST_SWAY * np.sin(2.0 * np.pi * FAST_RATE * time)
        return result

    return matrix


def shaken(
    rig: Rig, motion: Motion, seconds: float, make: Callable[..., Simulation], every: int = 1
) -> dict[str, float]:
    """Depths of every n-th guide of a groom in its head, which moves rigidly and collides as a
    mesh."""
    assert rig.head is not None
    settings = DynamicsSettings()
    collider = DistanceField.from_surface(rig.head, settings)
    rest = motion_flow.carried_guides(rig, rig.rest_pose)[::every]
    depths = Depths.of(rest, rig.head)
    simulation = make(start(rest))
    matrices = [motion(frame / FPS) for frame in range(round(seconds * FPS) + 1)]
    targets = [rest]
    for frame, now in enumerate(matrices[1:], 1):
        pose = Pose(moved(now, rig.head.positions).astype(np.float32), now)
        targets.append(motion_flow.carried_guides(rig, pose)[::every])
        earlier = matrices[max(frame - 2, 0)]
        since = earlier if frame > 1 else None
        posed = PosedCollider(collider, matrices[frame - 1], now, since)
        drive = Drive(
            targets[-2], targets[-1], (posed,), GRAVITY, targets[-3] if frame > 1 else None
        )
        simulation.advance(drive, settings, 1.0 / FPS)
        depths.note(simulation.state().grid, now)
    simulation.release()
    return depths.worst


def built_in_rig(count: int = 600) -> Rig:
    head = built_in_head()
    strands = grow_with_face(head.surface, GrowSettings(strand_count=count), head.weights, None)
    return rig_flow.prepare(strands, head.surface, GuideSettings(), place="built-in")


@dataclass(frozen=True)
class Thin:
    """A thin solid: how it collides, its mesh, and triangles (n, 3, 3) in its middle."""

    collider: Collider
    surface: Surface
    core: np.ndarray


def plate(settings: DynamicsSettings) -> Thin:
    """1 cm thick, 16 cm wide, 12 cm high."""
    half = np.array([0.08, 0.005, 0.06])
    surface = box(half)
    return Thin(DistanceField.from_surface(surface, settings), surface, quad(0.075, 0.055))


def finger(settings: DynamicsSettings) -> Thin:
    """8 mm in radius, along x, as a capsule."""
    del settings
    ends = np.array([-0.08, 0.0, 0.0]), np.array([0.08, 0.0, 0.0])
    return Thin(CapsuleCollider(*ends, 0.008), capsule(0.08, 0.008), quad(0.08, 0.004))


def finger_mesh(settings: DynamicsSettings) -> Thin:
    """The same as a mesh."""
    surface = capsule(0.08, 0.008)
    return Thin(DistanceField.from_surface(surface, settings), surface, quad(0.08, 0.004))


def ear(settings: DynamicsSettings) -> Thin:
    """A bowl of 6 by 3.5 cm, 4 mm thick, standing off the side of a ball of 10 cm."""
    surface, core = eared_ball()
    return Thin(DistanceField.from_surface(surface, settings), surface, core)


def swung(
    thin: Thin, make: Callable[..., Simulation], settings: DynamicsSettings, speed: float = 5.6
) -> dict[str, float]:
    """Move a solid through hanging hair, a substep at a time, and count strands that pass through
    it."""
    count, cv_count = 60, 16
    along = np.linspace(0.0, -0.25, cv_count)
    grid = np.zeros((count, cv_count, 3), np.float32)
    grid[:, :, 0] = np.linspace(-0.06, 0.06, count)[:, None]
    grid[:, :, 2] = along
    grid[:, :, 1] = np.linspace(0.0, 0.003, count)[:, None]
    depths = Depths.of(moved(np.linalg.inv(place(-0.15)), grid), thin.surface)
    simulation, step = make(start(grid)), 1.0 / settings.substep_rate
    passed = np.zeros(count, bool)
    matrices = [place(-0.15 + speed * step * k) for k in range(round(0.3 / speed / step) + 1)]
    before = dense(grid)
    for was, now in pairwise(matrices):
        simulation.advance(
            Drive(grid, grid, (PosedCollider(thin.collider, was, now),), GRAVITY), settings, step
        )
        here = simulation.state().grid
        depths.note(here, now)
        after = dense(here)
        paths = moved(np.linalg.inv(was), before), moved(np.linalg.inv(now), after)
        passed |= crosses(*paths, thin.core)[:, : -2 * SAMPLES].any(axis=1)
        before = after
    simulation.release()
    return {"passed": float(passed.sum()), **depths.worst}


def place(y: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = 0.0, y, -0.13
    return matrix


def crosses(begin: np.ndarray, end: np.ndarray, core: np.ndarray) -> np.ndarray:
    """Whether the line from each begin to its end (..., 3) crosses any triangle."""
    segment = end - begin
    found = np.zeros(begin.shape[:-1], bool)
    for a, b, c in core:
        one, two = b - a, c - a
        side = np.cross(segment, two)
        scale = side @ one
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((begin - a) * side).sum(axis=-1) / scale
            turned = np.cross(begin - a, one)
            v = (segment * turned).sum(axis=-1) / scale
            t = turned @ two / scale
        found |= (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t <= 1)
    return found


def quad(x: float, z: float) -> np.ndarray:
    a, b, c, d = (
        np.array([sx * x, 0.0, sz * z]) for sx, sz in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    )
    return np.array([[a, b, c], [a, c, d]])


def box(half: np.ndarray) -> Surface:
    """Closed, of 12 triangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Surface(corners.astype(np.float32), np.array(triangles, np.int32))


def capsule(half: float, radius: float, around: int = 20, rings: int = 6) -> Surface:
    """Along x, closed."""
    arc = np.linspace(0.0, np.pi / 2, rings)
    profile = [(-half - radius * np.cos(a), radius * np.sin(a)) for a in arc]
    profile += [(half + radius * np.cos(a), radius * np.sin(a)) for a in arc[::-1]]
    return revolved(np.array(profile), around)


def revolved(profile: np.ndarray, around: int) -> Surface:
    """(n, 2) x and radius about x, zero radius at both ends."""
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    rings = [
        np.stack([np.full(around, x), r * np.cos(angle), r * np.sin(angle)], axis=1)
        for x, r in profile
    ]
    triangles = []
    for ring in range(len(profile) - 1):
        for k in range(around):
            a, b = ring * around + k, ring * around + (k + 1) % around
            triangles += [(a, b, b + around), (a, b + around, a + around)]
    return Surface(np.concatenate(rings).astype(np.float32), np.array(triangles, np.int32))


def eared_ball() -> tuple[Surface, np.ndarray]:
    """A ball of 10 cm with an ear that stands up along z; and triangles in the middle of the ear.

    The ear lies in the x z plane, so that it meets hair with its broad side; the ball is below.
    """
    ball = revolved(
        np.array([(-0.1 * np.cos(a), 0.1 * np.sin(a)) for a in np.linspace(0.0, np.pi, 32)]), 48
    )
    ball = Surface(ball.positions + np.array([0.0, 0.0, -0.11], np.float32), ball.triangles)
    fraction = np.linspace(0.0, 1.0, 12)
    half = 0.002 * np.sqrt(1.0 - fraction**2)
    bowl = 0.006 * fraction**2
    profile = [(b - h, r) for b, h, r in zip(bowl, half, fraction, strict=True)]
    profile += [(b + h, r) for b, h, r in zip(bowl, half, fraction, strict=True)][-2::-1]
    shell = revolved(np.array(profile), 40)
    p = shell.positions
    placed = np.stack([p[:, 1] * 0.0175, p[:, 0], p[:, 2] * 0.03 + 0.01], axis=1)
    positions = np.concatenate([ball.positions, placed.astype(np.float32)])
    triangles = np.concatenate([ball.triangles, shell.triangles + len(ball.positions)])
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    rim = np.stack(
        [0.016 * np.cos(angle), np.full(25, 0.005), 0.027 * np.sin(angle) + 0.01], axis=1
    )
    core = np.array([[[0.0, 0.0, 0.01], a, b] for a, b in pairwise(rim)])
    return Surface(positions, triangles.astype(np.int32)), core


HEADS: dict[str, Callable[[], Rig]] = {"sintel": sintel_rig, "built_in": built_in_rig}


def figures(
    make: Callable[..., Simulation], case_names: Sequence[str]
) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    settings = DynamicsSettings()
    for name, solid in (
        ("plate", plate),
        ("finger", finger),
        ("finger_mesh", finger_mesh),
        ("ear", ear),
    ):
        if "thin" in case_names:
            for speed in SPEEDS:
                found[f"{name}_{speed}"] = swung(solid(settings), make, settings, speed)
                print(name, speed, found[f"{name}_{speed}"], flush=True)
    for name in HEADS:
        if name not in case_names:
            continue
        rig = HEADS[name]()
        low, high = rig.head.bounds()
        centre = (low + high) / 2.0
        for kind, motion, seconds in (
            ("demo", demo_shake(centre), 1.0),
            ("fast", fast_shake(centre), 0.6),
        ):
            found[f"{name}_{kind}"] = shaken(rig, motion, seconds, make)
            print(name, kind, found[f"{name}_{kind}"], flush=True)
    return found


def main(arguments: list[str]) -> int:
    start_bench()
    use_compute = "compute" in arguments
    if use_compute and not has_compute():
        raise SystemExit("There are no compute shaders here.")
    parts = chosen([each for each in arguments if each != "compute"], ("thin", *HEADS))
    found = figures(ComputeSimulation if use_compute else NumpySimulation, parts)
    flat = {f"{name}_{key}": value for name, part in found.items() for key, value in part.items()}
    device = {"device": "compute shaders" if use_compute else "numpy"}
    return report(device | flat, REFERENCE, max_limits=MAX_LIMITS)


sys.exit(main(sys.argv[1:]))
