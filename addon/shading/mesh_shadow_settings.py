"""Settings of the shadows that meshes cast on meshes in a scene."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer, toggle


@dataclass(frozen=True, kw_only=True)
class MeshShadowSettings(Settings):
    """Shadows of meshes on meshes, beside those of hair."""

    section = "mesh_shadows"
    title = "Mesh Shadows"
    help_page = "engine#shadows-of-meshes-on-meshes"
    owner = "scene"

    mesh_shadows: bool = toggle(
        True,
        label="Mesh Shadows",
        description="Let meshes cast shadows on meshes everywhere; if off, only around hair",
    )
    mesh_resolution: int = integer(
        2048,
        label="Resolution",
        description="Texels along each side of a light's shadow map; a light among the meshes "
        "uses up to six maps",
        soft=(512, 4096),
        hard=(16, 8192),
    )
