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
    PINNED,
    Touched,
    finish_lengths,
    hold_within_reach,
    keep_lengths,
    relax_lengths,
)
from .contacts import (
    MORE_ROUNDS,
    PART_PASSES,
    PARTS,
    Contacts,
    find_between,
    find_contacts,
    hurried_guides,
    spacing_of,
    touched_by,
)
from .settings import DynamicsSettings


@dataclass(frozen=True)
class Chain:
    """The length constraints of guides.

    length: (cv_count - 1, n) [m], to keep in this substep. held: see `frame.Block`.
    size: of the hair [m].
    """

    length: Floats
    held: Floats | None
    size: float
    settings: DynamicsSettings

    def part(self, guides: Ints) -> Chain:
        held = None if self.held is None else self.held[:, guides]
        return replace(self, length=self.length[:, guides], held=held)

    def keep_lengths(self, position: Floats, touched: Touched | None) -> None:
        if self.settings.length_solver == "direct":
            keep_lengths(position, self.length, touched, self.held)
            return
        relax_lengths(position, self.length, self.held, self.settings.relaxations)
        if self.settings.long_range:
            hold_within_reach(position, self.length, self.held)


@dataclass(frozen=True)
class Outside:
    """Colliders that guides stay outside of in a substep.

    radius, between: see `frame.Block`.
    poses: of the colliders.
    led_out: how far [m] a point that is inside may be moved out.
    passes: how often contacts and lengths are solved in turn.
    """

    chain: Chain
    radius: Floats
    between: Floats
    poses: list[Pose]
    led_out: float
    passes: int

    def keep(self, position: Floats, previous: Floats) -> None:
        """Solve contacts and lengths; changes both arrays (3, cv_count, n) world [m] in place.

        Guides that touch nothing take part too, so that no guide depends on the others.
        """
        contacts = self._find(position, previous)
        guides = hurried_guides(contacts, position, previous, self.chain.size)
        some = position.take(guides, axis=2), previous.take(guides, axis=2)
        self._solve(position, previous, contacts)
        if guides.size:
            own = self._part(guides, position.shape[2])
            position[:, :, guides], previous[:, :, guides] = own._in_parts(*some)

    def _in_parts(self, position: Floats, previous: Floats) -> tuple[Floats, Floats]:
        """Solve the substep in parts; position and previous position at its end."""
        here, path = previous, (position - previous) / np.float32(PARTS)
        went = np.zeros_like(path)
        for number in range(PARTS):
            before, here = here, here + path
            if number == PARTS - 1:
                self._put_back(here, position)
            self.chain.keep_lengths(here, None)
            poses = [pose.part(number, PARTS) for pose in self.poses]
            part = replace(
                self,
                poses=poses,
                led_out=self.led_out / PARTS,
                passes=self.passes * PART_PASSES,
            )
            before = before.copy()
            part._solve(here, before, part._find(here, before))
            path = here - before
            went += path
        return here, here - went

    def _put_back(self, position: Floats, end: Floats) -> None:
        """Put pinned and held CVs at their exact places at the substep's end."""
        position[:, :PINNED] = end[:, :PINNED]
        if self.chain.held is not None:
            np.copyto(position, end, where=self.chain.held > 0.0)

    def _part(self, guides: Ints, guide_count: int) -> Outside:
        radius, between = (
            rows.reshape(*rows.shape[:-1], -1, guide_count)[..., guides].reshape(
                *rows.shape[:-1], -1
            )
            for rows in (self.radius, self.between)
        )
        return replace(self, chain=self.chain.part(guides), radius=radius, between=between)

    def _find(self, position: Floats, previous: Floats) -> list[Contacts]:
        here, was = (rows.reshape(3, -1) for rows in (position, previous))
        size, (_, cv_count, guide_count) = self.chain.size, position.shape
        radius, poses, led_out = self.radius, self.poses, self.led_out
        spacing = spacing_of(size, cv_count)
        contacts = find_contacts(here, was, radius, poses, led_out, size, spacing)
        contacts += find_between(here, was, radius, self.between, poses, led_out, size, guide_count)
        return contacts

    def _solve(self, position: Floats, previous: Floats, contacts: list[Contacts]) -> None:
        _solve_in_turn(position, self.chain, contacts, self.passes)
        _solve_again(position, self.chain, contacts)
        for one in contacts:
            one.absorb(position.reshape(3, -1), previous.reshape(3, -1))


def _solve_in_turn(position: Floats, chain: Chain, contacts: list[Contacts], passes: int) -> None:
    """Solve contacts and lengths alternately, then finish lengths."""
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


def _solve_again(position: Floats, chain: Chain, contacts: list[Contacts]) -> None:
    """Repeat for guides that lengths have drawn into a collider."""
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
    """Guides, ascending, with a CV or segment that is farther below its plane than allowed."""
    here, guide_count = position.reshape(3, -1), position.shape[2]
    found = [one.index[one.missing(here)] % guide_count for one in contacts]
    return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)
