"""Hairloom's rooms; see docs/dev/architecture.md for the way of the data through them.

Importing this package touches neither bpy nor gpu, so that every room above `render` works in
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
