"""Hairloom: author, simulate, preview and export real-time hair in Blender."""

from .addon import register, unregister

__all__ = ["register", "unregister"]
