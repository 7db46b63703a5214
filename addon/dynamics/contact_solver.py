"""Guides stay outside of colliders and keep their lengths: both are solved in turn.

Lengths are solved last; CVs in contact slide along the surface. A guide that lengths have drawn
into a collider is solved again on its own.

A fast collider drags hair over itself, so that lengths move CVs to places where the planes of the
contacts no longer represent its surface. A guide that meets one is advanced in parts of the
substep. In each part, guide and collider move a part of their way and contacts are found again; the
speed that contacts take from the guide is missing in the next part. Fast means relative to the
guide's root: a head that shakes its own hair does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from .colliders import Pose
from .constraints import (
    PINNED_COUNT,
    TouchingCvs,
    finish_lengths,
    hold_within_reach,
    keep_lengths,
    relax_lengths,
)
from .contacts import (
    MAX_EXTRA_ROUNDS,
    PART_COUNT,
    PART_PASS_FACTOR,
    Contacts,
    fast_guides,
    find_contacts,
    find_segment_contacts,
    spacing_of,
    touching_cvs,
)
from .settings import DynamicsSettings


@dataclass(frozen=True)
class LengthConstraints:
    """The length constraints of guides.

    length: (cv_count - 1, n) [m], to keep in this substep. held: see `frame.Block`.
    size: of the hair [m].
    """

    length: Floats
    held: Floats | None
    size: float
    settings: DynamicsSettings

    def part(self, guides: Ints) -> LengthConstraints:
        """The constraints of some guides, indices (k,)."""
        held = None if self.held is None else self.held[:, guides]
        return replace(self, length=self.length[:, guides], held=held)

    def keep_lengths(self, position: Floats, touching: TouchingCvs | None) -> None:
        """Bring segments towards their lengths, in place. position: (3, cv_count, n) world [m]."""
        if self.settings.length_solver == "direct":
            keep_lengths(position, self.length, touching, self.held)
            return
        relax_lengths(position, self.length, self.held, self.settings.relaxations)
        if self.settings.long_range:
            hold_within_reach(position, self.length, self.held)


@dataclass(frozen=True)
class ContactSolver:
    """Colliders that guides stay outside of in a substep.

    radius, segment_radius: see `frame.Block`.
    poses: of the colliders.
    max_exit: how far [m] a point that is inside may be moved out.
    passes: how often contacts and lengths are solved in turn.
    """

    constraints: LengthConstraints
    radius: Floats
    segment_radius: Floats
    poses: list[Pose]
    max_exit: float
    passes: int

    def solve(self, position: Floats, previous: Floats) -> None:
        """Solve contacts and lengths; changes both arrays (3, cv_count, n) world [m] in place.

        Guides that touch nothing take part too, so that no guide depends on the others.
        """
        contacts = self._find_contacts(position, previous)
        guides = fast_guides(contacts, position, previous, self.constraints.size)
        some = position.take(guides, axis=2), previous.take(guides, axis=2)
        self._solve_contacts(position, previous, contacts)
        if guides.size:
            solver = self._part_of_guides(guides, position.shape[2])
            position[:, :, guides], previous[:, :, guides] = solver._solve_in_parts(*some)

    def _solve_in_parts(self, position: Floats, previous: Floats) -> tuple[Floats, Floats]:
        """Solve the substep in parts; position and previous position at its end."""
        here, path = previous, (position - previous) / np.float32(PART_COUNT)
        total = np.zeros_like(path)
        for number in range(PART_COUNT):
            before, here = here, here + path
            if number == PART_COUNT - 1:
                self._restore_fixed_cvs(here, position)
            self.constraints.keep_lengths(here, None)
            poses = [pose.part(number, PART_COUNT) for pose in self.poses]
            part = replace(
                self,
                poses=poses,
                max_exit=self.max_exit / PART_COUNT,
                passes=self.passes * PART_PASS_FACTOR,
            )
            before = before.copy()
            part._solve_contacts(here, before, part._find_contacts(here, before))
            path = here - before
            total += path
        return here, here - total

    def _restore_fixed_cvs(self, position: Floats, end: Floats) -> None:
        """Put pinned and held CVs at their exact places at the substep's end."""
        position[:, :PINNED_COUNT] = end[:, :PINNED_COUNT]
        if self.constraints.held is not None:
            np.copyto(position, end, where=self.constraints.held > 0.0)

    def _part_of_guides(self, guides: Ints, guide_count: int) -> ContactSolver:
        radius, segment_radius = (
            rows.reshape(*rows.shape[:-1], -1, guide_count)[..., guides].reshape(
                *rows.shape[:-1], -1
            )
            for rows in (self.radius, self.segment_radius)
        )
        return replace(
            self,
            constraints=self.constraints.part(guides),
            radius=radius,
            segment_radius=segment_radius,
        )

    def _find_contacts(self, position: Floats, previous: Floats) -> list[Contacts]:
        here, before = (rows.reshape(3, -1) for rows in (position, previous))
        size, (_, cv_count, guide_count) = self.constraints.size, position.shape
        radius, poses, max_exit = self.radius, self.poses, self.max_exit
        spacing = spacing_of(size, cv_count)
        contacts = find_contacts(here, before, radius, poses, max_exit, size, spacing)
        contacts += find_segment_contacts(
            here, before, radius, self.segment_radius, poses, max_exit, size, guide_count
        )
        return contacts

    def _solve_contacts(self, position: Floats, previous: Floats, contacts: list[Contacts]) -> None:
        _alternate(position, self.constraints, contacts, self.passes)
        _solve_deep_guides(position, self.constraints, contacts)
        for one in contacts:
            one.absorb(position.reshape(3, -1), previous.reshape(3, -1))


def _alternate(
    position: Floats, constraints: LengthConstraints, contacts: list[Contacts], passes: int
) -> None:
    """Solve contacts and lengths alternately, then finish lengths."""
    touching, settings = None, constraints.settings
    here = position.reshape(3, -1)
    for _ in range(passes):
        flags = [one.push_out(here, settings.friction) for one in contacts]
        touching = touching_cvs(contacts, flags)
        constraints.keep_lengths(position, touching)
    if settings.length_solver == "direct":
        tolerance, iterations = settings.length_tolerance, settings.length_iterations
        length, held, size = constraints.length, constraints.held, constraints.size
        finish_lengths(position, length, touching, held, tolerance, iterations, size)


def _solve_deep_guides(
    position: Floats, constraints: LengthConstraints, contacts: list[Contacts]
) -> None:
    """Repeat for guides that lengths have drawn into a collider."""
    guide_count = position.shape[2]
    guides = _guides_too_deep(position, contacts)
    for _ in range(MAX_EXTRA_ROUNDS):
        if not guides.size:
            return
        some, own = (
            position.take(guides, axis=2),
            [one.part(guides, guide_count) for one in contacts],
        )
        _alternate(some, constraints.part(guides), own, 1)
        position[:, :, guides] = some
        for one, part in zip(contacts, own, strict=True):
            one.copy_push_from(part, guides, guide_count)
        guides = guides[_guides_too_deep(some, own)]


def _guides_too_deep(position: Floats, contacts: list[Contacts]) -> Ints:
    """Guides, ascending, with a CV or segment that is farther below its plane than allowed."""
    here, guide_count = position.reshape(3, -1), position.shape[2]
    found = [one.index[one.are_too_deep(here)] % guide_count for one in contacts]
    return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)
