"""One frame of a fin: cloth in the same fixed substeps as hair.

    repeat substep_rate times a second:
        air          reduces the speed relative to it, broadside more than edgewise
        fields       the scene's force fields push, slow down and turn
        folds        one implicit step, as a change of speed
        contacts     found where the substep would lead
        repeat small_steps times:
            predict  Verlet: inertia, gravity
            pin      the animation carries pinned vertices and pulls at the others
            edges    one sweep over the colours
            reach    limit the distance of vertices from their pinned one to that along the edges
            contacts push vertices out, without bouncing

Edges are solved once in each of many small steps instead of often in a long one, which stretches
far less for the same work (Macklin et al. 2019, "Small Steps in Physics Simulation"). Sweeps always
go in the same direction: alternating directions became unstable in tests.

References: Jakobsen 2001, "Advanced Character Physics"; Nguyen and Donnelly 2005, GPU Gems 2,
chapter 23; Macklin et al. 2016, "XPBD". `reference.py` is a scalar implementation, one vertex at a
time.

Limitations: only vertices collide, neither edges nor faces; cloth does not collide with itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...strands.vectors import dot_rows
from ..colliders import PosedCollider, poses_through
from ..contacts import find_contacts
from ..force_fields import ForceFields, apply_force_fields
from ..frame import Drive
from ..rigid_path import CarriedPath
from ..schedule import due_substeps
from ..wind import Air, air_from_settings
from .carried import pinned_path
from .constraints import (
    animation_springs,
    apply_long_range_attachments,
    edge_fractions,
    fold_fractions,
    keep_distances,
)
from .contacts import MovingPlanes, find_moving_planes, push_out_at_end, relative_to_origin
from .settings import FinSettings
from .state import ClothState, Fabric, area_weighted_normals, vertex_rows


@dataclass(frozen=True)
class _Frame:
    """A drive prepared for a frame, and constants; rows (3, n).

    origin: (3, 1) float64 world [m]; relative to it, float32 is enough within the frame.
    path: on which the animation carries vertices.
    """

    origin: Floats
    path: CarriedPath
    colliders: tuple[PosedCollider, ...]
    gravity: Floats  # (3, 1) [m/s^2]
    air: Air | None
    force_fields: ForceFields | None  # None if none acts
    dt: float
    small_step: float  # [s] of a small step
    animation_springs: (
        Floats  # (n,) of the spring to where a vertex is carried, times small^2; 0 for the pinned
    )
    mobility: Floats  # (n,) inverse mass with that spring, 0 for the pinned
    edge_fractions: tuple[Floats, ...]
    fold_fractions: tuple[Floats, ...]
    radius: Floats  # (n,) [m]

    def carried_vertices(self, moment: float, chosen: Ints | slice) -> Floats:
        return self.path.part(chosen).at(moment)


def advance_cloth(
    state: ClothState, drive: Drive, settings: FinSettings, duration: float
) -> ClothState:
    """The state after a frame of `duration` seconds; `state` itself does not change.

    Args:
        drive: its targets are (vertex_count, 3), where the animation carries the mesh.

    Raises:
        HairloomError: a drive that does not fit the state or is not finite, or a bad duration.
    """
    dt = 1.0 / settings.substep_rate
    duration, count, left = due_substeps(state.time_left, duration, settings.max_frame_time, dt)
    if not count:
        return replace(state, time_left=left)
    frame = _prepare(state, drive, settings, dt)
    position = (state.position - frame.origin).astype(np.float32)
    previous = (state.previous - frame.origin).astype(np.float32)
    if state.small_step and state.small_step != frame.small_step:
        previous = position - (position - previous) * np.float32(
            frame.small_step / state.small_step
        )
    for number in range(count):
        begin = (number * dt - state.time_left) / duration
        span = (begin, begin + dt / duration)
        _apply_air_resistance(
            position, previous, state.fabric, frame, settings, state.time + number * dt
        )
        _apply_force_fields(position, previous, frame, state.fabric.size)
        _hold_folds(position, previous, state.fabric, frame, settings)
        position, previous = _substep(position, previous, state.fabric, frame, settings, span)
    return ClothState(
        position + frame.origin,
        previous + frame.origin,
        state.fabric,
        frame.small_step,
        left,
        state.time + count * dt,
    )


def cloth_at_frame_end(state: ClothState, drive: Drive) -> Floats:
    """Vertices at the very end of the frame, (vertex_count, 3) world [m], for drawing.

    Bridges the time left over: each vertex moves along with its pinned vertex or, if it has none,
    keeps its velocity.
    """
    fabric, position = state.fabric, state.position
    displacement = (vertex_rows(drive.target_now) - position)[:, fabric.anchor]
    if state.small_step:
        loose = ~fabric.pinned[fabric.anchor]
        flight = (position - state.previous) * (state.time_left / state.small_step)
        displacement[:, loose] = flight[:, loose]
    return np.ascontiguousarray((position + displacement).T)


def _apply_air_resistance(
    position: Floats,
    previous: Floats,
    fabric: Fabric,
    frame: _Frame,
    settings: FinSettings,
    time: float,
) -> None:
    """Damping and drag on the velocity relative to the air, split by the normal; changes
    `previous`.

    A sheet that moves broadside drags air along, one that moves edgewise cuts through it. Both
    are solved implicitly, so that they only bring the cloth's velocity closer to the air's.
    """
    if not settings.damping and not settings.drag:
        return
    displacement = position - previous
    if frame.air is not None:
        air_displacement = frame.air.at(
            position + frame.origin.astype(np.float32), time
        ) * np.float32(frame.small_step)
        displacement -= air_displacement
    normal = area_weighted_normals(position, fabric.triangles)
    across = dot_rows(normal, displacement)
    broadside = normal * across
    displacement -= broadside
    per_step = np.float32(settings.drag * frame.dt / frame.small_step)
    along = np.sqrt(dot_rows(displacement, displacement))
    broadside *= math.exp(-settings.damping * frame.dt) / (1.0 + per_step * np.abs(across))
    slip = np.float32(settings.edgewise)
    displacement *= math.exp(-settings.damping * settings.edgewise * frame.dt) / (
        1.0 + per_step * slip * along
    )
    displacement += broadside
    if frame.air is not None:
        displacement += air_displacement
    np.subtract(position, displacement, out=previous)


def _apply_force_fields(position: Floats, previous: Floats, frame: _Frame, size: float) -> None:
    """Apply the scene's force fields in a substep; changes `previous`."""
    if frame.force_fields is None:
        return
    ratio, origin = np.float32(frame.dt / frame.small_step), frame.origin.astype(np.float32)
    here = position + origin
    before = here - (position - previous) * ratio
    felt = before.copy()
    apply_force_fields(here, felt, frame.force_fields, frame.dt, size)
    felt -= before
    felt /= ratio
    previous += felt


def _hold_folds(
    position: Floats, previous: Floats, fabric: Fabric, frame: _Frame, settings: FinSettings
) -> None:
    """Bending, solved for where the substep would lead; changes `previous`."""
    if not settings.bend:
        return
    ahead = position + (position - previous) * np.float32(frame.dt / frame.small_step)
    held = ahead.copy()
    for fold, fraction in zip(fabric.folds, frame.fold_fractions, strict=True):
        keep_distances(held, fold, fraction)
    held -= ahead
    held *= np.float32(frame.small_step / frame.dt)
    previous -= held


def _substep(
    position: Floats,
    previous: Floats,
    fabric: Fabric,
    frame: _Frame,
    settings: FinSettings,
    span: tuple[float, float],
) -> tuple[Floats, Floats]:
    """Motion with edges and contacts; the new position and that one small step earlier."""
    steps, size = settings.small_steps, fabric.size
    max_exit = settings.depenetration_speed * size * frame.dt
    gravity_step, radius = frame.gravity * np.float32(frame.small_step**2), frame.radius
    poses = poses_through(frame.colliders, [span])[0] if fabric.pairs.size else []
    planes: list[MovingPlanes] = []
    if poses:
        planes = find_moving_planes(
            position, previous, gravity_step, steps, radius, poses, max_exit, size
        )
    before, scratch, displacement = (
        position.copy(),
        np.empty_like(position),
        np.empty_like(position),
    )
    pinned, is_pulled = np.flatnonzero(fabric.pinned), bool(frame.animation_springs.any())
    for number in range(steps):
        moment = span[0] + (span[1] - span[0]) * (number + 1) / steps
        np.subtract(position, previous, out=scratch)
        scratch += position
        scratch += gravity_step
        previous, position, scratch = position, scratch, previous
        position[:, pinned] = frame.carried_vertices(moment, pinned)
        if is_pulled:
            np.subtract(frame.carried_vertices(moment, slice(None)), position, out=displacement)
            displacement *= frame.animation_springs * frame.mobility
            position += displacement
        _keep_edges(position, fabric, frame, settings)
        for one in planes:
            one.push_out(position, previous, number, steps, settings.friction)
    if poses:
        contacts = find_contacts(position, before, radius, poses, max_exit, size)
        if contacts:
            push_out_at_end(position, previous, before, contacts, settings.friction, 1.0 / steps)
    return position, previous


def _keep_edges(position: Floats, fabric: Fabric, frame: _Frame, settings: FinSettings) -> None:
    for edge, fraction in zip(fabric.edges, frame.edge_fractions, strict=True):
        keep_distances(position, edge, fraction)
    if settings.long_range:
        apply_long_range_attachments(position, fabric)


def _prepare(state: ClothState, drive: Drive, settings: FinSettings, dt: float) -> _Frame:
    before, now = vertex_rows(drive.target_before), vertex_rows(drive.target_now)
    gravity = np.asarray(drive.gravity, np.float32)
    if before.shape != state.position.shape or now.shape != state.position.shape:
        raise HairloomError(
            f"the mesh has {now.shape[1]:,} vertices, but the simulation has "
            f"{state.vertex_count:,}",
            place="fin",
            remedy="Start the simulation again",
        )
    if gravity.shape != (3,) or not np.isfinite(gravity).all():
        raise HairloomError(
            "gravity is not three finite numbers", place="fin", remedy="Check the scene's gravity"
        )
    fabric, small_step = state.fabric, dt / settings.small_steps
    springs = animation_springs(fabric, settings, small_step)
    mobility = np.where(fabric.pinned, 0.0, 1.0 / (1.0 + springs)).astype(np.float32)
    origin = state.position.mean(axis=1, keepdims=True)
    return _Frame(
        origin=origin,
        path=pinned_path(fabric, drive, origin),
        colliders=tuple(relative_to_origin(origin, posed) for posed in drive.colliders),
        gravity=(gravity * np.float32(settings.gravity * (1.0 - settings.buoyancy)))[:, None],
        air=air_from_settings(settings),
        force_fields=drive.force_fields.scaled(settings.force_fields),
        dt=dt,
        small_step=small_step,
        animation_springs=springs,
        mobility=mobility,
        edge_fractions=edge_fractions(fabric, mobility, settings, small_step),
        fold_fractions=fold_fractions(fabric, settings, dt),
        radius=np.where(fabric.pinned, -np.inf, settings.radius * fabric.size).astype(np.float32),
    )
