"""Samples are distributed by the filter's weights, and cameras are shifted by them."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.camera_window import cropped, jittered, view_depth
from hairloom.addon.render.pixel_filter import jitters

CAMERAS = [
    Camera(look_at((0.3, -2.0, 0.5), (0.0, 0.0, 0.0)), perspective(0.7, 1.5, 0.1, 10.0)),
    Camera(look_at((0.3, -2.0, 0.5), (0.0, 0.0, 0.0)), orthographic(1.2, 1.5, 0.1, 10.0)),
]


def seen_at(camera: Camera, point: np.ndarray, width: int, height: int) -> np.ndarray:
    clip = camera.projection @ camera.view @ np.append(point, 1.0)
    return (clip[:2] / clip[3] + 1.0) / 2.0 * (width, height)


def test_the_first_sample_is_the_middle_and_more_begin_with_fewer() -> None:
    places = jitters(64, 1.5)
    np.testing.assert_allclose(places[0], 0.0, atol=1e-9)
    np.testing.assert_array_equal(jitters(8, 1.5), places[:8])
    assert np.abs(places).max() < 0.75


def test_samples_have_the_moments_of_the_filter() -> None:
    """Against the moments of the Blackman-Harris window, integrated here."""
    x = np.linspace(-0.5, 0.5, 20001)
    weight = (
        0.35875
        + 0.48829 * np.cos(2.0 * np.pi * x)
        + 0.14128 * np.cos(4.0 * np.pi * x)
        + 0.01168 * np.cos(6.0 * np.pi * x)
    )
    places = jitters(4096, 2.0) / 2.0
    for power in (1, 2, 4):
        expected = (weight * x**power).sum() / weight.sum()
        np.testing.assert_allclose((places**power).mean(axis=0), expected, atol=5e-4)
    assert abs(np.corrcoef(places.T)[0, 1]) < 0.01


def test_samples_lie_more_evenly_than_chance() -> None:
    """Each side of an axis has half of 64 samples, to within two."""
    places = jitters(64, 1.5)
    assert (np.abs((places > 0.0).sum(axis=0) - 32) <= 2).all()


@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "orthographic"])
def test_a_jittered_pixel_looks_beside_its_middle(camera: Camera) -> None:
    point = np.array([0.1, 0.2, -0.1])
    before = seen_at(camera, point, 300, 200)
    after = seen_at(jittered(camera, np.array([0.3, -0.4]), 300, 200), point, 300, 200)
    np.testing.assert_allclose(after - before, (-0.3, 0.4), atol=1e-9)


@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "orthographic"])
def test_a_window_is_that_part_of_the_picture(camera: Camera) -> None:
    point = np.array([0.1, 0.2, -0.1])
    whole = seen_at(camera, point, 300, 200)
    part = seen_at(cropped(camera, (0.2, 0.1, 0.7, 0.9)), point, 150, 160)
    np.testing.assert_allclose(part, whole - (60.0, 20.0), atol=1e-9)
    with pytest.raises(ValueError, match="window"):
        cropped(camera, (0.5, 0.0, 0.5, 1.0))


@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "orthographic"])
def test_depth_is_the_distance_along_the_view(camera: Camera) -> None:
    point = np.array([0.1, 0.2, -0.1, 1.0])
    clip = camera.projection @ camera.view @ point
    found = view_depth(camera, (clip[2:3] / clip[3] + 1.0) / 2.0)
    np.testing.assert_allclose(found, -(camera.view @ point)[2], rtol=1e-9)
