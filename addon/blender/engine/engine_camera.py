"""The camera and lens of a render, for the renderer."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...render.camera import Camera
from ...render.camera_window import Window, cropped
from ...render.lens import Lens

#: Blender's own minimum of a picture's side [pixels]
_MIN_SIZE = 1
#: minimum f-stop, as in Cycles
_MIN_F_STOP = 1.0e-5


def read_camera(
    engine: Any, depsgraph: bpy.types.Depsgraph, width: int, height: int, window: Window
) -> Camera:
    """The active camera, for the view that is rendered.

    Args:
        width, height: of the full picture [pixels].
        window: the part of it that is drawn.

    Raises:
        HairloomError: there is no camera.
    """
    camera = _active_camera(engine, depsgraph)
    if camera is None:
        raise HairloomError(
            "there is no camera", place=depsgraph.scene.name, remedy="Add one (Add > Camera)"
        )
    evaluated = camera.evaluated_get(depsgraph)
    render = depsgraph.scene.render
    projection = np.array(
        evaluated.calc_matrix_camera(
            depsgraph,
            x=width,
            y=height,
            scale_x=render.pixel_aspect_x,
            scale_y=render.pixel_aspect_y,
        )
    )
    # the two eyes of a stereo camera look through shifted windows
    shift = engine.camera_shift_x(evaluated) - evaluated.data.shift_x
    projection[0] -= (
        2.0 * shift * _fit_fraction(evaluated.data, render, width, height) * projection[3]
    )
    matrix = np.array(engine.camera_model_matrix(evaluated)).reshape(4, 4)
    return cropped(Camera(_view_matrix(matrix), projection), window)


def _active_camera(engine: Any, depsgraph: bpy.types.Depsgraph) -> bpy.types.Object | None:
    """The active camera; None if the scene has none, or an object of another type."""
    camera = engine.camera_override or depsgraph.scene.camera
    return camera if camera is not None and camera.type == "CAMERA" else None


def read_lens(engine: Any, depsgraph: bpy.types.Depsgraph) -> Lens | None:
    """The lens of the active camera; None without depth of field."""
    camera = _active_camera(engine, depsgraph)
    if camera is None or not camera.data.dof.use_dof:
        return None
    evaluated = camera.evaluated_get(depsgraph)
    data = evaluated.data
    # the radius as in Cycles; Blender's focal length is in millimetres
    focal_length = 1.0 if data.type == "ORTHO" else 1.0e-3 * data.lens
    radius = focal_length / (2.0 * max(data.dof.aperture_fstop, _MIN_F_STOP))
    focus = _focus_distance(evaluated, depsgraph)
    if not (radius > 0.0 and focus > 0.0 and np.isfinite(focus)):
        return None
    dof = data.dof
    # Cycles' blades turn clockwise in the picture
    return Lens(radius, focus, dof.aperture_blades, -dof.aperture_rotation, dof.aperture_ratio)


def _focus_distance(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> float:
    """The distance along the view [m] to the focus object, or the camera's focus distance."""
    dof = camera.data.dof
    if dof.focus_object is None:
        return float(dof.focus_distance)
    target = dof.focus_object.evaluated_get(depsgraph)
    matrix = target.matrix_world
    if target.type == "ARMATURE" and dof.focus_subtarget in target.pose.bones:
        matrix = matrix @ target.pose.bones[dof.focus_subtarget].matrix
    in_view = camera.matrix_world.normalized().inverted() @ matrix.translation
    return float(abs(in_view.z))


def camera_warnings(engine: Any, depsgraph: bpy.types.Depsgraph) -> tuple[str, ...]:
    """Warnings about the camera, each with its remedy; mostly none."""
    camera = _active_camera(engine, depsgraph)
    if camera is None or camera.data.type != "PANO":
        return ()
    return (
        f"{camera.name}: panoramic cameras are not drawn, this is a perspective one. Set its "
        "Type to Perspective or Orthographic.",
    )


def border_window(
    render: bpy.types.RenderSettings, width: int, height: int
) -> tuple[Window, tuple[int, int]]:
    """The part of the picture that is rendered, and its width and height [pixels].

    Raises:
        HairloomError: the part has no pixels.
    """
    left, bottom, right, top = 0, 0, width, height
    if render.use_border:
        # single precision, as in Blender, where 0.9 of 120 pixels are 108
        x, y = np.float32(width), np.float32(height)
        left, right = (int(x * np.float32(b)) for b in (render.border_min_x, render.border_max_x))
        bottom, top = (int(y * np.float32(b)) for b in (render.border_min_y, render.border_max_y))
    size = right - left, top - bottom
    if min(size) < _MIN_SIZE:
        raise HairloomError(
            f"the picture has {max(size[0], 0)} x {max(size[1], 0)} pixels",
            place="render",
            remedy="Set a larger resolution, or clear the render region (Ctrl Alt B)",
        )
    return (left / width, bottom / height, right / width, top / height), size


def view_rectangle(
    context: Any, depsgraph: bpy.types.Depsgraph, width: int, height: int
) -> tuple[int, int, int, int]:
    """The part of a 3D view that is drawn: its render region, or that of the scene in camera view.

    Args:
        width, height: of the view [pixels].

    Returns:
        Left, bottom, width and height [pixels]; width or height are 0 if the region has no pixels
        inside the view.
    """
    space, region, scene = context.space_data, context.region_data, depsgraph.scene
    corners = np.array([[0.0, 0.0], [1.0, 1.0]])
    if region.view_perspective != "CAMERA":
        if space.use_render_border:
            corners = _border(space, "render_border")
    elif scene.render.use_border:
        camera = space.camera or scene.camera
        if camera is not None and camera.type == "CAMERA":
            frame = _camera_frame(camera.evaluated_get(depsgraph), scene, region)
            corners = frame[0] + _border(scene.render, "border") * (frame[1] - frame[0])
    low, high = np.clip(corners * (width, height), 0, (width, height)).round().astype(int)
    size = np.maximum(high - low, 0)
    return int(low[0]), int(low[1]), int(size[0]), int(size[1])


def _border(owner: Any, name: str) -> Floats:
    """The lower left and upper right corner of a border, (2, 2), as fractions of the picture."""
    return np.array(
        [[getattr(owner, f"{name}_{end}_{axis}") for axis in "xy"] for end in ("min", "max")]
    )


def _camera_frame(camera: bpy.types.Object, scene: bpy.types.Scene, region: Any) -> Floats:
    """The lower left and upper right corner of a camera's frame, as fractions of its 3D view."""
    frame = np.array([(*corner, 1.0) for corner in camera.data.view_frame(scene=scene)])
    clip = frame @ np.array(region.window_matrix).T
    corners = 0.5 + 0.5 * clip[:, :2] / clip[:, 3:]
    return np.array([corners.min(axis=0), corners.max(axis=0)])


def _view_matrix(matrix: Floats) -> Floats:
    """From world to view space, (4, 4), by a camera's matrix without its scale."""
    rigid = np.eye(4)
    rigid[:3, :3] = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    rigid[:3, 3] = matrix[:3, 3]
    return np.linalg.inv(rigid)


def _fit_fraction(
    camera: bpy.types.Camera, render: bpy.types.RenderSettings, width: int, height: int
) -> float:
    """The side of the picture that camera shifts are measured in, relative to its width."""
    wide, high = width * render.pixel_aspect_x, height * render.pixel_aspect_y
    fits_width = camera.sensor_fit == "HORIZONTAL" or (camera.sensor_fit == "AUTO" and wide >= high)
    return 1.0 if fits_width else high / wide
