"""Everything that acts on the guides in a frame, checked and prepared for all guides and blocks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from .clearance import GuideClearance
from .colliders import PosedCollider
from .constraints import PINNED
from .contacts import BETWEEN, BETWEEN_RADIUS, radius_of_all
from .force_fields import NO_FIELDS, ForceFields
from .forces import Damped, combed_gravity, felt_gravity
from .hair_grid import HairInteraction, InteractionStrength
from .held import Held
from .neighbours import Stop
from .painted import PaintedFrame, PaintedGuides, painted_frame
from .rigid_path import CarriedPath, Carrier, Carry, KnownStep, LastStep, Rigid
from .settings import DynamicsSettings
from .springs import Springs
from .state import DynamicsState, Rest, StyleRows, as_rows, checked_grid
from .style import StyleBand, style_band
from .turn import root_sample, rotation_from, sample
from .wind import Air, air_of


@dataclass(frozen=True)
class Drive:
    """What acts on the guides during one frame.

    target_before, target_now: (guide_count, cv_count, 3) world [m], the style carried by the head
        at the frame's begin and end.
    colliders: with their motion during the frame.
    gravity: (3,) world [m/s^2].
    target_earlier: that style one frame earlier, which bends its path, see `trajectory.curvature`;
        None: straight.
    force_fields: of the scene.
    earlier_ratio: duration of the frame before, over that of this one.
    held: the CVs that follow their targets whatever the rest of the guide does; None: none.
    clearance: upper limit of the distance that guides keep from colliders; None: their radius.
    simulated: (guide_count,), the simulated fraction of each guide's visible motion, see
        `blend.blended`; None: all of it.
    painted: factors of the settings at each guide; None: nothing is painted.

    Pass the same arrays on from frame to frame, from now to before to earlier, so that cached
    results for them are used again.
    """

    target_before: Floats
    target_now: Floats
    colliders: tuple[PosedCollider, ...]
    gravity: Floats
    target_earlier: Floats | None = None
    force_fields: ForceFields = NO_FIELDS
    earlier_ratio: float = 1.0
    held: Held | None = None
    clearance: GuideClearance | None = None
    simulated: Floats | None = None
    painted: PaintedGuides | None = None

    @property
    def targets(self) -> tuple[Floats, ...]:
        """The targets that are not None, the latest first."""
        known = (self.target_now, self.target_before, self.target_earlier)
        return tuple(target for target in known if target is not None)

    @cached_property
    def carrier(self) -> Carrier:
        """The motion of the roots as a whole."""
        earlier = self.target_earlier
        return Carrier.through(
            root_sample(self.target_before),
            root_sample(self.target_now),
            None if earlier is None else root_sample(earlier),
            self.earlier_ratio,
        )

    @cached_property
    def style_carrier(self) -> Carrier | None:
        """`carrier` if it turns the style enough for its arc to matter; otherwise None."""
        return self.carrier if self.carrier.path.is_arc else None

    def target_at(self, moment: float) -> Floats:
        """The style at a moment of the frame, from 0 to 1, in the shape of the targets [m]."""
        before, now, earlier = (
            None if grid is None else grid.T
            for grid in (self.target_before, self.target_now, self.target_earlier)
        )
        assert before is not None and now is not None
        path = CarriedPath.through(before, now, earlier, self.earlier_ratio, self.style_carrier)
        return path.at(moment).T


def check_drive(state: DynamicsState, drive: Drive, known: tuple[Floats, ...] = ()) -> None:
    """Check that a drive fits the state.

    Args:
        known: target arrays that have been checked before.

    Raises:
        HairloomError: a drive that does not fit the state or is not finite.
    """
    for target in drive.targets:
        if any(target is one for one in known):
            continue
        guide_count, cv_count = checked_grid(target, "style").shape[:2]
        if (guide_count, cv_count) != (state.guide_count, state.cv_count):
            raise HairloomError(
                f"the style has {guide_count} guides of {cv_count} CVs, but the simulation has "
                f"{state.guide_count} of {state.cv_count}",
                place="dynamics",
                remedy="Start the simulation again",
            )
    if drive.held is not None and drive.held.is_held.shape != (state.guide_count, state.cv_count):
        raise HairloomError(
            f"ties hold {drive.held.is_held.shape} guides and CVs, but the simulation has "
            f"{(state.guide_count, state.cv_count)}",
            place="dynamics",
            remedy="Start the simulation again",
        )
    clearance = drive.clearance
    if clearance is not None and clearance.distances.shape[:2] != (
        state.guide_count,
        state.cv_count,
    ):
        raise HairloomError(
            f"there are distances from colliders for {clearance.distances.shape[:2]} guides and "
            f"CVs, but the simulation has {(state.guide_count, state.cv_count)}",
            place="dynamics",
            remedy="Start the simulation again",
        )
    if drive.simulated is not None and drive.simulated.shape != (state.guide_count,):
        raise HairloomError(
            f"there are values of Influence for {drive.simulated.shape} guides, but the "
            f"simulation has {state.guide_count}",
            place="dynamics",
            remedy="Start the simulation again",
        )
    if drive.painted is not None and not drive.painted.fits(state.cv_count, state.guide_count):
        raise HairloomError(
            f"painted values are not {state.guide_count} finite numbers, one for each guide",
            place="dynamics",
            remedy="Start the simulation again",
        )
    if np.shape(drive.gravity) != (3,) or not np.isfinite(drive.gravity).all():
        raise HairloomError(
            "gravity is not three finite numbers",
            place="dynamics",
            remedy="Check the scene's gravity",
        )
    if not np.isfinite(drive.force_fields.table).all():
        raise HairloomError(
            "a force field has numbers that are not finite",
            place="dynamics",
            remedy="Check the scene's force fields",
        )


def carried_after(
    state: DynamicsState, frame: Frame | None, drive: Drive, settings: DynamicsSettings, count: int
) -> LastStep | KnownStep:
    """`DynamicsState.carried` after a frame of `count` substeps.

    Args:
        frame: None if there are no substeps.
    """
    if not inherits(settings):
        return (
            state.carried if frame is None else LastStep(drive.carrier.path, frame.span(count - 1))
        )
    known = state.carried.places
    if frame is not None:
        known = frame.place(count - 2), frame.place(count - 1)
    before, now = (place.since(drive.carrier.path.now) for place in known)
    return KnownStep((before, now))


def inherits(settings: DynamicsSettings) -> bool:
    """Whether hair takes over a part of the roots' motion without inertia."""
    return settings.inherit_location > 0.0 or settings.inherit_rotation > 0.0


def style_rows(state: DynamicsState, drive: Drive) -> tuple[StyleRows, ...]:
    """The drive's targets as rows, taken from the state if the last frame has converted them."""
    known = {id(style.grid): style for style in state.styles}
    return tuple(
        known.get(id(target)) or StyleRows(target, as_rows(target)) for target in drive.targets
    )


@dataclass(frozen=True)
class Frame:
    """The data of a frame that all guides share."""

    drive: Drive
    settings: DynamicsSettings
    dt: float
    duration: float
    time: float  # [s] of the first substep, on the clock of the gusts
    time_left: float
    turn: Floats
    matrix: StyleBand
    damped: Damped
    air: Air | None
    force_fields: ForceFields | None  # None where none acts
    size: float  # of the hair [m], see `state.Rest`
    interaction: HairInteraction | None  # None if hair does not feel other hair
    painted: PaintedFrame | None  # None where nothing is painted
    begun: LastStep | KnownStep  # see `DynamicsState.carried`
    speed_ratio: float  # of a substep to the one before the frame

    @classmethod
    def of(
        cls,
        state: DynamicsState,
        drive: Drive,
        settings: DynamicsSettings,
        duration: float,
        dt: float,
    ) -> Frame:
        turn: Floats = np.eye(3)
        interaction, painted = None, None
        if drive.painted is not None and drive.painted.is_of_motion:
            painted = painted_frame(drive.painted, settings, state.cv_count, state.guide_count, dt)
        if state.guide_count:
            before, now = (sample(grid) for grid in (drive.target_before, drive.target_now))
            turn = rotation_from(state.rest.sample, (before + now) / 2.0)
            volume = None if painted is None else painted.volume
            interaction = _hair_interaction(state, drive, settings, turn, dt, volume)
        matrix = style_band(settings, state.cv_count, dt)
        air, fields = air_of(settings), drive.force_fields.by(settings.force_fields)
        time, left, size = state.time, state.time_left, state.rest.size
        return cls(
            drive,
            settings,
            dt,
            duration,
            time,
            left,
            turn,
            matrix,
            Damped.of(settings, dt),
            air,
            fields,
            size,
            interaction,
            painted,
            state.carried,
            dt / state.substep if state.substep else 1.0,
        )

    def pieces(self, count: int) -> list[range]:
        """Ranges of substeps in which guides are independent of each other."""
        return (
            [range(count)] if self.interaction is None else self.interaction.substep_ranges(count)
        )

    def stop(self, rest: Rest, number: int, read: Callable[[], tuple[Floats, Floats]]) -> Stop:
        """The stop before a substep in which hair feels hair, see `Stop`."""
        assert self.interaction is not None, "it feels"
        step = self.dt / self.duration
        ahead = self.interaction.strength.look_ahead * step
        return Stop(self.span(number)[0], step, ahead, rest, self.drive.target_before, read)

    @property
    def inherits(self) -> bool:
        """See `inherits`."""
        return inherits(self.settings)

    @property
    def style_carrier(self) -> Carrier | None:
        """See `Drive.style_carrier`."""
        return self.drive.carrier if self.inherits else self.drive.style_carrier

    def place(self, number: int) -> Rigid:
        """Where the roots as a whole are after a substep, relative to the frame's begin; -1: before
        the first substep."""
        return (
            self.begun.places[1] if number < 0 else self.drive.carrier.path.at(self.span(number)[1])
        )

    def inherited(self, number: int) -> Carry:
        """The motion that hair takes over from the roots without inertia in a substep; -1: in the
        last one of the frame before."""
        settings, ratio = self.settings, 1.0
        if number >= 0:
            now, before = self.place(number), self.place(number - 1)
        else:
            before, now, ratio = *self.begun.places, self.speed_ratio
        motion = now.since(before).part(
            settings.inherit_location * ratio, settings.inherit_rotation * ratio
        )
        return self.drive.carrier.carry(motion, before)

    def span(self, number: int) -> tuple[float, float]:
        """Begin and end of a substep as fractions of the frame."""
        begin = (number * self.dt - self.time_left) / self.duration
        return begin, begin + self.dt / self.duration

    def air_displacement(self, roots: Floats, number: int) -> Floats | None:
        """The displacement of the air at the roots (3, n) in a substep [m]; None in still air."""
        if self.air is None:
            return None
        return self.air.at(roots, self.time + number * self.dt) * np.float32(self.dt)


def _hair_interaction(
    state: DynamicsState,
    drive: Drive,
    settings: DynamicsSettings,
    turn: Floats,
    dt: float,
    volume: Floats | None,
) -> HairInteraction | None:
    """The hair grid in a frame; None if hair does not feel other hair.

    The grid is placed at the roots halfway through the frame, and turned with the groom.

    Args:
        volume: see `HairInteraction`.
    """
    strength = InteractionStrength.of(settings, dt)
    if strength is None or state.cv_count <= PINNED:
        return None
    grid = state.rest.hair_grid
    ends = [target[:, 0].mean(axis=0, dtype=np.float64) for target in drive.targets[:2]]
    placement = grid.placement(turn, (ends[0] + ends[1]) / 2.0)
    return HairInteraction(grid, placement, turn, strength, round(state.time / dt), volume)


@dataclass(frozen=True)
class Block:
    """Some guides prepared for a frame, rows (3, cv_count, n) world [m].

    style: the path on which the head carries the CVs.
    impulse, impulse_curvature: displacement of each CV by gravity and the moving style in a
        substep, and its change as the path of the style bends. If the style moves on an arc,
        gravity alone.
    radius: (cv_count * n,) [m], the distance that each CV keeps from colliders; read-only.
    between: (len(BETWEEN), cv_count * n) [m], the same for points of the segment that ends there.
    held: (cv_count, n), see `held.Held.rows`; None if none of these guides is held.
    springs: of the curled guides; None if none of these can stretch.
    matrix, damped: those of the frame, or individual ones of each guide.
    """

    rest: Rest
    style: CarriedPath
    impulse: Floats
    impulse_curvature: Floats | None
    radius: Floats
    between: Floats
    held: Floats | None
    springs: Springs | None
    matrix: StyleBand
    damped: Damped

    @classmethod
    def of(
        cls, state: DynamicsState, frame: Frame, styles: tuple[StyleRows, ...], guides: slice
    ) -> Block:
        """Args:
        styles: as `style_rows` gives them.
        """
        drive, settings, dt = frame.drive, frame.settings, frame.dt
        now, before, *earlier = (style.rows[:, :, guides] for style in styles)
        since = earlier[0] if earlier else None
        style = CarriedPath.through(before, now, since, drive.earlier_ratio, frame.style_carrier)
        middle: Floats = before + (now - before) * np.float32(0.5)
        if style.carrier is not None:
            middle = style.at(0.5)
        own = None if frame.painted is None else frame.painted.part(guides)
        matrix, damped = frame.matrix, frame.damped
        if own is not None:
            matrix, damped = own.matrix, own.damped
        felt = felt_gravity(drive.gravity, settings, frame.turn, middle) * np.float32(dt * dt)
        if own is not None:
            felt = felt * own.gravity
        impulse: Floats = np.asarray(felt)
        bent: Floats | None = None
        if style.carrier is None:
            carried = np.float32(damped.carried * (dt / frame.duration))
            impulse = style.displacement * carried
            impulse += felt
            bent = None if style.curvature is None else style.curvature * carried
        radius = radius_of_all(settings, state.cv_count, before.shape[2], state.rest.size)
        between = np.tile(radius * BETWEEN_RADIUS, (len(BETWEEN), 1))
        if drive.clearance is not None:
            known = drive.clearance.rows[:, :, guides].reshape(1 + len(BETWEEN), -1)
            radius, between = np.minimum(radius, known[0]), np.minimum(between, known[1:])
        held = None if drive.held is None else drive.held.rows[:, guides]
        if held is not None and held.any():
            is_held = held.ravel() > 0.0
            radius = np.where(is_held, np.float32(-np.inf), radius)
            between[:, is_held] = -np.inf
        else:
            held = None
        rest = state.rest.part(guides)
        combed = combed_gravity(drive.gravity, settings, frame.turn)
        springs = Springs.of(rest.room, rest.length, middle, combed, held, settings, dt)
        if springs is not None and own is not None:
            springs = replace(springs, load=springs.load * own.gravity[springs.guides])
        return cls(
            rest,
            style,
            impulse,
            bent,
            radius,
            between,
            held,
            springs,
            matrix,
            damped,
        )

    def impulse_at(self, span: tuple[float, float], begin: Floats | None, end: Floats) -> Floats:
        """The displacement [m] of each CV by gravity and the moving style in a substep; read-only.

        Args:
            span: the substep's begin and end as fractions of the frame.
            begin, end: the style at its begin and end; `begin` is None unless it moves on an arc.
        """
        if begin is not None:
            moved = end - begin
            moved *= np.float32(self.damped.carried)
            moved += self.impulse
            return moved
        if self.impulse_curvature is None:
            return self.impulse
        impulse = self.impulse_curvature * np.float32(span[0] + span[1] - 1.0)
        impulse += self.impulse
        return impulse
