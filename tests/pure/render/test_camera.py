"""Cameras: matrices tested by the points that they project."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, frame_camera, look_at, orthographic, perspective


def projected(camera: Camera, points: np.ndarray) -> np.ndarray:
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    clip = homogeneous @ (camera.projection @ camera.view).T
    return clip[:, :3] / clip[:, 3:]


def test_look_at_puts_the_target_ahead_and_up_upwards() -> None:
    view = look_at((3.0, -4.0, 1.0), (1.0, 1.0, 2.0))
    assert view[:3, :3] @ view[:3, :3].T == pytest.approx(np.eye(3))
    assert np.linalg.det(view) == pytest.approx(1.0)
    assert view @ [3.0, -4.0, 1.0, 1.0] == pytest.approx([0.0, 0.0, 0.0, 1.0])
    distance = np.linalg.norm([2.0, -5.0, -1.0])
    assert view @ [1.0, 1.0, 2.0, 1.0] == pytest.approx([0.0, 0.0, -distance, 1.0])
    above = view @ [1.0, 1.0, 2.5, 1.0]
    assert above[0] == pytest.approx(0.0) and above[1] > 0.0


def test_look_at_refuses_a_view_without_direction() -> None:
    with pytest.raises(ValueError, match="no view"):
        look_at((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="no view"):
        look_at((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def test_perspective_maps_its_frustum_to_the_unit_cube() -> None:
    camera = Camera(np.eye(4), perspective(np.radians(40.0), 1.5, 0.5, 20.0))
    slope = np.tan(np.radians(20.0))
    corners = np.array([[1.5 * slope * d, slope * d, -d] for d in (0.5, 20.0)])
    assert projected(camera, corners) == pytest.approx(np.array([[1, 1, -1], [1, 1, 1.0]]))


def test_orthographic_maps_its_box_to_the_unit_cube() -> None:
    camera = Camera(np.eye(4), orthographic(4.0, 2.0, 1.0, 9.0))
    corners = np.array([[4.0, 2.0, -1.0], [-4.0, -2.0, -9.0]])
    assert projected(camera, corners) == pytest.approx(np.array([[1, 1, -1], [-1, -1, 1.0]]))


def test_eye_of_either_kind_of_camera() -> None:
    view = look_at((3.0, -4.0, 1.0), (0.0, 0.0, 0.0))
    seen = Camera(view, perspective(0.5, 1.0, 0.1, 10.0)).eye
    assert seen == pytest.approx([3.0, -4.0, 1.0, 1.0])
    far = Camera(view, orthographic(2.0, 1.0, 0.1, 10.0)).eye
    assert far == pytest.approx([*np.array([3.0, -4.0, 1.0]) / np.sqrt(26.0), 0.0])


@pytest.mark.parametrize("direction", [(0.0, -1.0, 0.0), (-0.5, -1.0, 0.2), (1.0, 0.3, -0.8)])
@pytest.mark.parametrize("size", [(0.2, 0.3, 0.4), (10.0, 0.1, 0.1), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("aspect", [0.6, 1.0, 1.8])
def test_framing_holds_the_box_tightly(direction, size, aspect) -> None:
    low = np.array([5.0, -2.0, 1.0])
    high = low + size
    camera = frame_camera((low, high), direction, np.radians(30.0), aspect, margin=1.0)
    corners = low + np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    seen = projected(camera, corners)
    assert np.abs(seen).max() <= 1.0 + 1e-9
    if max(size) > 0.0:
        assert np.abs(seen[:, :2]).max() == pytest.approx(1.0)
