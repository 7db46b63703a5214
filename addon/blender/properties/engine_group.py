"""The settings of a scene's pictures; they live on the scene."""

from __future__ import annotations

import bpy
from bpy.props import PointerProperty

from ...shading.mesh_shadow_settings import MeshShadowSettings
from ...shading.picture_settings import PictureSettings
from ..base.redraw import redraw_views
from .properties import property_group

HAIRLOOM_PG_picture = property_group(PictureSettings, lambda _scene: redraw_views())
HAIRLOOM_PG_mesh_shadows = property_group(MeshShadowSettings, lambda _scene: redraw_views())


class HAIRLOOM_PG_scene(bpy.types.PropertyGroup):
    """Everything about the pictures of one scene."""

    __annotations__ = {
        "picture": PointerProperty(
            type=HAIRLOOM_PG_picture,
            name=PictureSettings.title,
            description="How many samples make one picture",
        ),
        "mesh_shadows": PointerProperty(
            type=HAIRLOOM_PG_mesh_shadows,
            name=MeshShadowSettings.title,
            description="Shadows of meshes on meshes",
        ),
    }


CLASSES = (HAIRLOOM_PG_picture, HAIRLOOM_PG_mesh_shadows, HAIRLOOM_PG_scene)


def register() -> None:
    """After CLASSES are registered."""
    bpy.types.Scene.hairloom = PointerProperty(
        type=HAIRLOOM_PG_scene, name="Hairloom", description="Settings of this scene's pictures"
    )


def unregister() -> None:
    del bpy.types.Scene.hairloom
