"""Blender's own drawing of the hair that is previewed: out of the way, and back again."""

from __future__ import annotations

import bpy


def show_originals(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    *,
    show: bool,
    has_own_shadow: bool = False,
) -> None:
    """Solid view leaves out hair that is shown as wires, EEVEE what no camera can see. Of hair as
    wires Blender draws nothing but, where it is selected, the outline of the strands; as bounds it
    would draw a box, selected or not.

    Touches the evaluated copy only.

    Args:
        has_own_shadow: ours lies on the head, so that Blender's strands are to throw none.
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
    """Of all view layers that a window shows or has shown: each has evaluated copies of its own."""
    layers = (layer for scene in bpy.data.scenes for layer in scene.view_layers)
    return tuple(layer.depsgraph for layer in layers if layer.depsgraph is not None)


def shown_depsgraphs() -> tuple[bpy.types.Depsgraph, ...]:
    """Of the view layers that windows show."""
    found = (window.view_layer.depsgraph for window in bpy.context.window_manager.windows)
    return tuple(depsgraph for depsgraph in found if depsgraph is not None)


def refresh_views() -> None:
    """Solid view shows the samples it has collected until it hears of an update."""
    bpy.context.scene.update_tag()
