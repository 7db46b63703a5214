"""Hair that feels other hair: volume, locks, rest and cost; the scene's force fields; and hair that
follows an animated style.

volume_kept          a ponytail below its tie, in a style that bears nearly nothing, after 2 s:
                     cells as wide as the spacing of strands that it runs through, over those at
                     rest; without: the same with Volume 0
volume_kept_bent     the same over a shoulder, a capsule that moves under it in the first second
rest_motion_mm       how much farther from its style hair at rest is after 10 s than with Volume 0
crossing_percent     of two locks side by side that swing against each other, 1 m/s at the tips:
                     strands on the other lock's side, in the worst frame
crossing_across_percent   the same with each lock as a separate groom
halves_apart_mm      of a ponytail on a head that sways: mean distance of its strands, over a
                     second, when cut into two grooms, from where they are in one; without: the same
                     if the two do not feel each other
cost_ratio_two_*     time of a frame of two half grooms that feel each other over one of the whole
cost_ratio_*         time of a frame at 24 a second with Volume over one without, on a head that
                     sways, with its mesh as collider; each frame by the minimum over rounds in turn
field_error          force fields of every kind, shape and falloff beside Blender's particles: the
                     largest error of acceleration at 200 places, over the largest acceleration
field_cost_ratio_*   time of a frame as above with four force fields over one without
style_follow_mm      of curves and children that nodes move, on a surface that turns, without
                     simulation: largest distance of a drawn strand from the curves
style_frame_ms       time of such a frame, simulated; read_once: the same with a style that is still

The exit status is 1 if a limit is missed.

make bench NAME="hair_grid --pictures out"
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from _field_particles import field_error
from _report import report
from _report import start as start_bench
from _shaken_head import Shake, guides_on, new_head, surface_of
from _simulations import ComputeSimulation, NumpySimulation, Simulation, has_compute, play
from _style_follow import style_follow
from grooms_together import Groom, play_frame

from hairloom.addon import register, unregister
from hairloom.addon.dynamics.colliders import CapsuleCollider, DistanceField, PosedCollider
from hairloom.addon.dynamics.force_fields import Falloff, ForceField, ForceFields
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.neighbours import run_alone
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.dynamics.step import advance
from hairloom.addon.motion_flow import FrameInput
from hairloom.addon.render.dynamics_pass import DynamicsPass

GRAVITY = np.array([0.0, 0.0, -9.81])
FPS, GUIDES, CVS, SECONDS = 24.0, 762, 16, 2.0
#: A style that bears nearly nothing, and no weight.
SOFT = {"style_root": 0.5, "style_tip": 0.1, "bend": 0.3, "sag_compensation": 0.0}
#: Volume in all figures but cost, which hardly depends on it.
VOLUME = 1.0
#: [m/s] of each lock, at the tips.
SWING = 1.0
SIZES, ROUNDS = {"762": 762, "10k": 10_000}, {"762": 7, "10k": 3}
#: Four common kinds, around the head.
FIELDS = (
    ForceField(
        "wind", axis=(1.0, 0.0, 0.0), strength=5.0, shape="plane", flow=1.0, across_fraction=1.0
    ),
    ForceField("force", center=(0.3, 0.3, 0.2), strength=-2.0, distance=Falloff(2.0)),
    ForceField("vortex", strength=2.0, shape="plane", distance=Falloff(1.0)),
    ForceField("turbulence", strength=4.0, size=0.2),
)
MIN_LIMITS = {"volume_kept": 0.8, "volume_kept_bent": 0.8}
MAX_LIMITS = {
    "rest_motion_mm": 0.01,
    "crossing_percent": 5.0,
    "crossing_across_percent": 5.0,
    "halves_apart_mm": 0.5,
    "field_error": 0.01,
    "style_follow_mm": 0.1,
    "cost_ratio_*": 1.6,
}
REFERENCE = "the same without Volume; Blender's particles; curves as Blender evaluates them"


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("--pictures", type=Path, help="folder of pictures of a ponytail")
    options.add_argument("--skip-cost", action="store_true", help="all but the slow part")
    arguments = options.parse_args()
    start_bench()
    found: dict[str, object] = {"guides": GUIDES}
    found |= in_blender()
    found |= volumes() | {"rest_motion_mm": rest_motion()} | crossings() | halves()
    if not arguments.skip_cost:
        for name, count in SIZES.items():
            found |= costs(name, count)
    if arguments.pictures is not None:
        draw(arguments.pictures)
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


def tail(count: int, narrow: float = 0.012, wide: float = 0.04, length: float = 0.3) -> np.ndarray:
    """A ponytail below its tie: out to `wide`, then straight down."""
    random = np.random.default_rng(1)
    angle, away = random.uniform(0.0, 2.0 * np.pi, count), random.random(count) ** 0.5
    along = np.linspace(0.0, 1.0, CVS)
    radius = narrow + (wide - narrow) * np.sin(np.minimum(1.6 * along, 1.0) * np.pi / 2.0)
    grid = np.zeros((count, CVS, 3))
    grid[..., 0] = (np.cos(angle) * away)[:, None] * radius
    grid[..., 1] = (np.sin(angle) * away)[:, None] * radius
    grid[..., 2] = -length * along
    return grid.astype(np.float32)


def volumes() -> dict[str, object]:
    grid = tail(GUIDES)
    apart = 2.0 * 0.04 * np.sqrt(np.pi / GUIDES)
    found = {}
    for name, moving in (("volume_kept", nothing), ("volume_kept_bent", shoulder)):
        for end, volume in (("", VOLUME), ("_without", 0.0)):
            state = start(grid)
            for frame in range(round(SECONDS * FPS)):
                drive = Drive(grid, grid, moving(frame), GRAVITY)
                settings = DynamicsSettings(volume=volume, **SOFT)
                state = advance(state, drive, settings, 1.0 / FPS)
            volume_ratio = cells_of(state.grid, apart) / cells_of(grid, apart)
            found[name + end] = round(volume_ratio, 3)
    return found


def nothing(_frame: int) -> tuple[PosedCollider, ...]:
    return ()


def shoulder(frame: int) -> tuple[PosedCollider, ...]:
    """5 cm thick, from beside the tail to below its tie."""
    capsule = CapsuleCollider(np.array([0.0, -0.3, -0.15]), np.array([0.0, 0.3, -0.15]), 0.05)
    matrices = []
    for moment in (frame, frame + 1):
        part = min(moment / FPS, 1.0)
        matrix = np.eye(4)
        matrix[0, 3] = -0.12 + 0.1 * part * part * (3.0 - 2.0 * part)
        matrices.append(matrix)
    return (PosedCollider(capsule, *matrices),)


def cells_of(grid: np.ndarray, width: float) -> int:
    """The number of cells of this width that strands run through."""
    steps = np.linspace(0.0, 1.0, 5)[:-1, None, None, None]
    points = grid[:, :-1] * (1.0 - steps) + grid[:, 1:] * steps
    return len(np.unique(np.floor(points.reshape(-1, 3) / width).astype(int), axis=0))


def rest_motion() -> float:
    grid, farthest = tail(GUIDES), []
    for volume in (0.0, VOLUME):
        state = start(grid)
        for _ in range(round(10.0 * FPS)):
            state = advance(
                state, Drive(grid, grid, (), GRAVITY), DynamicsSettings(volume=volume), 1.0 / FPS
            )
        farthest.append(np.linalg.norm(state.grid - grid, axis=2).max())
    return round(max(float(farthest[1] - farthest[0]), 0.0) * 1e3, 4)


def in_blender() -> dict[str, object]:
    """The largest error of force fields beside Blender's particles, and its case; and how hair
    follows its style."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    register()
    try:
        points = np.random.default_rng(3).uniform(-1.0, 1.0, (200, 3))
        errors = field_error(points)
        followed = style_follow()
    finally:
        unregister()
    worst_case = max(errors, key=errors.__getitem__)
    found = {
        "field_error": errors[worst_case],
        "field_worst": worst_case,
        "field_cases": len(errors),
    }
    return found | followed


def crossings() -> dict[str, object]:
    """Crossings of two locks of one groom, and of two grooms."""
    grid, side = tail(240, 0.012, 0.012, 0.25), np.repeat([-1.0, 1.0], 120)
    grid[..., 0] += (0.015 * side)[:, None].astype(np.float32)
    apart = (slice(0, 120), slice(120, 240))
    found = {}
    for name, parts in (("crossing", (slice(0, 240),)), ("crossing_across", apart)):
        for end, volume in (("", VOLUME), ("_without", 0.0)):
            settings = DynamicsSettings(volume=volume)
            grooms = [
                Groom(grid[part], settings, state=swinging(grid[part], side[part]))
                for part in parts
            ]
            max_fraction = 0.0
            for _ in range(round(SECONDS * FPS)):
                play_frame(grooms, [grid[part] for part in parts], 1.0 / FPS)
                ends = np.concatenate([groom.state.grid for groom in grooms])
                beyond = ends[:, CVS // 2 :, 0].mean(axis=1) * side
                max_fraction = max(max_fraction, float((beyond < -0.002).mean()))
            found[f"{name}_percent{end}"] = round(100.0 * max_fraction, 1)
    return found


def swinging(grid: np.ndarray, side: np.ndarray) -> DynamicsState:
    """Strands that swing against those on the other side."""
    state, dt = start(grid), 1.0 / DynamicsSettings().substep_rate
    previous = state.position.copy()
    previous[0] += np.linspace(0.0, 1.0, CVS)[:, None] * side * SWING * dt
    return replace(state, previous=previous, substep=dt)


def halves() -> dict[str, object]:
    grid, settings = tail(GUIDES), DynamicsSettings(volume=VOLUME, **SOFT)
    whole, none = [Groom(grid, settings)], frozenset[int]()
    cut, unfelt = ([Groom(grid[first::2], settings) for first in (0, 1)] for _ in range(2))
    away: dict[str, list[float]] = {"": [], "_without": []}
    for frame in range(round(FPS)):
        x = 0.05 * np.sin(2.0 * np.pi * (frame + 1) / FPS)
        target = grid + np.array([x, 0.0, 0.0], np.float32)
        play_frame(whole, [target], 1.0 / FPS)
        for end, grooms, near in (("", cut, None), ("_without", unfelt, [none, none])):
            play_frame(grooms, [target[0::2], target[1::2]], 1.0 / FPS, near)
            for first, groom in enumerate(grooms):
                off = groom.state.grid - whole[0].state.grid[first::2]
                away[end].append(float(np.linalg.norm(off, axis=2).mean()))
    return {
        f"halves_apart_mm{end}": round(1e3 * float(np.mean(far)), 3) for end, far in away.items()
    }


def costs(name: str, count: int) -> dict[str, object]:
    """Milliseconds per frame, and ratios, of all implementations that can run here."""
    surface = surface_of(new_head())
    field = DistanceField.from_surface(surface, DynamicsSettings(), place="head")
    guides = guides_on(surface, count)
    drives = list(Shake(guides.grid, (field,)).drives(FPS, 0.5))
    fields = ForceFields(FIELDS, np.random.default_rng(1).permutation(256))
    blown = [replace(drive, force_fields=fields) for drive in drives]
    makers: dict[str, Callable[[DynamicsState], Simulation]] = {"numpy": NumpySimulation}
    if has_compute():
        makers["compute"] = ComputeSimulation
    kinds = {"": (0.0, drives), "volume": (0.5, drives), "fields": (0.0, blown)}
    times: dict[tuple[str, str], list[list[float]]] = {}
    for _ in range(ROUNDS[name]):
        for device, make in makers.items():
            for kind, (volume, driven) in kinds.items():
                one = make(start(guides.grid))
                took = play(one, driven, DynamicsSettings(volume=volume), FPS)
                one.release()
                times.setdefault((device, kind), []).append(took)
    found: dict[str, object] = {}
    for device in makers:
        # the first frames compile, and size the grid
        without, with_it, with_fields = (
            float(np.min(times[device, kind], axis=0)[2:].mean()) for kind in kinds
        )
        found[f"{device}_{name}_ms"], found[f"{device}_{name}_without_ms"] = (
            round(with_it, 2),
            round(without, 2),
        )
        found[f"cost_ratio_{device}_{name}"] = round(with_it / without, 2)
        found[f"field_cost_ratio_{device}_{name}"] = round(with_fields / without, 2)
        found[f"cost_ratio_two_{device}_{name}"] = cost_of_two(device, guides.grid, ROUNDS[name])
    return found


def cost_of_two(device: str, grid: np.ndarray, rounds: int) -> float:
    """The time of two half grooms over that of the whole, without colliders, which each would
    have."""
    settings, frames, times = DynamicsSettings(volume=0.5), 8, []
    for _ in range(rounds):
        for parts in ((slice(0, None),), (slice(0, None, 2), slice(1, None, 2))):
            make = DynamicsPass if device == "compute" else None
            grooms = [Groom(grid[part], settings, make_pass=make) for part in parts]
            took = []
            for frame in range(frames):
                target = grid + np.array([0.01 * np.sin(frame), 0.0, 0.0], np.float32)
                begin = time.perf_counter()
                play_frame(grooms, [target[part] for part in parts], 1.0 / FPS)
                for groom in grooms:
                    groom.wait()
                took.append(time.perf_counter() - begin)
            times.append(took[2:])
    one, two = (np.min(times[first::2], axis=0).mean() for first in (0, 1))
    return round(float(two / one), 2)


def draw(folder: Path) -> None:
    """Draw a ponytail of soft hair on the built-in head: its style, and 2 s later without and with
    Volume."""
    from _ponytail import ponytail

    from hairloom.addon.blender.base import images
    from hairloom.addon.blender.colliders.fields import field_of
    from hairloom.addon.blender.pictures.studio import FIELD_OF_VIEW, Studio
    from hairloom.addon.blender.properties.groom_settings import GroomSettings
    from hairloom.addon.blender.sessions.numpy_solver import NumpySolver
    from hairloom.addon.blender.sessions.prepared_groom import prepare_groom
    from hairloom.addon.refine.settings import DetailSettings
    from hairloom.addon.render.camera import frame_camera
    from hairloom.addon.shading.ambient_settings import AmbientSettings

    hair = ponytail(8000)
    settings = GroomSettings().with_settings(DetailSettings(lod_size=0.0))
    studio = Studio(
        prepare_groom(hair.rig, AmbientSettings()), settings, look=hair.bust.look("light")
    )
    points = hair.rig.strands.points
    box = points.min(axis=0) - 0.03, points.max(axis=0) + 0.03
    camera = frame_camera(box, (-0.9, 0.9, 0.25), FIELD_OF_VIEW, 480 / 600)
    collider = field_of(hair.bust.surface, DynamicsSettings(), place="head")
    still = np.eye(4)
    pictures = [studio.picture(hair.pose(still), points, 480, 600, 2, camera)]
    for volume in (0.0, VOLUME):
        solver = NumpySolver(hair.rig)
        for _ in range(round(SECONDS * FPS)):
            posed = (PosedCollider(collider, still, still),)
            soft = DynamicsSettings(volume=volume, **SOFT)
            run_alone(solver.steps(FrameInput(hair.pose(still), posed, soft, GRAVITY, 1.0 / FPS)))
        pictures.append(studio.picture(hair.pose(still), solver.strands(), 480, 600, 2, camera))
    images.write_png(folder / "hair_grid.png", images.contact_sheet(pictures, 3))


if __name__ == "__main__":
    sys.exit(main())
