"""Programs of a recipe with features: what features declare is also what is bound."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from ..arrays import Floats
from .shader_feature import ShaderFeature
from .shader_program import ShaderProgram, ShaderRecipe, program
from .textures import UniformBlock


class UniformBlocks:
    """Uniform buffers by name, each updated to its current values; made on first use."""

    def __init__(self) -> None:
        self._blocks: dict[str, UniformBlock] = {}

    def holding(self, name: str, values: Floats) -> Any:
        """The buffer of this name, with these std140 values."""
        return self._blocks.setdefault(name, UniformBlock()).holding(values)


def recipe_with(recipe: ShaderRecipe, features: Iterable[ShaderFeature]) -> ShaderRecipe:
    """The recipe with all declarations of these features."""
    features = tuple(features)
    blocks = [(kind, name) for each in features for name, (kind, _) in each.blocks.items()]
    textures = [(kind, name) for each in features for name, (kind, _) in each.textures.items()]
    numbers = [(kind, name) for each in features for name, (kind, _) in each.numbers.items()]
    defines = dict(recipe.defines)
    for each in features:
        defines |= each.defines
    return replace(
        recipe,
        name="_".join([recipe.name, *(each.name for each in features if each.name)]),
        blocks=(*recipe.blocks, *blocks),
        textures=(*recipe.textures, *textures),
        integers=(*recipe.integers, *(name for each in features for name in each.integers)),
        numbers=(*recipe.numbers, *numbers),
        inputs=(*recipe.inputs, *(one for each in features for one in each.inputs)),
        varyings=(*recipe.varyings, *(one for each in features for one in each.varyings)),
        outputs=(*recipe.outputs, *(one for each in features for one in each.outputs)),
        defines=tuple(defines.items()),
    )


def bound(
    recipe: ShaderRecipe,
    features: Iterable[ShaderFeature],
    blocks: UniformBlocks,
    *,
    images: Mapping[str, Any] | None = None,
    textures: Mapping[str, Any] | None = None,
    integers: Mapping[str, int] | None = None,
    numbers: Mapping[str, Any] | None = None,
) -> ShaderProgram:
    """The program of a recipe with these features, bound and ready to draw.

    Args:
        blocks: buffers of the features' blocks.
        images, textures, integers, numbers: values for the recipe's own declarations.

    Raises:
        ShaderError: it does not compile here, or a declaration and a value do not match.
    """
    features = tuple(features)
    shader = program(recipe_with(recipe, features))
    buffers: dict[str, Any] = {}
    all_textures, all_numbers = dict(textures or {}), dict(numbers or {})
    all_integers = dict(integers or {})
    for each in features:
        buffers |= {name: blocks.holding(name, values) for name, (_, values) in each.blocks.items()}
        all_textures |= {name: texture for name, (_, texture) in each.textures.items()}
        all_numbers |= {name: number for name, (_, number) in each.numbers.items()}
        all_integers |= each.integers
    shader.bind(
        blocks=buffers,
        textures=all_textures,
        images=images,
        integers=all_integers,
        numbers=all_numbers,
    )
    return shader
