"""Hairloom's rooms; docs/dev/architecture.md describes the flow of data through them.

Importing this package imports neither bpy nor gpu, so that every room before `render` works in
plain Python.
"""


def register() -> None:
    """Called by Blender when the extension is enabled."""
    from .registration import register

    register()


def unregister() -> None:
    """Called by Blender when the extension is disabled."""
    from .registration import unregister

    unregister()
