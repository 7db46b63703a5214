"""The scene's view transform, for drawing hair over a picture that Blender has drawn.

What Blender 5.2 applies in a 3D view (measured in its window, and equal to
DRW_viewport_colormanagement_set in its source):

    Wireframe, Solid                                        the transform "Standard" alone
    Material Preview, Rendered, with the scene's light      all settings of the scene
    the same with neither the scene's lights nor its world  transform and look alone
    Rendered with the engine Workbench                      all settings of the scene

A transform is found by having Blender save a picture with the colours of a table, in temporary data
that is outside of scenes and undo steps. That takes some hundredths of a second, and is done by a
timer, once for each combination; drawing only looks up existing tables.
"""

from __future__ import annotations

import errno
import tempfile
import traceback
from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...render.display import Display, DisplayTable, table_radiances
from ..base.redraw import redraw_views
from ..scene.lights import uses_scene_light

#: number of cached tables, 7 MB each; dropped ones are made again when needed
CAPACITY = 8
#: white balance: temperature [K] and tint
type WhiteBalance = tuple[float, float]


@dataclass(frozen=True)
class ColorView:
    """Settings that determine how colours are shown, except exposure and gamma; the key of a table.

    space: the scene-linear colour space of this file.
    curves: the RGB curves, see `_curves_of`; empty: none. Blender applies them before the
        exposure, which then is in the table too.
    """

    space: str = "Linear Rec.709"
    device: str = "sRGB"
    transform: str = "Standard"
    look: str = "None"
    white_balance: WhiteBalance | None = None
    curves: tuple[Any, ...] = ()
    exposure: float = 0.0


class _Tables:
    """tables: made so far, the last used at the end. requested: views that wait for their table, in
    order. problems: why a view cannot have one."""

    def __init__(self) -> None:
        self.tables: OrderedDict[ColorView, DisplayTable] = OrderedDict()
        self.requested: dict[ColorView, None] = {}
        self.problems: dict[ColorView, str] = {}


_tables = _Tables()


def display_of(shading: bpy.types.View3DShading, scene: bpy.types.Scene) -> Display | None:
    """How a 3D view shows colours; None: the plain "Standard".

    May be called while drawing, as it only looks tables up. A missing table is requested, and views
    are drawn again once it is made; until then the last one is used, so that nothing flickers while
    a curve is dragged.
    """
    view, gain, gamma = view_of(shading, scene)
    if (view, gain, gamma) == (ColorView(), 1.0, 1.0):
        return None
    if view in _tables.problems:
        return None
    if view in _tables.tables:
        _tables.tables.move_to_end(view)
    else:
        _request_table(view)
    return (
        Display(_tables.tables[next(reversed(_tables.tables))], gain, gamma)
        if _tables.tables
        else None
    )


def view_of(
    shading: bpy.types.View3DShading, scene: bpy.types.Scene
) -> tuple[ColorView, float, float]:
    """What this view applies: the key of its table, gain and gamma."""
    settings, space = scene.view_settings, bpy.data.colorspace.working_space
    device = scene.display_settings.display_device
    if shading.type not in ("MATERIAL", "RENDERED"):
        return ColorView(space, device), 1.0, 1.0
    view = ColorView(space, device, settings.view_transform, settings.look)
    is_workbench = shading.type == "RENDERED" and scene.render.engine == "BLENDER_WORKBENCH"
    if not is_workbench and not any(uses_scene_light(shading)):
        return view, 1.0, 1.0
    balance, curves = None, ()
    if settings.use_white_balance:
        balance = settings.white_balance_temperature, settings.white_balance_tint
    if settings.use_curve_mapping:
        curves = _curves_of(settings.curve_mapping)
    exposure = settings.exposure if curves else 0.0
    gain = 1.0 if curves else 2.0**settings.exposure
    view = replace(view, white_balance=balance, curves=curves, exposure=exposure)
    return view, gain, max(settings.gamma, 1e-3)


def prepare() -> None:
    """Make the tables of all open 3D views, before the first draw."""
    _tables.problems.clear()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                display_of(area.spaces.active.shading, window.scene)
    _make_requested()


def problem() -> str:
    """Why colours are shown by the plain "Standard" although another is set; usually empty."""
    return next(iter(_tables.problems.values()), "")


def clear_tables() -> None:
    """Drop all tables, and stop the timer."""
    _tables.tables.clear()
    _tables.requested.clear()
    _tables.problems.clear()
    if bpy.app.timers.is_registered(_make_requested):
        bpy.app.timers.unregister(_make_requested)


def _request_table(view: ColorView) -> None:
    _tables.requested[view] = None
    if not bpy.app.timers.is_registered(_make_requested):
        bpy.app.timers.register(_make_requested, first_interval=0.0)


def _make_requested() -> None:
    """A timer for Blender: make tables outside of drawing, where data may be created."""
    if not _tables.requested:
        return
    for view in tuple(_tables.requested):
        try:
            _tables.tables[view] = DisplayTable(apply_view_transform(view, table_radiances()))
        except Exception as error:
            traceback.print_exc()
            _tables.problems[view] = (
                f"View transform {view.transform} cannot be read ({error}), so hair is shown with "
                "Standard. Stop the preview and start it again."
            )
        del _tables.requested[view]
    while len(_tables.tables) > CAPACITY:
        _tables.tables.popitem(last=False)
    redraw_views()


def apply_view_transform(view: ColorView, radiances: Floats) -> Floats:
    """Code values in [0, 1] of scene-linear colours (..., 3), as Blender saves them; float32.

    Raises:
        OSError, RuntimeError: no picture can be written to the folder for temporary files.
        TypeError: this Blender has no such transform or look.
    """
    pixels = np.ones((radiances.size // 3, 4), np.float32)
    pixels[:, :3] = radiances.reshape(-1, 3)
    problem = _apply_in_blender(view, pixels)
    if problem is not None:
        raise problem
    return pixels[:, :3].reshape(radiances.shape)


def _apply_in_blender(view: ColorView, pixels: Floats) -> Exception | None:
    """Replace these scene-linear colours, (count, 4), by their code values.

    Returns:
        The error, without its traceback: that would refer to data that Blender has freed by then,
        and Blender crashes when Python's garbage collection finds it.
    """
    # the longest row that divides the colours and fits in a picture
    width = next(w for w in range(min(len(pixels), 8192), 0, -1) if len(pixels) % w == 0)
    with (
        tempfile.TemporaryDirectory(prefix="hairloom") as folder,
        bpy.data.temp_data() as data,
    ):
        path = Path(folder) / "colors.png"
        try:
            scene = _scene_with(view, data)
            colors = data.images.new("Colors", width, len(pixels) // width, float_buffer=True)
            colors.pixels.foreach_set(pixels.ravel())
            colors.save_render(str(path), scene=scene)
            shown = data.images.load(str(path))
            shown.colorspace_settings.is_data = True
            if len(shown.pixels) != pixels.size:
                return OSError(errno.ENOSPC, "a picture was written only in part", folder)
            shown.pixels.foreach_get(pixels.ravel())
        except Exception as error:
            return error.with_traceback(None)
    return None


def _scene_with(view: ColorView, data: bpy.types.BlendData) -> bpy.types.Scene:
    """A scene with these view settings, which saves 16 bits per channel."""
    scene = data.scenes.new("Colors")
    scene.display_settings.display_device = view.device
    settings = scene.view_settings
    settings.view_transform, settings.look = view.transform, view.look
    settings.exposure, settings.gamma = view.exposure, 1.0
    if view.white_balance is not None:
        settings.use_white_balance = True
        settings.white_balance_temperature, settings.white_balance_tint = view.white_balance
    if view.curves:
        settings.use_curve_mapping = True
        _set_curves(view.curves, settings.curve_mapping)
    picture = scene.render.image_settings
    picture.file_format, picture.color_mode, picture.color_depth = "PNG", "RGB", "16"
    picture.compression = 0
    return scene


def _curves_of(mapping: bpy.types.CurveMapping) -> tuple[Any, ...]:
    """Levels, tone, extension and clipping of RGB curves; then points (x, y, handle) of each."""
    curves = tuple(
        tuple((*point.location, point.handle_type) for point in curve.points)
        for curve in mapping.curves
    )
    levels = tuple(mapping.black_level), tuple(mapping.white_level)
    corners = mapping.clip_min_x, mapping.clip_min_y, mapping.clip_max_x, mapping.clip_max_y
    return (*levels, mapping.tone, mapping.extend, mapping.use_clip, corners, *curves)


def _set_curves(curves: tuple[Any, ...], mapping: bpy.types.CurveMapping) -> None:
    """Set RGB curves to the result of `_curves_of`; new curves have two points."""
    mapping.black_level, mapping.white_level, mapping.tone, mapping.extend = curves[:4]
    mapping.use_clip = False
    corners = curves[5]
    mapping.clip_min_x, mapping.clip_min_y, mapping.clip_max_x, mapping.clip_max_y = corners
    mapping.use_clip = curves[4]
    for curve, points in zip(mapping.curves, curves[6:], strict=True):
        for x, y, _ in points[len(curve.points) :]:
            curve.points.new(x, y)
        for point, (x, y, handle) in zip(curve.points, points, strict=True):
            point.location, point.handle_type = (x, y), handle
    mapping.update()
