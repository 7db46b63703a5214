"""Traces that an extension can leave in Blender, and Blender's output about exceptions."""

import gc
import os
import stat
import sys
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import bpy
import gpu
from driver import hairloom_module

MENUS = (
    "TOPBAR_MT_file_import",
    "TOPBAR_MT_file_export",
    "VIEW3D_MT_curve_add",
    "VIEW3D_MT_object",
    "VIEW3D_MT_object_context_menu",
)
PROPERTY_OWNERS = ("Curves", "Object", "Scene", "WindowManager", "Mesh", "Material")


def shortcuts() -> list[Any]:
    """Hairloom's items in Blender's keymaps for add-ons."""
    keymaps = bpy.context.window_manager.keyconfigs.addon.keymaps
    items = [item for keymap in keymaps for item in keymap.keymap_items]
    return [
        item
        for item in items
        if item.idname.startswith("hairloom.")
        or (item.idname == "wm.call_menu_pie" and item.properties.name.startswith("HAIRLOOM"))
    ]


class Log:
    """All output of this Blender, from Python and from C, which tools/test_ui.py saves."""

    def __init__(self) -> None:
        # the runner redirects both streams to one file; a pipe could not be read here
        assert stat.S_ISREG(os.fstat(1).st_mode), "send the output into a file"
        self._path, self._offset = Path("/proc/self/fd/1"), 0

    def new_output(self) -> str:
        """The output since the last call."""
        sys.stdout.flush()
        sys.stderr.flush()
        with self._path.open("rb") as stream:
            stream.seek(self._offset)
            new = stream.read()
        self._offset += len(new)
        return new.decode(errors="replace")


def blender_traces() -> dict[str, Any]:
    """Everything of ours that is registered in Blender."""
    return {
        "handlers": {
            name: [f"{each.__module__}.{each.__qualname__}" for each in handlers]
            for name in dir(bpy.app.handlers)
            if isinstance(handlers := getattr(bpy.app.handlers, name), list)
        },
        "menus": {name: len(getattr(bpy.types, name).draw._draw_funcs) for name in MENUS},
        "properties": {
            name: sorted(getattr(bpy.types, name).bl_rna.properties.keys())
            for name in PROPERTY_OWNERS
        },
        "classes": [name for name in dir(bpy.types) if "hairloom" in name.lower()],
        "operators": dir(bpy.ops.hairloom),
        "shortcuts": len(shortcuts()),
        "threads": sorted(each.name for each in threading.enumerate()),
    }


def gpu_object_counts() -> Counter[str]:
    """The number of GPU objects of each kind that Python still references."""
    kinds = tuple(each for each in vars(gpu.types).values() if isinstance(each, type))
    gc.collect()
    found, to_visit = {}, list(gc.get_objects())
    while to_visit:
        for each in gc.get_referents(to_visit.pop()):
            if isinstance(each, kinds):
                found[id(each)] = type(each).__name__
            elif isinstance(each, tuple | dict) and not gc.is_tracked(each):
                to_visit.append(each)  # objects without references of their own
    return Counter(found.values())


def preview_traces() -> dict[str, Any]:
    """The state that only a preview, Play or long work has; all empty when none is active."""
    return {
        "previews": [each.name for each in hairloom_module("previews").simulations()],
        "draw handlers": hairloom_module("overlay")._overlay.handles,
        "drawn": sorted(hairloom_module("overlay").drawn_uids()),
        "ticks": hairloom_module("latest_job").is_scheduled("play"),
        "work": hairloom_module("long_work").running_label(),
    }
