"""Nearest strands, tangents and coverages of a drawn scene, against numpy and the picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import numpy as np
import pytest

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.nearest import projected
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.strands import Surface
from hairloom.addon.strands.vectors import unit

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE, WIDE = 96, 0.07
SQUARE = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float32)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
NOTHING = (0.0, 0.0, 0.0, 0.0)
PLAIN = ShadingSettings(model="kajiya_kay")
CAMERAS = {
    "perspective": Camera(
        look_at((0.0, -6.0, 1.0), (0.0, 0.0, 0.0)), perspective(0.4, 1.0, 0.5, 20.0)
    ),
    "orthographic": Camera(
        look_at((0.0, -6.0, 1.0), (0.0, 0.0, 0.0)), orthographic(2.4, 1.0, 0.5, 20.0)
    ),
}


def hair_of(points: np.ndarray, radius: float, **settings: Any) -> Any:
    return Snapshot(
        np.asarray(points, np.float32),
        np.full(np.shape(points)[:2], radius, np.float32),
        ambient=(1.0, 1.0, 1.0),
        shading=PLAIN,
        strand_settings=StrandSettings(tip_width=1.0, **settings),
        detail=DetailSettings(min_density=1.0, culling="none"),
    )


def scene_of(*grooms: Any, meshes: tuple[Any, ...] = ()) -> Any:
    from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot

    names = "One", "Two", "Three"
    drawn = (
        DrawnGroom(name, groom, name, number + 1)
        for number, (name, groom) in enumerate(zip(names, grooms, strict=False))
    )
    return SceneSnapshot(meshes=meshes, grooms=tuple(drawn), ambient=(1.0, 1.0, 1.0))


def plate(y: float, x: float = 0.0, **more: Any) -> Any:
    from hairloom.addon.render.snapshot import MeshSnapshot

    surface = Surface(SQUARE + np.float32([x, y, 0.0]), TRIANGLES)
    normals = np.broadcast_to(np.float32([0.0, -1.0, 0.0]), (4, 3))
    return MeshSnapshot(surface, normals, **more)


def straight(count: int, seed: int) -> np.ndarray:
    """Strands of two points, (count, 2, 3), in a box of 2 m."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 2, 3))


def nearest_by_hand(camera: Camera, strands: np.ndarray, radius: float) -> tuple[Any, Any]:
    """The nearest strand at each pixel's centre, or -1, and whether all its neighbours see the
    same."""
    middles = np.stack(np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5), axis=2)
    ends = projected(camera, strands, (SIZE, SIZE))
    clip = strands @ (camera.projection @ camera.view)[:3, :3].T  # for w alone
    w = strands @ (camera.projection @ camera.view)[3, :3] + (camera.projection @ camera.view)[3, 3]
    z = -(strands @ camera.view[2, :3] + camera.view[2, 3])
    assert clip.shape == strands.shape
    best, found = np.full((SIZE, SIZE), np.inf), np.full((SIZE, SIZE), -1)
    for index, (start, end) in enumerate(ends):
        along = (end - start) / np.linalg.norm(end - start)
        t = np.clip((middles - start) @ along / np.linalg.norm(end - start), 0.0, 1.0)
        away = np.abs((middles - start) @ np.array([-along[1], along[0]]))
        # places between are linear in 1 / w
        s = t * w[index, 0] / (t * w[index, 0] + (1.0 - t) * w[index, 1])
        depth = z[index, 0] + s * (z[index, 1] - z[index, 0])
        wide = radius * camera.projection[1, 1] * 0.5 * SIZE
        wide = wide / (w[index, 0] + s * (w[index, 1] - w[index, 0]))
        here = (away < wide) & (t > 0.0) & (t < 1.0) & (depth < best)
        best[here], found[here] = depth[here], index
    padded = np.pad(found, 1, constant_values=-2)
    shifts = [padded[y : y + SIZE, x : x + SIZE] for y in range(3) for x in range(3)]
    return found, np.all([each == found for each in shifts], axis=0)


@pytest.mark.parametrize("kind", CAMERAS)
def test_the_nearest_strand_is_that_of_brute_force(gpu_context: Any, kind: str) -> None:
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass

    camera, strands = CAMERAS[kind], [straight(12, seed) for seed in (1, 2)]
    scene = scene_of(*(hair_of(each, WIDE) for each in strands))
    found = ScenePass().nearest(scene, camera, Target(), (SIZE, SIZE))
    expected, is_inside = nearest_by_hand(camera, np.concatenate(strands), WIDE)
    is_inside &= expected >= 0
    assert is_inside.mean() > 0.1
    both = np.where(found.groom == 1, 12, 0) + found.strand
    assert (both == expected)[is_inside].mean() > 0.99
    assert ((found.groom >= 0) == (expected >= 0)).mean() > 0.97
    # and the place along it, by the point that is seen there
    snapshots = [groom.snapshot for groom in scene.grooms]
    places = projected(camera, found.on_strands(snapshots, np.zeros((SIZE, SIZE, 3))), (SIZE, SIZE))
    middles = np.stack(np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5), axis=2)
    away = np.linalg.norm(places - middles, axis=2)[found.strand >= 0]
    assert away.max() < WIDE * camera.projection[1, 1] * 0.5 * SIZE + 0.1


def test_vertex_values_are_interpolated_to_pixels(gpu_context: Any) -> None:
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass

    scene = scene_of(meshes=(plate(0.0, -0.5), plate(1.0, 0.5)))
    passes, target, camera = ScenePass(), Target(), CAMERAS["perspective"]
    values = [each.surface.positions for each in scene.meshes]
    found = passes.on_meshes(scene, values, camera, target, (SIZE, SIZE))
    nearest = passes.nearest(scene, camera, target, (SIZE, SIZE))
    is_mesh = nearest.mesh >= 0
    assert set(np.unique(nearest.mesh)) == {-1, 0, 1} and not found[~is_mesh].any()
    middles = np.stack(np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5), axis=2)
    places = projected(camera, found, (SIZE, SIZE))
    np.testing.assert_allclose(places[is_mesh], middles[is_mesh], atol=1e-3)
    for index, y in enumerate((0.0, 1.0)):
        np.testing.assert_allclose(found[nearest.mesh == index][:, 1], y, atol=1e-5)


@pytest.mark.parametrize("transparency", ["layers", "none"])
def test_tangents_are_those_of_the_strands_as_strong_as_they_cover(
    gpu_context: Any, transparency: str
) -> None:
    """Weighted by coverage, for two wide crossing strands; the nearer one has an opacity of 0.5."""
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass

    points = np.array([[[-2.0, 0.0, -0.5], [2.0, 0.0, 1.0]], [[0.5, -0.5, 2.0], [0.0, -0.5, -2.0]]])
    hair = hair_of(points, 0.3, opacity=0.5, transparency=transparency)
    camera = CAMERAS["orthographic"]
    camera = replace(camera, view=look_at((0.0, -6.0, 0.0), (0.0, 0.0, 0.0)))
    found = ScenePass().tangents(scene_of(hair), camera, Target(), (SIZE, SIZE))
    along = points[:, 1] - points[:, 0]
    far, near = along / np.linalg.norm(along, axis=1, keepdims=True)
    middle = found[SIZE // 2 + 10, SIZE // 2 + 8]
    expected = 0.5 * near + 0.25 * far if transparency == "layers" else near
    np.testing.assert_allclose(middle, expected, atol=2e-3)
    np.testing.assert_allclose(unit(found)[SIZE // 2 - 12, 4], far, atol=2e-3)


def test_coverages_are_the_alpha_of_the_picture(gpu_context: Any) -> None:
    """For two interpenetrating grooms before a plate that fills half of the picture, and a
    holdout."""
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass

    camera, passes, target = CAMERAS["perspective"], ScenePass(), Target()
    grooms = [hair_of(straight(40, seed), 0.004, opacity=0.7) for seed in (1, 2)]
    bare = scene_of(*grooms)

    def alpha(scene: Any) -> np.ndarray:
        passes.draw(scene, camera, target, (SIZE, SIZE), NOTHING)
        return np.array(target.color.read(), np.float32).reshape(SIZE, SIZE, 4)[..., 3]

    expected = alpha(bare)
    found, hair = passes.coverages(bare, camera, target, (SIZE, SIZE))
    assert set(found) == {"One", "Two"} and 0.05 < expected.mean() < 0.9
    np.testing.assert_allclose(hair, expected, atol=1e-5)
    np.testing.assert_allclose(found["One"] + found["Two"], expected, atol=1e-5)
    covered = scene_of(*grooms, meshes=(plate(0.0, name="Plate"),))
    found, hair = passes.coverages(covered, camera, target, (SIZE, SIZE))
    np.testing.assert_allclose(sum(found.values()), alpha(covered), atol=1e-5)
    assert (hair <= expected + 1e-5).all() and hair.mean() < 0.9 * expected.mean()
    held = replace(covered, grooms=(covered.grooms[0], replace(covered.grooms[1], is_holdout=True)))
    found, hair = passes.coverages(held, camera, target, (SIZE, SIZE))
    assert set(found) == {"One", "Plate"}
    np.testing.assert_allclose(found["One"] + found["Plate"], alpha(held), atol=1e-5)
    np.testing.assert_array_equal(hair, found["One"])


def test_strands_thinner_than_a_pixel_are_found_and_nearest_wherever_they_are(
    gpu_context: Any,
) -> None:
    """With the width *Min Width*, whatever their transparency."""
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass

    across = np.array([[[-2.0, 0.0, z], [2.0, 0.0, z]] for z in np.linspace(-0.9, 0.9, 10)])
    scene = scene_of(hair_of(across, 1e-4, opacity=0.3))
    found = ScenePass().nearest(scene, CAMERAS["orthographic"], Target(), (SIZE, SIZE))
    assert set(np.unique(found.strand[:, SIZE // 2])) == {-1, *range(10)}
    assert (found.strand >= 0).any(axis=0).all()
