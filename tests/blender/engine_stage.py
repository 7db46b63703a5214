"""The scene for tests of the render engine, and its renders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

SIZE = 64


def set_world(color: tuple[float, float, float]) -> None:
    tree = bpy.context.scene.world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (*color, 1.0)
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])


def background_node(scene: Any) -> Any:
    return next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")


def set_panorama(scene: Any, radiance: np.ndarray, kind: str = "EQUIRECTANGULAR") -> Any:
    """Light the world with a panorama of these pixels, row 0 at the bottom; returns its node."""
    rows, columns = radiance.shape[:2]
    image = bpy.data.images.new("Panorama", columns, rows, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    pixels = np.concatenate([radiance, np.ones_like(radiance[..., :1])], axis=-1)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    tree = scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image, node.projection = image, kind
    tree.links.new(node.outputs["Color"], background_node(scene).inputs["Color"])
    return node


def add_ball(radius: float = 0.15, color: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Any:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=48, ring_count=24)
    ball = bpy.context.object
    material = bpy.data.materials.new("Diffuse")
    material.node_tree.nodes.clear()
    diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*color, 1.0)
    ball.data.materials.append(material)
    return ball


def render_passes(folder: Path) -> dict[str, np.ndarray]:
    """Render, and read back all passes with `read_passes`."""
    scene = bpy.context.scene
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth = "32"
    path = folder / "picture.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read_passes(path) if path.is_file() else {}


def read_passes(path: Path) -> dict[str, np.ndarray]:
    """All passes of a file: name -> (height, width, channels), row 0 at the bottom."""
    import OpenImageIO

    found = {}
    file = OpenImageIO.ImageInput.open(str(path))
    while file.seek_subimage(len(found), 0):
        spec = file.spec()
        pixels = file.read_image(len(found), 0, 0, spec.nchannels, "float")
        found[spec.channelnames[0].rpartition(".")[0]] = pixels[::-1]
    file.close()
    return found


def render_picture(folder: Path) -> np.ndarray:
    return render_passes(folder)["ViewLayer.Combined"]


def read_encoded_pixels(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(*image.size[::-1], 4)[..., :3]


def view_shadings() -> list[Any]:
    """The shading settings of all 3D views of the file."""
    windows = bpy.context.window_manager.windows
    areas = [area for window in windows for area in window.screen.areas]
    return [area.spaces.active.shading for area in areas if area.type == "VIEW_3D"]
