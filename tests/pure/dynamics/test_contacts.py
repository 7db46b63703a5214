"""Hair and colliders: outside stays outside, inside is led out, friction drags hair along."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from hairloom.addon.dynamics.contacts import Contacts, cv_radius, touching_cvs
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.measure import deepest_penetration, max_stretch
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance
from hairloom.addon.errors import HairloomError

BARE = {"radius_root": 0.0, "radius_tip": 0.0}


def depths(scene, states, fps=60.0):
    return [
        deepest_penetration(state, scene.colliders(k / fps, (k + 1) / fps))
        for k, state in enumerate(states[1:])
    ]


def lying(kit, guide_count=40, cv_count=16, length=0.25):
    """Guides that stand up from the top of a ball of 0.1 m and fall over to all sides."""
    angle = np.linspace(0.0, 2.0 * np.pi, guide_count, endpoint=False)
    tilt = np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.ones(guide_count)], axis=1)
    tilt /= np.linalg.norm(tilt, axis=1, keepdims=True)
    along = np.linspace(0.0, length, cv_count)
    return (tilt[:, None] * (0.1 + along[:, None])).astype(np.float32)


def test_limp_hair_lies_on_a_ball(kit):
    """CV centers stay within 0.2 mm of the surface, without any collision radius to help."""
    settings = DynamicsSettings(**kit.LIMP | BARE | {"damping": 2.0})
    scene = kit.Scene(lying(kit), settings, on_head=(SphereCollider((0, 0, 0), 0.1),))
    states = scene.play(2.0)
    assert np.linalg.norm(states[-1].grid[:, 6], axis=1).max() < 0.13  # it did fall down
    assert max(depths(scene, states)) < 2e-4
    assert max(max_stretch(state) for state in states) < 0.01


def test_pearls_grow_towards_the_tip(kit):
    settings = DynamicsSettings(
        **kit.LIMP | {"damping": 2.0, "radius_root": 0.005, "radius_tip": 0.1}
    )
    scene = kit.Scene(lying(kit), settings, on_head=(SphereCollider((0, 0, 0), 0.1),))
    away = np.linalg.norm(scene.play(2.0)[-1].grid, axis=2) - 0.1
    radius = cv_radius(settings, 16, 0.2)
    assert radius[-1] == pytest.approx(0.02)
    assert (np.diff(radius) > 0.0).all()
    assert (away[:, 2:] > radius - 1e-3).all()


@pytest.mark.parametrize("thin", [False, True])
def test_hair_at_rest_stays_where_it_was_combed(kit, thin):
    """Short hair that lies nearer to a ball, and to a box's edge, than the collision radius."""
    settings = DynamicsSettings(radius_root=0.05, radius_tip=0.2, collider_resolution=24)
    if thin:  # segments pass near the edge, while their CVs are farther away
        edge = DistanceField.from_surface(kit.box((0.4, 0.03, 0.03)), settings)
        grid = kit.straight(12, 6, 0.05, (0.0, 0.7, -0.7)) + np.float32([-0.05, 0.003, 0.035])
        near = edge
    else:
        angle = np.linspace(-0.2, 0.4, 6)
        out = np.stack([np.zeros(6), np.sin(angle), np.cos(angle)], axis=1)
        grid = np.tile(out * np.linspace(0.1005, 0.103, 6)[:, None], (12, 1, 1)).astype(np.float32)
        near = SphereCollider((0.0, 0.0, 0.0), 0.1)
    scene = kit.Scene(grid, settings, on_head=(near,), is_combed=True)
    assert (scene.clearance.distances[:, 2:] < 0.006).any()
    off = [
        np.abs(kit.Scene(**scene.__dict__ | values).play(0.5)[-1].grid - grid).max()
        for values in ({}, {"is_combed": False}, {"on_head": ()})
    ]
    assert off[0] < off[2] + 1e-5
    assert off[1] > 1e-3


@pytest.mark.slow
def test_a_mesh_holds_hair_out(kit):
    """The same through a distance field of a ball mesh, to 1 mm, with the default radius."""
    field = DistanceField.from_surface(kit.icosphere(0.1, 3), DynamicsSettings())
    settings = DynamicsSettings(**kit.LIMP | {"damping": 2.0})
    scene = kit.Scene(lying(kit), settings, on_head=(field,))
    states = scene.play(1.5)
    closest = min(np.linalg.norm(state.grid[:, 2:], axis=2).min() for state in states)
    assert closest > 0.1 - 1e-3
    assert max(depths(scene, states)) < 1e-3


def test_a_moving_ball_sweeps_hair_along(kit):
    """A ball that moves into hanging hair at 1 m/s sweeps it along."""
    settings = DynamicsSettings(**kit.LIMP | {"damping": 1.0})
    ball = SphereCollider((0, 0, 0), 0.06)
    grid = kit.straight(12, 16, 0.25)
    state, farthest = start(grid), 0.0
    for frame in range(30):
        before, now = (kit.translation(0.05, -0.15 + k / 60.0, -0.15) for k in (frame, frame + 1))
        posed = (PosedCollider(ball, before, now),)
        state = advance(state, Drive(grid, grid, posed, kit.EARTH), settings, 1 / 60)
        assert deepest_penetration(state, posed) < 1e-4
        assert max_stretch(state) < 0.01
        farthest = max(farthest, float(state.grid[:, :, 1].max()))
    assert farthest > 0.1


@pytest.mark.parametrize("kind", ["finger", "plate"])
def test_nothing_thin_passes_between_two_points(kit, kind):
    """A thin collider at 2 m/s, which moves by about its thickness in each substep.

    A sharp edge over which hair is drawn enters a segment by up to 2 mm.
    """
    settings = DynamicsSettings()
    finger = CapsuleCollider((-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), 0.008)
    box = kit.box((0.2, 0.01, 0.12))
    thin = finger if kind == "finger" else DistanceField.from_surface(box, settings)
    height = 0.0 if kind == "finger" else 0.05
    grid = kit.straight(5, 16, 0.25) - np.float32([0.02, 0.0, 0.0])
    state, behind = start(grid), 0
    for step in range(22):
        ways = [kit.translation(0.0, -0.1 + k * 2.0 / 180.0, -0.13) for k in (step, step + 1)]
        posed = (PosedCollider(thin, *ways),)
        state = advance(state, Drive(grid, grid, posed, kit.EARTH), settings, 1.0 / 180.0)
        points = kit.moved(np.linalg.inv(ways[1]), between(state.grid))
        if kind == "finger":
            depth = 0.008 - np.linalg.norm(points[..., 1:], axis=-1)
        else:
            depth = (np.array([0.1, 0.005, 0.06]) - np.abs(points)).min(axis=-1)
        assert depth.max() < (5e-4 if kind == "finger" else 2.5e-3)
        level = np.abs(points[..., 2]) <= height + 0.004
        behind = max(behind, int((level & (points[..., 1] < -0.004)).sum()))
    assert state.grid[:, 8, 1].min() > 0.05, "it was swept along"
    assert not behind


def swept(kit, kind, speed, grid):
    """A plate of 1 cm or a finger of 16 mm moves 0.28 m into hanging hair: its matrix and the state
    at the beginning and after each substep."""
    settings = DynamicsSettings()
    thin = CapsuleCollider((-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), 0.008)
    if kind == "plate":
        thin = DistanceField.from_surface(kit.box((0.2, 0.01, 0.12)), settings)
    states, places = [start(grid)], [kit.translation(0.0, -0.14, -0.13)]
    for step in range(1, int(0.28 / speed * 180.0) + 1):
        places.append(kit.translation(0.0, -0.14 + step * speed / 180.0, -0.13))
        drive = Drive(grid, grid, (PosedCollider(thin, *places[-2:]),), kit.EARTH)
        states.append(advance(states[-1], drive, settings, 1.0 / 180.0))
    return list(zip(places, states, strict=True))


@pytest.mark.parametrize("speed", [4.0, 5.6])
@pytest.mark.parametrize("kind", ["finger", "plate"])
def test_nothing_thin_passes_however_fast(kit, kind, speed):
    """The collider moves farther than its thickness in a substep.

    The angle of each point about the collider's axis is unwrapped along its guide; a point that
    passed through would make it jump by a full turn from one substep to the next.
    """
    grid = kit.straight(5, 16, 0.25) - np.float32([0.02, 0.0, 0.0])
    seen = []
    for place, state in swept(kit, kind, speed, grid):
        points = kit.moved(np.linalg.inv(place), between(state.grid))[:, : -2 * 6]
        seen.append(np.unwrap(np.arctan2(points[..., 2], points[..., 1])))
        assert max_stretch(state) < 0.01
    turned = np.diff(seen, axis=0)
    turns = np.round(turned / (2.0 * np.pi))
    assert not turns.any()
    assert state.grid[:, 8, 1].min() > 0.08, "it was swept along"


def test_what_meets_something_fast_goes_as_if_it_was_alone(kit):
    grid = kit.straight(5, 16, 0.25) - np.float32([0.02, 0.0, 0.0])
    grid[3] += np.float32([0.0, 0.4, 0.0])  # that one does not meet it
    together = swept(kit, "finger", 5.6, grid)[-1][1]
    alone = swept(kit, "finger", 5.6, grid[[1, 3]])[-1][1]
    np.testing.assert_array_equal(together.position[..., [1, 3]], alone.position)


@pytest.mark.parametrize("turn", [(-1.0, -1.0, 1.0), (-1.0, 1.0, 1.0)])
def test_what_turns_round_in_one_substep_is_nowhere_flat(turn):
    """By 180 degrees, or into its mirror image: a linear blend would be singular halfway."""
    after = np.diag([*turn, 1.0])
    collider = CapsuleCollider((-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), 0.008)
    (pose,) = PosedCollider(collider, np.eye(4), after).poses([(0.0, 1.0)])
    for number in range(10):
        part = pose.part(number, 10)
        np.testing.assert_allclose(part.matrix, after, atol=1e-6)
        np.testing.assert_allclose(part.inverse_before, np.linalg.inv(after), atol=1e-6)


def between(grid):
    """Points of all free segments, (guides, n, 3)."""
    share = np.linspace(0.0, 1.0, 6)[:, None]
    points = grid[:, 1:-1, None] * (1.0 - share) + grid[:, 2:, None] * share
    return points.reshape(len(grid), -1, 3)


def test_hair_that_starts_inside_is_led_out(kit):
    """It comes out within a second, no faster than it would fall."""
    settings = DynamicsSettings()
    grid = lying(kit, length=0.2)
    scene = kit.Scene(grid, settings, standing=(SphereCollider((0.0, 0.08, 0.2), 0.05),))
    states = scene.play(2.0)
    depth = depths(scene, states)
    assert depth[0] > 0.02
    assert depth[-1] < 1e-4
    fastest = max(np.abs(s.position - s.previous).max() * settings.substep_rate for s in states[1:])
    assert fastest < 3.0
    calm = np.abs(states[-1].position - states[-1].previous).max() * settings.substep_rate
    assert calm < 0.05


def test_push_speed_is_the_limit(kit):
    """A single free CV deep inside moves out along the normal at this speed, without jitter."""
    settings = DynamicsSettings(
        **kit.LIMP | BARE | {"depenetration_speed": 0.01, "friction": 0.0, "length_tolerance": 0.02}
    )
    grid = kit.straight(1, 3, 20.0, (0.0, 1.0, 0.0))  # a long arm: nearly free to rise
    scene = kit.Scene(
        grid, settings, standing=(SphereCollider((0, 20.0, -0.05), 0.1),), gravity=np.zeros(3)
    )
    height = [state.position[2, 2, 0] for state in scene.play(0.5)]
    assert height[6] == pytest.approx(0.02, rel=0.05)  # 0.2 m/s for 0.1 s
    assert height[-1] == pytest.approx(0.05, abs=1e-3)


def test_friction_drags_hair_along(kit):
    """On a turning ball, rough hair goes with it and smooth hair does not."""
    ball = SphereCollider((0, 0, 0), 0.1)
    way = {}
    for friction in (0.0, 1.0):
        settings = DynamicsSettings(
            **kit.LIMP | BARE | {"damping": 1.0, "friction": friction, "style_tip": 0.0}
        )
        grid = lying(kit)
        state = start(grid)
        still = np.eye(4)
        for _ in range(60):  # settle
            posed = (PosedCollider(ball, still, still),)
            state = advance(state, Drive(grid, grid, posed, kit.EARTH), settings, 1 / 60)
        settled = state.grid
        for frame in range(12):
            turns = (kit.rotation(2, k * 0.02) for k in (frame, frame + 1))
            posed = (PosedCollider(ball, *turns),)
            state = advance(state, Drive(grid, grid, posed, kit.EARTH), settings, 1 / 60)
        middle = state.grid[:, 5], settled[:, 5]
        angle = [np.arctan2(points[:, 1], points[:, 0]) for points in middle]
        turned = (angle[0] - angle[1] + np.pi) % (2.0 * np.pi) - np.pi
        way[friction] = np.median(turned)
    assert way[1.0] > 0.05
    assert abs(way[0.0]) < 0.3 * way[1.0]


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_a_scaled_ball_is_an_ellipsoid(kit, mirror):
    """With uneven scale and mirroring, distances are those of the world, and hair stays outside."""
    matrix = np.diag([0.6 * mirror, 1.4, 1.0, 1.0])
    settings = DynamicsSettings(**kit.LIMP | BARE | {"damping": 2.0})
    grid = lying(kit)
    state = start(grid)
    posed = (PosedCollider(SphereCollider((0, 0, 0), 0.1), matrix, matrix),)
    for _ in range(90):
        state = advance(state, Drive(grid, grid, posed, kit.EARTH), settings, 1 / 60)
    level = np.linalg.norm(state.grid[:, 2:] / np.diag(matrix)[:3], axis=2) / 0.1
    assert level.min() > 0.99
    assert deepest_penetration(state, posed) < 2e-4


@pytest.mark.parametrize("bowed", [False, True])
def test_a_scaled_collider_that_moves_keeps_hair_out(kit, bowed):
    """An ellipsoid that tumbles through hanging hair, on straight and on smooth trajectories."""
    scale = np.diag([0.5, 1.5, -1.0, 1.0])

    def matrix(time):
        place = kit.translation(0.05, -0.25 + 0.8 * time, -0.15)
        return place @ kit.rotation(2, 3.0 * time) @ kit.rotation(0, 2.0 * time) @ scale

    grid = kit.straight(12, 16, 0.25)
    state, settings, swept = start(grid), DynamicsSettings(**kit.LIMP | {"damping": 1.0}), 0.0
    for frame in range(36):
        ways = [matrix(k / 60) for k in (frame - 1, frame, frame + 1)]
        earlier = ways[0] if bowed else None
        posed = PosedCollider(SphereCollider((0, 0, 0), 0.07), *ways[1:], earlier)
        state = advance(state, Drive(grid, grid, (posed,), kit.EARTH), settings, 1 / 60)
        assert deepest_penetration(state, (posed,)) < 1e-4
        assert max_stretch(state) < 0.01
        swept = max(swept, float(np.abs(state.grid[:, :, 1]).max()))
    assert swept > 0.05


def test_two_balls_that_touch_each_other(kit):
    """Limp hair that falls into the groove between them stays out of both, within a millimetre."""
    balls = tuple(SphereCollider((0.0, y, 0.0), 0.06) for y in (-0.058, 0.058))
    radii = {"radius_root": 0.005, "radius_tip": 0.02}
    settings = DynamicsSettings(**kit.LIMP | radii | {"damping": 2.0})
    grid = kit.straight(9, 16, 0.2, (0.0, 0.1, 1.0)) + np.float32([-0.04, 0.0, 0.05])
    scene = kit.Scene(grid, settings, standing=balls)
    states = scene.play(2.0)
    assert (states[-1].grid[:, -1, 2] < 0.12).all()  # it did fall
    assert max(depths(scene, states)) < 1e-3
    calm = np.abs(states[-1].position - states[-1].previous).max() * settings.substep_rate
    assert calm < 0.2


@pytest.mark.parametrize(
    "collider",
    [
        CapsuleCollider((-0.05, 0.08, 0.2), (0.05, 0.08, 0.2), 0.05),
        SphereSetCollider(((-0.03, 0.08, 0.2), (0.03, 0.08, 0.2)), (0.05, 0.05)),
    ],
    ids=["capsule", "sphere set"],
)
def test_any_solid_leads_out_what_starts_inside(kit, collider):
    """Over several frames, no faster than it would fall; hair that is out stays out."""
    settings = DynamicsSettings()
    scene = kit.Scene(lying(kit, length=0.2), settings, standing=(collider,))
    states = scene.play(2.0)
    depth = depths(scene, states)
    assert depth[0] > 0.015
    assert depth[-1] < 1e-4
    assert max(np.diff(depth)) < 1e-3
    fastest = max(np.abs(s.position - s.previous).max() * settings.substep_rate for s in states[1:])
    assert fastest < 3.0


def test_penetration_is_measured_in_the_world(kit):
    """A CV 1 cm under the surface of a ball scaled by 2 is 1 cm deep."""
    grid = kit.straight(1, 3, 0.2, (1.0, 0.0, 0.0))
    grid[0, 2] = [0.19, 0.0, 0.0]
    ball = SphereCollider((0, 0, 0), 0.1)
    twice = np.diag([2.0, 2.0, 2.0, 1.0])
    assert deepest_penetration(start(grid), (PosedCollider(ball, twice, twice),)) == pytest.approx(
        0.01, rel=1e-4
    )
    assert deepest_penetration(start(grid), ()) == 0.0


@pytest.mark.parametrize(
    "matrix",
    [np.diag([1.0, 0.0, 1.0, 1.0]), np.full((4, 4), np.nan), np.eye(3)],
)
def test_a_flat_or_broken_collider_is_named(matrix):
    with pytest.raises(HairloomError, match="transform"):
        PosedCollider(SphereCollider((0, 0, 0), 0.1), np.eye(4), matrix)


@pytest.mark.parametrize(("center", "radius"), [((0, 0, 0), 0.0), ((0, np.nan, 0), 1.0)])
def test_a_ball_without_volume_is_named(center, radius):
    with pytest.raises(HairloomError, match="no volume"):
        SphereCollider(center, radius)


def test_of_two_colliders_that_touch_a_cv_the_last_one_counts():
    pose = PosedCollider(SphereCollider(np.zeros(3), 1.0), np.eye(4), np.eye(4)).poses(
        [(0.0, 1.0)]
    )[0]

    def contacts(index, way):
        count = len(index)
        normal = np.repeat(np.float32(way)[:, None], count, axis=1)
        rows, zero = np.zeros((3, count), np.float32), np.zeros(count, np.float32)
        return Contacts(
            pose, np.array(index), normal, zero, rows, zero == 0.0, np.float32(0.0), zero, zero
        )

    both = [contacts([2, 5, 7], (1, 0, 0)), contacts([1, 5, 7, 9], (0, 1, 0))]
    found = touching_cvs(both, [np.array([1, 1, 0], bool), np.array([0, 1, 1, 1], bool)])
    np.testing.assert_array_equal(found.index, [2, 5, 7, 9])
    np.testing.assert_array_equal(found.normal.T[:, :2], [[1, 0], [0, 1], [0, 1], [0, 1]])
    assert touching_cvs(both, [np.zeros(3, bool), np.zeros(4, bool)]) is None
