"""Hashed alpha over samples: one sample shows a pattern, the mean converges to alpha."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.hashed_alpha import shifts
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE, SAMPLES = 32, 64


def camera_of() -> Any:
    view = look_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    return Camera(view, orthographic(1.0, 1.0, 0.0, 3.0))


def sheet(height: float, color: tuple[float, float, float], **looks: Any) -> Any:
    """A square that fills the picture and faces up, or down if `turned`."""
    corners = np.float32([[-1, -1, height], [1, -1, height], [1, 1, height], [-1, 1, height]])
    triangles = np.int32([[0, 1, 2], [0, 2, 3]])
    if looks.pop("turned", False):
        triangles = triangles[:, ::-1].copy()
    up = np.tile(np.float32([0, 0, 1]), (4, 1))
    surface = Surface(corners, triangles)
    return MeshSnapshot(surface, up, color=color, specular=0.0, **looks)


def samples_of(frame: Any, snapshot: Any, camera: Any, count: int) -> np.ndarray:
    """Each sample of a picture, (count, height, width, 4)."""
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass

    passes = MeshPass(), StrandPass()
    return np.array(
        [
            frame.render_image(
                snapshot, replace(camera, sample=sample), SIZE, SIZE, 1, passes=passes
            )
            for sample in range(count)
        ]
    )


def scene_of(*meshes: Any) -> Any:
    none = np.zeros((0, 2, 3), np.float32)
    return Snapshot(none, none[..., 0], meshes=meshes, ambient=(1.0, 1.0, 1.0))


def test_the_first_sample_is_the_pattern_of_the_paper(frame: Any) -> None:
    """Against interleaved gradient noise (Jimenez 2014)."""
    red = sheet(0.0, (1.0, 0.0, 0.0), alpha=0.4, transparency="hashed")
    (seen,) = samples_of(frame, scene_of(red), camera_of(), 1)
    y, x = np.mgrid[:SIZE, :SIZE]
    noise = (52.9829189 * ((0.06711056 * x + 0.00583715 * y) % 1.0)) % 1.0
    is_sure = np.abs(noise - 0.4) > 1e-3
    np.testing.assert_array_equal((seen[..., 3] == 1.0)[is_sure], (noise < 0.4)[is_sure])


@pytest.mark.parametrize("turned", [False, True])
def test_many_samples_are_as_dense_as_alpha_in_each_pixel(frame: Any, turned: bool) -> None:
    """For two sheets before a floor, which show the same side or not, against composited alpha."""
    hashed: dict[str, Any] = {"alpha": 0.4, "transparency": "hashed"}
    red = sheet(0.2, (1.0, 0.0, 0.0), **hashed)
    green = sheet(0.0, (0.0, 1.0, 0.0), turned=turned, **hashed)
    floor = sheet(-0.2, (0.0, 0.0, 1.0))
    samples = samples_of(frame, scene_of(red, green, floor), camera_of(), SAMPLES)
    expected = (0.4, 0.6 * 0.4, 0.6 * 0.6)
    errors = [
        np.abs(samples[:count].mean(axis=0)[..., :3] - expected).max() for count in (1, SAMPLES)
    ]
    assert errors[0] > 0.5 and errors[1] < 0.08, errors


def test_hashed_strands_come_to_what_they_cover(frame: Any) -> None:
    """Their noise decreases with the square root of the number of samples."""
    x = np.linspace(-0.4, 0.4, 40)
    strands = np.zeros((40, 2, 3), np.float32)
    strands[:, :, 0] = x[:, None]
    strands[:, :, 1] = (-0.45, 0.45)
    radius = np.full((40, 2), 0.006, np.float32)
    settings = StrandSettings(tip_width=1.0, opacity=0.6, transparency="layers")
    shown = Snapshot(strands, radius, ambient=(1.0, 1.0, 1.0), lights=(), strand_settings=settings)
    hashed = replace(shown, strand_settings=replace(settings, transparency="hashed"))
    exact = samples_of(frame, shown, camera_of(), 1)[0, ..., 3]
    alphas = samples_of(frame, hashed, camera_of(), SAMPLES)[..., 3]
    noise = [np.abs(alphas[:count].mean(axis=0) - exact).mean() for count in (1, SAMPLES)]
    assert noise[0] > 0.05 and noise[1] < 0.2 * noise[0], noise


def test_sequences_fill_evenly_and_differ() -> None:
    found = np.array([[shifts(number, k) for k in range(SAMPLES)] for number in range(5)])
    assert (found[:, 0] == 0.0).all() and (found >= 0.0).all() and (found < 1.0).all()
    sequences = np.concatenate([found[:4, :, 0], found[:4, :, 1]])
    counts = [np.histogram(each, 4, (0.0, 1.0))[0] for each in sequences]
    assert np.ptp(counts, axis=1).max() <= 8
    assert np.abs(np.corrcoef(sequences) - np.eye(8)).max() < 0.4
    np.testing.assert_array_equal(found[4], found[0])
