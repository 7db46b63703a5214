"""Textures of meshes' materials on the GPU."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from .shader_feature import ShaderFeature
from .snapshot import Color, MeshPictures, MeshSnapshot
from .textures import texture_from

#: a normal map of one texel, straight up
_LEVEL = np.array([[[0.5, 0.5, 1.0, 1.0]]], np.float32)


def pictures_of(mesh: MeshSnapshot) -> MeshPictures | None:
    """The pictures of a mesh; None if it has none, or no UVs."""
    pictures = mesh.pictures
    if pictures is None or mesh.surface.corner_uv is None:
        return None
    return None if pictures.color is None and pictures.normal is None else pictures


class PictureTextures:
    """Textures of pictures, each uploaded once as long as it is the same array."""

    def __init__(self) -> None:
        self._cache: dict[int, tuple[Floats, Any]] = {}
        self._colors: dict[Color, Any] = {}

    def feature(self, mesh: MeshSnapshot, pictures: MeshPictures) -> ShaderFeature:
        """The feature of programs that use a mesh's pictures; missing ones become one texel."""
        color, normal = pictures.color, pictures.normal
        texels = {
            "mesh_color_map": self._plain(mesh.color) if color is None else self._texture(color),
            "mesh_normal_map": self._texture(_LEVEL if normal is None else normal),
        }
        return ShaderFeature(
            name="pictures",
            textures={name: ("FLOAT_2D", texture) for name, texture in texels.items()},
            numbers={"mesh_bump": ("FLOAT", pictures.bump)},
            inputs=(("VEC2", "picture_uv"),),
            varyings=(("smooth", "VEC2", "mesh_uv"),),
            defines={"PICTURES": 1},
        )

    def alpha_feature(self, picture: Floats) -> ShaderFeature:
        """The feature of programs that only use the alpha of a mesh's picture."""
        return ShaderFeature(
            name="alpha",
            textures={"mesh_color_map": ("FLOAT_2D", self._texture(picture))},
            inputs=(("VEC2", "picture_uv"),),
            varyings=(("smooth", "VEC2", "mesh_uv"),),
            defines={"PICTURES": 1},
        )

    def color(self, picture: Floats) -> Any:
        """The texture of a colour picture (height, width, 4)."""
        return self._texture(picture)

    def forget_but(self, meshes: Sequence[MeshSnapshot]) -> None:
        """Release the textures that none of these meshes uses."""
        used = {id(_LEVEL)}
        for mesh in meshes:
            if mesh.pictures is not None:
                used |= {id(mesh.pictures.color), id(mesh.pictures.normal)}
        colors = {mesh.color for mesh in meshes}
        self._colors = {color: kept for color, kept in self._colors.items() if color in colors}
        self._cache = {key: cached for key, cached in self._cache.items() if key in used}

    def _plain(self, color: Color) -> Any:
        if color not in self._colors:
            texel = np.array([[[*color, 1.0]]], np.float32)
            self._colors[color] = texture_from(texel, "RGBA32F")
        return self._colors[color]

    def _texture(self, picture: Floats) -> Any:
        if id(picture) not in self._cache:
            texture = texture_from(picture, "RGBA16F")
            texture.extend_mode("REPEAT")
            self._cache[id(picture)] = picture, texture
        return self._cache[id(picture)][1]
