"""Hair cards as a scene for Blender's exporters, which vanishes again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...cards.card_mesh import OF_VERTICES, CardMesh
from ...exchange.cards.card_formats import GLB, OBJ, USD, CardFormat
from ...exchange.files.names import plain_name
from ...exchange.textures.srgb import srgb_decoded
from ..base.images import display_encoded

ROUGHNESS = 0.5
#: glTF elongates the highlight along u, across the strands, as hair does.
ANISOTROPY = 0.5
#: names of both UV layers; USD's importers go by these
_UV_LAYERS = {USD.name: ("st", "st1")}
_MADE_IN = ("objects", "meshes", "materials", "images", "scenes")

type Color = tuple[float, float, float]


@dataclass(frozen=True)
class CardLook:
    """The plain material of the file: what its textures and its colour are.

    card: (height, width, 4) linear with straight alpha, row 0 the lowest, to be packed into the
        file; or None.
    base, alpha: files beside it, for formats that name files. alpha is read from the channel "a" of
        the same file, else from the red of its own.
    color: scene-linear, multiplies the texture.
    """

    card: Floats | None = None
    base: str | None = None
    alpha: str | None = None
    color: Color = (1.0, 1.0, 1.0)


def level_names(name: str, count: int) -> tuple[str, ...]:
    """What the objects of `count` levels of detail are called, finest first."""
    plain = plain_name(name)
    return (plain,) if count == 1 else tuple(f"{plain}_LOD{level}" for level in range(count))


def without_loose(mesh: CardMesh, back: Ints) -> tuple[CardMesh, Ints]:
    """The same mesh without vertices that no triangle has, which some exporters leave out.

    Args:
        back: (triangle_count, 3) its triangles in another order, which are given back likewise.
    """
    used = np.unique(mesh.triangles)
    if len(used) == len(mesh.positions):
        return mesh, back
    vertices = {name: getattr(mesh, name)[used] for name in OF_VERTICES}
    triangles = np.searchsorted(used, mesh.triangles)
    return replace(mesh, triangles=triangles, **vertices), np.searchsorted(used, back)


@contextmanager
def card_scene(
    levels: Sequence[CardMesh],
    name: str,
    look: CardLook,
    file_format: CardFormat,
    *,
    portable: bool,
    texels: Sequence[Floats] = (),
) -> Iterator[bpy.types.Scene]:
    """A scene with one object a level, below an empty where there are several.

    It vanishes afterwards with every data-block made in the meantime. Blocks of the user that have
    the names of ours are called otherwise for the time.

    Args:
        texels: of each level, (vertex_count, 2): a third UV map, its second component from the top.
    """
    names = level_names(name, len(levels))
    before = _data_blocks()
    with _free_names({plain_name(name), *names}):
        try:
            scene = bpy.data.scenes.new(plain_name(name))
            material = _new_material(look, plain_name(name), file_format)
            parent = _new_parent(scene, plain_name(name)) if len(levels) > 1 else None
            for number, (level, level_name) in enumerate(zip(levels, names, strict=True)):
                mesh = _new_mesh(level, level_name, file_format, portable)
                if len(texels):
                    _add_texels(mesh, level, texels[number], file_format)
                mesh.materials.append(material)
                obj = bpy.data.objects.new(level_name, mesh)
                obj.parent = parent
                scene.collection.objects.link(obj)
            yield scene
        finally:
            bpy.data.batch_remove(_data_blocks() - before)


@contextmanager
def shown(scene: bpy.types.Scene) -> Iterator[None]:
    """The window shows this scene, as exporters want it, and then what it showed before.

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


def _data_blocks() -> set[bpy.types.ID]:
    return {block for kind in _MADE_IN for block in getattr(bpy.data, kind)}


@contextmanager
def _free_names(names: Iterable[str]) -> Iterator[None]:
    """Nothing of the file has these names while the block runs: Blender would number ours."""
    taken = [
        (block, block.name)
        for kind in _MADE_IN
        for name in names
        if (block := getattr(bpy.data, kind).get(name)) is not None and block.library is None
    ]
    try:
        for block, name in taken:
            block.name = f"{name} (while exporting)"
        yield
    finally:
        for block, name in taken:
            block.name = name


def _new_parent(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    parent = bpy.data.objects.new(name, None)
    parent["fbx_type"] = "LodGroup"  # Blender's FBX exporter asks for it
    scene.collection.objects.link(parent)
    return parent


def _new_mesh(
    cards: CardMesh, name: str, file_format: CardFormat, portable: bool
) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    corners = cards.triangles.ravel()
    mesh.vertices.add(len(cards.positions))
    mesh.vertices.foreach_set("co", cards.positions.ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(cards.triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)

    first, second = _UV_LAYERS.get(file_format.name, ("UVMap", "Occlusion"))
    _add_uv_layer(mesh, first, cards.uv[corners])
    # The exporter of glTF flips v.
    along = 1.0 - cards.along if file_format == GLB else cards.along
    _add_uv_layer(mesh, second, np.stack([cards.occlusion, along], axis=1)[corners])
    if not portable and file_format.extra:
        _add_attribute(mesh, "_AO", "FLOAT", "value", cards.occlusion)
    if file_format == OBJ:
        _add_colors(mesh, cards)
    if file_format == USD:
        side = np.cross(cards.tangent, cards.normal)
        _add_attribute(mesh, "tangents", "FLOAT_VECTOR", "vector", _unit(side))
    _add_attribute(mesh, "custom_normal", "FLOAT_VECTOR", "vector", cards.normal)
    return mesh


def _add_texels(
    mesh: bpy.types.Mesh, cards: CardMesh, texels: Floats, file_format: CardFormat
) -> None:
    """Blender, and all files but glTF's, count v from the bottom."""
    name = "st2" if file_format == USD else "Motion"
    _add_uv_layer(mesh, name, (texels * [1.0, -1.0] + [0.0, 1.0])[cards.triangles.ravel()])


def _add_uv_layer(mesh: bpy.types.Mesh, name: str, uv: Floats) -> None:
    layer = mesh.uv_layers.new(name=name, do_init=False)
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())


def _add_attribute(mesh: bpy.types.Mesh, name: str, kind: str, field: str, values: Floats) -> None:
    attribute = mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set(field, np.ascontiguousarray(values, np.float32).ravel())


def _add_colors(mesh: bpy.types.Mesh, cards: CardMesh) -> None:
    """OBJ knows one UV map alone, so colours take the rest; its exporter codes them as sRGB."""
    value = np.stack([cards.occlusion, cards.along, np.zeros_like(cards.along)], axis=1)
    colors = np.concatenate([srgb_decoded(value), np.ones((len(value), 1))], axis=1)
    _add_attribute(mesh, "Occlusion color", "FLOAT_COLOR", "color", colors)
    mesh.color_attributes.active_color = mesh.color_attributes["Occlusion color"]


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def _new_material(look: CardLook, name: str, file_format: CardFormat) -> bpy.types.Material:
    """Double-sided and blended: glTF's exporter reads BLEND from alpha that comes from an image."""
    material = bpy.data.materials.new(name)
    material.use_backface_culling = False
    material.surface_render_method = "BLENDED"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = nodes.new("ShaderNodeBsdfPrincipled")
    surface.inputs["Base Color"].default_value = (*look.color, 1.0)
    surface.inputs["Roughness"].default_value = ROUGHNESS
    surface.inputs["Anisotropic"].default_value = ANISOTROPY
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    if file_format == GLB:
        _link_packed(material, surface, look, name)
    else:
        _link_files(material, surface, look)
    return material


def _link_packed(
    material: bpy.types.Material, surface: bpy.types.Node, look: CardLook, name: str
) -> None:
    """The picture goes into the file, and the colour becomes its factor."""
    if look.card is None:
        return
    nodes, links = material.node_tree.nodes, material.node_tree.links
    picture = _new_picture(material, _packed_image(look.card, name))
    tint = nodes.new("ShaderNodeMix")  # becomes baseColorFactor
    tint.data_type, tint.blend_type = "RGBA", "MULTIPLY"
    factor, first, second = (tint.inputs[i] for i in (0, 6, 7))
    factor.default_value = 1.0
    second.default_value = (*look.color, 1.0)
    links.new(picture.outputs["Color"], first)
    links.new(tint.outputs[2], surface.inputs["Base Color"])
    links.new(picture.outputs["Alpha"], surface.inputs["Alpha"])


def _link_files(material: bpy.types.Material, surface: bpy.types.Node, look: CardLook) -> None:
    """Pictures are named; the other exporters know those alone that are linked straight."""
    links = material.node_tree.links
    base = None if look.base is None else _new_picture(material, _named_image(look.base, "sRGB"))
    if base is not None:
        links.new(base.outputs["Color"], surface.inputs["Base Color"])
    if look.alpha is None:
        return
    if base is not None and look.alpha == look.base:
        links.new(base.outputs["Alpha"], surface.inputs["Alpha"])
        return
    alpha = _new_picture(material, _named_image(look.alpha, "Non-Color"))
    links.new(alpha.outputs["Color"], surface.inputs["Alpha"])


def _new_picture(material: bpy.types.Material, image: bpy.types.Image) -> bpy.types.Node:
    picture = material.node_tree.nodes.new("ShaderNodeTexImage")
    picture.image = image
    picture.extension = "EXTEND"  # else the root's opaque row wraps around to the tip
    return picture


def _named_image(file: str, space: str) -> bpy.types.Image:
    """An image of which exporters want the file's name alone; it need not be there yet."""
    image = bpy.data.images.new(file, 1, 1, alpha=True)
    image.source = "FILE"
    image.filepath = file
    image.colorspace_settings.name = space
    return image


def _packed_image(texture: Floats, name: str) -> bpy.types.Image:
    height, width = texture.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True)
    coded = display_encoded(np.concatenate([texture[..., :3], np.ones_like(texture[..., 3:])], -1))
    coded[..., 3] = texture[..., 3]  # straight: the colour goes on where alpha is 0
    image.pixels.foreach_set(coded.ravel())
    return image
