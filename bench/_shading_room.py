"""Cycles in a scene of its own: strands of Principled Hair (Chiang's model), one sun, one camera.

The camera is at (0, 0, 1) times DISTANCE, looks down and is orthographic; or it is one of ours.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from hairloom.addon.render.camera import Camera

DISTANCE = 50.0


class CyclesRoom:
    """Cycles' pictures of strands: set strands, sun and hair first."""

    def __init__(self) -> None:
        self._scene = scene = bpy.data.scenes.new("Room")
        scene.render.engine = "CYCLES"
        cycles = scene.cycles
        cycles.device, cycles.use_adaptive_sampling = "CPU", False
        cycles.pixel_filter_type, cycles.light_sampling_threshold = "BOX", 0.0
        self.paths(16)
        cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
        scene.render.film_transparent = True
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.world = bpy.data.worlds.new("Dark")
        scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
        self._camera = self._new("Camera", bpy.data.cameras.new("Camera"))
        self._camera.data.type, self._camera.data.clip_end = "ORTHO", 2.0 * DISTANCE
        self._camera.location.z = DISTANCE
        scene.camera = self._camera
        self._sun = self._new("Sun", bpy.data.lights.new("Sun", "SUN"))
        self._sun.data.energy, self._sun.data.angle = 1.0, 0.0
        self._material = bpy.data.materials.new("Hair")
        nodes = self._material.node_tree.nodes
        self._node = nodes.new("ShaderNodeBsdfHairPrincipled")
        self._node.model, self._node.parametrization = "CHIANG", "ABSORPTION"
        surface = nodes["Material Output"].inputs["Surface"]
        self._material.node_tree.links.new(self._node.outputs[0], surface)
        self._strands: Any = None
        self._body: Any = None

    def _new(self, name: str, data: Any) -> Any:
        thing = bpy.data.objects.new(name, data)
        self._scene.collection.objects.link(thing)
        return thing

    def strands(
        self,
        points: np.ndarray,
        radius: float | np.ndarray,
        casts_shadow: bool = True,
        counts: np.ndarray | None = None,
    ) -> None:
        """Replace the strands: (strand_count, cv_count, 3), root first, with a radius or radii.
        Strands of different numbers of points, `counts`, are (point_count, 3).
        """
        curves = bpy.data.hair_curves.new("Strands")
        curves.add_curves(
            [points.shape[1]] * points.shape[0] if counts is None else counts.tolist()
        )
        curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
        width = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
        radii = np.broadcast_to(np.float32(radius), points.shape[:-1])
        width.data.foreach_set("value", radii.ravel())
        curves.materials.append(self._material)
        if self._strands is not None:
            bpy.data.objects.remove(self._strands)
        self._strands = self._new("Strands", curves)
        self._strands.visible_shadow = casts_shadow

    def body(
        self,
        positions: np.ndarray,
        triangles: np.ndarray,
        color: tuple[float, float, float] = (0.0, 0.0, 0.0),
        casts_shadow: bool = False,
    ) -> None:
        """A smooth Lambertian body; by default it is black and casts no shadow."""
        mesh = bpy.data.meshes.new("Body")
        mesh.from_pydata(positions.tolist(), [], triangles.tolist())
        mesh.shade_smooth()
        material = bpy.data.materials.new("Body")
        principled = material.node_tree.nodes["Principled BSDF"].inputs
        principled["Base Color"].default_value = (*color, 1.0)
        principled["Specular IOR Level"].default_value = 0.0
        mesh.materials.append(material)
        self._body = self._new("Body", mesh)
        self._body.visible_shadow = casts_shadow

    def leave_out_body(self, is_holdout: bool) -> None:
        """Whether the body is a holdout, so that alpha is the coverage of strands."""
        self._body.is_holdout = is_holdout

    def look(self, camera: Camera) -> None:
        """See through a perspective camera of ours, in square pictures."""
        lens = self._camera.data
        self._camera.matrix_world = Matrix(np.linalg.inv(camera.view).tolist())
        lens.type, lens.sensor_fit = "PERSP", "VERTICAL"
        lens.angle = 2.0 * float(np.arctan(1.0 / camera.projection[1, 1]))

    def paths(self, samples: int, bounces: int = 0, is_denoised: bool = False) -> None:
        """Paths per pixel, and bounces of each; 0 bounces: direct sunlight alone."""
        cycles = self._scene.cycles
        cycles.samples, cycles.use_denoising = samples, is_denoised
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
        cycles.transmission_bounces = bounces

    def tilt(self, angle: float) -> None:
        """Lift the strands' +X towards the camera [rad]."""
        self._strands.rotation_euler.y = -angle

    def sun(self, towards: np.ndarray, strength: float = 1.0) -> None:
        """Set the direction to the sun, and its strength [W/m^2]."""
        self._sun.data.energy = strength
        self._sun.rotation_euler = Vector(towards).to_track_quat("Z", "Y").to_euler()

    @property
    def blender_world(self) -> Any:
        return self._scene.world

    def world(self, radiance: np.ndarray) -> None:
        """Light from all around, as an Environment Texture: (rows, columns, 3), row 0 at the
        bottom."""
        tree, (rows, columns) = self._scene.world.node_tree, radiance.shape[:2]
        image = bpy.data.images.new("Panorama", columns, rows, float_buffer=True)
        image.colorspace_settings.name = "Linear Rec.709"
        pixels = np.concatenate([radiance, np.ones_like(radiance[..., :1])], axis=-1)
        image.pixels.foreach_set(pixels.astype(np.float32).ravel())
        image.update()
        background = tree.nodes["Background"]
        background.inputs["Strength"].default_value = 1.0
        node = tree.nodes.get("Panorama") or tree.nodes.new("ShaderNodeTexEnvironment")
        node.name, node.image = "Panorama", image
        tree.links.new(node.outputs["Color"], background.inputs["Color"])

    def hair(self, absorption: tuple[float, float, float], **inputs: float) -> None:
        """Principled Hair's inputs by their names, with _ for a space; angles in radians."""
        self._node.inputs["Absorption Coefficient"].default_value = absorption
        for name, value in inputs.items():
            self._node.inputs[name.replace("_", " ")].default_value = value

    def picture(self, size: int, height: float = 1.0, seed: int = 0) -> np.ndarray:
        """(size, size, 4) scene-linear, premultiplied, of a square `height` [m] high, which a
        camera of ours ignores.
        """
        render = self._scene.render
        render.resolution_x = render.resolution_y = size
        self._camera.data.ortho_scale, self._scene.cycles.seed = height, seed
        with tempfile.TemporaryDirectory() as folder:
            render.filepath = str(Path(folder) / "picture.exr")
            bpy.ops.render.render(write_still=True, scene=self._scene.name)
            image = bpy.data.images.load(render.filepath)
            pixels = np.array(image.pixels[:]).reshape(size, size, 4)
            bpy.data.images.remove(image)
        return pixels
