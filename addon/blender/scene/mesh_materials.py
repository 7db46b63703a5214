"""Reads from a mesh's material what the renderer uses of it: a simple Principled BSDF.

Base colour, alpha and normal map are read, each as a value or as one image; emission as a value.
The effects of other nodes on them are ignored, and reported.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...arrays import Floats
from ...errors import HairloomError
from ...render.snapshot import MeshPictures
from ..base.images import read_image

type Color = tuple[float, float, float]

_GREY: Color = (0.8, 0.8, 0.8)
#: reflectance of Principled at normal incidence, at its default IOR of 1.5
_SPECULAR = 0.04
_ROUGHNESS = 0.5

#: (session number of the image, kind) -> its state and pixels; the most recently used last
_picture_cache: dict[tuple[int, str], tuple[tuple[object, ...], Floats]] = {}
#: number of pictures that are cached, 16 MB each for images of 1,024 pixels
_CACHE_SIZE = 16


@dataclass(frozen=True)
class MeshMaterial:
    """A mesh's material for the renderer; fields without a description: see MeshSnapshot.

    color: scene-linear albedo; for an image, its mean.
    notes: what could not be read, each with its remedy.
    """

    color: Color = _GREY
    specular: float = _SPECULAR
    roughness: float = _ROUGHNESS
    pictures: MeshPictures | None = None
    alpha: float = 1.0
    transparency: str = "opaque"
    emission: Color = (0.0, 0.0, 0.0)
    notes: tuple[str, ...] = ()


def material_of(material: bpy.types.Material | None) -> MeshMaterial:
    """The material for MeshPass; without known nodes, the colour of the Solid viewport."""
    if material is None:
        return MeshMaterial()
    node = _shader(material)
    if node is None:
        return MeshMaterial(_color(material.diffuse_color))
    reader = _MaterialReader(material)
    if node.type == "EMISSION":
        shining = reader.emission(node.inputs["Color"], node.inputs["Strength"])
        return MeshMaterial((0.0, 0.0, 0.0), 0.0, emission=shining, notes=tuple(reader.notes))
    is_diffuse = node.type == "BSDF_DIFFUSE"
    socket = node.inputs["Color" if is_diffuse else "Base Color"]
    alpha = 1.0 if is_diffuse else reader.alpha(node.inputs["Alpha"], socket)
    color, plain = reader.color(socket)
    normal, bump = reader.normal(node.inputs["Normal"])
    has_pictures = color is not None or normal is not None
    is_opaque = alpha >= 1.0 and not (reader.uses_alpha and color is not None)
    is_blended = material.surface_render_method == "BLENDED"
    return MeshMaterial(
        plain,
        0.0 if is_diffuse else _specular(node),
        _ROUGHNESS if is_diffuse else float(node.inputs["Roughness"].default_value),
        MeshPictures(color, normal, bump) if has_pictures else None,
        alpha,
        "opaque" if is_opaque else "blended" if is_blended else "hashed",
        (0.0, 0.0, 0.0)
        if is_diffuse
        else reader.emission(node.inputs["Emission Color"], node.inputs["Emission Strength"]),
        tuple(reader.notes),
    )


def material_notes(obj: bpy.types.Object) -> tuple[str, ...]:
    """Notes on what could not be read of an object's materials, each once."""
    all_notes = (material_of(slot.material).notes for slot in obj.material_slots)
    return tuple(dict.fromkeys(note for notes in all_notes for note in notes))


def may_be_transparent(obj: bpy.types.Object) -> bool:
    """Whether an object may be transparent in a view: by its colour, or by the colour, render
    method, shader or alpha of a material."""
    materials = (slot.material for slot in obj.material_slots)
    return obj.color[3] < 1.0 or any(
        _is_transparent(each) for each in materials if each is not None
    )


def _is_transparent(material: bpy.types.Material) -> bool:
    if material.diffuse_color[3] < 1.0 or material.surface_render_method == "BLENDED":
        return True
    nodes = () if material.node_tree is None else material.node_tree.nodes
    if any(each.type == "BSDF_TRANSPARENT" for each in nodes):
        return True
    node = _shader(material)
    alpha = None if node is None else node.inputs.get("Alpha")
    return alpha is not None and (_linked_node(alpha) is not None or alpha.default_value < 1.0)


class _MaterialReader:
    """Reads one material and notes what it leaves out."""

    def __init__(self, material: bpy.types.Material) -> None:
        self.notes: list[str] = []
        self.uses_alpha = False
        self._name = material.name

    def alpha(self, socket: bpy.types.NodeSocket, color: bpy.types.NodeSocket) -> float:
        """Its value; 1 if the alpha comes from the colour's own image."""
        source = _linked_node(socket)
        if source is None:
            return float(socket.default_value)
        node, output = source
        base = _linked_node(color)
        if node.type == "TEX_IMAGE" and output == "Alpha" and base is not None and base[0] == node:
            self.uses_alpha = True
        else:
            self._note_unsupported("Alpha", "the alpha of the base colour's own picture")
        return 1.0

    def color(self, socket: bpy.types.NodeSocket) -> tuple[Floats | None, Color]:
        """The colour's image and its mean; without one, None and the value."""
        source = _linked_node(socket)
        value = _color(socket.default_value)
        if source is None:
            return None, value
        node, output = source
        if node.type == "RGB":
            return None, _color(node.outputs[0].default_value)
        if node.type != "TEX_IMAGE" or output != "Color":
            self._note_unsupported(socket.name, "an Image Texture")
            return None, value
        picture = self._picture(node.image, is_color=True)
        return picture, value if picture is None else _mean(picture)

    def emission(self, socket: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Color:
        """The emitted light, as one value; for an image, its mean."""
        factor = float(strength.default_value)
        if not factor > 0.0:
            return (0.0, 0.0, 0.0)
        _, (red, green, blue) = self.color(socket)
        return (factor * red, factor * green, factor * blue)

    def normal(self, socket: bpy.types.NodeSocket) -> tuple[Floats | None, float]:
        """The normal map and its strength; None if the surface's own normals are used."""
        source = _linked_node(socket)
        if source is None:
            return None, 1.0
        node, _ = source
        image = _linked_node(node.inputs["Color"]) if node.type == "NORMAL_MAP" else None
        if image is None or image[0].type != "TEX_IMAGE" or node.space != "TANGENT":
            self._note_unsupported("Normal", "a Normal Map in tangent space with an Image Texture")
            return None, 1.0
        return self._picture(image[0].image, is_color=False), float(
            node.inputs["Strength"].default_value
        )

    def _picture(self, image: bpy.types.Image | None, *, is_color: bool) -> Floats | None:
        if image is None:
            return None
        kind = ("color" if self.uses_alpha else "opaque") if is_color else "normal"
        key, state = (image.session_uid, kind), _image_state(image)
        cached = _picture_cache.pop(key, None)
        if cached is not None and cached[0] == state and not image.is_dirty:
            _picture_cache[key] = cached  # now the most recently used
            return cached[1]
        try:
            picture = read_image(image, is_color=is_color, place=f"Image '{image.name}'")
        except HairloomError as error:
            self.notes.append(f"{self._name}: {error} Until then a plain value is used.")
            return None
        if kind == "opaque":
            picture[..., 3] = 1.0
        _picture_cache[key] = _image_state(image), picture
        for oldest in list(_picture_cache)[:-_CACHE_SIZE]:
            del _picture_cache[oldest]
        return picture

    def _note_unsupported(self, what: str, supported: str) -> None:
        self.notes.append(
            f"{self._name}: {what} comes from unsupported nodes, so its own value was used. "
            f"Supported are values, and {supported}."
        )


def clear_cache() -> None:
    """Drop all cached pictures."""
    _picture_cache.clear()


def _image_state(image: bpy.types.Image) -> tuple[object, ...]:
    """A state that changes with the pixels; includes the file's modification time."""
    file = Path(bpy.path.abspath(image.filepath, library=image.library))
    modified = file.stat().st_mtime_ns if image.packed_file is None and file.is_file() else None
    settings = image.colorspace_settings.name, image.alpha_mode
    return (*image.size, image.filepath, modified, *settings)


def _shader(material: bpy.types.Material) -> bpy.types.Node | None:
    """The surface shader, if it is a supported one."""
    nodes = () if material.node_tree is None else material.node_tree.nodes
    for kind in ("BSDF_PRINCIPLED", "BSDF_DIFFUSE", "EMISSION"):
        for node in nodes:
            if node.type == kind and not node.mute:
                return node
    return None


def _linked_node(socket: bpy.types.NodeSocket) -> tuple[bpy.types.Node, str] | None:
    """The node linked to an input, and the name of its output; None: the input's value is used."""
    while socket.links:
        link = socket.links[0]
        if link.from_node.type != "REROUTE":
            return None if link.from_node.mute else (link.from_node, link.from_socket.name)
        socket = link.from_node.inputs[0]
    return None


def _specular(node: bpy.types.Node) -> float:
    """The reflectance of a Principled node at normal incidence."""
    ior = node.inputs["IOR"].default_value
    level = 2.0 * node.inputs["Specular IOR Level"].default_value
    return float(min(((ior - 1.0) / (ior + 1.0)) ** 2 * level, 1.0))


def _mean(picture: Floats) -> Color:
    return _color(picture[..., :3].mean(axis=(0, 1)).tolist())


def _color(values: Iterable[float]) -> Color:
    red, green, blue, *_ = (max(0.0, float(value)) for value in values)
    return (red, green, blue)
