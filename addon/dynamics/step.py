"""One frame of motion, in fixed substeps.

    repeat substep_rate times a second:
        hair grid    at some substeps: forces between hair and other hair
        drag         quadratic, through air or water
        fields       the scene's force fields push, slow down and turn
        predict      Verlet: inertia, damping, gravity, wind
        pin          the head carries the first two CVs, ties carry the CVs they hold
        springs      curls stretch; the rest of the substep keeps the resulting lengths
        style        global and local shape, one direct solve
        lengths      one direct solve, or relaxation
        contacts     find them, then alternate:  push out  |  keep lengths; again in parts if fast
        absorb       remove the speed gained by pushing out: contacts do not bounce

References: Jakobsen 2001, "Advanced Character Physics"; Nguyen and Donnelly 2005, "Hair Animation
and Rendering in the Nalu Demo", GPU Gems 2, chapter 23; Han and Harada 2012. `reference/` has a
scalar implementation, one CV at a time.

Guides are independent of each other between two moments at which hair feels hair (`hair_grid`), or
for the whole frame if it does not. So they are advanced in blocks that fit into the cache; a
guide's motion is the same to the last bit in any block.

Time shorter than a substep is left in the state for the next frame, so the result does not depend
on the frame rate; `grid_at_frame_end` bridges it for drawing.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from ..arrays import Floats
from .blend import visible_guides
from .colliders import Pose, poses_through
from .constraints import PINNED_COUNT, pin
from .contact_solver import ContactSolver, LengthConstraints
from .force_fields import apply_force_fields, strand_directions
from .forces import apply_drag, predict
from .frame import Block, Drive, Frame, check_drive, convert_styles, root_places_after
from .neighbours import FrameSteps, run_alone
from .rigid_path import RigidTransform
from .schedule import due_substeps
from .settings import DynamicsSettings
from .state import DynamicsState
from .style import restore_style

#: Maximum number of guides advanced together. With fewer, the overhead of numpy's calls dominates;
#: with more, the arrays of a substep do not fit into the cache.
MAX_BLOCK_GUIDES = 12_000


def advance(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> DynamicsState:
    """The state after a frame of `duration` seconds; `state` itself does not change.

    Raises:
        HairloomError: a drive that does not fit the state or is not finite, or a bad duration.
    """
    return run_alone(advance_in_steps(state, drive, settings, duration))


def advance_in_steps(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> FrameSteps[DynamicsState]:
    """`advance` as a generator that stops to feel other hair, see `neighbours.FrameSteps`."""
    dt = 1.0 / settings.substep_rate
    longest = settings.max_frame_time
    duration, count, time_left = due_substeps(state.time_left, duration, longest, dt)
    check_drive(state, drive, tuple(style.grid for style in state.styles))
    if not count:
        root_places = root_places_after(state, None, drive, settings, count)
        return replace(state, time_left=time_left, root_places=root_places)
    styles = convert_styles(state, drive)
    frame = Frame.of(state, drive, settings, duration, dt)
    spans = [frame.span(number) for number in range(count)]
    poses = poses_through(drive.colliders, spans)
    position, previous = state.position.copy(), _previous(state, dt)
    slices, substep_ranges = _blocks(state.guide_count), frame.substep_ranges(count)
    blocks_on_demand = (Block.of(state, frame, styles, guides) for guides in slices)
    blocks = blocks_on_demand if len(substep_ranges) == 1 else list(blocks_on_demand)
    push = None if frame.interaction is None else state.push
    for substeps in substep_ranges:
        if frame.interaction is not None and (
            push is None or frame.interaction.is_due(substeps[0])
        ):
            neighbours = yield frame.stop_before(
                state.rest, substeps[0], partial(_copy_both, position, previous)
            )
            interaction = frame.interaction.with_neighbours(neighbours)
            slowed, push = interaction.friction_and_push(position, previous)
            previous += slowed
        for guides, block in zip(slices, blocks, strict=True):
            here, before = position[:, :, guides].copy(), previous[:, :, guides].copy()
            pushed = None if push is None else push[:, :, guides]
            position[:, :, guides], previous[:, :, guides] = _advance_block(
                block, here, before, pushed, frame, spans, poses, substeps
            )
    time = state.time + count * dt
    root_places = root_places_after(state, frame, drive, settings, count)
    return DynamicsState(
        position, previous, state.rest, dt, time_left, time, styles, push, root_places
    )


def _copy_both(position: Floats, previous: Floats) -> tuple[Floats, Floats]:
    return position.copy(), previous.copy()


def _previous(state: DynamicsState, dt: float) -> Floats:
    """Where the CVs were one substep of `dt` [s] earlier, rescaled if the substep has changed."""
    if not state.substep or state.substep == dt:
        return state.previous.copy()
    motion = state.position - state.previous
    motion *= np.float32(dt / state.substep)
    return state.position - motion


def _blocks(guide_count: int) -> list[slice]:
    """All guides in blocks of nearly the same size."""
    count = -(-guide_count // MAX_BLOCK_GUIDES)
    ends = [guide_count * number // count for number in range(count + 1)] if count else [0]
    return [slice(first, last) for first, last in pairwise(ends)]


def _advance_block(
    block: Block,
    position: Floats,
    previous: Floats,
    push: Floats | None,
    frame: Frame,
    spans: list[tuple[float, float]],
    poses: list[list[Pose]],
    substeps: range,
) -> tuple[Floats, Floats]:
    """Position and previous position after these substeps; overwrites the arrays passed."""
    settings, rest, damping_factors = frame.settings, block.rest, block.damping_factors
    scratch = np.empty_like(position)
    constraints = LengthConstraints(rest.length, block.held, rest.size, settings)
    max_exit = settings.depenetration_speed * rest.size * frame.dt
    passes = settings.contact_passes if frame.drive.colliders else 0
    moves_on_arc, style_before = block.style.carrier is not None, None
    if moves_on_arc:
        root_place = frame.root_place(substeps[0] - 1) if frame.inherits_motion else None
        style_before = block.style.at(spans[substeps[0]][0], root_place)
    inherited_motion = frame.inherited_motion(substeps[0] - 1) if frame.inherits_motion else None
    for number in substeps:
        span = spans[number]
        style = block.style.at(span[1])
        here, before = position, previous
        if inherited_motion is not None:
            here, before = position, inherited_motion.apply(previous)
            inherited_motion = frame.inherited_motion(number)
            here, before = inherited_motion.apply(here), inherited_motion.apply(before)
            style_before = None if style_before is None else inherited_motion.apply(style_before)
        impulse = block.impulse_at(span, style_before, style)
        style_before = style if moves_on_arc else None
        if push is not None:
            impulse = impulse + push
        air_displacement = frame.air_displacement(position[:, 0], number)
        if settings.drag:
            apply_drag(here, before, settings.drag, air_displacement)
        if frame.force_fields is not None:
            _apply_force_fields(here, before, frame)
        if air_displacement is not None:
            impulse = impulse + air_displacement[:, None] * np.float32(damping_factors.air)
        predict(here, before, impulse, damping_factors.velocity, out=scratch)
        previous, position, scratch = position, scratch, previous
        pin(position, style, rest.length, block.held)
        if block.springs is not None:
            constraints = replace(
                constraints, length=block.springs.step(position, previous, rest.length)
            )
        restore_style(position, style, rest.shape, block.style_system)
        pin(position, style, rest.length, block.held)
        constraints.keep_lengths(position, None)
        contact_solver = ContactSolver(
            constraints, block.radius, block.segment_radius, poses[number], max_exit, passes
        )
        contact_solver.solve(position, previous)
    return position, previous


def _apply_force_fields(position: Floats, previous: Floats, frame: Frame) -> None:
    """Apply the force fields to each free CV; changes `previous`, which holds the speed."""
    fields = frame.force_fields
    assert fields is not None, "it is asked where there are any"
    here, before = (np.ascontiguousarray(rows[:, PINNED_COUNT:]) for rows in (position, previous))
    directions = (
        strand_directions(position)[:, PINNED_COUNT:].reshape(3, -1) if fields.acts_across else None
    )
    flat = before.reshape(3, -1)
    apply_force_fields(here.reshape(3, -1), flat, fields, frame.dt, frame.size, directions)
    previous[:, PINNED_COUNT:] = before


def grid_at_frame_end(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> Floats:
    """CVs at the very end of the frame, (guide_count, cv_count, 3) world [m], for drawing.

    Bridges the time left over: each guide is moved as a whole to where its root is now, and held
    CVs to where they are held. Then the result is blended with the style, see `Drive.simulated`.

    Args:
        duration: of the frame [s].
    """
    displacement: Floats = drive.target_now[:, :1] - state.position[:, 0].T[:, None]
    held_displacement = remaining_displacement(state.time_left, drive, duration)
    if held_displacement is not None:
        displacement = displacement + held_displacement
    rotation, grid = remaining_rotation(state, settings), state.grid
    if rotation is not None:
        root = grid[:, :1]
        grid = RigidTransform(rotation, np.zeros(3), np.zeros(3)).apply((grid - root).T).T + root
    grid = (grid + displacement).astype(np.float32)
    return visible_guides(grid, drive.target_now, drive.simulated)


def remaining_rotation(state: DynamicsState, settings: DynamicsSettings) -> Floats | None:
    """The rotation (3, 3) of hair about its roots in the time left over, if it inherits theirs;
    None if it does not turn."""
    if not settings.inherit_rotation or not state.time_left:
        return None
    remaining_motion = state.root_places.places[1].inverse
    return remaining_motion.scaled(0.0, settings.inherit_rotation).rotation


def remaining_displacement(time_left: float, drive: Drive, duration: float) -> Floats | None:
    """The displacement of each CV of held guides relative to its root in the time left over, in the
    shape of the targets [m]; None if nothing is held or no time is left."""
    if drive.held is None or not time_left or not duration:
        return None
    displacement: Floats = drive.target_now - drive.target_at(1.0 - min(time_left / duration, 1.0))
    displacement -= displacement[:, :1]
    displacement = drive.held.interpolated(displacement)
    displacement[~drive.held.is_held.any(axis=1)] = 0.0
    return displacement
