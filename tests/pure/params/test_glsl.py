"""The layout that `params.glsl` writes, against the std140 rules of the specification."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params import Settings, choice, color, integer, number, toggle
from hairloom.addon.params.glsl import struct_source, struct_values

#: OpenGL 4.5, section 7.6.2.2, rules 1 and 3: base alignment and size in bytes
ALIGNMENT = {"float": (4, 4), "int": (4, 4), "vec3": (16, 12)}


@dataclass(frozen=True, kw_only=True)
class Mixed(Settings):
    """Every case of the layout: a vec3 at a boundary, and after one, two and three scalars."""

    section: ClassVar[str] = "mixed"
    title: ClassVar[str] = "Mixed"

    first: tuple[float, float, float] = color((0.1, 0.2, 0.3), label="a", description="a")
    in_its_lane: float = number(0.4, label="b", description="b", soft=(0.0, 1.0), hard=(0.0, 1.0))
    whole: int = integer(-7, label="c", description="c", soft=(-9, 9), hard=(-9, 9))
    after_one: tuple[float, float, float] = color((0.5, 0.6, 0.7), label="d", description="d")
    after_six: tuple[float, float, float] = color((0.8, 0.9, 1.0), label="e", description="e")
    switch: bool = toggle(True, label="f", description="f")
    pick: str = choice("c", tuple((name, name, name) for name in "abc"), label="g", description="g")


def members(settings: type[Settings]) -> list[tuple[str, str]]:
    """(type, name) of each member, parsed from the GLSL text."""
    lines = struct_source(settings, "Block").splitlines()
    assert lines[0] == "struct Block {"
    assert lines[-1] == "};"
    return [(line.split()[0], line.split()[1].rstrip(";")) for line in lines[1:-1]]


def offsets(settings: type[Settings]) -> tuple[list[int], int]:
    """Offset of each member and size of the struct, by the rules of std140."""
    end, found = 0, []
    for kind, _ in members(settings):
        alignment, size = ALIGNMENT[kind]
        start = -(-end // alignment) * alignment
        found.append(start)
        end = start + size
    return found, -(-end // 16) * 16  # rule 9: a struct is padded to a multiple of a vec4


def read_back(settings: Settings) -> dict[str, object]:
    data = struct_values(settings).tobytes()
    places, size = offsets(type(settings))
    assert len(data) == size
    formats = {"float": "<f", "int": "<i", "vec3": "<3f"}
    result: dict[str, object] = {}
    for (kind, name), place in zip(members(type(settings)), places, strict=True):
        values = struct.unpack_from(formats[kind], data, place)
        result[name] = values if kind == "vec3" else values[0]
    return result


def test_offsets_of_the_mixed_struct_are_the_known_ones() -> None:
    assert offsets(Mixed) == ([0, 12, 16, 32, 48, 60, 64], 80)


def test_each_value_lies_at_its_offset() -> None:
    assert read_back(Mixed()) == {
        "first": pytest.approx((0.1, 0.2, 0.3)),
        "in_its_lane": pytest.approx(0.4),
        "whole": -7,
        "after_one": pytest.approx((0.5, 0.6, 0.7)),
        "after_six": pytest.approx((0.8, 0.9, 1.0)),
        "switch": 1,
        "pick": 2,
    }


def has_curves(kind: type[Settings]) -> bool:
    return any(parameter.kind == "curve" for parameter in kind.parameters())


STRUCTS = {name: kind for name, kind in ALL_SETTINGS.items() if not has_curves(kind)}


def test_a_set_with_curves_is_no_struct() -> None:
    """Curves have no layout here and raise an error instead of being dropped silently."""
    assert "dynamics" not in STRUCTS
    for write in (lambda kind: struct_source(kind, "Block"), lambda kind: struct_values(kind())):
        with pytest.raises(AssertionError, match=r"dynamics: .*style_along"):
            write(ALL_SETTINGS["dynamics"])


@pytest.mark.parametrize("kind", STRUCTS.values(), ids=STRUCTS)
def test_every_parameter_set_reads_back(kind: type[Settings]) -> None:
    found = read_back(kind())
    for parameter in kind.parameters():
        value = parameter.default
        if parameter.kind == "map":
            assert parameter.name not in found, "the name of what is painted"
            continue
        if parameter.kind == "choice":
            value = [identifier for identifier, _, _ in parameter.choices].index(value)
        if parameter.kind == "toggle":
            value = int(value)
        assert found[parameter.name] == pytest.approx(value, rel=1e-6)


def test_values_are_float32_and_a_whole_number_of_vec4() -> None:
    values = struct_values(Mixed())
    assert values.dtype == np.float32
    assert len(values) % 4 == 0
