"""Position in time and normal of what a pixel sees: hair, meshes, or nothing."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.nearest import (
    FAR_AWAY,
    Nearest,
    SceneAtTime,
    background,
    motion,
    projected,
    unprojected,
)
from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.strands import Surface

SIZE = 8, 6
CAMERAS = {
    "perspective": Camera(
        look_at((1.0, -2.0, 0.5), (0.0, 0.0, 0.0)), perspective(0.7, SIZE[0] / SIZE[1], 0.1, 50.0)
    ),
    "orthographic": Camera(
        look_at((1.0, -2.0, 0.5), (0.0, 0.0, 0.0)), orthographic(2.0, SIZE[0] / SIZE[1], 0.1, 50.0)
    ),
}


def seen(strand: int = -1, place: float = 0.0, mesh: int = -1, depth: float = 0.9) -> Nearest:
    """The same in all pixels."""
    whole = np.zeros(SIZE[::-1], np.int32)
    return Nearest(
        np.full(whole.shape, depth, np.float32),
        whole + mesh,
        whole + (0 if strand >= 0 else -1),
        whole + strand,
        np.full(whole.shape, place, np.float32),
    )


def groom(points: np.ndarray) -> DrawnGroom:
    return DrawnGroom("hair", Snapshot(points, np.full(points.shape[:2], 0.01)), "Hair", 7)


@pytest.mark.parametrize("kind", CAMERAS)
def test_unprojected_depths_lie_at_pixel_centers(kind: str) -> None:
    camera = CAMERAS[kind]
    depth = np.random.default_rng(1).uniform(0.1, 0.99, SIZE[::-1])
    places = projected(camera, unprojected(camera, depth), SIZE)
    middles = np.stack(np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5), axis=2)
    np.testing.assert_allclose(places, middles, atol=1e-6)
    np.testing.assert_allclose(
        projected(camera, background(camera, depth), SIZE), middles, atol=1e-6
    )


def test_motion_is_from_before_to_now_and_from_now_to_after_both_backwards() -> None:
    before, now, after = (
        np.full((3, 1, 1, 2), 5.0) + np.array([[-1, 0], [0, 0], [4, 2]])[:, None, None]
    )
    assert motion(before, now, after)[0, 0].tolist() == [-1.0, 0.0, -4.0, -2.0]


def test_a_strand_is_a_curve_through_its_points() -> None:
    """Against a parabola, which the cubic interpolation reproduces between inner points."""
    x = np.arange(5.0)
    points = np.stack([x, x**2, 0.0 * x], axis=1)[None].repeat(3, axis=0)
    points[1] += 1.0
    hair = groom(points).snapshot
    nothing = np.zeros((*SIZE[::-1], 3))
    for place, exact in (
        (0.5, (2.0, 4.0, 0.0)),
        (0.375, (1.5, 2.25, 0.0)),
        (1.0, (4.0, 16.0, 0.0)),
    ):
        found = seen(0, place).on_strands([hair], nothing)
        np.testing.assert_allclose(found, np.broadcast_to(exact, found.shape), atol=1e-6)
    slope = seen(1, 0.375).on_strands([hair], nothing, slope=True)
    np.testing.assert_allclose(slope[0, 0], (1.0, 3.0, 0.0), atol=1e-6)
    elsewhere = seen().on_strands([hair], nothing + 9.0)
    assert (elsewhere == 9.0).all()


def test_numbers_are_those_of_the_object_and_of_the_strand() -> None:
    surface = Surface(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    mesh = MeshSnapshot(surface, np.eye(3), number=3)
    scene = SceneSnapshot(meshes=(mesh,), grooms=(groom(np.zeros((4, 2, 3))),))
    for nearest, number, strand in ((seen(2), 7, 3), (seen(mesh=0), 3, 0), (seen(depth=1.0), 0, 0)):
        assert (nearest.object_numbers(scene) == number).all()
        assert (nearest.strand_numbers() == strand).all()
    alone = seen(mesh=0).of_hair()
    assert (alone.distances(CAMERAS["perspective"]) == np.float32(FAR_AWAY)).all()
    assert not alone.object_numbers(scene).any()


@pytest.mark.parametrize("kind", CAMERAS)
def test_normals_face_the_eye_and_are_across_the_strand(kind: str) -> None:
    camera = CAMERAS[kind]
    points = np.array([[[0.0, 0.0, 0.0], [0.3, 0.1, 1.0]]])
    scene = SceneSnapshot(grooms=(groom(points),))
    nothing = np.zeros((*SIZE[::-1], 3))
    hair = seen(0, 0.5).normals(scene, camera, nothing)
    to_eye = camera.eye[:3] - camera.eye[3] * unprojected(camera, seen(0).depth)
    np.testing.assert_allclose(hair @ (points[0, 1] / 1.05), 0.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(hair, axis=2), 1.0, atol=1e-6)
    assert ((hair * to_eye).sum(axis=2) > 0.0).all()
    for side in (1.0, -1.0):
        away = seen(mesh=0).normals(scene, camera, nothing + (0.0, 2.0 * side, 0.0))
        np.testing.assert_allclose(away, np.broadcast_to((0.0, -1.0, 0.0), away.shape), atol=1e-6)
    assert not seen(depth=1.0).normals(scene, camera, nothing + 1.0).any()


def test_objects_missing_at_the_other_time_stay_where_they_are() -> None:
    surface = Surface(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    more = Surface(np.ones((4, 3), np.float32), np.array([[0, 1, 2]], np.int32))
    moved = Surface(surface.positions + 1.0, surface.triangles)
    meshes = tuple(MeshSnapshot(surface, np.eye(3), key=key) for key in "abc")
    hair = groom(np.zeros((4, 2, 3)))
    now = SceneSnapshot(meshes=meshes, grooms=(hair,))
    then = SceneSnapshot(
        meshes=(
            MeshSnapshot(more, np.ones((4, 3)), key="c"),
            MeshSnapshot(moved, np.eye(3), key="a"),
        ),
        grooms=(groom(np.ones((5, 2, 3))),),
    )
    found = SceneAtTime.of(now, then, CAMERAS["perspective"])
    assert found.meshes[0] is moved.positions
    assert found.meshes[1] is surface.positions and found.meshes[2] is surface.positions
    assert found.grooms == (hair.snapshot,)
    fewer = SceneSnapshot(grooms=(groom(np.ones((4, 2, 3))),))
    assert SceneAtTime.of(now, fewer, CAMERAS["perspective"]).grooms[0] is fewer.grooms[0].snapshot
