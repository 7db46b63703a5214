"""A ball of combed hair, on which highlights are easy to read: for benches, tests and pictures.

The ball has a radius of 1 m and +Y is its top; strands run along its meridians from there down.
"""

import numpy as np

#: angle that a strand covers [rad]
ARC = 0.5


def combed_strands(count: int, cv_count: int = 12, lift: float = 0.03) -> np.ndarray:
    """Strands with random roots, (n <= count, cv_count, 3) float32.

    With regular roots, neighbours would always hide the same side of a strand. Strands that would
    grow over the lower pole are left out.

    Args:
        lift: how far tips stand off, in radii.
    """
    random = np.random.default_rng(5)
    root = np.arccos(random.uniform(-1.0, 1.0, count))[:, None]
    azimuth = random.uniform(0.0, 2.0 * np.pi, count)[:, None]
    along = np.linspace(0.0, 1.0, cv_count)
    points = on_ball(root + ARC * along, azimuth, 1.0 + lift * np.sin(0.5 * np.pi * along))
    return points[root[:, 0] + ARC < np.pi].astype(np.float32)


def ball_mesh(rings: int = 64, radius: float = 0.99) -> tuple[np.ndarray, np.ndarray]:
    """The ball itself: positions (n, 3) float32 and triangles (m, 3) int64."""
    columns = 2 * rings
    polar = np.linspace(0.0, np.pi, rings + 1)[:, None]
    azimuth = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)
    row, column = np.mgrid[:rings, :columns]
    corner, following = row * columns + column, row * columns + (column + 1) % columns
    upper = np.stack([corner, following, following + columns], axis=-1)
    lower = np.stack([corner, following + columns, corner + columns], axis=-1)
    positions = on_ball(polar, azimuth, radius).reshape(-1, 3).astype(np.float32)
    return positions, np.concatenate([upper, lower]).reshape(-1, 3).astype(np.int64)


def on_ball(polar: np.ndarray, azimuth: np.ndarray, radius: np.ndarray | float) -> np.ndarray:
    """Points (..., 3) at a polar angle from the top and an azimuth, [rad]."""
    flat = np.sin(polar) * radius
    height = np.cos(polar) * radius
    coordinates = np.broadcast_arrays(flat * np.cos(azimuth), height, flat * np.sin(azimuth))
    return np.stack(coordinates, axis=-1)
