"""The scalp parted like brickwork, as for box braids: rows of cells around the crown.

A position is two angles, seen from the middle of the head: polar, down from the crown, and azimuth,
around it from the forehead on. Guides at mirrored positions on both sides of a parting keep it
straight, since a child follows the nearest guide.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from style_growth import Head, Roots, smoothstep, unit

#: how far guides beside a parting are from it, and from each other [m]
PARTING_OFFSET, GUIDE_SPACING = 0.0008, 0.0055
#: guides along the hairline, beyond those of cells
HAIRLINE_GUIDE_COUNT = 160
#: hair leans to the border of its cell, so that partings are thin and have straight edges: the
#: border's position between the cell's middle and its partings, and how far hair leans towards it
BORDER_POSITION, LEAN_FACTOR = 0.86, 0.9
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
    """begin, end: polar angles [rad]. lines: azimuths of the partings between its cells (n,),
    ascending. radius: length around, at its end, of an angle of 1 [m].
    """

    begin: float
    end: float
    lines: np.ndarray
    radius: float

    @property
    def sizes(self) -> np.ndarray:
        """The widths of its cells in azimuth (n,)."""
        return np.diff(np.append(self.lines, self.lines[0] + TURN))


class _Brickwork:
    """Rows of cells over the whole head, about as long as they are wide."""

    crown, forward = unit(np.array([0.0, 0.63, 0.77])), unit(np.array([0.0, -0.77, 0.63]))
    middle = np.array([0.0, 0.015, 0.015])

    def __init__(self, head: Head, width: float) -> None:
        self._head, self._width = head, width
        angles, turns = np.linspace(0.0, 2.2, 120), np.linspace(-np.pi, np.pi, 97)
        lines = np.stack([self.on_skin(angles, np.full(120, turn)) for turn in turns[::4]])
        arc_length = np.cumsum(np.linalg.norm(np.diff(lines, axis=1), axis=2).mean(axis=0))
        # four cells meet at the crown, as large as others
        edges = np.append(0.0, np.arange(1.13 * width, arc_length[-1], width))
        edges = np.interp(edges, np.append(0.0, arc_length), angles)
        self.rows = []
        for number, (begin, end) in enumerate(itertools.pairwise(edges)):
            ring = self.on_skin(np.full(97, end), turns)
            length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1)))
            count = round(0.5 * (begin + end) / end * length[-1] / width) if number else 4
            # cells of a row begin at the middles of those of the row before
            fraction = (np.arange(count) + 0.5 * ((number + 1) % 2)) / count
            azimuth = np.sort(np.interp((fraction + 0.5) % 1.0 * length[-1], length, turns))
            self.rows.append(_Row(begin, end, azimuth, length[-1] / TURN))

    def on_skin(self, polar: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        ahead = np.cos(azimuth)[:, None] * self.forward + np.sin(azimuth)[:, None] * [1.0, 0.0, 0.0]
        ray = np.cos(polar)[:, None] * self.crown + np.sin(polar)[:, None] * ahead
        return self._head.exit_points(self.middle, ray)

    def row_guides(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Guides of a row: how far down in it, 0 to 1, and azimuth [rad]."""
        row, offset = self.rows[number], PARTING_OFFSET / self._width
        lines, sizes = row.lines[:, None], row.sizes[:, None]
        positions = [(1.0 - offset, self._end_parting_angles(number))]
        if number:
            positions.append((offset, self._end_parting_angles(number - 1)))
        for polar in (0.35, 0.68):
            radius = row.radius if number else row.radius * polar
            positions.append((polar, lines + np.array([-PARTING_OFFSET, PARTING_OFFSET]) / radius))
            positions.append((polar, lines + sizes * np.array([1.0, 3.0, 5.0]) / 6.0))
        return (
            np.concatenate([np.full(azimuth.size, polar) for polar, azimuth in positions]),
            np.concatenate([azimuth.ravel() for _, azimuth in positions]),
        )

    def _end_parting_angles(self, number: int) -> np.ndarray:
        """Azimuths of guides on both sides of the parting at the end of a row."""
        row, next_row = self.rows[number : number + 2]
        corners = np.sort(np.concatenate([row.lines, next_row.lines]))
        inset, angles = PARTING_OFFSET / row.radius, []
        for start, end in itertools.pairwise([*corners, corners[0] + TURN]):
            gap = (end - start) * row.radius
            if gap < 3.0 * PARTING_OFFSET:
                angles.append(np.array([0.5 * (start + end)]))
            else:
                count = 1 + max(1, round((gap - 2.0 * PARTING_OFFSET) / GUIDE_SPACING))
                angles.append(np.linspace(start + inset, end - inset, count))
        return np.concatenate(angles)

    def cells(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """For each row: positions of guides on the skin, their borders, cells and sections."""
        count = 0
        for number, row in enumerate(self.rows[:-1]):
            polar, azimuth = self.row_guides(number)
            azimuth = row.lines[0] + (azimuth - row.lines[0]) % TURN
            cell = np.searchsorted(row.lines, azimuth, side="right") - 1
            first, size = row.lines[cell], row.sizes[cell]
            across, along = 2.0 * (azimuth - first) / size - 1.0, 2.0 * polar - 1.0
            distance = np.maximum(np.abs(across), np.abs(along))
            leaning = 0.5 + 0.5 * (
                1.0
                + LEAN_FACTOR * smoothstep(0.0, 0.5, distance) * (BORDER_POSITION / distance - 1.0)
            ) * (np.stack([along, across]))
            height = row.end - row.begin
            yield (
                self.on_skin(row.begin + height * polar, azimuth),
                self.on_skin(row.begin + height * leaning[0], first + size * leaning[1]),
                count + cell,
                np.minimum((1.5 * (across + 1.0)).astype(int), 2),
            )
            count += len(row.lines)


def parted_in_cells(head: Head, width: float) -> Cells:
    """Cells of this width [m] on the scalp, and guides in them, more of them beside partings.

    If the hairline leaves less than half of a cell, its neighbour takes the rest.
    """
    rows = _Brickwork(head, width).cells()
    position, border, cell, section = map(np.concatenate, zip(*rows, strict=True))
    roots = head.roots_near(position)
    # nothing leans out over the hairline
    beyond = head.roots_near(position + 2.5 * (border - position))
    can_lean = head.weight(beyond, "scalp") > 0.7
    cells = Cells(roots, cell, section, np.where(can_lean[:, None], border, position))
    cells = _joined(cells.take(np.flatnonzero(head.weight(roots, "scalp") > 0.5)))
    weight = head.weights["scalp"]
    edge = head.roots(
        HAIRLINE_GUIDE_COUNT, lambda _: ((weight > 0.02) & (weight < 0.9)).astype(float)
    )
    nearest = np.linalg.norm(edge.position[:, None] - cells.roots.position, axis=2).argmin(axis=1)
    return Cells(
        cells.roots.joined(edge),
        np.append(cells.cell, cells.cell[nearest]),
        np.append(cells.section, cells.section[nearest]),
        np.append(cells.border, edge.position, axis=0),
    )


def _joined(cells: Cells) -> Cells:
    """Cells with few guides joined to the cell beside them, and renumbered without gaps."""
    cell, section, position = cells.cell.copy(), cells.section.copy(), cells.roots.position
    size = np.bincount(cell)
    is_small = size < 0.5 * np.median(size[size > 0])
    large = np.flatnonzero(~is_small[cell])
    for small in np.unique(cell[is_small[cell]]):
        members = np.flatnonzero(cells.cell == small)
        gap = np.linalg.norm(position[members, None] - position[large], axis=2)
        neighbor = np.bincount(cells.cell[large[gap.argmin(axis=1)]]).argmax()
        gap[:, cells.cell[large] != neighbor] = np.inf
        cell[members], section[members] = neighbor, cells.section[large[gap.argmin(axis=1)]]
    return replace(cells, cell=np.unique(cell, return_inverse=True)[1], section=section)
