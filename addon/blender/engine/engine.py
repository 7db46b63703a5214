"""The render engine as it is registered in Blender; engine_still.py and engine_view.py do the
work."""

from __future__ import annotations

import traceback
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...errors import HairloomError
from ...render import gpu_objects, skin_layouts
from ...render.shader_source import ShaderError
from ..base import event_handlers
from ..base.gpu_context import can_draw
from ..viewport.overlay import ENGINE
from . import engine_hair
from .engine_passes import COMBINED, enabled_passes
from .engine_still import Still
from .engine_view import EngineView


class HAIRLOOM_RE_engine(bpy.types.RenderEngine):
    """Render meshes and hair on the GPU"""

    bl_idname = ENGINE
    bl_label = "Hairloom"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    # If true, Blender makes a GPU context before it calls the engine, and crashes without a driver,
    # so background mode looks for one first. It needs this too if another engine rendered before.
    bl_use_gpu_context = not bpy.app.background or can_draw()

    def __init__(self, *args: Any, **keywords: Any) -> None:
        super().__init__(*args, **keywords)
        self.view = EngineView()
        self.failure = ""

    def update_render_passes(self, scene: Any, renderlayer: Any) -> None:
        """Register the passes for Blender's compositor and file outputs."""
        for each in (COMBINED, *enabled_passes(scene, renderlayer)):
            channels = len(each.channels), each.channels
            self.register_pass(scene, renderlayer, each.name, *channels, each.kind)

    def render(self, depsgraph: Any) -> None:
        """Called by F12 and animations for each view layer; with a window, in a separate thread."""
        try:
            self._render(depsgraph)
        finally:
            gpu_objects.hand_over()

    def _render(self, depsgraph: Any) -> None:
        layer = depsgraph.view_layer
        for each in enabled_passes(depsgraph.scene, layer):
            self.add_pass(each.name, len(each.channels), each.channels, layer=layer.name)
        try:
            still = Still(self, depsgraph)
            for name in _view_names(depsgraph.scene.render):
                still.render_view(name)
        except Exception as error:
            if not isinstance(error, (HairloomError, ShaderError)):
                traceback.print_exc()
            # error_set() alone prints nothing in background mode
            self.report({"ERROR"}, f"Hairloom: {error}")
            return
        for warning in still.warnings:
            self.report({"WARNING"}, warning)

    def view_update(self, context: Any, depsgraph: Any) -> None:
        """Called when Blender has evaluated something again."""
        self.failure = ""
        self._attempt(self.view.read, context, depsgraph)

    def view_draw(self, context: Any, depsgraph: Any) -> None:
        """Called for each redraw of a 3D view in Rendered mode."""
        counts = self._attempt(self.view.draw, context, depsgraph)
        if counts is None:
            return
        count, total = counts
        warning = next(iter(self.view.warnings), "")
        notice = "Hair is being made. " if self.view.is_waiting else ""
        self.update_stats(f"{notice}Sample {count} of {total}", warning)
        if count < total:
            self.tag_redraw()

    def _attempt(self, action: Any, context: Any, depsgraph: Any) -> Any:
        """Run an action; an error is reported once, not at every redraw, until an update."""
        if self.failure:
            return None
        try:
            return action(context, depsgraph)
        except Exception as error:
            if not isinstance(error, (HairloomError, ShaderError)):
                traceback.print_exc()
            self.failure = f"Hairloom cannot draw here: {error}"
            print(self.failure)
            self.update_stats("Hairloom cannot draw here", self.failure.splitlines()[0])
            return None


def _view_names(render: Any) -> list[str]:
    """The names of the views of a picture; a single empty one without stereoscopy."""
    if not render.use_multiview:
        return [""]
    return [view.name for view in render.views if view.use]


@persistent
def on_load_pre(*_: Any) -> None:
    """Forget the hair of the previous file, and cancel what is being built of it."""
    engine_hair.forget()


CLASSES = (HAIRLOOM_RE_engine,)

HANDLERS = ((bpy.app.handlers.load_pre, on_load_pre),)


def register() -> None:
    event_handlers.append(HANDLERS)


def unregister() -> None:
    """Remove the handlers, and free everything in memory."""
    event_handlers.remove(HANDLERS)
    engine_hair.forget()
    skin_layouts.forget()
