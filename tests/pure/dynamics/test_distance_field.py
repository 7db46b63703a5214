"""Signed distances against the formulas of balls and boxes."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders.distance_field import DistanceField
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import closest_point

RESOLUTION = 40


def field_of(surface, resolution=RESOLUTION):
    return DistanceField.from_surface(surface, DynamicsSettings(collider_resolution=resolution))


def scattered(reach, count=4000, seed=0):
    points = np.random.default_rng(seed).uniform(-reach, reach, (3, count))
    return points.astype(np.float32)


def box_distance(points, size):
    """Signed distance of a box around the origin (Quilez)."""
    q = np.abs(points) - np.asarray(size)[:, None] / 2.0
    outside = np.linalg.norm(np.maximum(q, 0.0), axis=0)
    return outside + np.minimum(q.max(axis=0), 0.0)


@pytest.fixture(scope="module")
def ball(kit):
    return field_of(kit.icosphere(0.1))


@pytest.fixture(scope="module")
def brick(kit):
    return field_of(kit.box((0.2, 0.12, 0.08)))


def test_ball(ball):
    """Near the surface within a tenth of a cell of the formula, including the error of facets."""
    points = scattered(0.13)
    exact = np.linalg.norm(points, axis=0) - 0.1
    distance, gradient = ball.distance(points)
    near = np.abs(exact) < 2.0 * ball.cell
    assert np.abs(distance - exact)[near].max() < 0.1 * ball.cell
    away = points / np.linalg.norm(points, axis=0)
    assert (gradient * away).sum(axis=0)[near].min() > 0.96
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=0)[near], 1.0, atol=0.04)


def test_box_within_half_a_diagonal(brick):
    """Exact at faces, rounded by part of a cell at edges and corners, coarser far away."""
    points = scattered(0.11, 20000)
    exact = box_distance(points, (0.2, 0.12, 0.08))
    distance, _ = brick.distance(points)
    error, near = np.abs(distance - exact), np.abs(exact) < 2.0 * brick.cell
    assert error[near].max() < 0.5 * brick.cell
    assert np.median(error[near]) < 0.01 * brick.cell
    assert error.max() < 2.0 * brick.cell
    assert ((distance < 0.0) == (exact < 0.0))[np.abs(exact) > 0.3 * brick.cell].all()


def test_gradient_is_the_slope(brick):
    points = scattered(0.1, 500).astype(np.float64)
    _, gradient = brick.distance(points)
    step = 1e-6
    cell = (points - brick.low[:, None]) / brick.cell
    top = np.array(brick.values.shape)[:, None] - 1.0
    in_grid = ((cell > 0.0) & (cell < top)).all(axis=0)
    inside_a_cell = (np.abs(cell - np.round(cell)) > 1e-3).all(axis=0) & in_grid
    assert inside_a_cell.sum() > 100
    for axis in range(3):
        way = np.zeros((3, 1))
        way[axis] = step
        slope = (brick.distance(points + way)[0] - brick.distance(points - way)[0]) / (2 * step)
        np.testing.assert_allclose(gradient[axis][inside_a_cell], slope[inside_a_cell], atol=1e-3)


def test_near_nodes_are_exact_and_all_signs_right(kit):
    surface = kit.icosphere(0.1, 1)
    field = field_of(surface, 12)
    nodes = np.indices(field.values.shape).reshape(3, -1).T * field.cell + field.low
    exact = closest_point(nodes, surface).distance
    exact[winding_number(nodes, surface) > 0.5] *= -1.0  # at every node, not only near ones
    values, near = field.values.ravel(), np.abs(exact) < 2.0 * field.cell
    assert (values[near] < exact[near] + 1e-6).all()  # lower where edges would be cut off
    assert (np.abs(values[near] - exact[near]) < 1e-6).mean() > 0.4
    assert (values[near] > exact[near] - 0.1 * field.cell).all()
    np.testing.assert_array_equal(values[~near] < 0.0, exact[~near] < 0.0)


def test_no_part_of_the_surface_lies_outside(kit):
    """For a box with sharp edges, and a sheet of a third of a cell, both askew to the grid."""
    turn = kit.rotation(0, 0.3) @ kit.rotation(1, 0.2)
    for size in ((0.2, 0.14, 0.1), (0.2, 0.2, 0.003)):
        straight = kit.box(size)
        surface = Surface(kit.moved(turn, straight.positions), straight.triangles)
        field = DistanceField.from_surface(surface, DynamicsSettings(collider_resolution=22))
        random = np.random.default_rng(4)
        triangle = random.integers(len(surface.triangles), size=5000)
        fraction = random.dirichlet((0.4, 0.4, 0.4), 5000)
        points = np.einsum("nk,nkd->nd", fraction, surface.corners[triangle])
        distance, _ = field.distance(np.ascontiguousarray(points.T, np.float32))
        assert distance.max() < 0.1 * field.cell
        assert (distance > -0.9 * field.cell).all()


def test_near_misses_none(ball):
    for reach in (0.001, 0.01, 0.03):
        points = scattered(0.2)
        within = np.linalg.norm(points, axis=0) - 0.1 < reach - 1e-4
        chosen = ball.near(points, reach)
        assert np.isin(np.flatnonzero(within), chosen).all()
        assert len(chosen) < points.shape[1]


def test_near_misses_none_of_what_is_looked_up_and_keeps_few_others(ball):
    points = scattered(0.2)
    distance, _ = ball.distance(points)
    for reach in (-0.02, 0.0, 0.001, 0.01):
        chosen = ball.near(points, reach)
        assert np.isin(np.flatnonzero(distance < np.sqrt(3.0) * reach), chosen).all()
        chosen = chosen[np.abs(points[:, chosen]).max(axis=0) < 0.1]
        # 0.87 is half the diagonal of a cell
        assert (distance[chosen] < np.sqrt(3.0) * reach + 0.87 * ball.cell).all()


def test_outside_of_the_grid_distance_goes_on(ball):
    points = np.array([[0.5, 0.0, -0.3], [0.0, 0.9, 0.3], [0.0, 0.0, 0.3]], np.float32)
    distance, gradient = ball.distance(points)
    exact = np.linalg.norm(points, axis=0) - 0.1
    assert (distance > 0.5 * exact).all()
    assert (distance < 1.05 * exact).all()
    assert ((gradient * points).sum(axis=0) > 0.0).all()
    assert not len(ball.near(points, 0.05))


def test_a_hole_does_not_turn_the_inside_out(kit):
    whole = kit.icosphere(0.1, 2)
    holed = Surface(whole.positions, whole.triangles[6:])
    field = field_of(holed)
    # no farther than the closed hole
    assert -0.1 < field.distance(np.zeros((3, 1), np.float32))[0][0] < -0.05
    assert field.distance(np.full((3, 1), 0.09, np.float32))[0][0] > 0.04


def test_a_mesh_turned_inside_out_is_the_same(kit, brick):
    surface = kit.box((0.2, 0.12, 0.08))
    turned = field_of(Surface(surface.positions, surface.triangles[:, ::-1]))
    np.testing.assert_allclose(turned.values, brick.values, atol=1e-6)


def test_winding_counts(kit):
    points = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    np.testing.assert_allclose(winding_number(points, kit.icosphere(0.1, 2)), [1, 0], atol=0.05)


@pytest.mark.parametrize(
    ("positions", "triangles", "message"),
    [
        (np.zeros((3, 3)), np.zeros((0, 3), int), "no faces"),
        (np.zeros((3, 3)), np.array([[0, 1, 2]]), "one point"),
        (np.eye(3), np.array([[0, 1, 2]]), "encloses no volume"),
    ],
)
def test_a_mesh_without_volume_is_named(positions, triangles, message):
    with pytest.raises(HairloomError, match=message):
        field_of(Surface(positions.astype(np.float32), triangles))


def test_a_wide_opening_lets_nothing_of_the_inside_count_as_outside(kit):
    """Against the exact winding number, for a ball that is cut off below, so that rows of the grid
    enter it."""
    ball = kit.icosphere(0.1)
    kept = ball.positions[ball.triangles][:, :, 2].min(axis=1) > -0.06
    bowl = Surface(ball.positions, ball.triangles[kept])
    field = field_of(bowl)
    points = scattered(0.11, 20000)
    distance, _ = field.distance(points)
    winding = np.abs(winding_number(points.T, bowl))
    is_far = (np.abs(distance) > 1.5 * field.cell) & (np.abs(winding - 0.5) > 0.1)
    assert ((winding > 0.5) & is_far).sum() > 4000
    is_wrong = (distance < 0.0) != (winding > 0.5)
    assert is_wrong[is_far].mean() < 1e-3, "some are, at the rim"


def test_an_opening_is_a_surface_too(kit):
    """In and above a box without its lid, no distance exceeds that to the closed opening."""
    box = kit.box((0.2, 0.2, 0.2))
    upper = (box.corners[:, :, 2] > 0.0).all(axis=1)
    field = DistanceField.from_surface(
        Surface(box.positions, box.triangles[~upper]), DynamicsSettings(collider_resolution=24)
    )
    for axis in range(3):
        jump = np.abs(np.diff(field.values, axis=axis))
        assert jump.max() < 1.3 * field.cell
    height = np.linspace(-0.08, 0.2, 60)
    middle = np.stack([np.zeros(60), np.zeros(60), height]).astype(np.float32)
    distance = field.distance(middle)[0]
    closure = height[np.flatnonzero(np.diff(np.sign(distance)))]
    assert len(closure) == 1
    assert (np.abs(distance) <= np.abs(height - closure) + field.cell).all()
    kept = field.near(middle, 0.005)
    assert np.isin(np.flatnonzero(np.abs(distance) < 0.005), kept).all()
