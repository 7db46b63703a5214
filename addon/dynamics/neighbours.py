"""Hair of several grooms goes through a frame together: each feels the CVs of the others in its
own grid, see `among`.

    at first sight     their style, where it is then in the grid that goes with the groom: the
                       density that they have at rest
    before it feels    where the others are at that moment, and how they move

Grooms that feel stop there, and none goes on before all have got as far. So no result depends on
their order, and each has substeps of its own: after its last stop, hair is taken to go straight on.
Hair that is not simulated, or does not feel, goes straight through the frame.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..arrays import Floats
from .among import (
    COARSEST,
    HEAVIEST,
    MASS,
    REACHED,
    HairGrid,
    Neighbours,
    Others,
    hair_of_cvs,
)
from .state import Rest, as_rows
from .turn import rotation_from, sample

#: Other guides count one in several, of which each counts for all, where a CV would have less mass.
LIGHTEST = MASS // 4
#: Moments of a frame this near to each other are one.
ONE_MOMENT = 1.0e-6


@dataclass(frozen=True, eq=False)
class Stop:
    """A groom in a frame, before it feels other hair.

    moment: as a fraction of the frame. step, ahead: one substep, and how far ahead CVs count, as
        others.
    rest, style: what it returns to, and where that is at the frame's begin, (guide_count, cv_count,
        3) world [m].
    read: gives its CVs and where they were a substep before, each (3, cv_count, guide_count)
        float32 world [m].
    """

    moment: float
    step: float
    ahead: float
    rest: Rest
    style: Floats
    read: Callable[[], tuple[Floats, Floats]]


#: A frame of a groom, that stops before it feels and takes what it feels of others; None: nothing.
type Steps[Result] = Generator[Stop, Neighbours | None, Result]


def alone[Result](steps: Steps[Result]) -> Result:
    """What comes of a frame without others."""
    try:
        next(steps)
        while True:
            steps.send(None)
    except StopIteration as end:
        result: Result = end.value
        return result


@dataclass(frozen=True, eq=False)
class Style:
    """A groom's style, as other grooms see it at first.

    read: gives where it is at the frame's begin, (guide_count, cv_count, 3) world [m].
    hair: (guide_count,) metres of strands that each CV stands for.
    source: what it was made from; another one is another style.
    """

    read: Callable[[], Floats]
    hair: Floats
    source: object


def hair_of(guides: Floats, strands: Floats) -> Floats:
    """Metres of strands that a CV of each guide stands for.

    Args:
        guides: (guide_count, cv_count, 3) [m]. strands: (guide_count,) how many it stands for.
    """
    lengths = np.linalg.norm(np.diff(guides, axis=1), axis=2).sum(axis=1)
    size = float(np.median(lengths)) if len(lengths) else 0.0
    return hair_of_cvs(strands, size, guides.shape[1], len(guides))


@dataclass(frozen=True, eq=False)
class KnownHair:
    """What a groom knows of others since its motion began.

    rest: of the groom, another one in each frame where its style is animated. at_rest: of each
        other, by its number, what its style was made from and the CVs of this near the groom's,
        where both are at rest; None: there are none.
    grid: of the groom among those that are near now. among: their numbers, as far as they are near
        at rest.
    """

    rest: Rest | None = None
    at_rest: Mapping[int, tuple[object, Others | None]] = field(default_factory=dict)
    grid: HairGrid | None = None
    among: frozenset[int] = frozenset()

    def meeting(self, rest: Rest, style: Floats, others: Mapping[int, Style]) -> KnownHair:
        """The same with all of these others.

        Args:
            rest, style: see `Stop`.
            others: those that are near, by numbers that stay the same.
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
            met = Others.of(tuple(parts.values()))
            grid = HairGrid.at_rest(rest.position, rest.size, rest.strands, met)
        return KnownHair(rest, known, grid, among)


@dataclass(frozen=True, eq=False)
class Straight:
    """How a groom goes through a frame that does not stop in it.

    begin: its guides, (guide_count, cv_count, 3) world [m]. read_end: gives them, once it is there.
    reach: how far hair gets from the middle of its roots [m]; what goes farther in a frame has been
        put elsewhere.
    """

    begin: Floats
    read_end: Callable[[], Floats]
    reach: float = np.inf

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """Begin and end, of one shape."""
        end = self.read_end()
        if self.begin.shape != end.shape:
            return end, end
        moved = float(np.linalg.norm((end - self.begin).mean(axis=(0, 1))))
        return (end if moved > self.reach else self.begin), end


class Mover:
    """A groom in a frame.

    known: of others, in the end. error: why it did not come to the frame's end.

    Args:
        number: stays the same from frame to frame.
        steps: what it does, where that waits. near: the numbers of those that it feels.
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
        """The moment at which it stands before it feels; infinite: it goes through."""
        return np.inf if self._steps is None or self._stop is None else self._stop.moment

    def go_on(self, felt: Neighbours | None) -> None:
        """To the next stop or the frame's end."""
        if self._steps is None:
            return
        try:
            self._stop = self._steps.send(felt)
            self._here, self._before = self._stop.read()
        except StopIteration:
            self._steps = None
        except Exception as error:  # the others go on; whoever has sent it reports it
            self._steps, self.error = None, error

    def feels(self, movers: Mapping[int, Mover]) -> Neighbours | None:
        """What it feels of the others where it stands."""
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
        seen = Others.of([each._seen(moment, stop.step, grid.unit) for each in others.values()])
        seen = seen.near(own, 2.0 * (REACHED + 1) * grid.cell)
        if grid is stop.rest.hair_grid and not seen.mass.any():
            return None
        return Neighbours(grid, seen, own)

    def _seen(self, moment: float, step: float, unit: float) -> Others:
        """CVs at a moment of the frame.

        Args:
            step: a substep of the groom that sees them, as another fraction of it.
            unit: see `HairGrid`.
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
            return Others(here, motion * np.float32(step / stop.step), mass)
        here, end = (_rows(guides[chosen]) for guides in self._straight.ends)
        moved = end - here
        return Others(here + moved * np.float32(moment), moved * np.float32(step), mass)


def go_together(movers: Sequence[Mover]) -> None:
    """Through the frame."""
    by_number = {mover.number: mover for mover in movers}
    for mover in movers:
        mover.go_on(None)
    while (moment := min(mover.stands_at for mover in movers)) < np.inf:
        due = [mover for mover in movers if mover.stands_at <= moment + ONE_MOMENT]
        felt = [mover.feels(by_number) for mover in due]
        for mover, other in zip(due, felt, strict=True):
            mover.go_on(other)


def _at_rest(rest: Rest, style: Floats, other: Style) -> Others | None:
    """The CVs of other hair near those of a groom, where both are in their style and the groom has
    gone back to where its motion began; None: there are none."""
    grid, guides = rest.hair_grid, other.read()
    chosen, mass = _masses(other.hair, grid.unit, guides.shape[1])
    turn = rotation_from(rest.sample, sample(style))
    middle = style[:, 0].mean(axis=0, dtype=np.float64)
    back = (guides[chosen].astype(np.float64) - middle) @ turn + grid.middle
    points = _rows(back)
    all_of_it = Others(points, np.zeros_like(points), mass)
    near = all_of_it.near(rest.position.reshape(3, -1), (REACHED + 1) * COARSEST * rest.size)
    return near if near.mass.any() else None


def _masses(hair: Floats, unit: float, cv_count: int) -> tuple[slice, Floats]:
    """Which guides of other hair count, and the masses of all their CVs, as `_rows` has them."""
    mass = hair / unit if unit else np.zeros(len(hair))
    lightest = LIGHTEST / max(len(hair), 1)
    every = int(max(LIGHTEST / max(float(mass.mean()), lightest), 1.0)) if len(hair) else 1
    chosen = slice(every // 2, None, every)
    mass = np.rint(np.clip(mass[chosen] * every, 0.0, HEAVIEST))
    return chosen, np.tile(mass.astype(np.float32), cv_count)


def _rows(grid: Floats) -> Floats:
    """The CVs of guides (guide_count, cv_count, 3) as (3, cv_count * guide_count) float32."""
    return as_rows(grid).reshape(3, -1)
