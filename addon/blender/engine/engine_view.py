"""The viewport in Rendered mode: a picture that accumulates samples while nothing changes."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, replace
from typing import Any

import bpy
import gpu
import numpy as np

from ...render.accumulation import Accumulation, Target
from ...render.camera import Camera
from ...render.camera_window import Window, cropped, jittered
from ...render.pixel_filter import jitters
from ...render.scene_pass import ScenePass
from ...render.scene_snapshot import DrawnGroom, SceneSnapshot
from ...render.snapshot import Snapshot
from ...shading.lights import three_point_lights
from ...shading.mesh_shadow_settings import MeshShadowSettings
from ...shading.picture_settings import PictureSettings
from ..base import latest_job
from ..base.gpu_context import schedule_free_unused
from ..properties.properties import settings_of
from ..scene.lights import uses_scene_light
from ..sessions.snapshots import with_all_strands
from ..viewport import overlay
from . import engine_hair
from .engine_camera import view_rectangle
from .engine_scene import SceneReader, Visibility
from .engine_still import sky_of


@dataclass(frozen=True, eq=False)
class _SampleInputs:
    """All inputs of a sample; samples with equal inputs accumulate.

    scene: with the previewed hair in it.
    keys: values and objects; whenever the picture changes, so does one of them.
    """

    scene: SceneSnapshot
    camera: Camera
    keys: tuple[Any, ...]

    def is_same_as(self, other: _SampleInputs | None) -> bool:
        return (
            other is not None
            and len(self.keys) == len(other.keys)
            and all(a is b or a == b for a, b in zip(self.keys, other.keys, strict=True))
        )


class EngineView:
    """One 3D view that is drawn by the engine."""

    def __init__(self) -> None:
        # Blender drops this when the view leaves Rendered mode, and may never draw with it again
        weakref.finalize(self, schedule_free_unused).atexit = False
        self._reader, self._pass = SceneReader(), ScenePass()
        self._target, self._picture = Target(), Accumulation()
        self._scene: SceneSnapshot | None = None
        self._inputs: _SampleInputs | None = None
        self._previewed: tuple[frozenset[int], ...] = ()
        self._local_view: int = 0

    def read(self, context: Any, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what Blender has evaluated again."""
        changed = {update.id.original.session_uid for update in depsgraph.updates}
        self._read(context, depsgraph, changed if self._scene is not None else None)

    def draw(self, context: Any, depsgraph: bpy.types.Depsgraph) -> tuple[int, int]:
        """Add a sample to the picture unless it has all, and draw it.

        Returns:
            the number of samples so far, and the final number.
        """
        space, render = context.space_data, depsgraph.scene.render
        local_view = space.local_view.as_pointer() if space.local_view else 0
        has_other_content = self._previewed != _previewed() or self._local_view != local_view
        if self._scene is None or has_other_content or self._has_new_hair:
            self._read(context, depsgraph, None if self._scene is None else set())
        settings = settings_of(depsgraph.scene.hairloom.picture, PictureSettings)
        left, bottom, width, height = gpu.state.viewport_get()
        x, y, *size = view_rectangle(context, depsgraph, width, height)
        if not all(size):
            return settings.viewport_samples, settings.viewport_samples
        window = x / width, y / height, (x + size[0]) / width, (y + size[1]) / height
        inputs = self._sample_inputs(context, render, size, window)
        if not inputs.is_same_as(self._inputs) or self._picture.size != tuple(size):
            self._picture.begin(*size)
        self._inputs = inputs
        if self._picture.count < settings.viewport_samples:
            self._add_sample(inputs, render)
        # outside the render region Blender's background stays
        gpu.state.viewport_set(left + x, bottom + y, *size)
        self._picture.show(left + x, bottom + y)
        gpu.state.viewport_set(left, bottom, width, height)
        return self._picture.count, settings.viewport_samples

    def _add_sample(self, inputs: _SampleInputs, render: bpy.types.RenderSettings) -> None:
        size, number = self._picture.size, self._picture.count
        offset = jitters(number + 1, render.filter_size)[-1]
        camera = jittered(inputs.camera, offset, *size, number)
        scene = inputs.scene.at_sample(number)
        self._pass.draw(scene, camera, self._target, size, sky_of(scene, render))
        self._picture.add(self._target.color)

    @property
    def is_waiting(self) -> bool:
        """Whether hair is being built that the picture does not show yet."""
        return bool(self._reader.pending or overlay.pending_uids())

    @property
    def _has_new_hair(self) -> bool:
        return not all(engine_hair.is_pending(uid) for uid in self._reader.pending)

    @property
    def count(self) -> int:
        """The number of samples so far."""
        return self._picture.count

    @property
    def warnings(self) -> tuple[str, ...]:
        return (*self._reader.warnings, *self._pass.notes)

    def _read(self, context: Any, depsgraph: bpy.types.Depsgraph, changed: set[int] | None) -> None:
        space = context.space_data
        self._local_view = space.local_view.as_pointer() if space.local_view else 0
        self._previewed = drawn, pending = _previewed()
        self._scene = self._reader.read(
            depsgraph,
            changed=changed,
            is_shown=lambda obj: obj.visible_in_viewport_get(space),
            is_previewed=drawn.__contains__,
            has_pending_preview=pending.__contains__,
            blocking=latest_job.is_blocking(),
        )

    def _sample_inputs(
        self, context: Any, render: bpy.types.RenderSettings, size: list[int], window: Window
    ) -> _SampleInputs:
        assert self._scene is not None
        space, view = context.space_data, context.region_data
        whole = Camera(np.array(view.view_matrix), np.array(view.window_matrix))
        camera = cropped(whole, window)
        visible = Visibility(is_seen=True, is_holdout=False, casts_shadow=True)
        found = (
            (*each, self._reader.previewed.get(each[0], visible))
            for each in overlay.shown_in(context)
            if each[1].is_made
        )
        previewed = tuple(
            DrawnGroom((uid,), with_all_strands(drawing.snapshot), is_holdout=visibility.is_holdout)
            for uid, drawing, visibility in found
            if visibility.is_seen
        )
        shadows = settings_of(context.scene.hairloom.mesh_shadows, MeshShadowSettings)
        grooms = (*self._scene.grooms, *previewed)
        scene = replace(self._scene, grooms=grooms, mesh_shadows=shadows)
        uses_scene = uses_scene_light(space.shading)
        if not all(uses_scene):
            scene = overlay.with_view_lights(scene, space.shading, three_point_lights(camera.view))
        keys = (
            *(self._scene, shadows),
            *(drawing.snapshot for _, drawing in overlay.shown_in(context)),
            *(_points_version(groom.snapshot) for groom in previewed),
            *((groom.key, groom.is_holdout) for groom in previewed),
            camera.view.tobytes(),
            camera.projection.tobytes(),
            (*uses_scene, render.film_transparent, render.filter_size, *size),
            (scene.lights, scene.ambient),
            b"" if scene.harmonics is None else scene.harmonics.tobytes(),
        )
        return _SampleInputs(scene, camera, keys)


def _previewed() -> tuple[frozenset[int], ...]:
    """Session numbers of grooms that are previewed, and of those that are about to be."""
    return overlay.drawn_uids(), overlay.pending_uids()


def _points_version(snapshot: Snapshot) -> int:
    """A number that grows whenever the GPU computes new points into the same texture."""
    return 0 if snapshot.device_points is None else snapshot.device_points.serial
