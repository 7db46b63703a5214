"""Hair as a hole in the picture, weighted by its coverage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import gpu_objects
from .accumulation import Target
from .shader_program import ShaderRecipe, program, released_with_shaders
from .textures import drawing_into

_RECIPE = ShaderRecipe(
    name="holdout",
    compute="holdout.comp.glsl",
    textures=(("FLOAT_2D", "holes"),),
    images=(("RGBA32F", "picture", "READ_WRITE"),),
)
_NOTHING = (0.0, 0.0, 0.0, 0.0)


class Holdout:
    """Draws into a separate texture and cuts the result out of a target.

    Creating one does not touch the GPU.
    """

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """See shader_program.released_with_shaders."""
        self._depth: Any = None
        self._holes: Any = None
        self._framebuffer: Any = None

    def cut(self, target: Target, draw: Callable[[], None]) -> None:
        """Cut what `draw` draws out of the target's colour and alpha. It is depth-tested against
        the target, and writes its depth.
        """
        if self._depth is not target.depth:
            size = target.color.width, target.color.height
            self._depth = target.depth
            self._holes = gpu_objects.texture(size, format="RGBA32F")
            self._framebuffer = gpu_objects.framebuffer(
                depth_slot=self._depth, color_slots=(self._holes,)
            )
        with drawing_into(self._framebuffer):
            self._framebuffer.clear(color=_NOTHING)
            draw()
        shader = program(_RECIPE)
        shader.bind(textures={"holes": self._holes}, images={"picture": target.color})
        width, height = self._holes.width, self._holes.height
        shader.dispatch(width, height)
