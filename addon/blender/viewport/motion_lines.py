"""Coloured lines that show what happens to simulated hair: where guides are longer or shorter than
in their style, where they touch or are inside colliders, how dense hair is in each cell; and masks.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...dynamics.colliders import signed_distance
from ...dynamics.contacts import all_cv_radii
from ...dynamics.groom_rotation import fit_rotation, sample_guides
from ...dynamics.hair_grid import GRID_OFFSET
from ...dynamics.settings import DynamicsSettings
from ..sessions.session import Session

type Color = tuple[float, float, float, float]
#: relative changes of length, each with the colour of segments from that value on
STRETCH_COLORS: tuple[tuple[float, Color], ...] = (
    (0.0, (0.25, 0.6, 0.3, 0.25)),
    (0.01, (1.0, 0.75, 0.1, 0.9)),
    (0.05, (1.0, 0.15, 0.1, 1.0)),
)
#: colours of points that touch a collider, and of those inside one
TOUCHING_COLOR: Color = (0.2, 0.9, 0.6, 0.9)
INSIDE_COLOR: Color = (1.0, 0.15, 0.1, 1.0)
#: distance at which a point touches a collider, relative to the distance that it keeps; length of
#: its line, relative to the hair's length
_TOUCH_FACTOR, _TICK_LENGTH = 1.05, 0.03
#: density of hair in a cell, relative to the mean of all cells with hair at rest
DENSITY_COLORS: tuple[tuple[float, Color], ...] = (
    (0.0, (0.2, 0.4, 1.0, 0.35)),
    (0.5, (0.2, 0.9, 0.5, 0.6)),
    (1.5, (1.0, 0.75, 0.1, 0.8)),
    (3.0, (1.0, 0.15, 0.1, 1.0)),
)
#: mask values, in the colours of Blender's Weight Paint
MASK_COLORS: tuple[tuple[float, Color], ...] = (
    (0.0, (0.0, 0.0, 1.0, 0.8)),
    (0.125, (0.0, 0.5, 1.0, 0.8)),
    (0.25, (0.0, 1.0, 0.9, 0.8)),
    (0.375, (0.0, 1.0, 0.3, 0.8)),
    (0.5, (0.3, 1.0, 0.0, 0.8)),
    (0.625, (0.9, 1.0, 0.0, 0.8)),
    (0.75, (1.0, 0.5, 0.0, 0.8)),
    (0.875, (1.0, 0.0, 0.0, 0.8)),
)
#: Inset of squares in their cells, as a fraction, so that neighbours do not share a line.
_INSET = 0.06

type Colored = Iterator[tuple[Color, Floats]]


def stretch_lines(session: Session) -> Colored:
    """Segments of all guides, coloured by their change of length from the style."""
    now, rest = session.solver.guides(), session.solver.motion.dynamics.rest.length.T
    segments = np.stack([now[:, :-1], now[:, 1:]], axis=2)
    length = np.linalg.norm(segments[:, :, 1] - segments[:, :, 0], axis=2)
    change = np.abs(length / np.maximum(rest, 1.0e-12) - 1.0)
    for color, chosen in _by_color(change, STRETCH_COLORS):
        yield color, segments[chosen].reshape(-1, 3)


def contact_lines(session: Session) -> Colored:
    """Lines from points of guides that touch a collider, away from it; and from those inside, to
    its surface."""
    settings, guides = session.settings[DynamicsSettings], session.solver.guides()
    count, cv_count, _ = guides.shape
    size = session.solver.motion.dynamics.rest.size
    radius = all_cv_radii(settings, cv_count, count, size).reshape(cv_count, count).T
    reach = max(float(radius.max(initial=0.0)) * _TOUCH_FACTOR, 1.0e-6)
    found = signed_distance(guides.reshape(-1, 3), session.posed_colliders, reach)
    distance, outward = found[0].reshape(count, cv_count), found[1].reshape(guides.shape)
    is_inside = (distance < 0.0) & np.isfinite(radius)
    touches = (
        (distance <= radius * _TOUCH_FACTOR) & (distance < reach) & ~is_inside & np.isfinite(radius)
    )
    tick = np.full(distance.shape, _TICK_LENGTH * size, np.float32)
    for color, chosen, long in (
        (TOUCHING_COLOR, touches, tick),
        (INSIDE_COLOR, is_inside, -distance),
    ):
        ends = guides[chosen] + outward[chosen] * long[chosen][:, None]
        yield color, np.stack([guides[chosen], ends], axis=1).reshape(-1, 3)


def density_lines(session: Session) -> Colored:
    """Two slices of the hair grid through the middle of the roots: cells with hair as squares,
    coloured by density."""
    rest, guides = session.solver.motion.dynamics.rest, session.solver.guides()
    if not len(guides):
        return
    grid = rest.hair_grid
    turn = fit_rotation(rest.sample_points, sample_guides(guides))
    middle = guides[:, 0].mean(axis=0, dtype=np.float64)
    place = grid.placement(turn, middle)
    at_rest, _ = _cells(grid.placement(np.eye(3), grid.middle).to_cells(rest.position), grid.mass)
    mean_density = float(at_rest.mean())
    mass, cell = _cells(place.to_cells(np.ascontiguousarray(guides.transpose(2, 1, 0))), grid.mass)
    for across in (0, 1):
        is_cut = cell[:, across] == np.floor(GRID_OFFSET[across])
        squares = _squares(cell[is_cut], across)
        for color, chosen in _by_color(mass[is_cut] / mean_density, DENSITY_COLORS):
            corners = (squares[chosen].reshape(-1, 3) - GRID_OFFSET) * grid.cell
            yield color, corners @ turn.T + middle


def painted_lines(guides: Floats, painted: Floats | None) -> Colored:
    """Segments of all guides, coloured by the painted values; none without these.

    Args:
        painted: (cv_count or 1, guide_count).
    """
    if painted is None:
        return
    segments = np.stack([guides[:, :-1], guides[:, 1:]], axis=2)
    here = np.broadcast_to(painted.T, guides.shape[:2])
    for color, chosen in _by_color((here[:, :-1] + here[:, 1:]) / 2.0, MASK_COLORS):
        yield color, segments[chosen].reshape(-1, 3)


def _cells(places: Floats, mass: Floats) -> tuple[Floats, Ints]:
    """The mass of hair in each cell that has any, (n,), and the numbers of these cells, (n, 3).

    Args:
        places: (3, cv_count, guide_count) in cells. mass: (guide_count,).
    """
    every = np.floor(places.reshape(3, -1).T).astype(np.int64)
    cells, index = np.unique(every, axis=0, return_inverse=True)
    weights = np.broadcast_to(mass, places.shape[1:]).ravel()
    return np.bincount(index.ravel(), weights, len(cells)), cells


def _squares(cells: Ints, across: int) -> Floats:
    """The outlines of cells in the plane perpendicular to an axis, (n, 8, 3) in cells."""
    one, other = (axis for axis in range(3) if axis != across)
    corner = np.array([[0, 0], [1, 0], [1, 0], [1, 1], [1, 1], [0, 1], [0, 1], [0, 0]], float)
    corner = _INSET + corner * (1.0 - 2.0 * _INSET)
    squares = np.repeat(cells[:, None].astype(np.float64), 8, axis=1)
    squares[..., across] += 0.5
    squares[..., one] += corner[:, 0]
    squares[..., other] += corner[:, 1]
    return squares


def _by_color(
    values: Floats, colors: tuple[tuple[float, Color], ...]
) -> Iterator[tuple[Color, Bools]]:
    """Each colour, with a mask of the values from its threshold up to the next one."""
    ends = [begin for begin, _ in colors[1:]] + [np.inf]
    for (begin, color), end in zip(colors, ends, strict=True):
        yield color, (values >= begin) & (values < end)
