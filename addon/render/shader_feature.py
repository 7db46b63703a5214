"""What programs have for one purpose, such as Marschner's model or opacity maps: said once.

A feature holds each declaration together with the value that a draw gives it; `feature_programs`
makes programs of them. Nothing here needs a GPU.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..arrays import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class ShaderFeature:
    """Part of a program.

    name: what it adds to the program's name; nothing where all programs of a recipe have it.
    blocks: (struct, std140 values) by name. textures: (sampler type, texture) by name.
    integers: by name. numbers: (type, value) by name.
    inputs, varyings, outputs: as in ShaderRecipe.
    defines: value by name; one that the recipe has as well takes its place.
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
