"""Scalar reference of `step`, one guide and one CV at a time in float64: for reading and tests.

It shares with the fast form only settings and their curves, state, drive, colliders, the air, the
rigid motion of groom and roots, and the cells of the hair grid. Here frames are rotation matrices,
and each linear system is written out and solved densely, so the banded solvers are tested as well.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from ...arrays import Floats
from ...params.curve import sample_curve as curve_along
from ..constraints import CONTACT_WEIGHT, HELD_SWEEPS, HELD_WEIGHT, PINNED_COUNT, ROUNDING
from ..contacts import MAX_EXTRA_ROUNDS, PART_COUNT, PART_PASS_FACTOR, SEGMENT_POINTS
from ..frame import Drive, Frame, inherits_motion, root_places_after
from ..groom_rotation import best_rotation
from ..hair_grid import UPDATES_PER_SECOND
from ..rigid_path import RigidMotion, RigidTransform
from ..settings import DynamicsSettings
from ..springs import MAX_LINEARISED, max_extension_fraction, stiffness
from ..state import DynamicsState
from ..trajectory import curvature
from ..wind import air_from_settings
from .contacts import (
    Plane,
    Substep,
    SubstepCollider,
    are_too_deep,
    needs_parts,
    planes_of,
    push_out,
)
from .force_fields import previous_after_fields
from .hair_grid import GroomPoints, friction_and_push_reference
from .shape import jacobian_of, segment_rotations, turning_fraction

#: Painted settings with a single value per guide.
_PAINTED = ("gravity", "damping", "style_damping", "volume")


def advance_reference(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> DynamicsState:
    """Reference of `step.advance`; see there."""
    dt = 1.0 / settings.substep_rate
    duration = min(duration, settings.max_frame_time)
    time = state.time_left + duration
    count = math.floor(time / dt + 1.0e-6) if duration else 0
    guides = [_Guide(state, drive, g, settings) for g in range(state.guide_count)]
    if state.substep and count:
        for guide in guides:
            guide.previous = guide.x - (guide.x - guide.previous) * (dt / state.substep)
    push = _Push(state, drive, settings, dt)
    frame = Frame.of(state, drive, settings, duration, dt) if count else None
    for number in range(count):
        push.before(number, guides)
        assert frame is not None
        inherited_motions = (
            [frame.inherited_motion(k) for k in (number - 1, number)]
            if frame.inherits_motion
            else []
        )
        root_place = frame.root_place(number - 1) if frame.inherits_motion else None
        begin = (number * dt - state.time_left) / duration
        substep = Substep(begin, begin + dt / duration, state.time + number * dt, dt)
        for guide in guides:
            guide.substep(drive, substep, inherited_motions, root_place)
    if not guides:
        return state
    rows = [np.stack([g.x for g in guides]), np.stack([g.previous for g in guides])]
    position, previous = (grid.transpose(2, 1, 0).astype(np.float32) for grid in rows)
    left = max(time - count * dt, 0.0)
    last_substep = dt if count else state.substep
    time = state.time + count * dt
    root_places = root_places_after(state, frame, drive, settings, count)
    return DynamicsState(
        position, previous, state.rest, last_substep, left, time, (), push.rows, root_places
    )


def _transformed(inherited_motion: RigidTransform, points: Floats) -> Floats:
    result: Floats = (
        points - inherited_motion.origin
    ) @ inherited_motion.rotation.T + inherited_motion.moved_origin
    return result


class _Push:
    """Forces between guides, computed at some substeps, see `hair_grid`."""

    def __init__(
        self, state: DynamicsState, drive: Drive, settings: DynamicsSettings, dt: float
    ) -> None:
        self.state, self.settings, self.dt = state, settings, dt
        self.is_active = settings.volume > 0.0 and state.cv_count > PINNED_COUNT
        self.substeps = max(round(1.0 / (UPDATES_PER_SECOND * dt)), 1)
        self.first = round(state.time / dt)
        self.rows = state.push if self.is_active else None
        self.middles = (drive.target_before + drive.target_now).transpose(2, 1, 0) / 2.0

    def before(self, number: int, guides: list[_Guide]) -> None:
        """Update the push of guides before a substep of the frame."""
        if not self.is_active or not guides:
            return
        if self.rows is None or (self.first + number) % self.substeps == 0:
            self._update(guides)
        assert self.rows is not None
        for guide, push in zip(guides, self.rows.transpose(2, 1, 0), strict=True):
            guide.push = push.astype(np.float64)

    def _update(self, guides: list[_Guide]) -> None:
        rest = self.state.rest
        here = np.concatenate([guide.x for guide in guides])
        before = np.concatenate([guide.previous for guide in guides])
        turn = best_rotation(rest.position, self.middles)
        middle = self.middles[:, 0].mean(axis=1, dtype=np.float64)
        at_rest = np.concatenate([guide.rest for guide in guides])
        hair = GroomPoints(here, here - before, turn, middle)
        cv_count = len(here) // len(guides)
        volume = np.repeat([guide.settings.volume for guide in guides], cv_count)
        friction, push = friction_and_push_reference(
            rest.hair_grid, at_rest, hair, volume, self.dt, self.substeps
        )
        for guide, own in zip(guides, np.split(friction, len(guides)), strict=True):
            guide.previous = guide.previous + own
        self.rows = push.reshape(len(guides), -1, 3).transpose(2, 1, 0).astype(np.float32)


class _Guide:
    """One guide, x and previous (cv_count, 3) float64 world [m]."""

    def __init__(
        self, state: DynamicsState, drive: Drive, guide: int, settings: DynamicsSettings
    ) -> None:
        def points(rows: Floats) -> Floats:
            return rows[:, :, guide].T.astype(np.float64)

        def painted(name: str) -> Floats:
            factors = {} if drive.painted is None else drive.painted.factors
            of_guide = factors.get(name, np.ones((1, guide + 1)))[:, guide]
            return np.broadcast_to(of_guide, state.cv_count)

        each = {name: float(painted(name).mean()) for name in _PAINTED}
        self.settings = settings = settings.multiplied(**each)
        self.stiffness = {name: painted(name) for name in ("style_root", "style_tip", "bend")}

        self.x, self.previous = points(state.position), points(state.previous)
        self.rest = points(state.rest.position)
        self.twist_cv = int(state.rest.shape.twist_cv[guide])
        self.rest_length = [float(np.linalg.norm(b - a)) for a, b in pairwise(self.rest)]
        self.push = np.zeros_like(self.x)  # by other guides, in each substep
        self.length = self.rest_length  # the lengths to keep in this substep
        curl_slack = state.rest.curl_slack
        self.curl_slack = (
            np.zeros(len(self.length)) if curl_slack is None else curl_slack[:, guide].astype(float)
        )
        self.size = state.rest.size
        self.held = [False] * len(self.x)
        if drive.held is not None:
            self.held[PINNED_COUNT:] = drive.held.is_held[guide, PINNED_COUNT:].tolist()
        self.clearance = np.full((len(self.x), 1 + len(SEGMENT_POINTS)), np.inf)
        if drive.clearance is not None:
            self.clearance = drive.clearance.distances[guide].astype(np.float64)
        self.carrier = drive.carrier if inherits_motion(settings) else drive.style_carrier
        self.before = drive.target_before[guide].astype(np.float64)
        now, earlier = drive.target_now[guide].astype(np.float64), drive.target_earlier
        self.curvature = np.zeros_like(now)
        if self.carrier is not None:
            now = self._before_carrier(now, self.carrier.path.now)
        if earlier is not None:
            since = earlier[guide].astype(np.float64)
            if self.carrier is not None and self.carrier.path.earlier is not None:
                since = self._before_carrier(since, self.carrier.path.earlier)
            self.curvature = curvature(since, self.before, now, drive.earlier_ratio)
        self.displacement = now - self.before
        self.middle = (self.before + drive.target_now[guide]) / 2.0
        if self.carrier is not None:
            self.middle = self._style_at(0.5)
        middle = (drive.target_before + drive.target_now).transpose(2, 1, 0) / 2.0
        turn = best_rotation(state.rest.position, middle)
        self.gravity = self._effective_gravity(drive, settings, turn)
        self.load = settings.sag_compensation * self._tension_on_style(
            turn @ (np.asarray(drive.gravity, np.float64) * settings.gravity)
        )

    def substep(
        self,
        drive: Drive,
        substep: Substep,
        inherited_motions: list[RigidTransform],
        root_place: RigidMotion | None,
    ) -> None:
        """Args:
        inherited_motions: the motion that hair inherits from the roots, in the previous substep and
            in this one; empty if it inherits none.
        root_place: where the roots as a whole are at the begin; None: according to their path.
        """
        settings, position_before = self.settings, self.x.copy()
        air = self._air(settings, substep)
        style_before = self._style_at(substep.begin, root_place)
        for inherited_motion in inherited_motions:
            self.previous = _transformed(inherited_motion, self.previous)
        if inherited_motions:
            self.x, style_before = (
                _transformed(inherited_motions[1], each) for each in (self.x, style_before)
            )
        self._apply_drag(settings.drag, air, substep.dt)
        fields = drive.force_fields.scaled(settings.force_fields)
        if fields is not None:
            self.previous = previous_after_fields(
                self.x, self.previous, fields, substep.dt, self.size
            )
        self._predict(settings, air, substep, style_before)
        self.previous = position_before
        style = self._style_at(substep.end)
        self._pin(style)
        self._spring_step(settings, substep.dt)
        self._restore_style(style, settings, substep.dt)
        self._pin(style)
        self._keep_lengths({}, settings)
        found = [SubstepCollider.of(posed, substep, self.size) for posed in drive.colliders]
        solids = [solid for solid in found if solid is not None]
        passes = settings.contact_passes if drive.colliders else 0
        if not self._solve_contacts(solids, settings, substep.dt, passes):
            self._solve_contacts_in_parts(solids, settings, substep.dt, passes)

    def _solve_contacts(
        self, solids: list[SubstepCollider], settings: DynamicsSettings, dt: float, passes: int
    ) -> bool:
        """Solve contacts and lengths; False, without doing so, if the guide needs to be advanced in
        parts."""
        found = [
            planes_of(
                solid, self.x, self.previous, self.held, settings, dt, self.size, self.clearance
            )
            for solid in solids
        ]
        spacing = self.size / (len(self.x) - 1)
        for solid, (of_cvs, of_segments) in zip(solids, found, strict=True):
            own = of_cvs + of_segments
            if not solid.is_part and needs_parts(solid, own, self.x, self.previous, spacing):
                return False
        planes = [of_cvs for of_cvs, _ in found] + [of_segments for _, of_segments in found]
        self._solve_in_turn(planes, settings, passes)
        for _ in range(MAX_EXTRA_ROUNDS):
            if not are_too_deep(planes, self.x):
                break
            self._solve_in_turn(planes, settings, 1)
        for group in planes:
            for plane in group:
                plane.absorb(self.x, self.previous)
        return True

    def _solve_contacts_in_parts(
        self,
        solids: list[SubstepCollider],
        settings: DynamicsSettings,
        dt: float,
        passes: int,
    ) -> None:
        end, path = self.x.copy(), (self.x - self.previous) / PART_COUNT
        part_displacement = np.zeros_like(path)
        self.x = self.previous.copy()
        for number in range(PART_COUNT):
            self.previous = self.x.copy()
            self.x = self.x + path
            if number == PART_COUNT - 1:
                fixed = [*range(PINNED_COUNT), *self._held_cvs()]
                self.x[fixed] = end[fixed]
            self._keep_lengths({}, settings)
            solids_now = [solid.part(number, PART_COUNT) for solid in solids]
            self._solve_contacts(solids_now, settings, dt / PART_COUNT, passes * PART_PASS_FACTOR)
            path = self.x - self.previous
            part_displacement += path
        self.previous = self.x - part_displacement

    def _solve_in_turn(
        self, planes: list[list[Plane]], settings: DynamicsSettings, passes: int
    ) -> None:
        normals: dict[int, Floats] = {}
        for _ in range(passes):
            normals = push_out(planes, self.x, settings.friction)
            self._keep_lengths(normals, settings)
        if settings.length_solver == "direct":
            self._finish_lengths(normals, settings)

    def _style_at(self, fraction: float, place: RigidMotion | None = None) -> Floats:
        style = (
            self.before
            + self.displacement * fraction
            + self.curvature * fraction * (fraction - 1.0)
        )
        if self.carrier is None:
            return style
        place, pivot = place or self.carrier.path.at(fraction), self.carrier.pivot
        return (style - pivot) @ place.rotation.T + pivot + place.shift

    def _before_carrier(self, points: Floats, place: RigidMotion) -> Floats:
        assert self.carrier is not None
        pivot = self.carrier.pivot
        return (points - pivot - place.shift) @ place.rotation + pivot

    def _air(self, settings: DynamicsSettings, substep: Substep) -> Floats:
        """Velocity of the air at the root, (3,)."""
        air = air_from_settings(settings)
        if air is None:
            return np.zeros(3)
        return air.at(self.x[0][:, None].astype(np.float32), substep.time)[:, 0].astype(np.float64)

    def _apply_drag(self, drag: float, air: Floats, dt: float) -> None:
        for cv in range(len(self.x)):
            relative_velocity = (self.x[cv] - self.previous[cv]) / dt - air
            relative_velocity = relative_velocity / (
                1.0 + drag * float(np.linalg.norm(relative_velocity)) * dt
            )
            self.previous[cv] = self.x[cv] - (relative_velocity + air) * dt

    def _predict(
        self, settings: DynamicsSettings, air: Floats, substep: Substep, style_before: Floats
    ) -> None:
        damping_rate = settings.damping + settings.style_damping
        velocity_factor = math.exp(-damping_rate * substep.dt)
        mean_factor = (1.0 - velocity_factor) / damping_rate if damping_rate else 0.0
        style_displacement = self._style_at(substep.end) - style_before
        for cv in range(len(self.x)):
            displacement = (self.x[cv] - self.previous[cv]) * velocity_factor
            displacement = (
                displacement + style_displacement[cv] * mean_factor * settings.style_damping
            )
            displacement = displacement + air * substep.dt * mean_factor * settings.damping
            displacement = displacement + self.gravity[cv] * substep.dt**2 + self.push[cv]
            self.x[cv] = self.x[cv] + displacement

    def _pin(self, style: Floats) -> None:
        self.x[:PINNED_COUNT] = style[:PINNED_COUNT]
        before = PINNED_COUNT - 1
        for cv in self._held_cvs():
            displacement = style[cv] - self.x[before]
            ratio = sum(self.rest_length[before:cv]) / float(np.linalg.norm(displacement))
            is_beside = cv == before + 1
            self.x[cv] = self.x[before] + displacement * (ratio if is_beside else min(ratio, 1.0))
            before = cv

    def _held_cvs(self) -> list[int]:
        return [cv for cv, is_held in enumerate(self.held) if is_held]

    def _towards_root(self) -> list[int]:
        """Free CVs with a held one beyond them, the last first."""
        last = max(self._held_cvs(), default=0)
        return [cv for cv in range(last - 1, PINNED_COUNT - 1, -1) if not self.held[cv]]

    def _effective_gravity(self, drive: Drive, settings: DynamicsSettings, turn: Floats) -> Floats:
        pull = np.asarray(drive.gravity, np.float64) * settings.gravity
        gravity = np.tile(pull * (1.0 - settings.buoyancy), (len(self.x), 1))
        free = len(self.x) - PINNED_COUNT
        if free < 1:
            return gravity
        # the part of the compensated weight orthogonal to all length constraints, by projection
        compensated = np.tile(turn @ pull, free)
        jacobian = jacobian_of(self.middle)
        tension = self._tension_on_style(turn @ pull)
        gravity[PINNED_COUNT:] -= settings.sag_compensation * (
            compensated - jacobian.T @ tension
        ).reshape(free, 3)
        return gravity

    def _tension_on_style(self, compensated: Floats) -> Floats:
        """The tension of each segment beyond the pinned ones that holds the style's gravity
        [m/s^2]."""
        free = len(self.x) - PINNED_COUNT
        if free < 1:
            return np.zeros(0)
        jacobian = jacobian_of(self.middle)
        tension: Floats = np.linalg.solve(
            jacobian @ jacobian.T, jacobian @ np.tile(compensated, free)
        )
        return tension

    def _spring_step(self, settings: DynamicsSettings, dt: float) -> None:
        """One step of the springs along a curl, by their tension; sets `length` to the result."""
        curl_slack = self.curl_slack[PINNED_COUNT - 1 :] * max_extension_fraction(settings)
        if not curl_slack.any():
            return
        free, kappa = len(self.x) - PINNED_COUNT, stiffness(settings, len(self.x))
        rest = np.array(self.rest_length[PINNED_COUNT - 1 :])
        previous = np.linalg.norm(np.diff(self.previous[PINNED_COUNT - 1 :], axis=0), axis=1)
        right = self._lengths() - rest
        compliance = np.zeros(free)
        for one in np.flatnonzero(curl_slack):
            max_extension = curl_slack[one] * rest[one]
            ratio = np.clip(
                (previous[one] - rest[one]) / max_extension, -MAX_LINEARISED, MAX_LINEARISED
            )
            slope = kappa * (1.0 + ratio**2) / (1.0 - ratio**2) ** 2
            tension = kappa * max_extension * ratio / (1.0 - ratio**2) + self.load[one]
            compliance[one] = 1.0 / (slope * dt * dt)
            right[one] += tension / slope - max_extension * ratio
        jacobian, mobility = jacobian_of(self.x), self._mobility({})
        before = self.x.copy()
        tension = np.linalg.solve(jacobian @ mobility @ jacobian.T + np.diag(compliance), right)
        self.x[PINNED_COUNT:] -= (mobility @ jacobian.T @ tension).reshape(free, 3)
        held = self._held_cvs()
        self.x[held] = before[held]
        longest = rest * (1.0 + curl_slack)
        left = np.clip(self._lengths(), rest**2 / longest, longest)
        self.length = [*self.rest_length[: PINNED_COUNT - 1], *left]

    def _restore_style(self, style: Floats, settings: DynamicsSettings, dt: float) -> None:
        count = len(self.x)
        free = count - PINNED_COUNT
        if free < 1:
            return
        bend_frequency = 2.0 * math.pi * (count - 1) ** 2 / 3.5160
        at_root, at_tip, bends = (
            getattr(settings, name) * factor for name, factor in self.stiffness.items()
        )
        turns = segment_rotations(self.x, style, self.twist_cv)
        rest_turns = segment_rotations(self.rest, self.rest, self.twist_cv)
        matrix, right = np.eye(free), self.x[PINNED_COUNT:].copy()
        for cv in range(PINNED_COUNT, count):
            along = float(curve_along(settings.style_along, np.array([cv / (count - 1)]))[0])
            swings = at_root[cv] * along + at_tip[cv] * (1.0 - along)
            pull = (2.0 * math.pi * swings * dt) ** 2
            matrix[cv - PINNED_COUNT, cv - PINNED_COUNT] += pull
            right[cv - PINNED_COUNT] += pull * style[cv]
        for i in range(1, count - 1):
            rest_second = self.rest[i + 1] - 2.0 * self.rest[i] + self.rest[i - 1]
            style_second = style[i + 1] - 2.0 * style[i] + style[i - 1]
            held = turning_fraction(
                rest_second, (self.rest_length[i] + self.rest_length[i - 1]) / 2.0
            )
            wanted = held * (turns[i - 1] @ rest_turns[i - 1].T @ rest_second)
            wanted = wanted + (1.0 - held) * style_second
            weights = {i - 1: 1.0, i: -2.0, i + 1: 1.0}
            for one, weight in weights.items():
                if one < PINNED_COUNT:
                    wanted = wanted - weight * self.x[one]
            inner = {one - PINNED_COUNT: w for one, w in weights.items() if one >= PINNED_COUNT}
            along = float(curve_along(settings.bend_along, np.array([i / (count - 1)]))[0])
            stiffness = (bend_frequency * bends[i] * along * dt) ** 2
            for one, weight in inner.items():
                right[one] += stiffness * weight * wanted
                for other, other_weight in inner.items():
                    matrix[one, other] += stiffness * weight * other_weight
        self.x[PINNED_COUNT:] = np.linalg.solve(matrix, right)

    def _keep_lengths(self, normals: dict[int, Floats], settings: DynamicsSettings) -> None:
        if settings.length_solver == "direct":
            self._newton_step(normals)
            return
        for _ in range(settings.relaxations):
            self._relax()
        if settings.long_range:
            self._hold_within_reach()

    def _relax(self) -> None:
        last = len(self.x) - 1
        for cv in range(PINNED_COUNT, last + 1):
            displacement = self.x[cv] - self.x[cv - 1]
            excess = displacement * (1.0 - self.length[cv - 1] / np.linalg.norm(displacement))
            free = [cv > PINNED_COUNT and not self.held[cv - 1], not self.held[cv]]
            lower, upper = (one / max(sum(free), 1) for one in free)
            self.x[cv - 1] += excess * lower
            self.x[cv] -= excess * upper

    def _hold_within_reach(self) -> None:
        root, reach = self.x[PINNED_COUNT - 1], 0.0
        for cv in range(PINNED_COUNT, len(self.x)):
            reach += self.length[cv - 1]
            displacement = self.x[cv] - root
            self.x[cv] = root + displacement * min(reach / float(np.linalg.norm(displacement)), 1.0)
        held = self._held_cvs()
        before = self.x[held].copy()
        for _ in range(HELD_SWEEPS if held else 1):
            self.x[held] = before
            for cv in self._towards_root():
                self._limit_distance(cv, cv + 1, self.length[cv])
            for cv in range(PINNED_COUNT, len(self.x)):
                self._limit_distance(cv, cv - 1, self.length[cv - 1])

    def _limit_distance(self, cv: int, other: int, farthest: float) -> None:
        offset = self.x[cv] - self.x[other]
        away = float(np.linalg.norm(offset))
        if away > farthest:
            self.x[cv] = self.x[other] + offset * (farthest / away)

    def _newton_step(self, normals: dict[int, Floats]) -> None:
        free = len(self.x) - PINNED_COUNT
        if free < 1:
            return
        jacobian, mobility, held = jacobian_of(self.x), self._mobility(normals), self._held_cvs()
        before = self.x[held].copy()
        error = self._lengths() - self.length[PINNED_COUNT - 1 :]
        tension = np.linalg.solve(jacobian @ mobility @ jacobian.T, error)
        self.x[PINNED_COUNT:] -= (mobility @ jacobian.T @ tension).reshape(free, 3)
        self.x[held] = before

    def _mobility(self, normals: dict[int, Floats]) -> Floats:
        free = len(self.x) - PINNED_COUNT
        mobility = np.eye(3 * free)
        for cv, normal in normals.items():
            at = slice(3 * (cv - PINNED_COUNT), 3 * (cv - PINNED_COUNT) + 3)
            mobility[at, at] -= float(CONTACT_WEIGHT) * np.outer(normal, normal)
        for cv in self._held_cvs():
            at = slice(3 * (cv - PINNED_COUNT), 3 * (cv - PINNED_COUNT) + 3)
            mobility[at, at] = (1.0 - float(HELD_WEIGHT)) * np.eye(3)
        return mobility

    def _finish_lengths(self, normals: dict[int, Floats], settings: DynamicsSettings) -> None:
        for _ in range(settings.length_iterations):
            if not self._is_off(settings.length_tolerance):
                return
            self._newton_step(normals)
        if self._is_off(settings.length_tolerance):
            self._rebuild()

    def _is_off(self, tolerance: float) -> bool:
        wanted = np.array(self.length[PINNED_COUNT - 1 :])
        allowed = wanted * tolerance + ROUNDING * self.size
        return bool((np.abs(self._lengths() - wanted) > allowed).any())

    def _rebuild(self) -> None:
        segment = self._segments()
        for cv in self._towards_root():
            self.x[cv] = self.x[cv + 1] - segment[cv]
        segment = self._segments()
        for cv in range(PINNED_COUNT, len(self.x)):
            self.x[cv] = self.x[cv - 1] + segment[cv - 1]

    def _segments(self) -> Floats:
        """The segments with their directions, but the lengths that they should have."""
        displacements = np.diff(self.x, axis=0)
        lengths = zip(displacements, self.length, strict=True)
        return np.array(
            [
                displacement / np.linalg.norm(displacement) * length
                for displacement, length in lengths
            ]
        )

    def _lengths(self) -> Floats:
        return np.array([np.linalg.norm(b - a) for a, b in pairwise(self.x[PINNED_COUNT - 1 :])])
