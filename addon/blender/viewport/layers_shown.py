"""Blender's own strands in a window that changes to another view layer.

Each view layer has evaluated copies of its own, and nobody is told when a window begins to show
one: our strands are drawn there at once, but Blender's are among them until it evaluates something.
"""

from __future__ import annotations

import bpy

from ..base.objects import LayerKey, layer_key

_shown: frozenset[LayerKey] = frozenset()


def look() -> None:
    """While a view is drawn: a view layer that is new in any window is evaluated after it."""
    global _shown
    windows = bpy.context.window_manager.windows
    now = frozenset(layer_key(each.scene, each.view_layer) for each in windows)
    if now - _shown and not bpy.app.timers.is_registered(_evaluate):
        bpy.app.timers.register(_evaluate, first_interval=0.0)
    _shown = now


def forget() -> None:
    """No view of ours is drawn any more."""
    global _shown
    _shown = frozenset()
    if bpy.app.timers.is_registered(_evaluate):
        bpy.app.timers.unregister(_evaluate)


def _evaluate() -> None:
    for scene in {window.scene for window in bpy.context.window_manager.windows}:
        scene.update_tag()
