"""Grooms that interact: against a form without a grid, against one groom, and at rest."""

from dataclasses import replace

import numpy as np
import pytest
from grooms_together import Groom, play_frame
from tails import SOFT_STYLE, cell_count, rotation_matrix, squeezed_tail, tail, two_locks

from hairloom.addon.dynamics import hair_grid
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.hair_grid import (
    HairGrid,
    HairInteraction,
    InteractionStrength,
    NeighbourCvs,
    Neighbours,
)
from hairloom.addon.dynamics.neighbours import (
    KnownNeighbours,
    NeighbourStyle,
    hair_length_of_guides,
    run_alone,
)
from hairloom.addon.dynamics.reference.hair_grid import (
    GroomPoints,
    NeighbourPoints,
    friction_and_push_reference,
)
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance, advance_in_steps

FRAME, DT = 1.0 / 24.0, 1.0 / 180.0
FULL = DynamicsSettings(volume=1.0, **SOFT_STYLE)


def swayed(grooms, frames, near=None, sway=0.05):
    """The CVs of all grooms in each frame while the head sways at 1 Hz."""
    rests, found = [groom.grid for groom in grooms], []
    for number in range(1, frames + 1):
        way = np.float32([sway * np.sin(2.0 * np.pi * number * FRAME), 0.0, 0.0])
        play_frame(grooms, [rest + way for rest in rests], FRAME, near)
        found.append([groom.state.grid for groom in grooms])
    return found


def test_as_without_a_grid():
    """Against the form without a grid, with other hair that moves, of various mass, some far
    away."""
    rest, position, previous, turn, middle = squeezed_tail()
    random, settings = np.random.default_rng(3), DynamicsSettings(volume=1.0)
    at_rest = np.concatenate([tail(12, 8, seed=4).reshape(-1, 3) + [0.01, 0.0, 0.0]] * 2)
    at_rest[96:] += [5.0, 0.0, 0.0]
    mass = random.integers(1, 60, len(at_rest)).astype(np.float32)
    here = (at_rest * [0.6, 0.7, 1.0]) @ turn.T + [0.4, -2.0, 1.5]
    motion = random.normal(0.0, 0.002, here.shape)

    def rows(points):
        return np.ascontiguousarray(points.T, np.float32)

    still = NeighbourCvs(rows(at_rest), np.zeros_like(rows(at_rest)), mass)
    grid = HairGrid.at_rest(rest.position, rest.size, rest.strands, still)
    strength = InteractionStrength.of(settings, DT)
    plain = HairInteraction(
        rest.hair_grid, rest.hair_grid.placement(turn, middle), turn, strength, 0
    )
    ahead = position + (position - previous) * np.float32(strength.look_ahead)
    other = Neighbours(grid, NeighbourCvs(rows(here), rows(motion), mass), ahead.reshape(3, -1))
    found = plain.with_neighbours(other).friction_and_push(position, previous)
    flat = [each.transpose(2, 1, 0).reshape(-1, 3).astype(float) for each in (position, previous)]
    beside = NeighbourPoints(here, motion, mass.astype(float))
    hair = GroomPoints(flat[0], flat[0] - flat[1], turn, middle.astype(float), beside)
    own = rest.position.transpose(2, 1, 0).reshape(-1, 3).astype(float)
    volumes, beside = np.ones(len(own)), NeighbourPoints(at_rest, at_rest * 0.0, mass.astype(float))
    expected = friction_and_push_reference(grid, own, hair, volumes, DT, strength.substeps, beside)
    without = friction_and_push_reference(
        grid, own, replace_others(hair), volumes, DT, strength.substeps
    )
    for one, slow, other in zip(found, expected, without, strict=True):
        one = one.transpose(2, 1, 0).reshape(-1, 3)
        assert (np.abs(slow - other).max(axis=1) > 1e-6).mean() > 0.3  # they act on many
        np.testing.assert_allclose(one, slow, atol=3e-5 * np.abs(slow).max())


def replace_others(hair):
    return GroomPoints(hair.position, hair.motion, hair.rotation, hair.middle)


def test_two_halves_of_a_groom_move_as_it_does():
    """Halves that interact deviate from the whole groom by a tenth of what separate halves do, and
    by a fortieth of what hair without volume does. They deviate at all because their grids have
    other origins."""
    grid = tail(600)
    whole, halves = swayed([Groom(grid, FULL)], 24), [grid[::2], grid[1::2]]
    cases = {
        "together": swayed([Groom(half, FULL) for half in halves], 24),
        "apart": swayed([Groom(half, FULL) for half in halves], 24, near=[frozenset()] * 2),
        "none": swayed([Groom(half, replace(FULL, volume=0.0)) for half in halves], 24),
    }
    away = {}
    for name, frames in cases.items():
        joined = [np.stack(both, axis=1).reshape(grid.shape) for both in frames]
        off = [one - ends[0] for one, ends in zip(joined, whole, strict=True)]
        away[name] = np.linalg.norm(off, axis=-1).mean()
        if name == "together":
            kept = cell_count(joined[-1]) / cell_count(whole[-1][0])
    assert away["together"] < 0.0002
    assert away["together"] < 0.1 * away["apart"]
    assert away["together"] < 0.025 * away["none"]
    assert kept == pytest.approx(1.0, abs=0.02)


def test_locks_of_two_grooms_do_not_swing_through_each_other():
    grid, side = two_locks(100)
    along, wrong = np.linspace(0.0, 1.0, grid.shape[1])[:, None], {}
    for volume in (0.0, 1.0):
        grooms = []
        for sign in (-1.0, 1.0):
            state = start(grid[side == sign])
            previous = state.position.copy()
            previous[0] += along * sign * 0.8 * DT  # 0.8 m/s towards the other, at the tips
            state = replace(state, previous=previous, substep=DT)
            settings = DynamicsSettings(volume=volume)
            grooms.append(Groom(grid[side == sign], settings, state=state))
        worst = 0.0
        for ends in swayed(grooms, 24, sway=0.0):
            x = [end[:, grid.shape[1] // 2 :, 0].mean(axis=1) for end in ends]
            worst = max(worst, float((np.stack([-x[0], x[1]]) < -0.002).mean()))
        wrong[volume] = worst
    assert wrong[0.0] > 0.9
    assert wrong[1.0] <= 0.05


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_at_rest_nothing_acts_wherever_the_head_is(angle):
    """No push between two grooms that are combed into each other."""
    one, other = tail(300), tail(200, seed=2) * np.float32(1.03)
    rest, turn, move = start(one).rest, rotation_matrix(angle), np.array([3.0, -1.0, 0.5])
    style = NeighbourStyle(lambda: other, hair_length_of_guides(other, np.ones(200)), other)
    known = KnownNeighbours().updated(rest, one, {1: style})
    assert known.grid is not rest.hair_grid
    rows = [
        np.ascontiguousarray((grid @ turn.T + move).transpose(2, 1, 0), np.float32)
        for grid in (one, other)
    ]
    points = rows[1].reshape(3, -1)
    mass = np.full(points.shape[1], hair_grid.MEAN_MASS, np.float32)
    others = NeighbourCvs(points, np.zeros_like(points), mass)
    place = rest.hair_grid.placement(turn, one[:, 0].mean(axis=0) @ turn.T + move)
    strength = InteractionStrength.of(FULL, DT)
    felt = Neighbours(known.grid, others, rows[0].reshape(3, -1))
    plain = HairInteraction(rest.hair_grid, place, turn, strength, 0)
    slowed, push = plain.with_neighbours(felt).friction_and_push(rows[0], rows[0])
    assert not slowed.any() and not push.any()
    apart = Neighbours(rest.hair_grid, others, rows[0].reshape(3, -1))
    _, push = plain.with_neighbours(apart).friction_and_push(rows[0], rows[0])
    assert push.any(), "it is what they are at rest that keeps them still"


def test_grooms_in_each_other_stay_at_rest():
    settings, grids = DynamicsSettings(volume=1.0), (tail(200), tail(150, seed=2))
    felt = [Groom(grid, settings) for grid in grids]
    unfelt = [Groom(grid, replace(settings, volume=0.0)) for grid in grids]
    swayed(felt, 24, sway=0.0)
    swayed(unfelt, 24, sway=0.0)
    for one, other in zip(felt, unfelt, strict=True):
        assert not one.state.push.any()
        assert np.abs(one.state.position - other.state.position).max() < 5e-6
        assert np.abs(one.state.position - one.state.previous).max() / DT < 1e-4


def test_the_order_of_grooms_changes_no_bit():
    grids = [tail(80), tail(60, seed=2), tail(40, seed=3)]
    ends = {}
    for order in ((0, 1, 2), (2, 0, 1)):
        grooms = [Groom(grids[number], FULL) for number in order]
        swayed(grooms, 6)
        ends[order] = {number: groom.state for number, groom in zip(order, grooms, strict=True)}
    for number in range(3):
        one, other = (end[number] for end in ends.values())
        assert np.array_equal(one.position, other.position)


def test_neighbours_that_is_far_away_changes_no_bit():
    grid = tail(80)
    by_itself, beside = Groom(grid, FULL), Groom(grid, FULL)
    far = Groom(tail(50) + np.float32([1000.0, 0.0, 0.0]), FULL)
    swayed([by_itself], 6)
    swayed([beside, far], 6)
    assert np.array_equal(by_itself.state.position, beside.state.position)
    assert np.isfinite(far.state.position).all()
    assert max(beside.known.grid.counts) <= hair_grid.MAX_CELLS_PER_AXIS


def test_hair_that_goes_straight_is_felt():
    """A lock without simulation that is moved into a hanging one pushes it."""
    grid, side = two_locks(100)
    still, moved = grid[side > 0.0], grid[side < 0.0]
    for settings in (FULL, replace(FULL, volume=0.0)):
        hanging, brought = Groom(still, settings), Groom(moved, None)
        for number in range(1, 13):
            way = np.float32([0.03 * number / 12.0, 0.0, 0.0])
            play_frame(
                [hanging, brought], [still, moved + way], FRAME, [frozenset([1]), frozenset()]
            )
        pushed = hanging.state.grid[:, 6:, 0].mean() - still[:, 6:, 0].mean()
        assert pushed > 0.005 if settings.volume else abs(pushed) < 0.001


@pytest.mark.parametrize("rate", [100.0, 240.0])
def test_grooms_of_other_substeps(rate):
    """Grooms with different substep rates end within 2 mm of grooms with equal ones."""
    grids = [tail(300)[::2], tail(300)[1::2]]
    even = [Groom(grid, FULL) for grid in grids]
    uneven = [Groom(grids[0], FULL), Groom(grids[1], replace(FULL, substep_rate=rate))]
    for one, other in zip(swayed(even, 12)[-1], swayed(uneven, 12)[-1], strict=True):
        assert np.linalg.norm(one - other, axis=2).mean() < 0.002


@pytest.mark.parametrize("size", [0.001, 1000.0])
def test_grooms_of_any_size(size):
    """With gravity scaled alike, scaled hair makes the scaled motion."""
    ends = []
    for scale in (1.0, size):
        grids = [(tail(120, seed=seed) * scale).astype(np.float32) for seed in (1, 2)]
        grooms = [Groom(grid, FULL, gravity=scale) for grid in grids]
        ends.append(np.stack(swayed(grooms, 6, sway=0.05 * scale)[-1][0]) / scale)
    assert np.linalg.norm(ends[0] - ends[1], axis=2).mean() < 0.0005


def test_neighbours_counts_for_the_strands_it_stands_for():
    """Half as many guides that each represent twice as many strands give the same density, also
    where hair has so many guides that only some are used."""
    one, other = tail(200), tail(400, seed=2)
    rest = start(one, strands=np.full(200, 10.0)).rest
    found = []
    nine = np.repeat(other, 9, axis=0)
    for guides, strands in ((other, 10.0), (other[::2], 20.0), (nine, 10.0 / 9.0)):
        hair = hair_length_of_guides(guides, np.full(len(guides), strands))
        style = NeighbourStyle(lambda guides=guides: guides, hair, guides)
        grid = KnownNeighbours().updated(rest, one, {1: style}).grid
        found.append((grid.rest_density * grid.cell**-3).mean())
    np.testing.assert_allclose(found, found[0], rtol=0.1)


def test_an_animated_style_does_not_forget_how_others_were_combed():
    """The grid has the new style, and other hair as it was when they first met."""
    one, other = tail(200), tail(200, seed=2)
    places = iter([other, other + np.float32([0.01, 0.0, 0.0])])
    style = NeighbourStyle(lambda: next(places), hair_length_of_guides(other, np.ones(200)), other)
    first = KnownNeighbours().updated(start(one).rest, one, {1: style})
    bent = one * np.float32([1.1, 1.0, 1.0])
    second = first.updated(start(bent).rest, bent, {1: style})
    assert second.rest_cvs[1][1] is first.rest_cvs[1][1]
    expected = KnownNeighbours().updated(
        start(bent).rest, one, {1: replace(style, read_guides=lambda: other)}
    )
    np.testing.assert_allclose(second.grid.rest_density, expected.grid.rest_density, rtol=0.02)
    assert np.abs(second.grid.rest_density - first.grid.rest_density).max() > 0.1


def test_what_is_known_of_others_is_kept():
    """The grid is kept as long as no groom is edited."""
    grooms = [Groom(tail(60), FULL), Groom(tail(60, seed=2), FULL)]
    swayed(grooms, 2)
    grid = grooms[0].known.grid
    swayed(grooms, 2)
    assert grooms[0].known.grid is grid
    swayed(grooms, 2, near=[frozenset(), frozenset()])
    swayed(grooms, 2)
    assert grooms[0].known.grid is grid
    grooms[1].grid = grooms[1].grid.copy()  # another style
    swayed(grooms, 1)
    assert grooms[0].known.grid is not grid


def test_alone_is_without_others():
    state = start(tail(60))
    drive = Drive(tail(60), tail(60), (), np.array([0.0, 0.0, -9.81]))
    one, other = (
        advance(state, drive, FULL, FRAME),
        run_alone(advance_in_steps(state, drive, FULL, FRAME)),
    )
    assert np.array_equal(one.position, other.position)
