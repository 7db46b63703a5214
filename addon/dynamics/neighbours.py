"""Several grooms are advanced through a frame together: each feels the CVs of the others in its own
grid, see `hair_grid`.

    when they first meet    density at rest: the others' style, placed in the groom's grid as it
                            then is relative to the groom
    before each feeling     the places and motions of the others at that moment

Grooms stop whenever they feel other hair, and none goes on before all have reached that moment. So
results do not depend on the order of grooms, and each groom has its own substeps: between its stops
it is extrapolated linearly. Hair that is not simulated, or does not feel other hair, moves linearly
through the frame.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..arrays import Floats
from .groom_rotation import fit_rotation, sample_guides
from .hair_grid import (
    MARGIN_CELLS,
    MAX_CELL,
    MAX_MASS,
    MEAN_MASS,
    HairGrid,
    NeighbourCvs,
    Neighbours,
    hair_length_of_cvs,
)
from .state import Rest, as_rows

#: If the mean CV of another groom has less mass than this, only one in several of its guides is
#: used, with the mass of all of them.
MIN_MEAN_MASS = MEAN_MASS // 4
#: Moments of a frame that differ by less than this are the same.
SAME_MOMENT = 1.0e-6


@dataclass(frozen=True, eq=False)
class Stop:
    """A groom that has stopped in a frame to feel other hair.

    moment: as a fraction of the frame.
    substep, look_ahead: a substep, and how far ahead CVs are deposited, as fractions of the frame.
    rest: of the groom.
    style: (guide_count, cv_count, 3) world [m], its style at the frame's begin.
    read_cvs: returns its CVs now and a substep earlier, each (3, cv_count, guide_count) float32
        world [m].
    """

    moment: float
    substep: float
    look_ahead: float
    rest: Rest
    style: Floats
    read_cvs: Callable[[], tuple[Floats, Floats]]


#: A frame of a groom: yields a stop whenever it feels other hair, and is sent the nearby hair of
#: other grooms, or None if there is none.
type FrameSteps[Result] = Generator[Stop, Neighbours | None, Result]


def run_alone[Result](steps: FrameSteps[Result]) -> Result:
    """The result of a frame without other grooms."""
    try:
        next(steps)
        while True:
            steps.send(None)
    except StopIteration as end:
        result: Result = end.value
        return result


@dataclass(frozen=True, eq=False)
class NeighbourStyle:
    """A groom's style, as other grooms need it when they first meet.

    read_guides: returns it at the frame's begin, (guide_count, cv_count, 3) world [m].
    hair_per_cv: (guide_count,) metres of strands that each CV stands for.
    source: the object that it was made from, whose identity identifies the style.
    """

    read_guides: Callable[[], Floats]
    hair_per_cv: Floats
    source: object


def hair_length_of_guides(guides: Floats, strands: Floats) -> Floats:
    """Metres of strands that a CV of each guide stands for.

    Args:
        guides: (guide_count, cv_count, 3) [m]. strands: (guide_count,) how many each stands for.
    """
    lengths = np.linalg.norm(np.diff(guides, axis=1), axis=2).sum(axis=1)
    size = float(np.median(lengths)) if len(lengths) else 0.0
    return hair_length_of_cvs(strands, size, guides.shape[1], len(guides))


@dataclass(frozen=True, eq=False)
class KnownNeighbours:
    """The other grooms that a groom has met since its motion began.

    rest: of the groom; another object in each frame if its style is animated.
    rest_cvs: by each other groom's number, the source of its style, and its CVs near the groom with
        both at rest; None: there are none.
    grid: of the groom, with the grooms that are near now included at rest.
    near_numbers: numbers of the grooms that are near both now and at rest.
    """

    rest: Rest | None = None
    rest_cvs: Mapping[int, tuple[object, NeighbourCvs | None]] = field(default_factory=dict)
    grid: HairGrid | None = None
    near_numbers: frozenset[int] = frozenset()

    def updated(
        self, rest: Rest, style: Floats, others: Mapping[int, NeighbourStyle]
    ) -> KnownNeighbours:
        """The same after meeting other grooms.

        Args:
            rest, style: see `Stop`.
            others: all that are near now, by numbers that are constant over frames.
        """
        known = dict(self.rest_cvs)
        new_numbers = [
            number
            for number, other in others.items()
            if number not in known or known[number][0] is not other.source
        ]
        for number in new_numbers:
            other = others[number]
            known[number] = other.source, _rest_cvs_nearby(rest, style, other)
        near_cvs = {number: known[number][1] for number in sorted(others)}
        parts = {number: part for number, part in near_cvs.items() if part is not None}
        near_numbers = frozenset(parts)
        is_same = (
            rest is self.rest
            and near_numbers == self.near_numbers
            and near_numbers.isdisjoint(new_numbers)
        )
        if is_same and self.grid is not None:
            return KnownNeighbours(rest, known, self.grid, near_numbers)
        grid = rest.hair_grid
        if parts:
            neighbour_cvs = NeighbourCvs.joined(tuple(parts.values()))
            grid = HairGrid.at_rest(rest.position, rest.size, rest.strands, neighbour_cvs)
        return KnownNeighbours(rest, known, grid, near_numbers)


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """The motion of a groom that does not stop in a frame.

    guides_at_begin: its guides, (guide_count, cv_count, 3) world [m].
    read_guides_at_end: returns them at the frame's end, once they are there.
    reach: how far hair reaches from the middle of its roots [m]; a groom that moves farther in a
        frame has been placed elsewhere, and counts as not moving.
    """

    guides_at_begin: Floats
    read_guides_at_end: Callable[[], Floats]
    reach: float = np.inf

    @cached_property
    def guides_at_ends(self) -> tuple[Floats, Floats]:
        """The guides at begin and end, in the shape that they have at the end."""
        end = self.read_guides_at_end()
        if self.guides_at_begin.shape != end.shape:
            return end, end
        moved = float(np.linalg.norm((end - self.guides_at_begin).mean(axis=(0, 1))))
        return (end if moved > self.reach else self.guides_at_begin), end


class AdvancingGroom:
    """A groom that is advanced through a frame.

    known: the other grooms that it has met, updated during the frame.
    error: the exception that ended its frame early; None: none.

    Args:
        number: constant over frames.
        straight: its motion if it does not stop.
        steps: its frame; None if it does not stop.
        neighbour_numbers: the numbers of the grooms that it feels.
    """

    def __init__(
        self,
        number: int,
        style: NeighbourStyle,
        linear_motion: LinearMotion,
        steps: FrameSteps[object] | None = None,
        neighbour_numbers: frozenset[int] = frozenset(),
        known: KnownNeighbours | None = None,
    ) -> None:
        self.number, self.known, self.neighbour_numbers = (
            number,
            known or KnownNeighbours(),
            neighbour_numbers,
        )
        self.error: Exception | None = None
        self._style, self._linear_motion, self._steps = style, linear_motion, steps
        self._stop: Stop | None = None
        self._position = self._previous = linear_motion.guides_at_begin

    @property
    def stop_moment(self) -> float:
        """The moment at which it has stopped; infinite if it has not."""
        return np.inf if self._steps is None or self._stop is None else self._stop.moment

    def advance_to_stop(self, neighbours: Neighbours | None) -> None:
        """Advance to the next stop or the frame's end."""
        if self._steps is None:
            return
        try:
            self._stop = self._steps.send(neighbours)
            self._position, self._previous = self._stop.read_cvs()
        except StopIteration:
            self._steps = None
        except Exception as error:  # the others go on; the caller reports it
            self._steps, self.error = None, error

    def find_neighbours(self, movers: Mapping[int, AdvancingGroom]) -> Neighbours | None:
        """The nearby hair of the other grooms at its stop; None if there is none."""
        stop = self._stop
        assert stop is not None, "it stands somewhere"
        others = {number: movers[number] for number in sorted(self.neighbour_numbers)}
        if not others:
            return None
        styles = {number: other._style for number, other in others.items()}
        self.known = self.known.updated(stop.rest, stop.style, styles)
        grid = self.known.grid
        assert grid is not None, "they have met"
        motion = (self._position - self._previous) * np.float32(stop.look_ahead / stop.substep)
        own_position, moment = (
            (self._position + motion).reshape(3, -1),
            stop.moment + stop.look_ahead,
        )
        cvs = NeighbourCvs.joined(
            [each._cvs_at(moment, stop.substep, grid.hair_per_mass) for each in others.values()]
        )
        cvs = cvs.near_box(own_position, 2.0 * (MARGIN_CELLS + 1) * grid.cell)
        if grid is stop.rest.hair_grid and not cvs.mass.any():
            return None
        return Neighbours(grid, cvs, own_position)

    def _cvs_at(self, moment: float, substep: float, hair_per_mass: float) -> NeighbourCvs:
        """This groom's CVs at a moment of the frame, as another groom feels them.

        Args:
            moment: as a fraction of the frame.
            substep: a substep of the other groom, as a fraction of the frame.
            hair_per_mass: of the other groom, see `HairGrid`.
        """
        cv_count = self._linear_motion.guides_at_begin.shape[1]
        chosen, mass = _chosen_guides_and_masses(self._style.hair_per_cv, hair_per_mass, cv_count)
        stop = self._stop
        if stop is not None:
            here, before = (
                rows[:, :, chosen].reshape(3, -1) for rows in (self._position, self._previous)
            )
            motion = here - before
            here = here + motion * np.float32((moment - stop.moment) / stop.substep)
            return NeighbourCvs(here, motion * np.float32(substep / stop.substep), mass)
        here, end = (_cv_columns(guides[chosen]) for guides in self._linear_motion.guides_at_ends)
        displacement = end - here
        return NeighbourCvs(
            here + displacement * np.float32(moment), displacement * np.float32(substep), mass
        )


def advance_together(movers: Sequence[AdvancingGroom]) -> None:
    """Advance all grooms through the frame."""
    by_number = {mover.number: mover for mover in movers}
    for mover in movers:
        mover.advance_to_stop(None)
    while (moment := min(mover.stop_moment for mover in movers)) < np.inf:
        due = [mover for mover in movers if mover.stop_moment <= moment + SAME_MOMENT]
        neighbours = [mover.find_neighbours(by_number) for mover in due]
        for mover, found in zip(due, neighbours, strict=True):
            mover.advance_to_stop(found)


def _rest_cvs_nearby(rest: Rest, style: Floats, other: NeighbourStyle) -> NeighbourCvs | None:
    """The CVs of another groom's style near a groom at rest, moved together with the groom to where
    its motion began; None: there are none."""
    grid, guides = rest.hair_grid, other.read_guides()
    chosen, mass = _chosen_guides_and_masses(other.hair_per_cv, grid.hair_per_mass, guides.shape[1])
    rotation = fit_rotation(rest.sample_points, sample_guides(style))
    middle = style[:, 0].mean(axis=0, dtype=np.float64)
    positions_at_rest = (guides[chosen].astype(np.float64) - middle) @ rotation + grid.middle
    points = _cv_columns(positions_at_rest)
    all_cvs = NeighbourCvs(points, np.zeros_like(points), mass)
    near = all_cvs.near_box(rest.position.reshape(3, -1), (MARGIN_CELLS + 1) * MAX_CELL * rest.size)
    return near if near.mass.any() else None


def _chosen_guides_and_masses(
    hair_per_cv: Floats, hair_per_mass: float, cv_count: int
) -> tuple[slice, Floats]:
    """Which guides of another groom are used, and the masses of their CVs in `_cv_columns`
    order."""
    mass = hair_per_cv / hair_per_mass if hair_per_mass else np.zeros(len(hair_per_cv))
    min_mass = MIN_MEAN_MASS / max(len(hair_per_cv), 1)
    stride = (
        int(max(MIN_MEAN_MASS / max(float(mass.mean()), min_mass), 1.0)) if len(hair_per_cv) else 1
    )
    chosen = slice(stride // 2, None, stride)
    mass = np.rint(np.clip(mass[chosen] * stride, 0.0, MAX_MASS))
    return chosen, np.tile(mass.astype(np.float32), cv_count)


def _cv_columns(grid: Floats) -> Floats:
    """The CVs of guides (guide_count, cv_count, 3) as (3, cv_count * guide_count) float32."""
    return as_rows(grid).reshape(3, -1)
