"""Hiding Blender's own drawing of previewed hair, and showing it again."""

from __future__ import annotations

import bpy


def show_originals(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    *,
    show: bool,
    has_hairloom_shadow: bool = False,
) -> None:
    """Show or hide Blender's drawing of hair.

    Hidden hair is displayed as wire, of which solid view draws only the outline of selected strands
    (of bounds, always a box), and is invisible to cameras, so that EEVEE does not draw it. Only the
    evaluated copy is changed.

    Args:
        has_hairloom_shadow: our shadow is on the head, so Blender's strands must not cast one.
    """
    evaluated = hair.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        return
    display, is_visible = (hair.display_type, hair.visible_camera) if show else ("WIRE", False)
    if evaluated.display_type != display:
        evaluated.display_type = display
    if evaluated.visible_camera != is_visible:
        evaluated.visible_camera = is_visible
    casts_shadow = hair.visible_shadow and (show or not has_hairloom_shadow)
    if evaluated.visible_shadow != casts_shadow:
        evaluated.visible_shadow = casts_shadow


def all_depsgraphs() -> tuple[bpy.types.Depsgraph, ...]:
    """The depsgraphs of all view layers that a window shows or has shown; each has its own
    evaluated copies."""
    layers = (layer for scene in bpy.data.scenes for layer in scene.view_layers)
    return tuple(layer.depsgraph for layer in layers if layer.depsgraph is not None)


def shown_depsgraphs() -> tuple[bpy.types.Depsgraph, ...]:
    """The depsgraphs of the view layers that windows show."""
    depsgraphs = (window.view_layer.depsgraph for window in bpy.context.window_manager.windows)
    return tuple(depsgraph for depsgraph in depsgraphs if depsgraph is not None)


def refresh_views() -> None:
    """Have views drawn again: solid view keeps its accumulated samples until an update."""
    bpy.context.scene.update_tag()
