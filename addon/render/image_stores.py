"""Synchronization of image stores in fragment shaders with later reads."""

from __future__ import annotations

from .shader_program import ShaderRecipe, program

_RECIPE = ShaderRecipe(
    name="image_stores_done", compute="image_stores_done.comp.glsl", group_size=(1, 1)
)


def finish_stores() -> None:
    """Make the image stores of all draws so far visible to all later reads."""
    done = program(_RECIPE)
    done.bind()
    done.dispatch(1)
