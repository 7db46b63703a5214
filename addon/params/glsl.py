"""From a `Settings` class to a GLSL struct in std140 layout, and from values to its bytes.

std140 (OpenGL 4.5 specification, section 7.6.2.2): a scalar aligns to 4 bytes, a vec3 to 16 and
takes 12, the whole struct is padded to a multiple of 16.
"""

from __future__ import annotations

import numpy as np

from .field import Parameter, Settings

_SCALAR_TYPES = {"number": "float", "integer": "int", "toggle": "int", "choice": "int"}


def struct_source(settings: type[Settings], struct_name: str) -> str:
    """GLSL declaration of the struct, one member per parameter, in declaration order."""
    _check_kinds(settings)
    members = [f"  {_SCALAR_TYPES.get(p.kind, 'vec3')} {p.name};" for p in _members(settings)]
    return "\n".join([f"struct {struct_name} {{", *members, "};", ""])


def struct_values(settings: Settings) -> np.ndarray:
    """The values in std140 layout, (n,) float32; integers are stored as their bit patterns."""
    _check_kinds(type(settings))
    words: list[float | np.int32] = []
    for parameter in _members(type(settings)):
        value = getattr(settings, parameter.name)
        if parameter.kind == "color":
            words.extend([0.0] * (-len(words) % 4))
            words.extend(value)
        else:
            words.append(_scalar(parameter, value))
    words.extend([0.0] * (-len(words) % 4))
    packed = np.zeros(len(words), np.float32)
    bits = packed.view(np.int32)
    for index, word in enumerate(words):
        if isinstance(word, np.int32):
            bits[index] = word
        else:
            packed[index] = word
    return packed


def _members(settings: type[Settings]) -> list[Parameter]:
    """All parameters but the names of colour maps: the mapped colours are stored with strands."""
    return [each for each in settings.parameters() if each.kind != "map"]


def _check_kinds(settings: type[Settings]) -> None:
    """Assert that no parameter is a curve, which shaders read from a texture, or a mask's name."""
    unsupported = [p.name for p in settings.parameters() if p.kind in ("curve", "mask")]
    assert not unsupported, f"{settings.section}: {', '.join(unsupported)}"


def _scalar(parameter: Parameter, value: float | bool | str) -> float | np.int32:
    if parameter.kind == "choice":
        return np.int32([identifier for identifier, _, _ in parameter.choices].index(str(value)))
    return float(value) if parameter.kind == "number" else np.int32(value)
