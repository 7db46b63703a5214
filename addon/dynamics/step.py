"""One frame of motion, in fixed substeps.

    repeat substep_rate times a second:
        predict      Verlet: inertia, damping, gravity
        pin          the head carries the first two CVs
        style        global and local shape, one direct solve
        lengths      one direct solve
        contacts     found once, then in turn:  push out  |  keep lengths
        absorb       what was pushed out does not bounce

References: Jakobsen 2001, "Advanced Character Physics"; Nguyen and Donnelly 2005, "Hair Animation
and Rendering in the Nalu Demo", GPU Gems 2, chapter 23; Han and Harada 2012. `reference.py` holds
the same, one CV after the other.

Time that is shorter than a substep waits in the state for the next frame, so the result does not
depend on the frame rate; `grid_at_frame_end` bridges it for drawing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from .colliders import PosedCollider
from .constraints import finish_lengths, keep_lengths, pin
from .contacts import Contacts, find_contacts, touched_normals
from .forces import carried_share, felt_gravity, predict, speed_kept
from .settings import DynamicsSettings
from .state import DynamicsState, rows_of
from .style import restore_style, style_band

#: A substep is due when all but this share of it has passed, so that 4 / 240 s is one 60th.
_DUE = 1.0e-6


@dataclass(frozen=True)
class Drive:
    """What acts on the guides during one frame.

    target_before, target_now: (guide_count, cv_count, 3) world [m], the style carried by the head
        at the frame's begin and end.
    colliders: with their way during the frame.
    gravity: (3,) world [m/s^2].
    """

    target_before: Floats
    target_now: Floats
    colliders: tuple[PosedCollider, ...]
    gravity: Floats


@dataclass(frozen=True)
class _Frame:
    """A drive made ready: rows (3, cv_count, guide_count), and what is constant over the frame."""

    style_before: Floats
    style_way: Floats
    impulse: Floats  # [m] that a substep adds to each CV
    duration: float

    def style_at(self, moment: float) -> Floats:
        return self.style_before + self.style_way * np.float32(moment)


def advance(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> DynamicsState:
    """The state after a frame of `duration` seconds; the state given stays as it is.

    Raises:
        HairloomError: a drive that does not fit the state or is not finite, or a bad duration.
    """
    dt = 1.0 / settings.substep_rate
    duration, count, left = _schedule(state, settings, duration, dt)
    if not count:
        return replace(state, time_left=left)
    frame = _prepare(state, drive, settings, duration, dt)
    matrix = style_band(settings, state.cv_count, dt)
    rest = state.rest
    position, previous = state.position.copy(), state.previous.copy()
    spare = np.empty_like(position)
    kept = speed_kept(settings, dt) * (dt / state.substep if state.substep else 1.0)

    for number in range(count):
        begin = (number * dt - state.time_left) / duration
        span = (begin, begin + dt / duration)
        style = frame.style_at(span[1])
        predict(position, previous, frame.impulse, kept, out=spare)
        previous, position, spare = position, spare, previous
        pin(position, style)
        restore_style(position, style, rest.shape, matrix)
        keep_lengths(position, rest.length, None)
        contacts = find_contacts(position, previous, drive.colliders, span, settings, dt)
        _keep_outside(position, rest.length, contacts, settings)
        for one in contacts:
            one.absorb(position, previous)
        kept = speed_kept(settings, dt)
    return DynamicsState(position, previous, rest, substep=dt, time_left=left)


def grid_at_frame_end(state: DynamicsState, drive: Drive) -> Floats:
    """CVs at the frame's very end, (guide_count, cv_count, 3) world [m], for drawing.

    Bridges the time that is left over: each guide is moved as a whole to where its root is now.
    """
    root_way = drive.target_now[:, :1] - state.position[:, 0].T[:, None]
    return (state.grid + root_way).astype(np.float32)


def _keep_outside(
    position: Floats, length: Floats, contacts: list[Contacts], settings: DynamicsSettings
) -> None:
    """Contacts and lengths in turn; lengths come last, and slide along what touches."""
    normals = None
    for _ in range(settings.contact_passes if contacts else 0):
        touching = [one.push_out(position, settings.friction) for one in contacts]
        normals = touched_normals(contacts, touching, position)
        keep_lengths(position, length, normals)
    tolerance, iterations = settings.length_tolerance, settings.length_iterations
    finish_lengths(position, length, normals, tolerance, iterations)


def _schedule(
    state: DynamicsState, settings: DynamicsSettings, duration: float, dt: float
) -> tuple[float, int, float]:
    """The simulated duration [s], how many substeps are due, and the time left after them [s]."""
    if not math.isfinite(duration) or duration < 0.0:
        raise HairloomError(
            f"a frame of {duration} seconds cannot be simulated",
            place="dynamics",
            remedy="Check the scene's frame rate",
        )
    duration = min(duration, settings.longest_frame)
    time = state.time_left + duration
    count = math.floor(time / dt + _DUE) if duration else 0
    left = time - count * dt
    return duration, count, 0.0 if left < _DUE * dt else left


def _prepare(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float, dt: float
) -> _Frame:
    before, now = rows_of(drive.target_before, "style"), rows_of(drive.target_now, "style")
    gravity = np.asarray(drive.gravity, np.float32)
    if before.shape != state.position.shape or now.shape != state.position.shape:
        raise HairloomError(
            f"the style has {before.shape[2]} guides of {before.shape[1]} CVs, "
            f"the simulation {state.guide_count} of {state.cv_count}",
            place="dynamics",
            remedy="Start the simulation again",
        )
    if gravity.shape != (3,) or not np.isfinite(gravity).all():
        raise HairloomError(
            "gravity is not three finite numbers",
            place="dynamics",
            remedy="Check the scene's gravity",
        )
    way = now - before
    felt = felt_gravity(gravity, settings, state.rest.position, before + way * np.float32(0.5))
    impulse = way * np.float32(carried_share(settings, dt) * dt / duration)
    impulse += felt * np.float32(dt * dt)
    return _Frame(before, way, impulse, duration)
