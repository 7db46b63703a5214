"""Depth of field, against the optics of a thin lens."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.lens import Lens, camera_through_lens

EYE, TARGET = np.array([0.3, -2.0, 0.5]), np.array([0.0, 0.0, 0.2])
FORWARD = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
CAMERAS = (
    Camera(look_at(EYE, TARGET), perspective(0.6, 1.5, 0.1, 10.0)),
    Camera(look_at(EYE, TARGET), orthographic(1.0, 1.5, 0.1, 10.0)),
)


def shown(camera: Camera, point: Floats) -> Floats:
    clip = camera.projection @ camera.view @ np.append(point, 1.0)
    return clip[:2] / clip[3]


@pytest.mark.parametrize("camera", CAMERAS)
def test_points_in_focus_stay_and_others_spread(camera: Camera) -> None:
    """Against similar triangles: a place p on the lens moves a point by p (1 - depth / focus)."""
    lens = Lens(radius=0.03, focus=1.7)
    right, up = camera.view[0, :3], camera.view[1, :3]
    for depth in (1.0, 1.7, 4.0):
        point = EYE + depth * FORWARD + 0.1 * right - 0.2 * up
        for place in lens.places(20):
            seen = shown(camera_through_lens(camera, lens, place), point)
            moved = point - (1.0 - depth / lens.focus) * (place[0] * right + place[1] * up)
            np.testing.assert_allclose(seen, shown(camera, moved), atol=1e-9)


def test_the_eye_goes_to_its_place_of_the_lens() -> None:
    camera, place = CAMERAS[0], np.array([0.02, -0.01])
    moved = camera_through_lens(camera, Lens(0.03, 1.0), place)
    right, up = camera.view[0, :3], camera.view[1, :3]
    np.testing.assert_allclose(moved.eye[:3], EYE + place[0] * right + place[1] * up, atol=1e-12)
    turn = moved.view[:3, :3]
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("blades", [0, 2, 3, 5, 8])
def test_samples_are_even_over_the_aperture(blades: int) -> None:
    """Against the moments of a disk, or of a regular polygon."""
    lens = Lens(radius=2.0, focus=1.0, blades=blades, rotation=0.4)
    places = lens.places(4096)
    np.testing.assert_array_equal(places[0], 0.0)
    np.testing.assert_array_equal(places[:100], lens.places(100))
    assert np.linalg.norm(places, axis=1).max() <= 2.0 + 1e-12
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=0.01)
    # mean squared distance from the centre: R^2 / 2; of a polygon R^2 (2 + cos(2 pi / n)) / 6
    square = 2.0 if blades < 3 else 4.0 * (2.0 + np.cos(2.0 * np.pi / blades)) / 6.0
    assert (places**2).sum(axis=1).mean() == pytest.approx(square, rel=0.01)
    if blades >= 3:
        # no place lies beyond a side
        for side in range(blades):
            angle = 0.4 + (side + 0.5) * 2.0 * np.pi / blades
            along = places @ [np.cos(angle), np.sin(angle)]
            assert along.max() <= 2.0 * np.cos(np.pi / blades) + 1e-12


def test_an_anamorphic_aperture_is_narrow() -> None:
    round_, narrow = Lens(1.0, 1.0).places(50), Lens(1.0, 1.0, ratio=2.0).places(50)
    np.testing.assert_allclose(narrow, round_ * [0.5, 1.0])
