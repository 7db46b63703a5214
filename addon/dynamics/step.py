"""One frame of motion, in fixed substeps.

    repeat substep_rate times a second:
        among        now and then: hair feels other hair
        brake        drag by the square of the speed through the air
        blow         the scene's force fields push, slow down and turn
        predict      Verlet: inertia, damping, gravity, wind
        pin          the head carries the first two CVs, ties carry what they hold
        springs      curls give along themselves; the lengths that they leave are kept from there on
        style        global and local shape, one direct solve
        lengths      one direct solve, or relaxation
        contacts     found once, then in turn:  push out  |  keep lengths
        absorb       what was pushed out does not bounce

References: Jakobsen 2001, "Advanced Character Physics"; Nguyen and Donnelly 2005, "Hair Animation
and Rendering in the Nalu Demo", GPU Gems 2, chapter 23; Han and Harada 2012. `reference/` holds
the same, one CV after the other.

Between two moments at which hair feels hair (`among`), and where it does not for the whole frame,
guides are on their own. So they are advanced in blocks that fit into the cache; a guide's motion is
the same to the last bit in any block.

Time that is shorter than a substep waits in the state for the next frame, so the result does not
depend on the frame rate; `grid_at_frame_end` bridges it for drawing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arrays import Floats, Ints
from .blend import blended
from .colliders import Pose, poses_through
from .constraints import (
    PINNED,
    Touched,
    finish_lengths,
    hold_within_reach,
    keep_lengths,
    pin,
    relax_lengths,
)
from .contacts import (
    MORE_ROUNDS,
    Contacts,
    find_between,
    find_contacts,
    spacing_of,
    touched_by,
)
from .force_fields import along_strands, blow
from .forces import brake, predict
from .frame import Block, Drive, Frame, carried_after, check_drive, style_rows
from .rigid_path import Carry
from .schedule import due_substeps
from .settings import DynamicsSettings
from .state import DynamicsState
from .style import restore_style

__all__ = ["Drive", "advance", "displacement_beside_root", "grid_at_frame_end"]

#: Guides that are advanced together, at most. Fewer, and numpy's calls cost more than the numbers;
#: more, and the arrays of a substep leave the cache.
BLOCK = 12_000


def advance(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> DynamicsState:
    """The state after a frame of `duration` seconds; the state given stays as it is.

    Raises:
        HairloomError: a drive that does not fit the state or is not finite, or a bad duration.
    """
    dt = 1.0 / settings.substep_rate
    longest = settings.longest_frame
    duration, count, left = due_substeps(state.time_left, duration, longest, dt)
    check_drive(state, drive, tuple(style.grid for style in state.styles))
    if not count:
        carried = carried_after(state, None, drive, settings, count)
        return replace(state, time_left=left, carried=carried)
    styles = style_rows(state, drive)
    frame = Frame.of(state, drive, settings, duration, dt)
    spans = [frame.span(number) for number in range(count)]
    poses = poses_through(drive.colliders, spans)
    position, previous = state.position.copy(), _previous(state, dt)
    slices, pieces = _blocks(state.guide_count), frame.pieces(count)
    made = (Block.of(state, frame, styles, guides) for guides in slices)
    blocks = made if len(pieces) == 1 else list(made)
    push = None if frame.among is None else state.push
    for numbers in pieces:
        if frame.among is not None and (push is None or frame.among.is_due(numbers[0])):
            taken, push = frame.among.feel(position, previous)
            previous += taken
        for guides, block in zip(slices, blocks, strict=True):
            here, before = position[:, :, guides].copy(), previous[:, :, guides].copy()
            pushed = None if push is None else push[:, :, guides]
            position[:, :, guides], previous[:, :, guides] = _advance_block(
                block, here, before, pushed, frame, spans, poses, numbers
            )
    time = state.time + count * dt
    carried = carried_after(state, frame, drive, settings, count)
    return DynamicsState(position, previous, state.rest, dt, left, time, styles, push, carried)


def _previous(state: DynamicsState, dt: float) -> Floats:
    """Where the CVs were a substep of `dt` [s] earlier."""
    if not state.substep or state.substep == dt:
        return state.previous.copy()
    motion = state.position - state.previous
    motion *= np.float32(dt / state.substep)
    return state.position - motion


def _blocks(guide_count: int) -> list[slice]:
    """All guides in blocks of nearly the same size."""
    count = -(-guide_count // BLOCK)
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
    numbers: range,
) -> tuple[Floats, Floats]:
    """Position and previous position after these substeps; takes the arrays."""
    settings, rest, damped = frame.settings, block.rest, block.damped
    spare = np.empty_like(position)
    chain = _Chain(rest.length, block.held, rest.size, settings)
    is_arc, begun = block.style.carrier is not None, None
    if is_arc:
        first = frame.place(numbers[0] - 1) if frame.inherits else None
        begun = block.style.at(spans[numbers[0]][0], first)
    inherited = frame.inherited(numbers[0] - 1) if frame.inherits else None
    for number in numbers:
        span = spans[number]
        style = block.style.at(span[1])
        here, before = position, previous
        if inherited is not None:
            here, before = position, inherited.moved(previous)
            inherited = frame.inherited(number)
            here, before = inherited.moved(here), inherited.moved(before)
            begun = None if begun is None else inherited.moved(begun)
        impulse = block.impulse_at(span, begun, style)
        begun = style if is_arc else None
        if push is not None:
            impulse = impulse + push
        air_displacement = frame.air_displacement(position[:, 0], number)
        if settings.drag:
            brake(here, before, settings.drag, air_displacement)
        if frame.force_fields is not None:
            _blow(here, before, frame)
        if air_displacement is not None:
            impulse = impulse + air_displacement[:, None] * np.float32(damped.air)
        predict(here, before, impulse, damped.kept, out=spare)
        previous, position, spare = position, spare, previous
        pin(position, style, rest.length, block.held)
        if block.springs is not None:
            chain = replace(chain, length=block.springs.step(position, previous, rest.length))
        restore_style(position, style, rest.shape, block.matrix)
        pin(position, style, rest.length, block.held)
        chain.keep_lengths(position, None)
        _keep_outside(position, previous, block, chain, frame, poses[number])
    return position, previous


def _blow(position: Floats, previous: Floats, frame: Frame) -> None:
    """The force fields at each free CV; changes `previous`, which holds the speed."""
    fields = frame.force_fields
    assert fields is not None, "it is asked where there are any"
    here, before = (np.ascontiguousarray(rows[:, PINNED:]) for rows in (position, previous))
    along = along_strands(position)[:, PINNED:].reshape(3, -1) if fields.is_across else None
    flat = before.reshape(3, -1)
    blow(here.reshape(3, -1), flat, fields, frame.dt, frame.size, along)
    previous[:, PINNED:] = before


def grid_at_frame_end(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> Floats:
    """CVs at the frame's very end, (guide_count, cv_count, 3) world [m], for drawing.

    Bridges the time that is left over: each guide is moved as a whole to where its root is now,
    and what is held to where it is held. What is not to be seen of the simulation goes with the
    style.

    Args:
        duration: of the frame [s].
    """
    displacement: Floats = drive.target_now[:, :1] - state.position[:, 0].T[:, None]
    beside_root = displacement_beside_root(state.time_left, drive, duration)
    if beside_root is not None:
        displacement = displacement + beside_root
    turn, grid = turned_beside_root(state, settings), state.grid
    if turn is not None:
        root = grid[:, :1]
        grid = Carry(turn, np.zeros(3), np.zeros(3)).moved((grid - root).T).T + root
    grid = (grid + displacement).astype(np.float32)
    if drive.simulated is None:
        return grid
    return blended(grid, drive.target_now.astype(np.float32), drive.simulated)


def turned_beside_root(state: DynamicsState, settings: DynamicsSettings) -> Floats | None:
    """How hair turns about its roots (3, 3) in the time left over, where it inherits their
    rotation; None: not."""
    if not settings.inherit_rotation or not state.time_left:
        return None
    left = state.carried.places[1].inverse
    return left.part(0.0, settings.inherit_rotation).rotation


def displacement_beside_root(time_left: float, drive: Drive, duration: float) -> Floats | None:
    """How much more than its root each CV of held guides moves in the time left over, in the shape
    of the targets [m]; None where nothing is held, or no time is left."""
    if drive.held is None or not time_left or not duration:
        return None
    displacement: Floats = drive.target_now - drive.target_at(1.0 - min(time_left / duration, 1.0))
    displacement -= displacement[:, :1]
    displacement = drive.held.spread(displacement)
    displacement[~drive.held.is_held.any(axis=1)] = 0.0
    return displacement


@dataclass(frozen=True)
class _Chain:
    """What keeps guides in one piece; length, held: see `Block`. size: of the hair [m]."""

    length: Floats
    held: Floats | None
    size: float
    settings: DynamicsSettings

    def part(self, guides: Ints) -> _Chain:
        held = None if self.held is None else self.held[:, guides]
        return replace(self, length=self.length[:, guides], held=held)

    def keep_lengths(self, position: Floats, touched: Touched | None) -> None:
        if self.settings.length_solver == "direct":
            keep_lengths(position, self.length, touched, self.held)
            return
        relax_lengths(position, self.length, self.held, self.settings.relaxations)
        if self.settings.long_range:
            hold_within_reach(position, self.length, self.held)


def _keep_outside(
    position: Floats, previous: Floats, block: Block, chain: _Chain, frame: Frame, poses: list[Pose]
) -> None:
    """Contacts and lengths in turn; lengths come last, and slide along what touches.

    Guides that touch nothing take part, so that none depends on what others do.
    """
    settings, size = frame.settings, block.rest.size
    here, was = (rows.reshape(3, -1) for rows in (position, previous))
    led_out = settings.depenetration_speed * size * frame.dt
    spacing = spacing_of(size, position.shape[1])
    contacts = find_contacts(here, was, block.radius, poses, led_out, size, spacing)
    guide_count = position.shape[2]
    contacts += find_between(
        here, was, block.radius, block.between, poses, led_out, size, guide_count
    )
    passes = settings.contact_passes if frame.drive.colliders else 0
    _solve_in_turn(position, chain, contacts, passes)
    _solve_again(position, chain, contacts)
    for one in contacts:
        one.absorb(here, was)


def _solve_in_turn(position: Floats, chain: _Chain, contacts: list[Contacts], passes: int) -> None:
    """Contacts and lengths, and lengths at last."""
    touched, settings = None, chain.settings
    here = position.reshape(3, -1)
    for _ in range(passes):
        touching = [one.push_out(here, settings.friction) for one in contacts]
        touched = touched_by(contacts, touching)
        chain.keep_lengths(position, touched)
    if settings.length_solver == "direct":
        tolerance, iterations = settings.length_tolerance, settings.length_iterations
        length, held, size = chain.length, chain.held, chain.size
        finish_lengths(position, length, touched, held, tolerance, iterations, size)


def _solve_again(position: Floats, chain: _Chain, contacts: list[Contacts]) -> None:
    """Once more in turn, for guides that their lengths have drawn into a collider."""
    guide_count = position.shape[2]
    guides = _missing(position, contacts)
    for _ in range(MORE_ROUNDS):
        if not guides.size:
            return
        some, own = (
            position.take(guides, axis=2),
            [one.part(guides, guide_count) for one in contacts],
        )
        _solve_in_turn(some, chain.part(guides), own, 1)
        position[:, :, guides] = some
        for one, part in zip(contacts, own, strict=True):
            one.note(part, guides, guide_count)
        guides = guides[_missing(some, own)]


def _missing(position: Floats, contacts: list[Contacts]) -> Ints:
    """Guides, rising, of which a CV or segment is farther below its plane than it may be."""
    here, guide_count = position.reshape(3, -1), position.shape[2]
    found = [one.index[one.missing(here)] % guide_count for one in contacts]
    return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)
