"""Parameters: validated when created, named in errors, and declared completely."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params import Parameter, Settings, choice, color, curve, integer, number, toggle
from hairloom.addon.params.curve import KNOT_POSITIONS

pytestmark = pytest.mark.portable

ADDON = Path(__file__).parents[3] / "addon"
PURE_ROOMS = ("groom", "dynamics", "refine", "shading", "cards", "exchange")


@dataclass(frozen=True, kw_only=True)
class Sample(Settings):
    section: ClassVar[str] = "sample"
    title: ClassVar[str] = "Sample"

    width: float = number(
        0.5, label="Width", description="How wide", soft=(0.0, 1.0), hard=(-1.0, 2.0)
    )
    count: int = integer(4, label="Count", description="How many", soft=(1, 8), hard=(1, 64))
    is_on: bool = toggle(True, label="On", description="Whether")
    tint: tuple[float, float, float] = color((0.1, 0.2, 0.3), label="Tint", description="Colour")
    kind: str = choice(
        "round",
        (("round", "Round", "A circle"), ("flat", "Flat", "A band")),
        label="Kind",
        description="Which",
    )
    taper: tuple[float, ...] = curve(
        (1.0, 1.0, 1.0, 0.5, 0.0), label="Taper", description="How it ends", hard=(0.0, 1.0)
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", 2.1),
        ("width", -1.1),
        ("width", float("nan")),
        ("width", float("inf")),
        ("width", "wide"),
        ("width", True),
        ("width", None),
        ("count", 2.5),
        ("count", 0),
        ("count", True),
        ("is_on", 1),
        ("tint", (0.1, 0.2)),
        ("tint", (0.1, 0.2, 1.5)),
        ("tint", 0.5),
        ("kind", "square"),
        ("kind", 0),
        ("taper", (1.0, 0.5, 0.0)),
        ("taper", (1.0, 0.5, 0.5, 0.5, 1.1)),
        ("taper", (1.0, 0.5, float("nan"), 0.5, 0.0)),
        ("taper", "abcde"),
        ("taper", 1.0),
    ],
)
def test_a_bad_value_is_refused_by_name_value_and_remedy(name: str, value: Any) -> None:
    with pytest.raises(HairloomError) as caught:
        Sample(**{name: value})
    assert f"'{name}' is {value!r}" in caught.value.problem
    assert caught.value.place == "sample settings"
    assert caught.value.remedy.startswith("Use ")


@pytest.mark.parametrize(
    ("name", "value"), [("width", -1.0), ("width", 2.0), ("count", 1), ("count", 64)]
)
def test_the_ends_of_the_hard_range_are_allowed(name: str, value: float) -> None:
    assert getattr(Sample(**{name: value}), name) == value


def test_values_take_their_canonical_type() -> None:
    sample = Sample(width=1, count=3.0, tint=[0, 1, 0.5])  # type: ignore[arg-type]
    assert (type(sample.width), type(sample.count), sample.tint) == (float, int, (0.0, 1.0, 0.5))


def test_plain_data_comes_back_and_missing_names_keep_their_default() -> None:
    sample = Sample(width=0.75, kind="flat", taper=(0.0, 0.25, 0.5, 0.75, 1.0))
    assert Sample.from_dict(sample.as_dict(), "here") == sample
    assert Sample.from_dict({"kind": "flat"}, "here") == Sample(kind="flat")


def test_an_unknown_name_is_refused_and_near_ones_are_suggested() -> None:
    with pytest.raises(
        HairloomError, match=r"unknown sample parameter 'wdth'\. Did you mean width"
    ):
        Sample.from_dict({"wdth": 1.0}, "here")


def _all_settings() -> list[type[Settings]]:
    """Every Settings subclass of the pure rooms, found by importing all of their modules."""
    for room in PURE_ROOMS:
        for file in sorted((ADDON / room).rglob("[!_]*.py")):
            module = ".".join(file.relative_to(ADDON).with_suffix("").parts)
            importlib.import_module(f"hairloom.addon.{module}")
    found, waiting = [], [Settings]
    while waiting:
        subclasses = waiting.pop().__subclasses__()
        waiting += subclasses
        found += [kind for kind in subclasses if kind.__module__.startswith("hairloom.")]
    return found


def _all_parameters() -> list[tuple[type[Settings], Parameter]]:
    return [(kind, parameter) for kind in ALL_SETTINGS.values() for parameter in kind.parameters()]


def test_the_table_of_parameter_sets_is_complete() -> None:
    """It has all sets except shared base classes, which have no section."""
    assert {kind.__qualname__ for kind in _all_settings() if kind.section} == {
        kind.__qualname__ for kind in ALL_SETTINGS.values()
    }


@pytest.mark.parametrize("kind", ALL_SETTINGS.values(), ids=ALL_SETTINGS)
def test_each_set_has_a_section_a_title_and_valid_defaults(kind: type[Settings]) -> None:
    assert kind.section.isidentifier()
    assert kind.title
    assert kind().as_dict() == {p.name: p.default for p in kind.parameters()}


@pytest.mark.parametrize(
    ("kind", "parameter"),
    _all_parameters(),
    ids=[f"{kind.section}.{parameter.name}" for kind, parameter in _all_parameters()],
)
def test_each_parameter_is_declared_in_full(kind: type[Settings], parameter: Parameter) -> None:
    assert parameter.label
    assert parameter.description
    assert not parameter.description.endswith(".")  # Blender's tooltips end without one
    assert parameter.source
    assert parameter.checked(parameter.default, kind.section) == parameter.default
    if parameter.kind in ("number", "integer"):
        assert parameter.soft_range is not None
        assert parameter.hard_range is not None
        (soft_low, soft_high), (low, high) = parameter.soft_range, parameter.hard_range
        assert low <= soft_low < soft_high <= high
        assert soft_low <= parameter.default <= soft_high
    if parameter.kind == "curve":
        assert len(parameter.default) == len(KNOT_POSITIONS)
        assert parameter.hard_range is not None
    if parameter.kind == "choice":
        assert all(label and text for _, label, text in parameter.choices)
