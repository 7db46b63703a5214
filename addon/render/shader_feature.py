"""Features: the declarations and values of programs for one purpose, such as opacity maps.

A feature holds each declaration together with its value for a draw, so that both are in one place;
`feature_programs` composes programs from features. Nothing here needs a GPU.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..arrays import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class ShaderFeature:
    """Part of a program.

    name: appended to the program's name; empty for features of all programs of a recipe.
    blocks: (struct, std140 values) by name. textures: (sampler type, texture) by name.
    integers: by name. numbers: (type, value) by name.
    inputs, varyings, outputs: as in ShaderRecipe.
    defines: values by name, which override those of the recipe.
    """

    name: str = ""
    blocks: Mapping[str, tuple[str, Floats]] = field(default_factory=dict)
    textures: Mapping[str, tuple[str, Any]] = field(default_factory=dict)
    integers: Mapping[str, int] = field(default_factory=dict)
    numbers: Mapping[str, tuple[str, Any]] = field(default_factory=dict)
    inputs: tuple[tuple[str, str], ...] = ()
    varyings: tuple[tuple[str, str, str], ...] = ()
    outputs: tuple[tuple[str, str], ...] = ()
    defines: Mapping[str, int] = field(default_factory=dict)
