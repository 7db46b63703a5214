"""One picture of a render: the samples of one view layer, from one camera, with its passes."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...render import gpu_objects
from ...render.accumulation import Accumulation, Target
from ...render.camera import Camera
from ...render.camera_window import Window, jittered
from ...render.capabilities import NOISE_FREE_SAMPLES, capabilities
from ...render.lens import camera_through_lens
from ...render.nearest import Nearest, SceneAtTime, background, motion, projected, unprojected
from ...render.pixel_filter import jitters
from ...render.scene_pass import Rgba, ScenePass, SeparateShafts, shafts_of
from ...render.scene_snapshot import SceneSnapshot
from ...render.textures import texture_from
from ...shading.bright_shafts import wants_bright
from ...shading.picture_settings import PictureSettings
from ...strands.vectors import unit
from ..base.gpu_context import ensure_gpu
from ..properties.properties import settings_of
from . import hair_scene
from .engine_camera import border_window, camera_warnings, read_camera, read_lens
from .engine_mattes import Mattes
from .engine_passes import (
    COMBINED,
    DATA,
    DEPTH,
    NORMAL,
    OBJECT_INDEX,
    SHADOW,
    SHAFTS,
    STRAND_INDEX,
    TANGENT,
    VECTOR,
    empty_value,
    passes_in,
    write,
)
from .engine_picture import engine_picture
from .engine_scene import SceneReader

#: interval at which the picture so far is shown [s]
_UPDATE_INTERVAL = 1.0


_UNREADABLE_PICTURE = (
    "Light Shafts: bright things cast none, since the engine's picture could not be read. Turn "
    "Stereoscopy off, and render the scene that the hair belongs to."
)


@dataclass(frozen=True)
class SampleTime:
    """Samples that are taken at one time.

    time: [frames], relative to the rendered frame.
    offsets: (n, 2) the samples' offsets [pixels].
    """

    time: float
    offsets: Floats


def sample_times(
    settings: PictureSettings, render: bpy.types.RenderSettings
) -> tuple[SampleTime, ...]:
    """The samples distributed over the shutter time; all at one time without motion blur."""
    offsets = jitters(settings.samples, render.filter_size)
    steps = min(settings.motion_steps, settings.samples) if render.use_motion_blur else 1
    if steps == 1:
        return (SampleTime(0.0, offsets),)
    start = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[render.motion_blur_position]
    return tuple(
        SampleTime(
            render.motion_blur_shutter * (start + (step + 0.5) / steps), offsets[step::steps]
        )
        for step in range(steps)
    )


class Still:
    """Renders the views of one view layer.

    Args:
        engine: Blender's render engine, which shows progress and signals cancellation.

    Raises:
        HairloomError: no GPU, or a picture without pixels.
    """

    def __init__(self, engine: Any, depsgraph: bpy.types.Depsgraph) -> None:
        ensure_gpu()
        self._engine, self._depsgraph = engine, depsgraph
        self._render = depsgraph.scene.render
        self._settings = _noise_free(settings_of(depsgraph.scene.hairloom.picture, PictureSettings))
        self._full_size = engine.resolution_x, engine.resolution_y
        self._window: Window
        self._window, self._size = border_window(self._render, *self._full_size)
        self._reader, self._pass = SceneReader(), ScenePass()
        self._target, self._picture = Target(), Accumulation()
        drawn_scene = hair_scene.drawn_scene(depsgraph.scene)
        self._drawn_scene = drawn_scene
        self._shadow: tuple[Target, Accumulation] | None = None
        self._shafts = Accumulation()
        self._separate_shafts: SeparateShafts | None = None
        self._is_needed = drawn_scene is None or hair_scene.is_needed(drawn_scene)
        self._layer = depsgraph.view_layer
        self._mattes: Mattes | None = None
        self.warnings: tuple[str, ...] = ()

    def render_view(self, name: str) -> None:
        """Render the view of this name, which is empty without stereoscopy.

        Raises:
            HairloomError: there is no camera.
            ShaderError: a shader does not compile here.
        """
        engine, depsgraph = self._engine, self._depsgraph
        engine.active_view_set(name)
        result = engine.begin_result(0, 0, *self._size, layer=depsgraph.view_layer.name, view=name)
        try:
            if self._is_needed:
                self._fill(result)
            else:
                _fill_empty(result)
        finally:
            engine.end_result(result)
        for key, value in () if self._mattes is None else self._mattes.metadata.items():
            engine.get_result().stamp_data_add_field(key, value)

    def _fill(self, result: Any) -> None:
        blender_scene = self._depsgraph.scene
        # without time stretching, which frame_set applies itself
        frame = blender_scene.frame_current + blender_scene.frame_subframe
        moments = sample_times(self._settings, self._render)
        lens = read_lens(self._engine, self._depsgraph)
        through_lens = None if lens is None else lens.places(self._settings.samples)
        self._picture.begin(*self._size)
        passes = passes_in(result)
        if SHADOW.name in passes:
            self._shadow = Target(), Accumulation()
            self._shadow[1].begin(*self._size)
        last_update = time.monotonic()
        scene, camera = self._read_scene()
        self._separate_shafts = (
            None if self._drawn_scene is None else self._shafts_target(self._drawn_scene, scene)
        )
        if self._separate_shafts is not None:
            self._shafts.begin(*self._size)
        self._mattes = Mattes.of(passes, self._layer, *self._size)
        if DATA & passes.keys():
            self._add_data(passes, frame, scene, camera)
        for moment in moments:
            if self._engine.test_break():
                break
            if len(moments) > 1:
                self._set_frame(frame + moment.time)
                scene, camera = self._read_scene()
            for offset in moment.offsets:
                if self._engine.test_break():
                    break
                sample_camera = camera
                if lens is not None and through_lens is not None:
                    sample_camera = camera_through_lens(
                        camera, lens, through_lens[self._picture.count]
                    )
                self._add_sample(scene, sample_camera, offset)
                if time.monotonic() - last_update > _UPDATE_INTERVAL:
                    self._show(result)
                    self._engine.update_result(result)
                    last_update = time.monotonic()
        if len(moments) > 1:
            self._set_frame(frame)
        self._show(result)
        if self._mattes is not None:
            self._mattes.write(passes)

    def _shafts_target(
        self, drawn_scene: bpy.types.Scene, scene: SceneSnapshot
    ) -> SeparateShafts | None:
        """The target for shafts of light; None without any. Shafts from bright things also need the
        picture of Blender's own engine."""
        settings = shafts_of(scene)
        if settings is None:
            return None
        light = gpu_objects.texture(self._size, format="RGBA32F")
        if not wants_bright(settings):
            return SeparateShafts(light)
        left, bottom = (
            round(start * side)
            for start, side in zip(self._window[:2], self._full_size, strict=True)
        )
        picture = engine_picture(drawn_scene.original, self._full_size, (left, bottom), self._size)
        if picture is None:
            self.warnings = (*self.warnings, _UNREADABLE_PICTURE)
            return SeparateShafts(light)
        shows_world = not drawn_scene.render.film_transparent
        return SeparateShafts(light, texture_from(picture, "RGBA32F"), shows_world)

    def _read_scene(self) -> tuple[SceneSnapshot, Camera]:
        """Scene and camera as evaluated now."""
        camera = read_camera(self._engine, self._depsgraph, *self._full_size, self._window)
        scene = self._reader.read(self._depsgraph)
        warnings = (*self._reader.warnings, *camera_warnings(self._engine, self._depsgraph))
        self.warnings = tuple(
            dict.fromkeys((*self.warnings, *warnings, *_darkness_warnings(scene)))
        )
        return scene, camera

    def _set_frame(self, time_: float) -> None:
        frame = int(np.floor(time_))
        self._engine.frame_set(frame, time_ - frame)

    def _add_sample(self, scene: SceneSnapshot, camera: Camera, offset: Floats) -> None:
        jittered_camera = jittered(camera, offset, *self._size, sample=self._picture.count)
        scene = scene.at_sample(self._picture.count)
        sky = sky_of(scene, self._render)
        self._pass.draw(
            scene, jittered_camera, self._target, self._size, sky, self._separate_shafts
        )
        self.warnings = tuple(dict.fromkeys((*self.warnings, *self._pass.notes)))
        self._picture.add(self._target.color)
        if self._shadow is not None:
            target, shadow = self._shadow
            self._pass.draw_hair_shadow(scene, jittered_camera, target, self._size)
            shadow.add(target.color)
        if self._separate_shafts is not None:
            self._shafts.add(self._separate_shafts.light)
        if self._mattes is not None:
            self._mattes.add(
                *self._pass.coverages(scene, jittered_camera, self._target, self._size)
            )
        self._engine.update_progress(self._picture.count / self._settings.samples)
        self._engine.update_stats("", f"Sample {self._picture.count} of {self._settings.samples}")

    def _add_data(
        self, passes: dict[str, Any], frame: float, scene: SceneSnapshot, camera: Camera
    ) -> None:
        """Write the passes in DATA, of the nearest surface or strand at each pixel's centre, at the
        exact frame."""
        drawing = self._target, self._size
        nearest = self._pass.nearest(scene, camera, *drawing)
        if self._drawn_scene is not None:
            nearest = nearest.of_hair()
        make = {
            DEPTH.name: lambda: nearest.distances(camera),
            OBJECT_INDEX.name: lambda: nearest.object_numbers(scene),
            STRAND_INDEX.name: nearest.strand_numbers,
            TANGENT.name: lambda: unit(self._pass.tangents(scene, camera, *drawing)),
            NORMAL.name: lambda: nearest.normals(
                scene,
                camera,
                self._pass.on_meshes(
                    scene, [mesh.vertex_normals for mesh in scene.meshes], camera, *drawing
                ),
            ),
            VECTOR.name: lambda: self._motion(nearest, frame, scene, camera),
        }
        for name in DATA & passes.keys():
            write(passes[name], make[name]())

    def _motion(
        self, nearest: Nearest, frame: float, scene: SceneSnapshot, camera: Camera
    ) -> Floats:
        """The Vector pass: motion of the nearest surface or strand from the previous and to the
        next frame."""
        moments = {}
        for step in (-1, 1):
            self._set_frame(frame + step)
            moments[step] = SceneAtTime.of(scene, *self._read_scene())
        self._set_frame(frame)
        moments[0] = SceneAtTime.of(scene, scene, camera)
        # cards and the background only have the motion of the camera
        is_there, is_mesh = (nearest.depth < 1.0)[..., None], (nearest.mesh >= 0)[..., None]
        seen, behind = unprojected(camera, nearest.depth), background(camera, nearest.depth)
        static, pixels = np.where(is_there, seen, behind), {}
        for step, each in moments.items():
            drawing = camera, self._target, self._size
            meshes = np.where(is_mesh, self._pass.on_meshes(scene, each.meshes, *drawing), static)
            points = nearest.on_strands(each.grooms, meshes)
            pixels[step] = projected(each.camera, points, self._size)
        return motion(pixels[-1], pixels[0], pixels[1])

    def _show(self, result: Any) -> None:
        passes = passes_in(result)
        write(passes[COMBINED.name], self._picture.mean())
        if self._shadow is not None:
            write(passes[SHADOW.name], self._shadow[1].mean()[..., :3])
        if self._separate_shafts is not None:
            write(passes[SHAFTS.name], self._shafts.mean()[..., :3])


def _fill_empty(result: Any) -> None:
    """Fill all passes with their empty values, so that compositing them changes nothing."""
    for name, each in passes_in(result).items():
        write(each, np.full(len(each.rect) * each.channels, empty_value(name)))


def _noise_free(settings: PictureSettings) -> PictureSettings:
    """The settings, with enough samples for hashed strands where the GPU cannot draw layers."""
    if capabilities().image_atomics:
        return settings
    return replace(settings, samples=max(settings.samples, NOISE_FREE_SAMPLES))


def sky_of(scene: SceneSnapshot, render: bpy.types.RenderSettings) -> Rgba:
    """The background colour, premultiplied."""
    return (0.0, 0.0, 0.0, 0.0) if render.film_transparent else (*scene.ambient, 1.0)


def _darkness_warnings(scene: SceneSnapshot) -> tuple[str, ...]:
    if scene.lights or any(scene.ambient):
        return ()
    return (
        "Lights: there is no light and the world is black, so the picture is black. Add a "
        "light, or give the world a colour.",
    )
