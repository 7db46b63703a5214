"""The dynamics against Blender's own: milliseconds per frame, stretch, penetration, frame rates.

762 guides of 16 CVs on a ball that swings 0.3 m to either side once a second, at 60 frames a
second, the ball's mesh as collider, bend and style on as by default. The peer is Blender's "Hair
Dynamics" on the same guides in the same process (see `_hair_dynamics`). Every time is the minimum
of the medians of several rounds, in which all variants take turns, so that load on the machine
affects all of them.

make bench NAME=dynamics            about four minutes
make bench NAME="dynamics --peer-10k"   the peer with 10,000 guides too: three minutes more
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import bpy
import numpy as np
from _hair_dynamics import HairDynamics, animate
from _report import report
from _shaken_head import RADIUS, Shake, depth_in, guides_on, new_head, surface_of, sway
from _simulations import ComputeSimulation, NumpySimulation, Simulation, has_compute, play
from _turns import in_turns

from hairloom.addon.dynamics.colliders import DistanceField, SphereCollider
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.measure import deepest_penetration, max_stretch
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.strands import StrandSet, Surface

REFERENCE = "Hair Dynamics, Physics, surface collision, 10 x 15 (as shipped)"
MAX_LIMITS = {
    "stretch_max_percent": 1.0,
    "penetration_sphere_mm": 0.001,
    "penetration_mesh_mm": 0.1,
}
#: times faster than the peer
MIN_LIMITS = {"ratio_numpy": 1.0, "ratio_compute": 1.0}
GUIDES, FPS, WARM_UP, SWING = 762, 60.0, 10, 60
#: Enough that a busy minute of the machine does not affect all rounds.
ROUNDS, SCALING_ROUNDS = 7, 3
FRAMES = WARM_UP + SWING  # of a play; one whole swing is measured
SIZES = (1_000, 3_000, 10_000, 30_000, 50_000)
FRAME_RATES = (24.0, 30.0, 60.0, 120.0)
SETTINGS = DynamicsSettings()
Simulations = dict[str, Callable[[DynamicsState], Simulation]]


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("--peer-10k", action="store_true", help="the peer with 10,000 guides too")
    options.add_argument("--rounds", type=int, default=ROUNDS, help="in which all take turns")
    arguments = options.parse_args()
    simulations: Simulations = {"numpy": NumpySimulation}
    if has_compute():
        simulations["compute"] = ComputeSimulation
    head = new_head()
    surface = surface_of(head)
    field = DistanceField.from_surface(surface, SETTINGS, place="head")
    guides = guides_on(surface, GUIDES)

    found: dict[str, Any] = dict.fromkeys(("compute_ms", "ratio_compute"))
    found |= race(simulations, head, guides, field, arguments.rounds)
    for name in simulations:
        found[f"ratio_{name}"] = found["hair_dynamics_ms"] / found[f"{name}_ms"]
    found |= accuracy(simulations, guides, surface, field)
    found |= scaling(simulations, surface, field)
    for name, make in simulations.items():
        found["framerate_tip_percent" if name == "numpy" else f"{name}_framerate_tip_percent"] = (
            frame_rates(make, guides, field)
        )
    if arguments.peer_10k:
        found["hair_dynamics_10k_ms"] = peer_10k(head, surface)
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


def race(
    simulations: Simulations,
    head: bpy.types.Object,
    guides: StrandSet,
    field: DistanceField,
    rounds: int,
) -> dict[str, float]:
    """Milliseconds per frame of all variants, in the best round and in the worst.

    In each round each variant plays one swing.
    """
    shake = Shake(guides.grid, (field,))
    balls = Shake(guides.grid, (SphereCollider((0.0, 0.0, 0.0), RADIUS),))
    animate(head, [sway(frame / FPS) for frame in range(FRAMES + 1)], int(FPS))
    peer_stretch = idle = 0.0

    def peer_plays() -> float:
        nonlocal peer_stretch, idle
        peer = HairDynamics(head, guides)
        times, stretch = peer.play(FRAMES, WARM_UP)
        peer_stretch, idle = max(peer_stretch, stretch), peer.idle_ms(30)
        peer.remove()
        return statistics.median(times)

    def plays(make: Callable[[DynamicsState], Simulation], shaken: Shake) -> float:
        return statistics.median(timed(make, shaken, FRAMES / FPS))

    contestants: dict[str, Callable[[], float]] = {"hair_dynamics_ms": peer_plays}
    for name, make in simulations.items():
        contestants[f"{name}_ms"] = partial(plays, make, shake)
        contestants[f"{name}_sphere_ms"] = partial(plays, make, balls)
    medians = in_turns(contestants, rounds)
    found = {name: min(values) for name, values in medians.items()}
    found |= {f"{name}_worst_round": max(values) for name, values in medians.items()}
    return found | {
        "hair_dynamics_stretch_percent": peer_stretch * 100.0,
        "hair_dynamics_idle_ms": idle,
    }


def timed(make: Callable[[DynamicsState], Simulation], shake: Shake, seconds: float) -> list[float]:
    simulation = make(start(shake.grid))
    times = play(simulation, shake.drives(FPS, seconds), SETTINGS, FPS)
    simulation.release()
    return times[WARM_UP:]


def accuracy(
    simulations: Simulations, guides: StrandSet, surface: Surface, field: DistanceField
) -> dict[str, float]:
    """The worst stretch and penetration of all implementations over two seconds.

    Colliders are the ball as a sphere, and its mesh, of which the simulation has only the distance
    field; depth is measured at the triangles themselves.
    """
    depth = depth_in(surface)
    max_values = {
        "stretch_max_percent": 0.0,
        "penetration_sphere_mm": 0.0,
        "penetration_mesh_mm": 0.0,
    }

    def note(key: str, value: float) -> None:
        max_values[key] = max(max_values[key], value)

    def watch_sphere(state: DynamicsState, drive: Drive) -> None:
        note("stretch_max_percent", max_stretch(state) * 100.0)
        note("penetration_sphere_mm", deepest_penetration(state, drive.colliders) * 1000.0)

    def watch_mesh(state: DynamicsState, drive: Drive) -> None:
        note("stretch_max_percent", max_stretch(state) * 100.0)
        free = state.grid[:, 2:].reshape(-1, 3) - drive.colliders[0].matrix_now[:3, 3]
        note("penetration_mesh_mm", depth(free) * 1000.0)

    sphere = SphereCollider((0.0, 0.0, 0.0), RADIUS)
    for make in simulations.values():
        for collider, watch in ((sphere, watch_sphere), (field, watch_mesh)):
            simulation = make(start(guides.grid))
            play(simulation, Shake(guides.grid, (collider,)).drives(FPS, 2.0), SETTINGS, FPS, watch)
            simulation.release()
    return max_values


def scaling(simulations: Simulations, surface: Surface, field: DistanceField) -> dict[str, float]:
    """Milliseconds per frame for growing numbers of guides, and the exponent that fits them
    best."""
    all_guides = guides_on(surface, SIZES[-1]).grid
    chosen = np.random.default_rng(1).permutation(SIZES[-1])
    shakes = {size: Shake(all_guides[np.sort(chosen[:size])], (field,)) for size in SIZES}
    medians: dict[str, list[float]] = {}
    for _ in range(SCALING_ROUNDS):
        for name, make in simulations.items():
            for size, shake in shakes.items():
                seconds = (WARM_UP + (20 if size <= 10_000 else 6)) / FPS
                times = timed(make, shake, seconds)
                medians.setdefault(f"{name}_{size // 1000}k_ms", []).append(
                    statistics.median(times)
                )
    found = {name: min(values) for name, values in medians.items()}
    for name in simulations:
        times = [found[f"{name}_{size // 1000}k_ms"] for size in SIZES]
        found[f"{name}_scaling_exponent"] = float(np.polyfit(np.log(SIZES), np.log(times), 1)[0])
    return found | {
        "scaling_exponent": max(found[f"{name}_scaling_exponent"] for name in simulations)
    }


def frame_rates(
    make: Callable[[DynamicsState], Simulation], guides: StrandSet, field: DistanceField
) -> float:
    """The largest distance of a guide's tip, after two seconds, between two frame rates, in percent
    of the guide's length."""
    tips = []
    for fps in FRAME_RATES:
        simulation = make(start(guides.grid))
        play(simulation, Shake(guides.grid, (field,)).drives(fps, 2.0), SETTINGS, fps)
        tips.append(simulation.state().grid[:, -1])
        simulation.release()
    apart = [np.linalg.norm(one - other, axis=1) for one in tips for other in tips]
    return float((np.max(apart, axis=0) / guides.lengths()).max() * 100.0)


def peer_10k(head: bpy.types.Object, surface: Surface) -> float:
    peer = HairDynamics(head, guides_on(surface, 10_000))
    times, _ = peer.play(25, 5)
    peer.remove()
    return statistics.median(times)


sys.exit(main())
