"""The order of points along a space-filling curve."""

import numpy as np

from hairloom.addon.strands.morton import morton_code


def test_the_corners_of_a_cube_come_in_the_order_of_their_bits() -> None:
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    code = morton_code(corners * 3.0 - 7.0)
    assert (np.diff(code) > 0).all() and code[0] == 0 and code[-1] == 2**30 - 1


def test_neighbours_in_the_order_are_near_in_space() -> None:
    points = np.random.default_rng(1).random((4096, 3))
    sorted_points = points[np.argsort(morton_code(points))]
    step = np.linalg.norm(np.diff(sorted_points, axis=0), axis=1)
    assert np.median(step) < 0.2 * np.linalg.norm(points[1:] - points[:-1], axis=1).mean()


def test_none_and_one_place() -> None:
    assert morton_code(np.zeros((0, 3))).shape == (0,)
    assert (morton_code(np.full((5, 3), 2.5)) == 0).all()
