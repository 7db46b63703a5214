"""Hair cards as a GLB, through Blender's own exporter, without touching the user's scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path

import bpy
import numpy as np

from ..arrays import Floats
from ..cards.card_mesh import CardMesh
from ..errors import HairloomError
from ..exchange.atomic import atomic_write
from .images import display_encoded

ROUGHNESS = 0.5
#: glTF elongates the highlight along u, across the strands, as hair does.
ANISOTROPY = 0.5
_OCCLUSION_LAYER = "Occlusion"
_OCCLUSION_ATTRIBUTE = "_AO"
_MADE_IN = ("objects", "meshes", "materials", "images", "scenes")

type Color = tuple[float, float, float]


def write_glb(
    path: Path,
    cards: CardMesh,
    texture: Floats | None,
    *,
    name: str = "Hair cards",
    base_color: Color = (1.0, 1.0, 1.0),
    portable: bool = True,
) -> None:
    """Write cards as one primitive whose index order is the order of `cards.triangles`.

    Args:
        texture: (height, width, 4), linear and straight alpha, row 0 at the bottom; or None.
        base_color: scene-linear, multiplies the texture.
        portable: ambient occlusion goes into TEXCOORD_1, both components. Otherwise it goes into
            the attribute _AO as well, which some engines refuse.

    Raises:
        HairloomError: no cards, nothing can be written there, or Blender's exporter is missing
            or fails.
    """
    if not len(cards.triangles):
        raise HairloomError(
            "there are no cards to write", place=str(path), remedy="Choose hair that has strands"
        )
    with _temporary_scene(name) as scene:
        mesh = _new_mesh(cards, name, portable)
        mesh.materials.append(_new_material(texture, name, base_color))
        scene.collection.objects.link(bpy.data.objects.new(name, mesh))
        with atomic_write(path) as temporary, _shown(scene):
            _export(temporary, path, attributes=not portable)


@contextmanager
def _temporary_scene(name: str) -> Iterator[bpy.types.Scene]:
    """A scene that vanishes afterwards with every data-block made in the meantime."""
    before = _data_blocks()
    try:
        yield bpy.data.scenes.new(name)
    finally:
        bpy.data.batch_remove(_data_blocks() - before)


def _data_blocks() -> set[bpy.types.ID]:
    return {block for kind in _MADE_IN for block in getattr(bpy.data, kind)}


@contextmanager
def _shown(scene: bpy.types.Scene) -> Iterator[None]:
    """The window shows this scene, as the exporter wants it, and then what it showed before.

    Blender runs the frame change handlers at both changes.
    """
    window = bpy.context.window or bpy.context.window_manager.windows[0]
    user_scene, user_layer = window.scene, window.view_layer
    with bpy.context.temp_override(window=window):
        try:
            window.scene = scene
            yield
        finally:
            window.scene = user_scene
            window.view_layer = user_layer


def _new_mesh(cards: CardMesh, name: str, portable: bool) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    corners = cards.triangles.ravel()
    mesh.vertices.add(len(cards.positions))
    mesh.vertices.foreach_set("co", cards.positions.ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(cards.triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)

    _add_uv_layer(mesh, "UVMap", cards.uv[corners])
    # The exporter flips v, so that glTF reads the same value in both components.
    occlusion = cards.occlusion[corners]
    _add_uv_layer(mesh, _OCCLUSION_LAYER, np.stack([occlusion, 1.0 - occlusion], axis=1))
    if not portable:
        attribute = mesh.attributes.new(_OCCLUSION_ATTRIBUTE, "FLOAT", "POINT")
        attribute.data.foreach_set("value", cards.occlusion)
    normals = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
    normals.data.foreach_set("vector", cards.normal.ravel())
    return mesh


def _add_uv_layer(mesh: bpy.types.Mesh, name: str, uv: Floats) -> None:
    layer = mesh.uv_layers.new(name=name, do_init=False)
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())


def _new_material(texture: Floats | None, name: str, base_color: Color) -> bpy.types.Material:
    """Double-sided and blended: the exporter reads BLEND from alpha that comes from an image."""
    material = bpy.data.materials.new(name)
    material.use_backface_culling = False
    material.surface_render_method = "BLENDED"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = nodes.new("ShaderNodeBsdfPrincipled")
    surface.inputs["Base Color"].default_value = (*base_color, 1.0)
    surface.inputs["Roughness"].default_value = ROUGHNESS
    surface.inputs["Anisotropic"].default_value = ANISOTROPY
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    if texture is None:
        return material

    picture = nodes.new("ShaderNodeTexImage")
    picture.image = _new_image(texture, name)
    picture.extension = "EXTEND"  # else the root's opaque row wraps around to the tip
    tint = nodes.new("ShaderNodeMix")  # becomes baseColorFactor
    tint.data_type, tint.blend_type = "RGBA", "MULTIPLY"
    factor, first, second = (tint.inputs[i] for i in (0, 6, 7))
    factor.default_value = 1.0
    second.default_value = (*base_color, 1.0)
    links.new(picture.outputs["Color"], first)
    links.new(tint.outputs[2], surface.inputs["Base Color"])
    links.new(picture.outputs["Alpha"], surface.inputs["Alpha"])
    return material


def _new_image(texture: Floats, name: str) -> bpy.types.Image:
    height, width = texture.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True)
    coded = display_encoded(np.concatenate([texture[..., :3], np.ones_like(texture[..., 3:])], -1))
    coded[..., 3] = texture[..., 3]  # straight: the colour goes on where alpha is 0
    image.pixels.foreach_set(coded.ravel())
    return image


def _export(temporary: Path, path: Path, *, attributes: bool) -> None:
    try:
        with redirect_stdout(StringIO()):  # its running commentary; its errors go to stderr
            bpy.ops.export_scene.gltf(
                filepath=str(temporary),
                export_format="GLB",
                use_active_scene=True,
                export_yup=True,
                export_apply=False,
                export_animations=False,
                export_current_frame=True,
                export_tangents=True,
                export_attributes=attributes,
            )
    except AttributeError as error:
        raise HairloomError(
            "Blender's glTF exporter is switched off",
            place="Preferences > Add-ons",
            remedy="Switch on 'glTF 2.0 format'",
        ) from error
    except RuntimeError as error:
        raise HairloomError(
            f"Blender's glTF exporter failed ({_reason(error)})",
            place=str(path),
            remedy="Try another file name or folder",
        ) from error


def _reason(error: RuntimeError) -> str:
    """The last line of a report that may hold a whole traceback."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    return [line for line in lines if not line.startswith("Location:")][-1].strip()
