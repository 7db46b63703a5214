"""Hiding Blender's own drawing of previewed hair, and showing it again."""

from __future__ import annotations

import bpy


def show_originals(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    *,
    show: bool,
    has_own_shadow: bool = False,
) -> None:
    """Show or hide Blender's drawing of hair.

    To hide it: solid view does not draw hair displayed as wire, only the outline of its strands
    while selected (as bounds it would draw a box always), and EEVEE does not draw what is invisible
    to cameras. Only the evaluated copy is changed.

    Args:
        has_own_shadow: our shadow is on the head, so that Blender's strands must not cast one.
    """
    evaluated = hair.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        return
    display, is_seen = (hair.display_type, hair.visible_camera) if show else ("WIRE", False)
    if evaluated.display_type != display:
        evaluated.display_type = display
    if evaluated.visible_camera != is_seen:
        evaluated.visible_camera = is_seen
    throws = hair.visible_shadow and (show or not has_own_shadow)
    if evaluated.visible_shadow != throws:
        evaluated.visible_shadow = throws


def all_depsgraphs() -> tuple[bpy.types.Depsgraph, ...]:
    """The depsgraphs of all view layers that a window shows or has shown; each has its own
    evaluated copies."""
    layers = (layer for scene in bpy.data.scenes for layer in scene.view_layers)
    return tuple(layer.depsgraph for layer in layers if layer.depsgraph is not None)


def shown_depsgraphs() -> tuple[bpy.types.Depsgraph, ...]:
    """The depsgraphs of the view layers that windows show."""
    found = (window.view_layer.depsgraph for window in bpy.context.window_manager.windows)
    return tuple(depsgraph for depsgraph in found if depsgraph is not None)


def refresh_views() -> None:
    """Have views drawn again: solid view keeps its accumulated samples until an update."""
    bpy.context.scene.update_tag()
