"""A head as one mesh for each of its materials."""

from __future__ import annotations

from dataclasses import replace

from ...render.snapshot import MeshSnapshot, Skin
from ..scene.built_in_head import HeadLook


def head_parts(head: MeshSnapshot, look: HeadLook) -> tuple[MeshSnapshot, ...]:
    """A head's parts, which share its vertices and skin, so that soft shadows continue across them.

    Args:
        head: the head with its normals and occlusion.
    """
    surface = head.surface
    has_skin = head.skin is not None and surface.corner_uv is not None
    return tuple(
        replace(
            head,
            surface=replace(
                surface,
                triangles=surface.triangles[triangles],
                corner_uv=None if surface.corner_uv is None else surface.corner_uv[triangles],
            ),
            skin=Skin(surface, triangles) if has_skin else None,
            color=material.color,
            specular=material.specular,
            roughness=material.roughness,
            pictures=material.pictures,
            alpha=material.alpha,
            transparency=material.transparency,
        )
        for triangles, material in look
    )
