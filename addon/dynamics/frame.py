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
from .constraints import PINNED_COUNT
from .contacts import SEGMENT_POINTS, SEGMENT_RADIUS, all_cv_radii
from .force_fields import NO_FIELDS, ForceFields
from .forces import DampingFactors, compensated_gravity, effective_gravity
from .groom_rotation import fit_rotation, sample_guides, sample_roots
from .hair_grid import HairInteraction, InteractionStrength
from .held import HeldCvs
from .neighbours import Stop
from .painted import PaintedFrame, PaintedGuides, painted_frame
from .rigid_path import CarriedPath, Carrier, KnownSubstep, LastSubstep, RigidMotion, RigidTransform
from .settings import DynamicsSettings
from .springs import Springs
from .state import DynamicsState, Rest, StyleRows, as_rows, checked_grid
from .style import StyleSystem, style_system
from .wind import Air, air_from_settings


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
    held: HeldCvs | None = None
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
            sample_roots(self.target_before),
            sample_roots(self.target_now),
            None if earlier is None else sample_roots(earlier),
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


def check_drive(state: DynamicsState, drive: Drive, checked: tuple[Floats, ...] = ()) -> None:
    """Check that a drive fits the state.

    Args:
        checked: targets, (guide_count, cv_count, 3), that have been checked before.

    Raises:
        HairloomError: a drive that does not fit the state or is not finite.
    """
    for target in drive.targets:
        if any(target is one for one in checked):
            continue
        guide_count, cv_count = checked_grid(target, "style").shape[:2]
        if (guide_count, cv_count) != (state.guide_count, state.cv_count):
            raise HairloomError(
                f"the style has {guide_count} guides of {cv_count} CVs, but the simulation has "
                f"{state.guide_count} of {state.cv_count}",
                place=DynamicsSettings.title,
                remedy="Start the simulation again",
            )
    if drive.held is not None and drive.held.is_held.shape != (state.guide_count, state.cv_count):
        raise HairloomError(
            f"ties hold {drive.held.is_held.shape} guides and CVs, but the simulation has "
            f"{(state.guide_count, state.cv_count)}",
            place=DynamicsSettings.title,
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
            place=DynamicsSettings.title,
            remedy="Start the simulation again",
        )
    if drive.simulated is not None and drive.simulated.shape != (state.guide_count,):
        raise HairloomError(
            f"there are values of Influence for {drive.simulated.shape} guides, but the "
            f"simulation has {state.guide_count}",
            place=DynamicsSettings.title,
            remedy="Start the simulation again",
        )
    if drive.painted is not None and not drive.painted.has_shape(state.cv_count, state.guide_count):
        raise HairloomError(
            f"painted values are not {state.guide_count} finite numbers, one for each guide",
            place=DynamicsSettings.title,
            remedy="Start the simulation again",
        )
    if np.shape(drive.gravity) != (3,) or not np.isfinite(drive.gravity).all():
        raise HairloomError(
            "gravity is not three finite numbers",
            place=DynamicsSettings.title,
            remedy="Check the scene's gravity",
        )
    if not np.isfinite(drive.force_fields.table).all():
        raise HairloomError(
            "a force field has numbers that are not finite",
            place=DynamicsSettings.title,
            remedy="Check the scene's force fields",
        )


def root_places_after(
    state: DynamicsState, frame: Frame | None, drive: Drive, settings: DynamicsSettings, count: int
) -> LastSubstep | KnownSubstep:
    """`DynamicsState.root_places` after a frame of `count` substeps.

    Args:
        frame: None if there are no substeps.
    """
    if not inherits_motion(settings):
        return (
            state.root_places
            if frame is None
            else LastSubstep(drive.carrier.path, frame.span(count - 1))
        )
    places = state.root_places.places
    if frame is not None:
        places = frame.root_place(count - 2), frame.root_place(count - 1)
    before, now = (place.relative_to(drive.carrier.path.now) for place in places)
    return KnownSubstep((before, now))


def inherits_motion(settings: DynamicsSettings) -> bool:
    """Whether hair takes over a part of the roots' motion without inertia."""
    return settings.inherit_location > 0.0 or settings.inherit_rotation > 0.0


def convert_styles(state: DynamicsState, drive: Drive) -> tuple[StyleRows, ...]:
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
    rotation: Floats
    style_system: StyleSystem
    damping_factors: DampingFactors
    air: Air | None
    force_fields: ForceFields | None  # None where none acts
    size: float  # of the hair [m], see `state.Rest`
    interaction: HairInteraction | None  # None if hair does not feel other hair
    painted: PaintedFrame | None  # None where nothing is painted
    last_root_places: LastSubstep | KnownSubstep  # see `DynamicsState.root_places`
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
        rotation: Floats = np.eye(3)
        interaction, painted = None, None
        if drive.painted is not None and drive.painted.affects_motion:
            painted = painted_frame(drive.painted, settings, state.cv_count, state.guide_count, dt)
        if state.guide_count:
            before, now = (sample_guides(grid) for grid in (drive.target_before, drive.target_now))
            rotation = fit_rotation(state.rest.sample_points, (before + now) / 2.0)
            volume = None if painted is None else painted.volume
            interaction = _hair_interaction(state, drive, settings, rotation, dt, volume)
        system = style_system(settings, state.cv_count, dt)
        air, fields = air_from_settings(settings), drive.force_fields.scaled(settings.force_fields)
        time, time_left, size = state.time, state.time_left, state.rest.size
        return cls(
            drive,
            settings,
            dt,
            duration,
            time,
            time_left,
            rotation,
            system,
            DampingFactors.of(settings, dt),
            air,
            fields,
            size,
            interaction,
            painted,
            state.root_places,
            dt / state.substep if state.substep else 1.0,
        )

    def substep_ranges(self, count: int) -> list[range]:
        """Ranges of substeps in which guides are independent of each other."""
        return (
            [range(count)] if self.interaction is None else self.interaction.substep_ranges(count)
        )

    def stop_before(
        self, rest: Rest, number: int, read: Callable[[], tuple[Floats, Floats]]
    ) -> Stop:
        """The stop before a substep in which hair feels hair, see `Stop`."""
        assert self.interaction is not None, "it feels"
        step = self.dt / self.duration
        ahead = self.interaction.strength.look_ahead * step
        return Stop(self.span(number)[0], step, ahead, rest, self.drive.target_before, read)

    @property
    def inherits_motion(self) -> bool:
        """See `inherits_motion`."""
        return inherits_motion(self.settings)

    @property
    def style_carrier(self) -> Carrier | None:
        """See `Drive.style_carrier`."""
        return self.drive.carrier if self.inherits_motion else self.drive.style_carrier

    def root_place(self, number: int) -> RigidMotion:
        """Where the roots as a whole are after a substep, relative to the frame's begin; -1: before
        the first substep."""
        return (
            self.last_root_places.places[1]
            if number < 0
            else self.drive.carrier.path.at(self.span(number)[1])
        )

    def inherited_motion(self, number: int) -> RigidTransform:
        """The motion that hair takes over from the roots without inertia in a substep; -1: in the
        last one of the frame before."""
        settings, speed_ratio = self.settings, 1.0
        if number >= 0:
            now, before = self.root_place(number), self.root_place(number - 1)
        else:
            before, now, speed_ratio = *self.last_root_places.places, self.speed_ratio
        motion = now.relative_to(before).scaled(
            settings.inherit_location * speed_ratio, settings.inherit_rotation * speed_ratio
        )
        return self.drive.carrier.transform(motion, before)

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
    rotation: Floats,
    dt: float,
    volume: Floats | None,
) -> HairInteraction | None:
    """The hair grid in a frame; None if hair does not feel other hair.

    The grid is placed at the roots halfway through the frame, and turned with the groom.

    Args:
        volume: see `HairInteraction`.
    """
    strength = InteractionStrength.of(settings, dt)
    if strength is None or state.cv_count <= PINNED_COUNT:
        return None
    grid = state.rest.hair_grid
    ends = [target[:, 0].mean(axis=0, dtype=np.float64) for target in drive.targets[:2]]
    placement = grid.placement(rotation, (ends[0] + ends[1]) / 2.0)
    return HairInteraction(grid, placement, rotation, strength, round(state.time / dt), volume)


@dataclass(frozen=True)
class Block:
    """Some guides prepared for a frame, rows (3, cv_count, n) world [m].

    style: the path on which the head carries the CVs.
    impulse, impulse_curvature: displacement of each CV by gravity and the moving style in a
        substep, and its change as the path of the style bends. If the style moves on an arc,
        gravity alone.
    radius: (cv_count * n,) [m], the distance that each CV keeps from colliders; read-only.
    segment_radius: (len(SEGMENT_POINTS), cv_count * n) [m], the same for points of the segment that
        ends there.
    held: (cv_count, n), see `held.HeldCvs.rows`; None if none of these guides is held.
    springs: of the curled guides; None if none of these can stretch.
    style_system, damping_factors: those of the frame, or individual ones of each guide.
    """

    rest: Rest
    style: CarriedPath
    impulse: Floats
    impulse_curvature: Floats | None
    radius: Floats
    segment_radius: Floats
    held: Floats | None
    springs: Springs | None
    style_system: StyleSystem
    damping_factors: DampingFactors

    @classmethod
    def of(
        cls, state: DynamicsState, frame: Frame, styles: tuple[StyleRows, ...], guides: slice
    ) -> Block:
        """Args:
        styles: as `convert_styles` gives them.
        """
        drive, settings, dt = frame.drive, frame.settings, frame.dt
        now, before, *earlier = (style.rows[:, :, guides] for style in styles)
        earlier_style = earlier[0] if earlier else None
        style = CarriedPath.through(
            before, now, earlier_style, drive.earlier_ratio, frame.style_carrier
        )
        middle: Floats = before + (now - before) * np.float32(0.5)
        if style.carrier is not None:
            middle = style.at(0.5)
        painted = None if frame.painted is None else frame.painted.part(guides)
        style_system, damping_factors = frame.style_system, frame.damping_factors
        if painted is not None:
            style_system, damping_factors = painted.style_system, painted.damping_factors
        gravity = effective_gravity(drive.gravity, settings, frame.rotation, middle) * np.float32(
            dt * dt
        )
        if painted is not None:
            gravity = gravity * painted.gravity
        impulse: Floats = np.asarray(gravity)
        impulse_curvature: Floats | None = None
        if style.carrier is None:
            style_fraction = np.float32(damping_factors.style * (dt / frame.duration))
            impulse = style.displacement * style_fraction
            impulse += gravity
            impulse_curvature = (
                None if style.curvature is None else style.curvature * style_fraction
            )
        radius = all_cv_radii(settings, state.cv_count, before.shape[2], state.rest.size)
        segment_radius = np.tile(radius * SEGMENT_RADIUS, (len(SEGMENT_POINTS), 1))
        if drive.clearance is not None:
            clearances = drive.clearance.rows[:, :, guides].reshape(1 + len(SEGMENT_POINTS), -1)
            radius, segment_radius = (
                np.minimum(radius, clearances[0]),
                np.minimum(segment_radius, clearances[1:]),
            )
        held = None if drive.held is None else drive.held.rows[:, guides]
        if held is not None and held.any():
            is_held = held.ravel() > 0.0
            radius = np.where(is_held, np.float32(-np.inf), radius)
            segment_radius[:, is_held] = -np.inf
        else:
            held = None
        rest = state.rest.part(guides)
        compensated = compensated_gravity(drive.gravity, settings, frame.rotation)
        springs = Springs.of(rest.curl_slack, rest.length, middle, compensated, held, settings, dt)
        if springs is not None and painted is not None:
            springs = replace(springs, load=springs.load * painted.gravity[springs.guides])
        return cls(
            rest,
            style,
            impulse,
            impulse_curvature,
            radius,
            segment_radius,
            held,
            springs,
            style_system,
            damping_factors,
        )

    def impulse_at(self, span: tuple[float, float], begin: Floats | None, end: Floats) -> Floats:
        """The displacement [m] of each CV by gravity and the moving style in a substep; read-only.

        Args:
            span: the substep's begin and end as fractions of the frame.
            begin, end: the style at its begin and end; `begin` is None unless it moves on an arc.
        """
        if begin is not None:
            displacement = end - begin
            displacement *= np.float32(self.damping_factors.style)
            displacement += self.impulse
            return displacement
        if self.impulse_curvature is None:
            return self.impulse
        impulse = self.impulse_curvature * np.float32(span[0] + span[1] - 1.0)
        impulse += self.impulse
        return impulse
