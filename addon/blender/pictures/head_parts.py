"""A head as one mesh for each of its materials."""

from __future__ import annotations

from dataclasses import replace

from ...render.snapshot import MeshSnapshot, Skin
from ..scene.built_in_head import HeadLook


def head_parts(whole: MeshSnapshot, look: HeadLook) -> tuple[MeshSnapshot, ...]:
    """A head's parts, which share its vertices; the shadow on it stays soft across them.

    Args:
        whole: the head with its normals and occlusion.
    """
    surface = whole.surface
    assert surface.corner_uv is not None, "a head with pictures has UVs"
    return tuple(
        replace(
            whole,
            surface=replace(
                surface,
                triangles=surface.triangles[triangles],
                corner_uv=surface.corner_uv[triangles],
            ),
            skin=Skin(surface, triangles),
            color=material.color,
            specular=material.specular,
            roughness=material.roughness,
            pictures=material.pictures,
        )
        for triangles, material in look
    )
