"""Hair that touches other hair: ponytails and locks."""

import numpy as np

from hairloom.addon.dynamics.state import start

#: A weak style that carries none of the weight.
SOFT_STYLE = {"style_root": 0.5, "style_tip": 0.1, "bend": 0.3, "sag_compensation": 0.0}


def tail(count, cv_count=12, root_radius=0.012, tip_radius=0.04, length=0.3, seed=1):
    """A ponytail below its tie: its radius grows from `root_radius` to `tip_radius`, then stays."""
    random = np.random.default_rng(seed)
    angle, away = random.uniform(0.0, 2.0 * np.pi, count), random.random(count) ** 0.5
    along = np.linspace(0.0, 1.0, cv_count)
    radius = root_radius + (tip_radius - root_radius) * np.sin(
        np.minimum(1.6 * along, 1.0) * np.pi / 2.0
    )
    grid = np.zeros((count, cv_count, 3))
    grid[..., 0] = (np.cos(angle) * away)[:, None] * radius
    grid[..., 1] = (np.sin(angle) * away)[:, None] * radius
    grid[..., 2] = -length * along
    return grid.astype(np.float32)


def two_locks(count, cv_count=12, seed=2):
    """Two locks of hair that hang side by side, 3 cm apart, and each strand's side, -1 or 1."""
    lock = tail(2 * count, cv_count, 0.012, 0.012, 0.25, seed)
    side = np.repeat([-1.0, 1.0], count)
    lock[..., 0] += (0.015 * side)[:, None].astype(np.float32)
    return lock, side


def cell_count(grid, width=0.006):
    """How many cells of this width strands run through."""
    steps = np.arange(4)[:, None, None, None] / 4.0
    points = grid[:, :-1] * (1.0 - steps) + grid[:, 1:] * steps
    return len(np.unique(np.floor(points.reshape(-1, 3) / width).astype(int), axis=0))


def rotation_matrix(angle, axis=(0.3, -0.5, 0.8)):
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def squeezed_tail(count=30, cv_count=8):
    """A tail that has been moved, turned, squeezed and set in motion: its rest, position,
    previous position, turn (3, 3), and mean root."""
    random = np.random.default_rng(5)
    rest = tail(count, cv_count)
    turn, move = rotation_matrix(0.7), np.array([0.4, -2.0, 1.5])
    here = rest * [0.55, 0.8, 1.0] @ turn.T + move
    before = here - random.normal(0.0, 0.002, here.shape)
    rows = [np.ascontiguousarray(one.transpose(2, 1, 0), np.float32) for one in (here, before)]
    middle = (rest[:, 0] @ turn.T + move).mean(axis=0)
    return start(rest, strands=random.uniform(0.0, 3.0, count)).rest, *rows, turn, middle
