"""One draw of strands: the resources of all its programs by name, and each program's own part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from .detail_pass import DetailOrder
from .shader_program import ShaderProgram, ShaderRecipe, program
from .strand_recipe import StrandShading, gather_recipe, shade_recipe, shown_recipe, strand_recipe

Named = Mapping[str, Any]


@dataclass(frozen=True)
class StrandDrawing:
    """What a moment needs to be drawn.

    order: which strands, in how many pieces.
    blocks, textures, integers, numbers: of all programs; each binds those that it declares.
    ribbon: the vertices of a strand that has room for so many pieces.
    """

    order: DetailOrder
    shading: StrandShading
    ribbon: Callable[[int], Any]
    blocks: Named
    textures: Named
    integers: Named
    numbers: Named = field(default_factory=dict)

    @property
    def is_adaptive(self) -> bool:
        return self.order.factors is not None

    def draw(self, *, is_hashed: bool) -> None:
        """All strands, each pixel shaded as it is drawn."""
        self._draw(
            strand_recipe(self.shading, is_adaptive=self.is_adaptive, is_hashed=is_hashed), {}, {}
        )

    def gather(self, images: Named, capacity: int) -> None:
        """All strands into the lists of pixels, see strand_layers.py."""
        recipe = gather_recipe(is_adaptive=self.is_adaptive)
        self._draw(recipe, images, {"capacity": capacity})

    def shade(self, images: Named, seen_count: int) -> ShaderProgram:
        """Bind what shades so many nodes that are seen."""
        recipe = shade_recipe(replace(self.shading, has_display=False))
        return self._bound(recipe, images, {"seen_count": seen_count})

    def show(self, images: Named, *, writes_depth: bool) -> ShaderProgram:
        """Bind what adds up these lists."""
        recipe = shown_recipe(has_display=self.shading.has_display)
        return self._bound(recipe, images, {"writes_depth": int(writes_depth)})

    def _draw(self, recipe: ShaderRecipe, images: Named, integers: Named) -> None:
        shader = self._bound(recipe, images, integers).shader
        for drawn in self.order.classes:
            if self.is_adaptive:
                shader.uniform_int("first_instance", drawn.first)
            self.ribbon(drawn.capacity).draw_instanced(
                shader, instance_start=0, instance_count=drawn.count
            )

    def _bound(self, recipe: ShaderRecipe, images: Named, integers: Named) -> ShaderProgram:
        own = {**self.integers, **integers}
        shader = program(recipe)
        shader.bind(
            blocks={name: self.blocks[name] for _, name in recipe.blocks},
            textures={name: self.textures[name] for _, name in recipe.textures},
            images={name: images[name] for _, name, *_ in recipe.images},
            integers={name: own[name] for name in recipe.integers},
            numbers={name: self.numbers[name] for _, name in recipe.numbers},
        )
        return shader
