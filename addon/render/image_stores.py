"""The order of what fragments store into images, and of what reads it."""

from __future__ import annotations

from .shader_program import ShaderRecipe, program

_RECIPE = ShaderRecipe(
    name="image_stores_done", compute="image_stores_done.comp.glsl", group_size=(1, 1)
)


def finish_stores() -> None:
    """What has been drawn so far has stored all that comes after it reads."""
    done = program(_RECIPE)
    done.bind()
    done.dispatch(1)
