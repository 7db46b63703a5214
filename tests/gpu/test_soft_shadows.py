"""The penumbra of a sun with an angle, in scenes and in stills of one groom, against the part of
its disk that an edge leaves visible.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.mesh_shadow_settings import MeshShadowSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

SIZE, SAMPLES = 96, 64
HEIGHT, ANGLE = 0.5, np.radians(20.0)
WHITE = (1.0, 1.0, 1.0)


def square(low: tuple[float, float], high: tuple[float, float], height: float) -> Surface:
    x, y = zip(low, high, strict=True)
    corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]
    positions = np.insert(np.array(corners), 2, height, axis=1).astype(np.float32)
    return Surface(positions, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def matt(surface: Surface) -> MeshSnapshot:
    normals = np.tile(np.float32([0.0, 0.0, 1.0]), (4, 1))
    return MeshSnapshot(surface, normals, WHITE, specular=0.0)


def camera_above() -> Camera:
    """A camera above the ground, with clip planes below what shades it."""
    return Camera(
        look_at((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        orthographic(0.6, 1.0, 3.7, 5.0),
    )


def mean_row(scene: SceneSnapshot) -> np.ndarray:
    """The middle row of the picture, averaged over all samples."""
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass
    from hairloom.addon.render.textures import texture_to_array

    camera = camera_above()
    drawing, target = ScenePass(), Target()
    total = np.zeros((SIZE, 3))
    for sample in range(SAMPLES):
        drawing.draw(scene.at_sample(sample), camera, target, (SIZE, SIZE), (0.0, 0.0, 0.0, 1.0))
        total += texture_to_array(target.color)[SIZE // 2, :, :3]
    return total / SAMPLES


def segment_left(place: np.ndarray) -> np.ndarray:
    """The fraction of a unit disk to the right of a line at -place."""
    x = np.clip(place, -1.0, 1.0)
    return 0.5 + (np.arcsin(x) + x * np.sqrt(1.0 - x * x)) / np.pi


def shaded_by_disk() -> np.ndarray:
    """The fraction of the sun's disk that an edge above x = 0 leaves visible along a row."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 0.6 - 0.3
    return segment_left(place / (HEIGHT * np.tan(0.5 * ANGLE)))


def test_an_edge_has_the_penumbra_of_the_disk(gpu_context: Any) -> None:
    """For a sheet over x < 0 above the camera's near plane."""
    ground = matt(square((-4.0, -4.0), (4.0, 4.0), 0.0))
    sheet = matt(square((-3.0, -3.0), (0.0, 3.0), HEIGHT))
    sun = Light.sun((0.0, 0.0, -1.0), WHITE, np.pi, ANGLE)
    scene = SceneSnapshot(
        meshes=(ground,),
        casters=(ground, sheet),
        lights=(sun,),
        mesh_shadows=MeshShadowSettings(mesh_resolution=2048),
    )
    found, expected = mean_row(scene)[:, 0], shaded_by_disk()
    assert np.abs(found - expected).max() < 0.05
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.02


def curtain() -> Snapshot:
    """Hair above the left half of the picture."""
    x = np.linspace(-0.5, 0.0, 400)
    ends = np.array([[[0.0, -0.5, HEIGHT], [0.0, 0.5, HEIGHT]]])
    strands = (ends + x[:, None, None] * [1.0, 0.0, 0.0]).astype(np.float32)
    radius = np.full(strands.shape[:2], 0.003, np.float32)
    return Snapshot(strands, radius, volume=VolumeSettings(shadows="deep"))


def shaded_row(found: np.ndarray) -> np.ndarray:
    """The fraction of the sun that is visible along a row under the curtain's edge: 0 at its closed
    end, 1 at its open end."""
    open_, closed = found[-8:].mean(), found[:8].mean()
    assert open_ == pytest.approx(1.0, abs=0.02) and closed < 0.4
    return (found - closed) / (open_ - closed)


@pytest.mark.slow(instead="test_a_still_is_shaded_softly")
def test_hair_shades_a_mesh_softly(gpu_context: Any) -> None:
    """The penumbra of a curtain whose edge is at x = 0, relative to its opacity."""
    ground = matt(square((-4.0, -4.0), (4.0, 4.0), 0.0))
    scene = SceneSnapshot(
        meshes=(ground,),
        casters=(ground,),
        grooms=(DrawnGroom("hair", curtain()),),
        lights=(Light.sun((0.0, 0.0, -1.0), WHITE, np.pi, ANGLE),),
    )
    found = shaded_row(mean_row(scene)[:, 1])
    assert found == pytest.approx(shaded_by_disk(), abs=0.08)


def still(snapshot: Snapshot, samples: int) -> np.ndarray:
    from hairloom.addon.render.card_pass import CardPass
    from hairloom.addon.render.frame import render_still
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass

    return render_still(
        snapshot,
        camera_above(),
        *(SIZE, SIZE, samples),
        center=np.zeros(3),
        passes=(MeshPass(), StrandPass()),
        card_pass=CardPass(),
    )


def test_a_still_is_shaded_softly(gpu_context: Any) -> None:
    ground = matt(square((-4.0, -4.0), (4.0, 4.0), 0.0))
    sun = Light.sun((0.0, 0.0, -1.0), WHITE, np.pi, ANGLE)
    shown = replace(curtain(), meshes=(ground,), lights=(sun,), ambient=(0.0, 0.0, 0.0))
    found = still(shown, 6)[SIZE // 2, :, 1]
    assert shaded_row(found) == pytest.approx(shaded_by_disk(), abs=0.08)


def test_the_samples_of_a_still_fill_its_pixels_evenly(gpu_context: Any) -> None:
    """In the light of a point light, they are the pixels of one larger picture."""
    from hairloom.addon.render.frame import render_image

    tilted = matt(square((-0.2, -0.1), (0.17, 0.21), 0.0))
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    surface = replace(tilted.surface, positions=np.float32(tilted.surface.positions @ turn))
    none = np.zeros((0, 3), np.float32)
    shown = Snapshot(
        none,
        none[:, 0],
        meshes=(replace(tilted, surface=surface),),
        lights=(Light.sun((0.0, 0.0, -1.0), WHITE, np.pi),),
    )
    expected = render_image(shown, camera_above(), SIZE, SIZE, 3)
    edge = (expected[..., 3] > 0.0) & (expected[..., 3] < 1.0)
    assert edge.sum() > 100
    assert still(shown, 3) == pytest.approx(expected, abs=1.0e-3)
