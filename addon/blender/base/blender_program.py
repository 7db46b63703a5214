"""The command that starts another Blender to run a script."""

from __future__ import annotations

import bpy


def blender_command() -> tuple[str, ...] | None:
    """Blender's own executable as a Python interpreter; None where Blender is a module."""
    if not bpy.app.binary_path:
        return None
    quietly = ("--background", "--factory-startup", "--python-exit-code", "1")
    return (bpy.app.binary_path, *quietly, "--python-use-system-env", "--python")
