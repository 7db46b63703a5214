"""Ambient occlusion: against a slab in closed form and against ray marching."""

from __future__ import annotations

import numpy as np
import pytest
from spheres import ball

from hairloom.addon.arrays import Floats
from hairloom.addon.shading.ambient import (
    HairCells,
    ambient_occlusion,
    depth_towards,
    openness_field,
    skin_occlusion,
    sky_directions,
    sky_openness,
    summed_light,
)
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.density_grid import (
    body_depth,
    grid_around,
    hair_depth,
    sample,
)
from hairloom.addon.strands import StrandSet, Surface


def straight_hair(count: int, radius: float = 1e-3) -> StrandSet:
    """Random needles of 10 cm in a box of 20 cm."""
    random = np.random.default_rng(1)
    root, way = random.uniform(-0.1, 0.1, (count, 3)), random.normal(size=(count, 3))
    way *= 0.1 / np.linalg.norm(way, axis=1, keepdims=True)
    points = np.stack([root, root + 0.3 * way, root + way], axis=1).reshape(-1, 3)
    return StrandSet(points, np.arange(count + 1) * 3, np.full(count * 3, radius), np.zeros(count))


def test_the_sky_is_whole_and_its_directions_integrate_polynomials() -> None:
    """Lebedev's 26 points are exact up to degree 7: means of x^2, x^4, x^2 y^2 and z^6."""
    steps, fractions = zip(*sky_directions(0.0), strict=True)
    unit = np.array(steps) / np.linalg.norm(steps, axis=1, keepdims=True)
    weight = np.array(fractions)
    x, y, z = unit.T
    assert weight.sum() == pytest.approx(1.0)
    assert weight @ unit == pytest.approx([0.0] * 3, abs=1e-15)
    exact = {1 / 3: x**2, 1 / 5: x**4, 1 / 15: x**2 * y**2, 1 / 7: z**6}
    for mean, values in exact.items():
        assert weight @ values == pytest.approx(mean)
    for upper_fraction in (0.3, 1.0):
        some = [(step, fraction) for step, fraction in sky_directions(upper_fraction)]
        assert sum(fraction for _, fraction in some) == pytest.approx(1.0)
    assert all(step[2] > 0 for step, _ in sky_directions(1.0))


@pytest.mark.parametrize("step", [step for step, _ in sky_directions(0.0)])
def test_running_sums_agree_with_walking_cell_by_cell(step: tuple[int, int, int]) -> None:
    depth = np.random.default_rng(2).random((5, 7, 6)).astype(np.float32)
    (found,) = depth_towards(depth[None], [step])
    for start in [(0, 0, 0), (4, 6, 5), (2, 3, 3), (1, 5, 2), (3, 0, 4)]:
        expected, here = 0.5 * depth[start], np.array(start) + step
        while ((here >= 0) & (here < depth.shape)).all():
            expected += depth[tuple(here)]
            here += step
        assert found[start] == pytest.approx(expected * np.linalg.norm(step), rel=1e-5)


def test_uniform_slab_in_closed_form() -> None:
    """Against the transmittance of a wide slab, exp(-tau (distance to top or bottom) / |cos|)."""
    depth = np.zeros((151, 151, 24), np.float32)
    depth[:, :, 2:22] = 0.11
    found = sky_openness(depth, 0.0)[75, 75]
    for cell in range(2, 22):
        above, below = (21.5 - cell) * 0.11, (cell - 1.5) * 0.11
        expected = 0.0
        for (x, y, z), fraction in sky_directions(0.0):
            if z:
                slant = np.linalg.norm((x, y, z))
                expected += fraction * np.exp(-(above if z > 0 else below) * slant)
            else:
                expected += fraction * np.exp(-75.5 * 0.11 * np.linalg.norm((x, y)))
        assert found[cell] == pytest.approx(expected, rel=1e-4)
    assert found[0] > 0.5


def test_optical_depth_is_the_area_of_the_hair() -> None:
    """Summed over all cells: (pi / 4) x the strands' area 2 r l, over the area of a cell's face."""
    strands = straight_hair(50)
    grid = grid_around(strands, 40)
    depth = hair_depth(strands, grid)
    area = np.pi / 4.0 * 2.0 * 1e-3 * strands.lengths().sum()
    assert depth.sum() * grid.cell**2 == pytest.approx(area, rel=1e-5)


def test_hair_lies_in_the_cells_that_it_passes() -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [1.0, 1.0, 1.0], [1.0, 1.0, 0.9]])
    strands = StrandSet(points, [0, 2, 4], np.full(4, 1e-3), np.zeros(2))
    grid = grid_around(strands, 50)
    depth = hair_depth(strands, grid)
    along = np.linspace(0.01, 0.09, 20)[:, None] * [0.0, 0.0, 1.0]
    assert sample(depth[None], grid.coordinates(along)).min() > 0.0
    between = np.linspace(0.2, 0.8, 20)[:, None] * np.ones(3)
    assert sample(depth[None], grid.coordinates(between)).max() == 0.0


def marched(depth: Floats, start: Floats, direction: Floats) -> float:
    """Optical depth along a ray through the trilinear field, in steps of a fiftieth of a cell."""
    step = 0.02
    distance = step * (np.arange(int(2.0 * max(depth.shape) / step)) + 0.5)
    ray = start + distance[:, None] * direction
    is_inside = ((ray >= 0) & (ray <= np.array(depth.shape) - 1)).all(axis=1)
    return float(sample(depth[None], ray[is_inside].astype(np.float32)).sum() * step)


def test_agrees_with_rays_marched_one_by_one() -> None:
    strands = straight_hair(400)
    settings = AmbientSettings(extinction=1.0, ao_bias=1.0, upper_fraction=0.0, cell_count=32)
    points = strands.points[::37]
    found = ambient_occlusion(strands, points, None, settings)
    grid = grid_around(strands, 32)
    depth = hair_depth(strands, grid)
    expected = []
    for start in grid.coordinates(points):
        rays = [
            fraction * np.exp(-marched(depth, start, np.array(step) / np.linalg.norm(step)))
            for step, fraction in sky_directions(0.0)
        ]
        expected.append(sum(rays))
    assert np.ptp(expected) > 0.3
    assert np.abs(found - expected).max() < 0.05
    assert np.abs(found - expected).mean() < 0.012


def carpet(length: float) -> StrandSet:
    """Dense upright fur on a square of 1 m that is tilted, so that it lies askew to the cells."""
    place = np.linspace(-0.5, 0.5, 160)
    x, y = (each.ravel() for each in np.meshgrid(place, place))
    root = np.stack([x, y, 0.04 * x + 0.02 * y], axis=1)
    up = np.array([-0.04, -0.02, 1.0])
    points = root[:, None] + np.linspace(0.0, length, 6)[:, None] * up
    count = len(root)
    return StrandSet(
        points.reshape(-1, 3), np.arange(count + 1) * 6, np.full(count * 6, 4e-4), np.zeros(count)
    )


def test_even_fur_on_a_large_body_is_shaded_evenly() -> None:
    """All places get the same shade, whatever their position in the cells."""
    fur = carpet(0.03)
    settings = AmbientSettings(extinction=8.0, ao_bias=1.0, upper_fraction=1.0)
    found = ambient_occlusion(fur, fur.points, None, settings).reshape(-1, 6)
    inner = (np.abs(fur.roots[:, :2]) < 0.35).all(axis=1)
    tips, roots = found[inner, -1], found[inner, 0]
    assert tips.std() < 0.1 * tips.mean()
    assert tips.mean() > 0.7 and tips.mean() > 2.0 * roots.mean()


def test_cells_are_fine_only_where_hair_is_short_and_never_too_many() -> None:
    long, short, shortest = (grid_around(carpet(each), 56) for each in (0.3, 0.03, 1e-4))
    assert long.cell > 1.0 / 56.0
    assert 0.95 < short.cell / (0.03 / 6) < 1.05
    assert shortest.cell < short.cell and np.prod(shortest.shape) < 1_400_000


def test_many_directions_agree_with_twenty_six() -> None:
    """The quadrature against 600 directions spread over the sphere (Fibonacci)."""
    strands = straight_hair(400)
    grid = grid_around(strands, 24)
    depth = hair_depth(strands, grid)
    openness = sky_openness(depth, 0.0)
    index = np.arange(600) + 0.5
    up, around = np.arccos(1.0 - 2.0 * index / 600), np.pi * (1.0 + 5.0**0.5) * index
    sphere = np.stack(
        [np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=1
    )
    for cell in [(12, 12, 12), (6, 14, 10), (20, 9, 16)]:
        expected = np.mean([np.exp(-marched(depth, np.array(cell, float), d)) for d in sphere])
        assert openness[cell] == pytest.approx(expected, abs=0.03)


def hair_on_ball() -> StrandSet:
    """Dense radial hair from a ball of 8 cm to 12 cm."""
    random = np.random.default_rng(3)
    way = random.normal(size=(4000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    points = way[:, None] * np.linspace(0.08, 0.12, 8)[None, :, None]
    return StrandSet(
        points.reshape(-1, 3), np.arange(4001) * 8, np.full(32000, 1e-3), np.zeros(4000)
    )


def test_open_at_the_outside_and_dark_at_the_scalp() -> None:
    strands = hair_on_ball()
    settings = AmbientSettings(extinction=2.0, upper_fraction=0.0)
    shade = ambient_occlusion(strands, strands.points, ball(0.08), settings).reshape(4000, 8)
    mean = shade.mean(axis=0)
    assert (np.diff(mean) > 0.0).all()
    assert mean[0] < 0.2
    assert mean[-1] > 0.8
    assert shade.min() >= 0.0
    assert shade.max() <= 1.0
    around = np.array([[0.2, 0.0, 0.0], [0.0, -0.3, 0.0], [0.0, 0.0, 1.0]])
    assert ambient_occlusion(strands, around, ball(0.08), settings) == pytest.approx(1.0)


def test_the_body_shuts_out_the_light_from_behind_and_only_that() -> None:
    """Without hair: against the sky that a ball 1.5 cells smaller hides; inside all is hidden."""
    strands = hair_on_ball()
    settings = AmbientSettings(extinction=0.0, ao_bias=1.0, upper_fraction=0.0, cell_count=96)
    on_ball = ambient_occlusion(strands, strands.roots * 1.01, ball(0.08), settings)
    shell = 0.08 - 1.5 * grid_around(strands, 96).cell
    hidden = 0.5 * (1.0 - np.sqrt(1.0 - (shell / 0.0808) ** 2))
    assert on_ball.mean() == pytest.approx(1.0 - hidden, abs=0.05)
    inside = ambient_occlusion(strands, np.zeros((1, 3)), ball(0.08), settings)
    assert inside[0] < 1e-3
    free = ambient_occlusion(strands, strands.roots, None, settings)
    assert free == pytest.approx(1.0)


def openness(
    strands: StrandSet, points: Floats, body: Surface | None, extinction: float, cell_count: int
) -> Floats:
    found = openness_field(HairCells.of(strands, body, cell_count), extinction).at(points)
    return found.T


def test_openness_depends_on_the_direction_of_light() -> None:
    """Over a ball without hair, light comes from everywhere except a cone: mean and outward vector
    are integrals over that, and the vector has no part along the ball."""
    strands = hair_on_ball()
    outward = strands.roots / np.linalg.norm(strands.roots, axis=1, keepdims=True)
    found = openness(strands, strands.roots * 1.01, ball(0.08), 0.0, 96)
    shell = 0.08 - 1.5 * grid_around(strands, 96).cell
    squared = (shell / 0.0808) ** 2
    assert found[:, 0].mean() == pytest.approx(0.5 * (1.0 + np.sqrt(1.0 - squared)), abs=0.05)
    along = np.sum(found[:, 1:] * outward, axis=1)
    assert along.mean() == pytest.approx(0.75 * squared, abs=0.07)
    aside = found[:, 1:] - along[:, None] * outward
    assert np.abs(aside.mean(axis=0)).max() < 0.02
    assert openness(strands, strands.roots, None, 0.0, 40) == pytest.approx(
        np.tile([1.0, 0.0, 0.0, 0.0], (4000, 1)), abs=1e-5
    )


def test_openness_is_less_in_the_hair_than_at_its_tips() -> None:
    strands = hair_on_ball()
    found = openness(strands, strands.points, ball(0.08), 2.0, 56)[:, 0].reshape(4000, 8)
    assert (np.diff(found.mean(axis=0)) > 0.0).all() and found.mean(axis=0)[-1] > 0.4


def test_a_thin_sheet_shades_neither_of_its_sides() -> None:
    """Like an ear, a plate 2 mm thick: the shell inside it would come out at the other side."""
    plate = ball(1.0)
    plate = Surface(plate.positions * [0.001, 0.08, 0.08], plate.triangles)
    strands = straight_hair(50)
    depth = body_depth(plate, grid_around(strands, 40))
    assert depth.max() == 0.0
    thick = Surface(plate.positions * [80.0, 1.0, 1.0], plate.triangles)
    assert body_depth(thick, grid_around(strands, 40)).max() > 0.0


def test_light_from_above_leaves_the_lower_side_dark() -> None:
    strands = hair_on_ball()
    height = strands.roots[:, 2]
    settings = AmbientSettings(extinction=1.0, upper_fraction=1.0, ao_bias=1.0)
    shade = ambient_occlusion(strands, strands.points, ball(0.08), settings).reshape(-1, 8)[:, -1]
    assert shade[height > 0.05].mean() > 0.85
    assert shade[height < -0.06].mean() < 0.1


def test_strength_fades_the_shade_out() -> None:
    strands = hair_on_ball()
    full = ambient_occlusion(strands, strands.roots, None, AmbientSettings())
    half = ambient_occlusion(strands, strands.roots, None, AmbientSettings(strength=0.5))
    assert half == pytest.approx(1.0 - 0.5 * (1.0 - full), abs=1e-6)
    none = ambient_occlusion(strands, strands.roots, None, AmbientSettings(strength=0.0))
    assert (none == 1.0).all()


def test_a_large_floor_costs_only_what_lies_near_the_hair() -> None:
    strands = straight_hair(50)
    floor = Surface([[-1e4, -1e4, 0], [1e4, -1e4, 0], [1e4, 1e4, 0]], [[0, 1, 2]])
    grid = grid_around(strands, 40)
    depth = body_depth(floor, grid)
    covered = (depth > 0.0).any(axis=2)
    below = floor.positions[:, 1].max()
    assert below > 0.0
    is_over_floor = (grid.low[0] + grid.cell * np.arange(grid.shape[0]))[:, None] > (
        grid.low[1] + grid.cell * np.arange(grid.shape[1])
    )[None, :] + 2.0 * grid.cell
    assert covered[is_over_floor].all()
    assert (depth > 0.0).sum() <= covered.size * 6


def test_no_hair_and_no_points() -> None:
    strands = straight_hair(3)
    none = strands.take(np.zeros(0, np.int64))
    assert (ambient_occlusion(none, strands.points, None, AmbientSettings()) == 1.0).all()
    assert ambient_occlusion(strands, np.zeros((0, 3)), None, AmbientSettings()).shape == (0,)


def test_skin_is_dark_only_under_the_hair() -> None:
    """On a ball with hair on its upper half only, skin under hair loses more light than the
    rest."""
    skin = ball(0.08)
    strands = hair_on_ball()
    upper = strands.take(np.flatnonzero(strands.roots[:, 2] > 0.0))
    light = skin_occlusion(upper, skin, AmbientSettings())
    height = skin.positions[:, 2]
    assert light[height > 0.05].mean() < light[height < -0.05].mean() - 0.2
    more = skin_occlusion(upper, skin, AmbientSettings(scalp_extinction=100.0))
    assert more[height > 0.05].mean() < light[height > 0.05].mean()


def test_sums_of_light_are_those_of_each_direction() -> None:
    """Weighted sums against single directions; also if each direction has its own cells."""
    random = np.random.default_rng(6)
    depth = random.random((5, 7, 6)).astype(np.float32)
    steps = [step for step, _ in sky_directions(0.0)][3::2]
    weights = random.normal(size=(3, len(steps)))
    through = np.exp(-depth_towards(depth[None], steps, own_fraction=0.0))
    np.testing.assert_allclose(
        summed_light(depth, steps, weights, own_fraction=0.0),
        np.tensordot(weights, through, 1),
        atol=1e-5,
    )
    factor = 1.0 + np.arange(len(steps), dtype=np.float32)[:, None, None, None]
    np.testing.assert_allclose(
        depth_towards(factor * depth, steps), factor * depth_towards(depth[None], steps), rtol=1e-5
    )
