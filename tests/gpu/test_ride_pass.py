"""Strands that ride on guides: the GPU against numpy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.groom.roots import root_frames
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.groom.weights import GuideWeights
from hairloom.addon.refine.lead_out import NO_DEFLECTIONS, Clearance, clearance_at
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet, Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

#: [m], for a head of 0.2 m at a height of 1.6 m: float32 has steps of 1.2e-7 there, and directions
#: of segments of 3 cm have errors of a few times 1e-6
TOLERANCE = 4.0e-6
ABOVE_GROUND = np.array([0.1, -0.2, 1.6])


def ball(rings: int = 12, segments: int = 24) -> Surface:
    """A ball of radius 0.1 m above the ground, without its poles."""
    polar = np.linspace(0.3, np.pi - 0.3, rings)[:, None]
    around = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)[None]
    outward = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar + 0 * around)]
    )
    ring, segment = np.meshgrid(np.arange(rings - 1), np.arange(segments), indexing="ij")
    a, b = (ring * segments + np.array([segment, (segment + 1) % segments])).reshape(2, -1)
    triangles = np.concatenate(
        [np.column_stack([a, a + segments, b]), np.column_stack([b, a + segments, b + segments])]
    )
    return Surface(outward.reshape(3, -1).T * 0.1 + ABOVE_GROUND, triangles)


def rig_on(
    head: Surface | None,
    count: int,
    cv_count: int = 6,
    guide_count: int = 9,
    above: tuple[float, float, float] = (0.001, 0.001, 0.001),
) -> Rig:
    """Bent strands of 0.2 m, with roots a little above successive triangles.

    Guides and weights are random.
    """
    random = np.random.default_rng(1)
    triangle = barycentric = None
    root = random.normal(size=(count, 3)) * 0.1 + ABOVE_GROUND
    if head is not None:
        triangle = np.arange(count) % len(head.triangles)
        barycentric = random.dirichlet((1.0, 1.0, 1.0), count).astype(np.float32)
        root = np.einsum("sk,skj->sj", barycentric, head.corners[triangle])
    direction = random.normal(size=(count, cv_count, 3)) * 0.2 / cv_count
    direction[:, 0] = above
    strands = StrandSet(
        points=(root[:, None] + direction.cumsum(axis=1)).reshape(-1, 3),
        offsets=np.arange(count + 1) * cv_count,
        radius=random.random(count * cv_count) * 1.0e-4,
        group=np.zeros(count, np.int32),
        root_triangle=triangle,
        root_barycentric=barycentric,
    )
    frames = None
    if head is not None:
        frames = root_frames(head.positions, head.triangles, triangle, barycentric)
    guides = random.permutation(count)[:guide_count].astype(np.int32)
    weights = GuideWeights(
        random.integers(0, len(guides), (count, 3)).astype(np.int32),
        random.dirichlet((1.0, 1.0, 1.0), count).astype(np.float32),
    )
    return Rig(strands, head, guides, strands.grid[guides], weights, frames)


def turned(angle: float, shift: tuple[float, float, float]) -> np.ndarray:
    """A turn about a slanting axis through the head, and a shift, (4, 4)."""
    axis = np.array([0.6, 0.0, 0.8])
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, ABOVE_GROUND - turn @ ABOVE_GROUND + shift
    return matrix


def deformed(head: Surface) -> Pose:
    """The head turned, moved and dented."""
    matrix = turned(1.1, (0.3, 0.1, -0.2))
    dent = 0.01 * np.sin(40.0 * head.positions[:, [1, 2, 0]])
    moved = (head.positions + dent) @ matrix[:3, :3].T + matrix[:3, 3]
    return Pose(moved.astype(np.float32), matrix)


def simulated(rig: Rig, pose: Pose, seed: int = 2) -> np.ndarray:
    """Guides that have swung by up to some centimetres from where their roots carry them."""
    guides = motion_flow.carried_guides(rig, pose)
    swing = np.random.default_rng(seed).normal(scale=0.02, size=guides.shape)
    swing[:, 0] *= np.arange(len(guides))[:, None] % 2  # every other one also leaves its root
    return (guides + swing).astype(np.float32)


def pass_of(rig: Rig) -> Any:
    from hairloom.addon.render.ride_pass import RidePass

    return RidePass(rig.strands, rig.root_holds, rig.guides, rig.guide_grid, rig.riders)


def shown(ride: Any, pose: Pose, guides: Any) -> np.ndarray:
    ride.ride(pose.head_positions, pose.matrix, guides)
    return np.asarray(ride.read())


def test_strands_ride_as_in_numpy_on_a_deformed_head() -> None:
    rig = rig_on(ball(), 700)
    ride, pose = pass_of(rig), deformed(rig.head)
    for seed in (2, 3):
        guides = simulated(rig, pose, seed)
        expected = motion_flow.strands_at(rig, pose, guides)
        found = shown(ride, pose, guides)
        assert np.abs(found - expected).max() < TOLERANCE
    assert np.abs(found - rig.strands.points).max() > 0.1, "it has gone a long way"
    ride.carry(pose.head_positions, pose.matrix)
    assert np.abs(ride.read() - motion_flow.carried_strands(rig, pose)).max() < TOLERANCE


def test_texels_made_in_a_thread_give_the_same_strands() -> None:
    from hairloom.addon.render.ride_pass import RidePass, RideTexels

    rig, taller = rig_on(ball(), 300), rig_on(ball(), 300, above=(0.002, 0.001, 0.003))
    pose = deformed(rig.head)

    def laid_out() -> Any:
        texels = RideTexels.of(rig.strands, rig.root_holds, rig.riders)
        own = rig.strands, rig.root_holds, rig.guides, rig.guide_grid, rig.riders
        return RidePass(*own, texels=texels)

    guides, ride = simulated(rig, pose), laid_out()
    expected = shown(pass_of(rig), pose, guides)
    assert np.array_equal(shown(ride, pose, guides), expected)
    ride.release()
    assert np.array_equal(shown(ride, pose, guides), expected), "after the GPU has lost it"
    ride = laid_out()
    ride.take_style(taller.strands, taller.guide_grid, taller.riders)
    guides = simulated(taller, pose)
    expected = shown(pass_of(taller), pose, guides)
    assert np.array_equal(shown(ride, pose, guides), expected), "before it was uploaded"


def test_more_strands_than_a_texture_has_rows() -> None:
    rig = rig_on(ball(), 16384 + 700, cv_count=3, guide_count=40)
    rig.guides[:2] = 16384, 16384 + 699
    rig.guide_grid[:] = rig.strands.grid[rig.guides]
    pose = deformed(rig.head)
    guides = simulated(rig, pose)
    expected = motion_flow.strands_at(rig, pose, guides)
    assert np.abs(shown(pass_of(rig), pose, guides) - expected).max() < TOLERANCE


def test_hair_without_a_head_goes_with_a_matrix() -> None:
    rig = rig_on(None, 300)
    matrix = turned(2.5, (0.5, 0.0, 0.0))
    matrix[:3, :3] *= 1.5
    pose = Pose(None, matrix)
    guides = simulated(rig, pose)
    ride = pass_of(rig)
    expected = motion_flow.strands_at(rig, pose, guides)
    # the matrix is rounded to float32, and strands are three metres from the origin
    assert np.abs(shown(ride, pose, guides) - expected).max() < 4.0 * TOLERANCE
    carried = motion_flow.carried_strands(rig, pose)[rig.strands.offsets[:-1]].mean(axis=0)
    assert ride.points.center == pytest.approx(carried, abs=2.0e-6)


def test_hair_on_triangles_without_area() -> None:
    """Against numpy for triangles that are a point, have no area, or are fine: both use the same
    fallback axes."""
    corner = np.array([0.1, 0.2, 1.5])
    edge = np.array([0.25, 0.0, 0.0])
    ends = [
        (corner, corner, corner),
        (corner, corner, corner + (0.0, 0.25, 0.125)),
        (corner, corner + edge, corner + 2.0 * edge),
        (corner, corner + edge, corner),
        (corner, corner + (0.0, 0.0, -0.25), corner + (0.0, 0.0, 0.5)),
        (corner, corner + edge, corner + (0.0, 0.25, 0.0)),
    ]
    head = Surface(np.reshape(ends, (-1, 3)), np.arange(18).reshape(6, 3))
    rig = rig_on(head, 24)
    good = head.positions.reshape(6, 3, 3)[np.array([5, 0, 1, 2, 3, 4])].reshape(-1, 3)
    for positions in (head.positions, good):  # flat triangles change places
        pose = Pose(positions, np.eye(4))
        guides = simulated(rig, pose)
        expected = motion_flow.strands_at(rig, pose, guides)
        assert np.isfinite(expected).all()
        assert np.abs(shown(pass_of(rig), pose, guides) - expected).max() < TOLERANCE


def test_strands_at_rest_stay_bit_for_bit() -> None:
    for rig in (rig_on(ball(), 400), rig_on(None, 400)):
        ride, pose = pass_of(rig), rig.rest_pose
        ride.carry(pose.head_positions, pose.matrix)
        assert np.array_equal(ride.read(), rig.strands.points)
        radius = rig.strands.radius.reshape(400, -1)
        pixels = np.array(ride.points.texture.read()).reshape(400, -1, 4)
        assert np.array_equal(pixels[..., 3], radius), "the fourth channel is the radius"
        assert np.array_equal(shown(ride, pose, rig.guide_grid), rig.strands.points)
        assert ride.points.center == pytest.approx(rig.strands.roots.mean(axis=0), abs=5.0e-7)


def test_guides_may_lie_on_the_gpu_already() -> None:
    from hairloom.addon.render.strand_layout import strand_rows
    from hairloom.addon.render.textures import texture_from

    rig = rig_on(ball(), 300)
    pose = deformed(rig.head)
    guides = simulated(rig, pose)
    texels = np.concatenate([guides, np.full((*guides.shape[:2], 1), 7.0)], axis=-1)
    texture = texture_from(strand_rows(texels), "RGBA32F")
    ride = pass_of(rig)
    assert np.array_equal(shown(ride, pose, texture), shown(ride, pose, guides))


@pytest.mark.parametrize(
    ("above", "tolerance"), [((0.0, 0.0, 0.0), TOLERANCE), ((0.0, 0.0, 0.001), 0.002)]
)
def test_the_middle_of_all_roots_follows_the_head(
    above: tuple[float, float, float], tolerance: float
) -> None:
    """Against the exact mean; if all roots lie above the surface, the error is at most twice their
    height."""
    rig = rig_on(ball(), 2000, above=above)
    pose = deformed(rig.head)
    ride = pass_of(rig)
    ride.carry(pose.head_positions, pose.matrix)
    expected = motion_flow.carried_strands(rig, pose)[rig.strands.offsets[:-1]].mean(axis=0)
    assert ride.points.center == pytest.approx(expected, abs=tolerance)


def test_released_points_come_back_with_the_next_frame() -> None:
    from hairloom.addon.render import shader_program

    rig = rig_on(ball(), 100)
    pose = deformed(rig.head)
    guides = simulated(rig, pose)
    ride = pass_of(rig)
    before, points = shown(ride, pose, guides), ride.points
    shader_program.release()
    assert points.texture is None, "a snapshot that still holds the points keeps no GPU object"
    assert np.array_equal(shown(ride, pose, guides), before)
    del ride
    shader_program.release()
    assert points.texture is None, "also when the pass is gone"


def test_guides_of_another_shape_are_refused() -> None:
    rig = rig_on(ball(), 50)
    pose = rig.rest_pose
    with pytest.raises(ValueError, match="guides have shape"):
        shown(pass_of(rig), pose, np.zeros((3, 6, 3), np.float32))


def coiled(count: int = 200) -> Rig:
    """Leaning coils and straight strands, with few guides."""
    random = np.random.default_rng(5)
    along = np.linspace(0.0, 1.0, 160)
    angle = 2.0 * np.pi * 8.0 * along
    radius = 0.006 * (np.arange(count)[:, None] % 3 > 0) * np.minimum(1.0, 20.0 * along)
    grid = np.stack([radius * np.cos(angle), radius * np.sin(angle), -0.2 * along + 0 * radius], -1)
    grid += (
        random.normal(size=(count, 1, 3)) * 0.05
        + 0.1 * random.normal(size=(count, 1, 3)) * along[:, None]
    )
    offsets, width = np.arange(count + 1) * 160, np.full(count * 160, 4e-5)
    strands = StrandSet(grid.reshape(-1, 3), offsets, width, np.zeros(count))
    return rig_flow.prepare(strands, None, GuideSettings(guide_count=30), place="coils")


def test_curls_are_drawn_out_as_in_numpy() -> None:
    rig = coiled()
    assert rig.curl_slack is not None and 0 < rig.curl_slack.any(axis=1).sum() < 30
    ride, matrix = pass_of(rig), turned(0.7, (0.1, 0.0, 0.0))
    pose = Pose(None, matrix)
    guides = motion_flow.carried_guides(rig, pose).astype(np.float64)
    direction = np.diff(guides, axis=1) * np.random.default_rng(6).uniform(0.7, 1.9, (30, 1, 1))
    direction += np.random.default_rng(7).normal(scale=0.002, size=direction.shape)
    now = np.concatenate([guides[:, :1], guides[:, :1] + direction.cumsum(axis=1)], axis=1)
    expected = motion_flow.strands_at(rig, pose, now.astype(np.float32))
    found = shown(ride, pose, now.astype(np.float32))
    assert np.abs(found - expected).max() < 2.0 * TOLERANCE
    plain = replace(rig.riders, can_extend=None)
    other = type(ride)(rig.strands, None, rig.guides, rig.guide_grid, plain)
    assert np.abs(shown(other, pose, now.astype(np.float32)) - found).max() > 0.02
    ride.carry(None, matrix)
    assert np.abs(ride.read() - motion_flow.carried_strands(rig, pose)).max() < TOLERANCE


@pytest.mark.parametrize("rounds", [8, 1 << 20])
def test_strands_that_ride_are_led_out(monkeypatch: pytest.MonkeyPatch, rounds: int) -> None:
    """In the pass that moves them, or in a later one if its loops would have too many
    iterations."""
    from hairloom.addon.render import ride_pass

    monkeypatch.setattr(ride_pass, "_ITERATIONS_PER_POINT", rounds)
    rig = rig_on(ball(), 700)
    ride, pose, offsets = pass_of(rig), deformed(rig.head), rig.strands.offsets
    head = SphereCollider(ABOVE_GROUND, 0.11)
    posed = (PosedCollider(head, pose.matrix, pose.matrix),)
    begun = clearance_at(motion_flow.carried_strands(rig, pose), offsets, posed, 0.001)
    held = np.where(np.arange(700) % 5, 0, 4).astype(np.int32)
    number = np.arange(len(begun.points)) - np.repeat(offsets[:-1], np.diff(offsets))
    is_held = number <= np.repeat(held, np.diff(offsets))
    clearance = Clearance(0.001, np.where(is_held, -np.inf, begun.points), held)
    guides = simulated(rig, pose)
    motion = replace(
        motion_flow.begin(rig, pose), guides=guides, colliders=posed, clearance=clearance
    )
    expected, led = motion_flow.strands_and_led(rig, motion)
    ride.lead_out.set_clearance(clearance)
    ride.ride(pose.head_positions, pose.matrix, guides, None, posed)
    found = ride.read_led()
    assert 200 < len(led.strands) < 650
    assert len(np.setxor1d(found.strands, led.strands)) <= 2, "rounding decides few"
    off = np.abs(ride.read() - expected).max(axis=1)
    assert (np.maximum.reduceat(off, offsets[:-1]) > TOLERANCE).mean() < 0.03
    assert off[is_held].max() < TOLERANCE
    shift = motion_flow.carried_strands(rig, pose) - motion_flow.strands_at(rig, pose, guides)
    assert np.abs(shift[is_held]).max() > 0.01

    # each frame starts from the deflections of the one before
    along = np.linspace(0.0, 1.0, guides.shape[1])[:, None]
    for frame in (1.0, 2.0, 3.0):
        moved = guides + frame * np.float32([0.0, 0.004, 0.0]) * along
        after = replace(motion, guides=moved, hair_time=1.0 / 60.0, deflections=led.deflections)
        expected, led = motion_flow.strands_and_led(rig, after)
        ride.ride(pose.head_positions, pose.matrix, moved, None, posed, elapsed=1.0 / 60.0)
        found = ride.read_led()
        assert len(np.setxor1d(found.strands, led.strands)) <= 3, "rounding decides few"
        off = np.abs(ride.read() - expected).max(axis=1)
        assert (np.maximum.reduceat(off, offsets[:-1]) > TOLERANCE).mean() < 0.05
    forgotten = motion_flow.strands_and_led(rig, replace(after, deflections=NO_DEFLECTIONS))[0]
    is_other = np.abs(expected - forgotten).max(axis=1) > 10.0 * TOLERANCE
    assert np.maximum.reduceat(is_other, offsets[:-1]).mean() > 0.1
    # after a jump to this frame there is no memory
    ride.ride(pose.head_positions, pose.matrix, moved, None, posed)
    found = ride.read()
    off = np.abs(found - forgotten).max(axis=1)
    assert (np.maximum.reduceat(off, offsets[:-1]) > TOLERANCE).mean() < 0.03
    first = pass_of(rig)
    first.lead_out.set_clearance(clearance)
    first.ride(pose.head_positions, pose.matrix, moved, None, posed)
    np.testing.assert_array_equal(first.read(), found)
    # long after, nothing leads them out, and they are where they ride
    ride.ride(pose.head_positions, pose.matrix, guides, None, posed)
    beyond = turned(0.0, (9.0, 0.0, 0.0))
    far = (PosedCollider(head, beyond, beyond),)
    ride.ride(pose.head_positions, pose.matrix, moved, None, far, elapsed=1.0)
    found = ride.read()
    ride.ride(pose.head_positions, pose.matrix, moved, None, far)
    np.testing.assert_allclose(found, ride.read(), atol=TOLERANCE)
