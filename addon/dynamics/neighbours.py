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
from .turn import rotation_from, sample

#: If the mean CV of another groom has less mass than this, only one in several of its guides is
#: used, with the mass of all of them.
LIGHTEST = MEAN_MASS // 4
#: Moments of a frame that differ by less than this are the same.
ONE_MOMENT = 1.0e-6


@dataclass(frozen=True, eq=False)
class Stop:
    """A groom that has stopped in a frame to feel other hair.

    moment: as a fraction of the frame.
    step, ahead: a substep, and how far ahead CVs are deposited, as fractions of the frame.
    rest: of the groom.
    style: (guide_count, cv_count, 3) world [m], its style at the frame's begin.
    read: returns its CVs now and a substep earlier, each (3, cv_count, guide_count) float32 world
        [m].
    """

    moment: float
    step: float
    ahead: float
    rest: Rest
    style: Floats
    read: Callable[[], tuple[Floats, Floats]]


#: A frame of a groom: yields a stop whenever it feels other hair, and is sent the nearby hair of
#: other grooms, or None if there is none.
type Steps[Result] = Generator[Stop, Neighbours | None, Result]


def alone[Result](steps: Steps[Result]) -> Result:
    """The result of a frame without other grooms."""
    try:
        next(steps)
        while True:
            steps.send(None)
    except StopIteration as end:
        result: Result = end.value
        return result


@dataclass(frozen=True, eq=False)
class Style:
    """A groom's style, as other grooms need it when they first meet.

    read: returns it at the frame's begin, (guide_count, cv_count, 3) world [m].
    hair: (guide_count,) metres of strands that each CV stands for.
    source: the object that it was made from, whose identity identifies the style.
    """

    read: Callable[[], Floats]
    hair: Floats
    source: object


def hair_of(guides: Floats, strands: Floats) -> Floats:
    """Metres of strands that a CV of each guide stands for.

    Args:
        guides: (guide_count, cv_count, 3) [m]. strands: (guide_count,) how many each stands for.
    """
    lengths = np.linalg.norm(np.diff(guides, axis=1), axis=2).sum(axis=1)
    size = float(np.median(lengths)) if len(lengths) else 0.0
    return hair_length_of_cvs(strands, size, guides.shape[1], len(guides))


@dataclass(frozen=True, eq=False)
class KnownHair:
    """The other grooms that a groom has met since its motion began.

    rest: of the groom; another object in each frame if its style is animated.
    at_rest: by each other groom's number, the source of its style, and its CVs near the groom with
        both at rest; None: there are none.
    grid: of the groom, with the grooms that are near now included at rest.
    among: numbers of the grooms that are near both now and at rest.
    """

    rest: Rest | None = None
    at_rest: Mapping[int, tuple[object, NeighbourCvs | None]] = field(default_factory=dict)
    grid: HairGrid | None = None
    among: frozenset[int] = frozenset()

    def meeting(self, rest: Rest, style: Floats, others: Mapping[int, Style]) -> KnownHair:
        """The same after meeting other grooms.

        Args:
            rest, style: see `Stop`.
            others: all that are near now, by numbers that are constant over frames.
        """
        known = dict(self.at_rest)
        fresh = [
            number
            for number, other in others.items()
            if number not in known or known[number][0] is not other.source
        ]
        for number in fresh:
            other = others[number]
            known[number] = other.source, _at_rest(rest, style, other)
        found = {number: known[number][1] for number in sorted(others)}
        parts = {number: part for number, part in found.items() if part is not None}
        among = frozenset(parts)
        is_same = rest is self.rest and among == self.among and among.isdisjoint(fresh)
        if is_same and self.grid is not None:
            return KnownHair(rest, known, self.grid, among)
        grid = rest.hair_grid
        if parts:
            met = NeighbourCvs.joined(tuple(parts.values()))
            grid = HairGrid.at_rest(rest.position, rest.size, rest.strands, met)
        return KnownHair(rest, known, grid, among)


@dataclass(frozen=True, eq=False)
class Straight:
    """The motion of a groom that does not stop in a frame.

    begin: its guides, (guide_count, cv_count, 3) world [m].
    read_end: returns them at the frame's end, once they are there.
    reach: how far hair reaches from the middle of its roots [m]; a groom that moves farther in a
        frame has been placed elsewhere, and counts as not moving.
    """

    begin: Floats
    read_end: Callable[[], Floats]
    reach: float = np.inf

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """The guides at begin and end, with the same shape."""
        end = self.read_end()
        if self.begin.shape != end.shape:
            return end, end
        moved = float(np.linalg.norm((end - self.begin).mean(axis=(0, 1))))
        return (end if moved > self.reach else self.begin), end


class Mover:
    """A groom that is advanced through a frame.

    known: the other grooms that it has met, updated during the frame.
    error: the exception that ended its frame early; None: none.

    Args:
        number: constant over frames.
        straight: its motion if it does not stop.
        steps: its frame; None if it does not stop.
        near: the numbers of the grooms that it feels.
    """

    def __init__(
        self,
        number: int,
        style: Style,
        straight: Straight,
        steps: Steps[object] | None = None,
        near: frozenset[int] = frozenset(),
        known: KnownHair | None = None,
    ) -> None:
        self.number, self.known, self.near = number, known or KnownHair(), near
        self.error: Exception | None = None
        self._style, self._straight, self._steps = style, straight, steps
        self._stop: Stop | None = None
        self._here = self._before = straight.begin

    @property
    def stands_at(self) -> float:
        """The moment at which it has stopped; infinite if it has not."""
        return np.inf if self._steps is None or self._stop is None else self._stop.moment

    def go_on(self, felt: Neighbours | None) -> None:
        """Advance to the next stop or the frame's end."""
        if self._steps is None:
            return
        try:
            self._stop = self._steps.send(felt)
            self._here, self._before = self._stop.read()
        except StopIteration:
            self._steps = None
        except Exception as error:  # the others go on; the caller reports it
            self._steps, self.error = None, error

    def feels(self, movers: Mapping[int, Mover]) -> Neighbours | None:
        """The nearby hair of the other grooms at its stop; None if there is none."""
        stop = self._stop
        assert stop is not None, "it stands somewhere"
        others = {number: movers[number] for number in sorted(self.near)}
        if not others:
            return None
        styles = {number: other._style for number, other in others.items()}
        self.known = self.known.meeting(stop.rest, stop.style, styles)
        grid = self.known.grid
        assert grid is not None, "they have met"
        motion = (self._here - self._before) * np.float32(stop.ahead / stop.step)
        own, moment = (self._here + motion).reshape(3, -1), stop.moment + stop.ahead
        seen = NeighbourCvs.joined(
            [each._seen(moment, stop.step, grid.hair_per_mass) for each in others.values()]
        )
        seen = seen.near_box(own, 2.0 * (MARGIN_CELLS + 1) * grid.cell)
        if grid is stop.rest.hair_grid and not seen.mass.any():
            return None
        return Neighbours(grid, seen, own)

    def _seen(self, moment: float, step: float, unit: float) -> NeighbourCvs:
        """This groom's CVs at a moment of the frame, as another groom feels them.

        Args:
            moment: as a fraction of the frame.
            step: a substep of the other groom, as a fraction of the frame.
            unit: of the other groom, see `HairGrid`.
        """
        cv_count = self._straight.begin.shape[1]
        chosen, mass = _masses(self._style.hair, unit, cv_count)
        stop = self._stop
        if stop is not None:
            here, before = (
                rows[:, :, chosen].reshape(3, -1) for rows in (self._here, self._before)
            )
            motion = here - before
            here = here + motion * np.float32((moment - stop.moment) / stop.step)
            return NeighbourCvs(here, motion * np.float32(step / stop.step), mass)
        here, end = (_rows(guides[chosen]) for guides in self._straight.ends)
        moved = end - here
        return NeighbourCvs(here + moved * np.float32(moment), moved * np.float32(step), mass)


def go_together(movers: Sequence[Mover]) -> None:
    """Advance all grooms through the frame."""
    by_number = {mover.number: mover for mover in movers}
    for mover in movers:
        mover.go_on(None)
    while (moment := min(mover.stands_at for mover in movers)) < np.inf:
        due = [mover for mover in movers if mover.stands_at <= moment + ONE_MOMENT]
        felt = [mover.feels(by_number) for mover in due]
        for mover, other in zip(due, felt, strict=True):
            mover.go_on(other)


def _at_rest(rest: Rest, style: Floats, other: Style) -> NeighbourCvs | None:
    """The CVs of another groom's style near a groom at rest, moved together with the groom to where
    its motion began; None: there are none."""
    grid, guides = rest.hair_grid, other.read()
    chosen, mass = _masses(other.hair, grid.hair_per_mass, guides.shape[1])
    turn = rotation_from(rest.sample, sample(style))
    middle = style[:, 0].mean(axis=0, dtype=np.float64)
    back = (guides[chosen].astype(np.float64) - middle) @ turn + grid.middle
    points = _rows(back)
    all_of_it = NeighbourCvs(points, np.zeros_like(points), mass)
    near = all_of_it.near_box(
        rest.position.reshape(3, -1), (MARGIN_CELLS + 1) * MAX_CELL * rest.size
    )
    return near if near.mass.any() else None


def _masses(hair: Floats, unit: float, cv_count: int) -> tuple[slice, Floats]:
    """Which guides of another groom are used, and the masses of their CVs in `_rows` order."""
    mass = hair / unit if unit else np.zeros(len(hair))
    lightest = LIGHTEST / max(len(hair), 1)
    every = int(max(LIGHTEST / max(float(mass.mean()), lightest), 1.0)) if len(hair) else 1
    chosen = slice(every // 2, None, every)
    mass = np.rint(np.clip(mass[chosen] * every, 0.0, MAX_MASS))
    return chosen, np.tile(mass.astype(np.float32), cv_count)


def _rows(grid: Floats) -> Floats:
    """The CVs of guides (guide_count, cv_count, 3) as (3, cv_count * guide_count) float32."""
    return as_rows(grid).reshape(3, -1)
