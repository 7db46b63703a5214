"""A ponytail on a moving head: held places stay in their tie, and strands keep their lengths."""

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.holds import anchors_of
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.groom.ties import Holders, Tie, TipSurface
from hairloom.addon.motion_flow import FrameInput
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.face import BROWS
from hairloom.addon.strands.resample import resample

GRAVITY = np.array([0.0, 0.0, -9.81])
RING = np.array([0.0, 0.1, 0.05])
CV_COUNT = 24


def ponytail(count: int = 200, seed: int = 4) -> StrandSet:
    """Strands from a patch through a ring of 1 cm behind it and 30 cm down; one of 20 passes by."""
    random = np.random.default_rng(seed)
    roots = random.uniform([-0.06, -0.06, 0.0], [0.06, 0.06, 0.0], (count, 3))
    across = random.normal(0.0, 0.003, (count, 1, 3)) * [1.0, 0.0, 1.0]
    along = np.linspace(0.0, 1.0, 40)[:, None]
    up = roots[:, None] + np.array([0.0, 0.02, 0.07]) * np.sin(np.pi * along)
    to_ring = up * (1.0 - along) + (RING + across) * along
    tail = RING + across + along * [0.0, 0.06, 0.0] + along**2 * [0.0, 0.0, -0.2]
    points = np.concatenate([to_ring, tail[:, 1:]], axis=1)
    points[::20, :, 1] -= 0.15 * np.linspace(0.0, 1.0, points.shape[1])  # these pass by
    number = points.shape[1]
    strands = StrandSet(
        points.reshape(-1, 3),
        np.arange(count + 1) * number,
        np.full(count * number, 4e-5),
        np.zeros(count, np.int32),
    )
    return resample(strands, CV_COUNT)


def tie() -> Tie:
    """The ring, its axis along y."""
    shape = np.eye(4)
    shape[:3, :3] = 0.012 * np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]).T
    shape[:3, 3] = RING
    return Tie("Scrunchy", shape)


def rig_of(holders: Holders, **settings: int) -> Rig:
    chosen = GuideSettings(
        **{"guide_count": 40, "cv_count": CV_COUNT, "tip_distance": 0.03, **settings}
    )
    return rig_flow.prepare(ponytail(), None, chosen, place="hair", holders=holders)


def shaking(time: float, turn: float = 25.0) -> np.ndarray:
    swing = np.sin(np.pi * min(time, 0.5)) ** 2 * np.sin(2.0 * np.pi * time)
    angle = np.radians(turn) * swing
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[0, 3] = 0.05 * swing
    return matrix


def pose_at(rig: Rig, matrix: np.ndarray, own: np.ndarray | None = None) -> Pose:
    """The pose in which head and ties move by `matrix`, the ties also by `own`."""
    assert rig.holds is not None
    tie_matrix = matrix if own is None else matrix @ own
    ties = np.broadcast_to(tie_matrix, (rig.holds.tie_count, 4, 4))
    surface = rig.holds.surface
    moved = None if surface is None else surface.positions @ matrix[:3, :3].T + matrix[:3, 3]
    return Pose(None, matrix, anchors_of(rig.holds, ties, moved))


def escape(rig: Rig, pose: Pose, strands: np.ndarray) -> np.ndarray:
    """Distance of each hold's place on its strand from where its anchor has it [m]."""
    holds = rig.holds.where(pose.anchors)
    first = holds.place.astype(int)
    part = (holds.place - first)[:, None]

    def at(grid):
        here, after = grid[holds.strand, first], np.minimum(first + 1, grid.shape[1] - 1)
        return here * (1.0 - part) + grid[holds.strand, after] * part

    rest = np.concatenate([at(rig.strands.grid), np.ones((len(first), 1))], axis=1)
    target = np.einsum("nij,nj->ni", pose.anchors[holds.anchor], rest)[:, :3]
    return np.linalg.norm(at(strands) - target, axis=1)


def lengths(strands: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)


def played(rig: Rig, poses: list[Pose], settings: DynamicsSettings, fps: float):
    motion = motion_flow.begin(rig, poses[0])
    for pose in poses[1:]:
        motion = motion_flow.advance(
            rig, motion, FrameInput(pose, (), settings, GRAVITY, 1.0 / fps)
        )
        yield motion


def grid(rig: Rig, points: np.ndarray) -> np.ndarray:
    return points.reshape(rig.strands.grid.shape)


TIPS = TipSurface(
    "Bun",
    Surface(np.array([[-1.0, -1, -0.155], [1, -1, -0.155], [0, 1, -0.155]]), np.array([[0, 1, 2]])),
)


@pytest.mark.parametrize(
    "holders", [Holders((tie(),)), Holders((tie(),), TIPS)], ids=["ponytail", "bun"]
)
def test_all_strands_stay_in_a_ring_that_turns_with_the_head(holders: Holders) -> None:
    """At 24 frames a second, within 0.1 mm; drawn strands keep their lengths to 0.2 %."""
    rig = rig_of(holders)
    assert rig.holds is not None and rig.notes == ()
    is_tip = rig.holds.anchor >= rig.holds.tie_count
    assert 150 < len(np.unique(rig.holds.strand[~is_tip])) < 200
    assert is_tip.any() == (holders.tip_surface is not None)
    assert rig.guide_holds is not None and len(rig.guide_holds.strand) > 20
    poses = [pose_at(rig, shaking(frame / 24.0)) for frame in range(30)]
    rest, swung = lengths(rig.strands.grid), 0.0
    for motion in played(rig, poses, DynamicsSettings(), 24.0):
        strands = grid(rig, motion_flow.strands_and_led(rig, motion)[0])
        assert escape(rig, motion.pose, strands).max() < 1e-4
        away = np.abs(strands - grid(rig, motion_flow.strands_at_rest(rig, motion.pose)))
        swung = max(swung, float(away.max()))
        assert np.isfinite(strands).all()
        assert np.abs(lengths(strands) / rest - 1.0).max() < 0.002
    assert swung > 0.01


def test_hair_beyond_a_tie_follows_the_tie_and_not_the_head() -> None:
    """A ring that rises by 2 cm while the head is still lifts the tail by as much."""
    rig = rig_of(Holders((tie(),)))
    lifted = np.eye(4)
    lifted[2, 3] = 0.02
    style = motion_flow.style_of_guides(rig, pose_at(rig, np.eye(4), lifted))
    rest = rig.guide_grid
    held = np.unique(rig.guide_holds.strand)
    np.testing.assert_allclose((style - rest)[held][:, -1], [[0, 0, 0.02]] * len(held), atol=1e-6)
    np.testing.assert_array_equal(style[held][:, :2], rest[held][:, :2])
    free = np.setdiff1d(np.arange(len(rig.guides)), held)
    assert len(free)
    np.testing.assert_array_equal(style[free], rest[free])


def test_hair_at_rest_stays_as_it_is_to_the_last_bit() -> None:
    rig = rig_of(Holders((tie(),), TIPS))
    pose = pose_at(rig, np.eye(4))
    np.testing.assert_array_equal(motion_flow.strands_at_rest(rig, pose), rig.strands.points)
    guides = motion_flow.style_of_guides(rig, pose)
    np.testing.assert_array_equal(guides, rig.guide_grid)
    np.testing.assert_array_equal(motion_flow.strands_at(rig, pose, guides), rig.strands.points)


def test_a_tie_that_goes_away_in_mid_motion_lets_go() -> None:
    rig = rig_of(Holders((tie(),)))
    poses = [pose_at(rig, shaking(frame / 24.0)) for frame in range(24)]
    gone = [replace(pose, anchors=np.full_like(pose.anchors, np.nan)) for pose in poses[12:]]
    motions = list(played(rig, poses[:12] + gone, DynamicsSettings(), 24.0))
    ends = [grid(rig, motion_flow.strands_and_led(rig, motion)[0]) for motion in motions]
    assert all(np.isfinite(end).all() for end in ends)
    assert escape(rig, poses[11], ends[10]).max() < 1e-4
    assert escape(rig, poses[-1], ends[-1]).max() > 1e-3


def test_a_tie_that_is_torn_off_leaves_every_length() -> None:
    rig = rig_of(Holders((tie(),)))
    away = np.eye(4)
    poses = []
    for frame in range(24):
        away = away.copy()
        away[0, 3] = 0.05 * frame
        poses.append(pose_at(rig, np.eye(4), away))
    rest = lengths(rig.guide_grid)
    for motion in played(rig, poses, DynamicsSettings(), 24.0):
        strands = grid(rig, motion_flow.strands_and_led(rig, motion)[0])
        assert np.isfinite(strands).all()
        assert np.abs(lengths(motion.dynamics.grid) / rest - 1.0).max() < 0.005


def test_held_strands_follow_guides_that_the_same_tie_holds() -> None:
    rig = rig_of(Holders((tie(),)), guide_count=5)
    kind = rig.holds.kinds(rig.strands.strand_count)
    for column in range(3):
        counts = rig.weights.weight[:, column] > 0.0
        np.testing.assert_array_equal(
            kind[rig.guides[rig.weights.guide[counts, column]]], kind[counts]
        )


def test_a_tie_without_hair_is_said_and_does_no_harm() -> None:
    shape = tie().shape.copy()
    shape[0, 3] = 9.0
    far = Tie("Scrunchy", shape)
    rig = rig_of(Holders((far,)))
    assert len(rig.notes) == 1 and "Scrunchy" in rig.notes[0]
    plain = rig_flow.prepare(
        ponytail(), None, GuideSettings(guide_count=40, cv_count=24), place="hair"
    )
    np.testing.assert_array_equal(rig.guides, plain.guides)
    np.testing.assert_array_equal(rig.weights.weight, plain.weights.weight)
    assert motion_flow.held_cvs(rig, pose_at(rig, np.eye(4))) is None


def test_the_end_of_a_braid_stays_together() -> None:
    """Three bundles twisted around each other, held at their ends by a ball that swings freely."""
    random = np.random.default_rng(3)
    along = np.linspace(0.0, 1.0, 60)
    turn = 12.0 * along + (2.0 * np.pi / 3.0) * (np.arange(90) % 3)[:, None]
    wide = 0.012 * np.minimum(1.0, 6.0 * (1.0 - along)) + 0.0005
    points = np.stack([wide * np.cos(turn), wide * np.sin(turn), 0.0 * turn - 0.3 * along], axis=-1)
    points += random.normal(0.0, 0.0008, (90, 1, 3))
    count = points.shape[1]
    strands = StrandSet(
        points.reshape(-1, 3), np.arange(91) * count, np.full(90 * count, 4e-5), np.zeros(90)
    )
    strands = resample(strands, CV_COUNT)
    shape = np.diag([0.006, 0.006, 0.006, 1.0])
    shape[2, 3] = -0.297
    settings = GuideSettings(guide_count=20, cv_count=CV_COUNT)
    ball = Holders((Tie("Band", shape, True),))
    rig = rig_flow.prepare(strands, None, settings, place="braid", holders=ball)
    assert rig.holds is not None and len(rig.holds.strand) == 90
    poses = []
    for frame in range(30):
        swung = np.eye(4)
        swung[:3, 3] = np.array([0.04, 0.0, 0.015]) * np.sin(0.2 * frame) ** 2
        poses.append(pose_at(rig, np.eye(4), swung))
    rest = lengths(rig.strands.grid)
    for motion in played(rig, poses, DynamicsSettings(), 24.0):
        now = grid(rig, motion_flow.strands_and_led(rig, motion)[0])
        assert escape(rig, motion.pose, now).max() < 1e-4
        assert np.abs(lengths(now) / rest - 1.0).max() < 0.002
        assert np.linalg.norm(now[:, -1] - now[:, -1].mean(axis=0), axis=1).max() < 0.008


def test_strange_strands_in_a_tie_do_no_harm() -> None:
    """A strand of two points, one with two coincident points, one with no length at its tip, and
    one whose points all coincide."""
    whole = ponytail(6).points.reshape(6, -1, 3)
    ends = np.stack([whole[0, 0], RING + [0.0, 0.02, 0.0]])
    doubled = np.concatenate([whole[1, :30], whole[1, 29:30], whole[1, 30:]])
    stopped = np.concatenate([whole[2], whole[2, -1:], whole[2, -1:]])
    lines = [ends, doubled, stopped, np.tile(RING, (5, 1)), *whole]
    counts = [len(line) for line in lines]
    strands = StrandSet(
        np.concatenate(lines),
        np.concatenate([[0], np.cumsum(counts)]),
        np.full(sum(counts), 4e-5),
        np.zeros(len(lines), np.int32),
    )
    settings = GuideSettings(cv_count=8, tip_distance=0.1)
    holders = Holders((tie(),), TIPS)
    rig = rig_flow.prepare(strands, None, settings, place="hair", holders=holders)
    assert rig.holds is not None and len(rig.holds.strand) > 6
    poses = [pose_at(rig, shaking(frame / 24.0)) for frame in range(12)]
    shrunk = np.diag([0.0, 0.0, 0.0, 1.0])
    poses += [Pose(None, shrunk, pose_at(rig, shrunk).anchors)] * 3 + poses[:3]
    for solver in ("direct", "relaxation"):
        chosen = DynamicsSettings(length_solver=solver)
        for motion in played(rig, poses, chosen, 24.0):
            assert np.isfinite(motion.dynamics.position).all()
            assert np.isfinite(motion_flow.strands_and_led(rig, motion)[0]).all()


def test_brows_go_with_the_face() -> None:
    """Short strands of the group BROWS beside long ones, one guide each: only their roots carry
    them."""
    along = np.linspace(0.0, 1.0, 8)[:, None]
    roots = np.linspace([-0.05, 0.0, 0.0], [0.05, 0.0, 0.0], 6)
    length = np.where(np.arange(6) < 2, 0.01, 0.2)
    grid = roots[:, None] + length[:, None, None] * along * [0.0, 0.6, -0.8]
    group = np.where(np.arange(6) < 2, BROWS, 0)
    strands = StrandSet(grid.reshape(-1, 3), np.arange(7) * 8, np.full(48, 4e-5), group)
    settings = GuideSettings(guide_count=6, cv_count=8)
    rig = rig_flow.prepare(strands, None, settings, place="hair")
    motion = motion_flow.begin(rig, rig.rest_pose)
    for frame in range(12):
        pose = Pose(None, shaking((frame + 1) / 24.0))
        motion = motion_flow.advance(
            rig, motion, FrameInput(pose, (), DynamicsSettings(), GRAVITY, 1.0 / 24.0)
        )
        points = motion_flow.strands_and_led(rig, motion)[0].reshape(6, 8, 3)
        off = np.abs(points - motion_flow.carried_strands(rig, pose).reshape(6, 8, 3)).max(
            axis=(1, 2)
        )
        assert off[:2].max() < 1e-6
    assert off[2:].min() > 0.001
    alone = rig_flow.prepare(strands.take(np.arange(2)), None, settings, place="brows")
    assert motion_flow.held_cvs(alone, alone.rest_pose) is None, "hair that is nothing else swings"


def test_brows_stay_held_where_ties_hold_other_hair() -> None:
    strands = ponytail(60)
    group = np.where(np.arange(60) < 6, BROWS, 0)
    rig = rig_flow.prepare(
        replace(strands, group=group),
        None,
        GuideSettings(guide_count=40, cv_count=CV_COUNT),
        place="hair",
        holders=Holders((tie(),)),
    )
    held = motion_flow.held_cvs(rig, pose_at(rig, np.eye(4)))
    is_face = rig.strands.group[rig.guides] == BROWS
    assert is_face.any() and held.is_held[is_face].all()
    assert held.is_held[~is_face].any() and not held.is_held[~is_face].all(axis=1).any()
