"""Figures of a motion against known values: strands that are stretched by hand."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import DistanceField, PosedCollider, SphereCollider
from hairloom.addon.dynamics.figures import CardFigures, Figures, FiguresCollector, blank_table
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.strands import Surface

COUNT, POINTS = 200, 8
LENGTHS = np.full(COUNT, 0.2)


def upright():
    """Strands 20 cm long, in a row along x, 1 mm apart."""
    grid = np.zeros((COUNT, POINTS, 3), np.float32)
    grid[..., 0] = np.arange(COUNT)[:, None] * 0.001
    grid[..., 2] = np.linspace(0.0, 0.2, POINTS)
    return grid


def ball(z):
    """A ball of 5 cm radius over the row's middle."""
    matrix = np.eye(4)
    matrix[:3, 3] = 0.1, 0.0, z
    return (PosedCollider(SphereCollider((0, 0, 0), 0.05), matrix, matrix),)


def measure_of(grid, colliders=()):
    return FiguresCollector(
        start(grid[:4]), grid.reshape(-1, 3), np.arange(COUNT + 1) * POINTS, colliders
    )


def add(measure, grid, colliders=()):
    measure.add_frame(grid.reshape(-1, 3), LENGTHS, grid[:4], colliders)


def test_each_strand_counts_by_its_worst_frame():
    grid = upright()
    measure = measure_of(grid)
    for factors in ({10: 1.5, 11: 0.8}, {10: 1.1, 12: 1.02, 13: 1.02, 14: 1.005}):
        now = grid.copy()
        for strand, factor in factors.items():
            now[strand, :, 2] *= factor
        add(measure, now)
    found = measure.figures
    assert found.strands_stretch_max_percent == pytest.approx(50.0, abs=1e-3)
    assert found.strands_stretched_percent == pytest.approx(100.0 * 4 / COUNT)
    # of 200 strands, the 99th percentile lies between the second and third worst: 20 and 2 %
    assert found.strands_stretch_p99_percent == pytest.approx(2.0 + 0.01 * 18.0, abs=1e-3)
    assert found.stretch_max_percent == 0.0, "none of them is a guide"
    now[2, -1, 2] += 0.1 * 0.2 / (POINTS - 1)
    add(measure, now)
    assert measure.figures.stretch_max_percent == pytest.approx(10.0, abs=1e-3)


def test_what_is_too_short_to_be_measured_does_not_decide():
    """A strand, also a guide, of 2 micrometres, where float32 has steps of 0.1 micrometres: 6
    micrometres more are 300 % of it, but 0.3 % of the length that counts."""
    grid = upright() + np.float32(1.0)
    grid[0] = 1.0
    grid[0, :, 2] += np.linspace(0.0, 2.0e-6, POINTS)
    points, offsets = grid.reshape(-1, 3), np.arange(COUNT + 1) * POINTS
    measure = FiguresCollector(start(grid[:4]), points, offsets, ())
    now = grid.copy()
    now[0, -1, 2] += 6.0e-6
    lengths = np.where(np.arange(COUNT) == 0, 2.0e-6, LENGTHS)
    measure.add_frame(now.reshape(-1, 3), lengths, now[:4], ())
    assert 0.2 < measure.figures.strands_stretch_max_percent < 0.5
    assert 1.0 < measure.figures.stretch_max_percent < 3.0  # of a hundredth of 29 mm
    now = grid.copy()
    now[3, -1, 2] += 0.1 * 0.2 / (POINTS - 1)
    measure.add_frame(now.reshape(-1, 3), lengths, now[:4], ())
    assert measure.figures.stretch_max_percent == pytest.approx(10.0, abs=0.1)


def test_only_what_was_outside_at_rest_counts_as_inside():
    grid = upright()
    measure = measure_of(grid, ball(0.0))
    add(measure, grid, ball(0.0))
    assert measure.figures == Figures(), "roots under the skin"
    add(measure, grid, ball(0.2))
    found = measure.figures
    assert found.strands_penetration_max_mm == pytest.approx(50.0, abs=1e-3), "a tip in its middle"
    reached = np.abs(grid[:, 0, 0] - 0.1) < 0.049
    assert found.strands_inside_percent == pytest.approx(100.0 * reached.mean())
    assert found.strands_penetration_p99_mm == pytest.approx(49.0, abs=0.02)


def test_figures_survive_a_file_and_garbage_does_not():
    found = Figures(strands_stretch_max_percent=0.25, penetration_max_mm=3.0)
    assert Figures.of(found.as_dict()) == found
    assert Figures.of(None) is None
    whole = found.as_dict()
    for bad in (
        [],
        {},
        whole | {"more": 1.0},
        whole | {"penetration_max_mm": "3"},
        whole | {"penetration_max_mm": float("nan")},
    ):
        with pytest.raises(ValueError, match="figures"):
            Figures.of(bad)


def test_the_table_says_nothing_is_nothing_and_little_is_not():
    found = Figures(strands_stretch_max_percent=0.0004, strands_penetration_max_mm=12.34)
    table = found.table
    assert table[1] == ("Stretch", "0.01 %", "0 %", "0 %")
    assert table[2] == ("Penetration", "12.3 mm", "0.0 mm", "0 %")


def test_nothing_is_deeper_in_a_thin_mesh_than_that_is_thick(kit):
    """In its middle, at the same distance from both sides, sampled distances are constant."""
    ball = kit.icosphere(0.1, 4)
    disc = Surface(ball.positions * [0.05, 1.0, 1.0], ball.triangles)
    field = DistanceField.from_surface(disc, DynamicsSettings())
    grid = upright()
    measure = measure_of(grid, ())
    matrix = np.eye(4)
    matrix[:3, 3] = 0.1, 0.0, 0.1
    add(measure, grid, (PosedCollider(field, matrix, matrix),))
    found = measure.figures.strands_penetration_max_mm
    assert 3.0 < found < 5.5, "half of its thickness is 5 mm"


@pytest.mark.parametrize("kind", [Figures, CardFigures])
def test_what_was_not_measured_takes_as_much_room(kind: type[Figures] | type[CardFigures]) -> None:
    """A panel keeps its height when a measurement begins."""
    blank, table = blank_table(kind), kind().table
    assert [len(row) for row in blank] == [len(row) for row in table]
    assert [row[0] for row in blank] == [row[0] for row in table]
    assert not any(any(letter.isdigit() for letter in text) for row in blank[1:3] for text in row)
