"""The scalp parted like brickwork, as for box braids: rows of cells around the crown.

A place is two angles, seen from the middle of the head: down from the crown, and around it from the
forehead on. Guides at mirrored places on both sides of a parting keep it straight, since a child
follows the nearest guide.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from style_growth import Head, Roots, ramp, unit

#: how far guides beside a parting are from it, and from each other [m]
BESIDE, APART = 0.0008, 0.0055
#: guides along the hairline, beyond those of cells
AT_HAIRLINE = 160
#: hair leans to the border of its cell, so that partings are thin and have straight edges: the
#: border's place between the cell's middle and its partings, and how far hair leans towards it
BORDER, LEAN = 0.86, 0.9
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Cells:
    """roots: of guides (n,). cell: of each (n,). section: of each, one of its cell's three strips
    (n,). border: (n, 3), where on the skin its hair leans to before it is drawn to the middle.
    """

    roots: Roots
    cell: np.ndarray
    section: np.ndarray
    border: np.ndarray

    def take(self, index: np.ndarray) -> "Cells":
        return Cells(
            self.roots.take(index), self.cell[index], self.section[index], self.border[index]
        )


@dataclass(frozen=True)
class _Row:
    """begin, end: angles down from the crown [rad]. lines: angles around of the partings between
    its cells (n,), ascending. radius: length around, at its end, of an angle of 1 [m].
    """

    begin: float
    end: float
    lines: np.ndarray
    radius: float

    @property
    def sizes(self) -> np.ndarray:
        """The angles around of its cells (n,)."""
        return np.diff(np.append(self.lines, self.lines[0] + TURN))


class _Brickwork:
    """Rows of cells over the whole head, about as long as they are wide."""

    crown, forward = unit(np.array([0.0, 0.63, 0.77])), unit(np.array([0.0, -0.77, 0.63]))
    middle = np.array([0.0, 0.015, 0.015])

    def __init__(self, head: Head, width: float) -> None:
        self._head, self._width = head, width
        angles, turns = np.linspace(0.0, 2.2, 120), np.linspace(-np.pi, np.pi, 97)
        lines = np.stack([self.on_skin(angles, np.full(120, turn)) for turn in turns[::4]])
        walked = np.cumsum(np.linalg.norm(np.diff(lines, axis=1), axis=2).mean(axis=0))
        # four cells meet at the crown, as large as others
        edges = np.append(0.0, np.arange(1.13 * width, walked[-1], width))
        edges = np.interp(edges, np.append(0.0, walked), angles)
        self.rows = []
        for number, (begin, end) in enumerate(itertools.pairwise(edges)):
            ring = self.on_skin(np.full(97, end), turns)
            length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1)))
            count = round(0.5 * (begin + end) / end * length[-1] / width) if number else 4
            # cells of a row begin at the middles of those of the row before
            part = (np.arange(count) + 0.5 * ((number + 1) % 2)) / count
            around = np.sort(np.interp((part + 0.5) % 1.0 * length[-1], length, turns))
            self.rows.append(_Row(begin, end, around, length[-1] / TURN))

    def on_skin(self, down: np.ndarray, around: np.ndarray) -> np.ndarray:
        ahead = np.cos(around)[:, None] * self.forward + np.sin(around)[:, None] * [1.0, 0.0, 0.0]
        ray = np.cos(down)[:, None] * self.crown + np.sin(down)[:, None] * ahead
        return self._head.left_by(self.middle, ray)

    def of_row(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Guides of a row: how far down in it, 0 to 1, and around [rad]."""
        row, near = self.rows[number], BESIDE / self._width
        lines, sizes = row.lines[:, None], row.sizes[:, None]
        places = [(1.0 - near, self._beside_end(number))]
        if number:
            places.append((near, self._beside_end(number - 1)))
        for down in (0.35, 0.68):
            radius = row.radius if number else row.radius * down
            places.append((down, lines + np.array([-BESIDE, BESIDE]) / radius))
            places.append((down, lines + sizes * np.array([1.0, 3.0, 5.0]) / 6.0))
        return (
            np.concatenate([np.full(around.size, down) for down, around in places]),
            np.concatenate([around.ravel() for _, around in places]),
        )

    def _beside_end(self, number: int) -> np.ndarray:
        """Angles around of guides on both sides of the parting at the end of a row."""
        row, after = self.rows[number : number + 2]
        corners = np.sort(np.concatenate([row.lines, after.lines]))
        inset, found = BESIDE / row.radius, []
        for one, other in itertools.pairwise([*corners, corners[0] + TURN]):
            gap = (other - one) * row.radius
            if gap < 3.0 * BESIDE:
                found.append(np.array([0.5 * (one + other)]))
            else:
                count = 1 + max(1, round((gap - 2.0 * BESIDE) / APART))
                found.append(np.linspace(one + inset, other - inset, count))
        return np.concatenate(found)

    def cells(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """For each row: places of guides on the skin, their borders, cells and sections."""
        count = 0
        for number, row in enumerate(self.rows[:-1]):
            down, around = self.of_row(number)
            around = row.lines[0] + (around - row.lines[0]) % TURN
            cell = np.searchsorted(row.lines, around, side="right") - 1
            first, size = row.lines[cell], row.sizes[cell]
            across, along = 2.0 * (around - first) / size - 1.0, 2.0 * down - 1.0
            far = np.maximum(np.abs(across), np.abs(along))
            leant = 0.5 + 0.5 * (1.0 + LEAN * ramp(0.0, 0.5, far) * (BORDER / far - 1.0)) * (
                np.stack([along, across])
            )
            deep = row.end - row.begin
            yield (
                self.on_skin(row.begin + deep * down, around),
                self.on_skin(row.begin + deep * leant[0], first + size * leant[1]),
                count + cell,
                np.minimum((1.5 * (across + 1.0)).astype(int), 2),
            )
            count += len(row.lines)


def parted_in_cells(head: Head, width: float) -> Cells:
    """Cells of this width [m] on the scalp, and guides in them, more of them beside partings.

    If the hairline leaves less than half of a cell, its neighbour takes the rest.
    """
    rows = _Brickwork(head, width).cells()
    place, border, cell, section = map(np.concatenate, zip(*rows, strict=True))
    roots = head.roots_near(place)
    # nothing leans out over the hairline
    beyond = head.roots_near(place + 2.5 * (border - place))
    leans = head.weight(beyond, "scalp") > 0.7
    cells = Cells(roots, cell, section, np.where(leans[:, None], border, place))
    cells = _joined(cells.take(np.flatnonzero(head.weight(roots, "scalp") > 0.5)))
    weight = head.weights["scalp"]
    edge = head.roots(AT_HAIRLINE, lambda _: ((weight > 0.02) & (weight < 0.9)).astype(float))
    near = np.linalg.norm(edge.place[:, None] - cells.roots.place, axis=2).argmin(axis=1)
    return Cells(
        cells.roots.and_also(edge),
        np.append(cells.cell, cells.cell[near]),
        np.append(cells.section, cells.section[near]),
        np.append(cells.border, edge.place, axis=0),
    )


def _joined(cells: Cells) -> Cells:
    """Cells with few guides joined to the cell beside them, and renumbered without gaps."""
    cell, section, place = cells.cell.copy(), cells.section.copy(), cells.roots.place
    size = np.bincount(cell)
    is_small = size < 0.5 * np.median(size[size > 0])
    whole = np.flatnonzero(~is_small[cell])
    for small in np.unique(cell[is_small[cell]]):
        own = np.flatnonzero(cells.cell == small)
        gap = np.linalg.norm(place[own, None] - place[whole], axis=2)
        beside = np.bincount(cells.cell[whole[gap.argmin(axis=1)]]).argmax()
        gap[:, cells.cell[whole] != beside] = np.inf
        cell[own], section[own] = beside, cells.section[whole[gap.argmin(axis=1)]]
    return replace(cells, cell=np.unique(cell, return_inverse=True)[1], section=section)
