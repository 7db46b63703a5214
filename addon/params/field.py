"""Declaring a parameter, and the checked, immutable object that holds a set of them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from inspect import get_annotations
from typing import Any, ClassVar, Literal, Self, TypedDict, Unpack

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError, did_you_mean
from .curve import KNOT_POSITIONS, Curve

Kind = Literal["number", "integer", "toggle", "color", "choice", "curve", "mask", "map"]
#: Kinds whose value is the name of painted data.
NAME_KINDS: tuple[Kind, ...] = ("mask", "map")
#: length [m], angle [rad], time [s], rate [1/s], speed [m/s], factor [0..1], acceleration [m/s^2]
Unit = Literal[
    "none",
    "length",
    "angle",
    "time",
    "rate",
    "speed",
    "factor",
    "percent",
    "acceleration",
    "pixels",
]
Range = tuple[float, float]
#: Where a set of parameters is stored: on the groom (Blender's Curves), the character (the Object)
#: or the scene; or nowhere, as a job's, which last for one operator or one call of a verb.
Owner = Literal["groom", "character", "scene", "job"]
#: Holds all sections of one owner as attributes: a property group, or anything like it.
Sections = Any

_METADATA_KEY = "parameter"
#: Similarity to a mistyped name, from 0 to 1, from which on a name is suggested instead.
_MIN_NAME_SIMILARITY = 0.5


@dataclass(frozen=True)
class Condition:
    """A condition on settings.

    `unmet_reason` is the text that a field shows while its condition does not hold, such as "needs
    Clump".
    """

    holds: Callable[[Sections], bool]
    unmet_reason: Callable[[Sections], str]

    def __call__(self, sections: Sections) -> bool:
        return self.holds(sections)


@dataclass(frozen=True)
class Parameter:
    """One parameter: everything that Blender, GLSL, presets and the docs need of it.

    `soft_range` is the range of a slider, `hard_range` that of valid values; both inclusive.
    `source` names the paper or equation, or is "Hairloom".
    `panel` is the sub-panel of its section that it is drawn in; empty: the section's own panel.
    It is drawn where `shown_when` holds, and greyed out, with the reason, where `active_when` does
    not hold.
    `is_painted`: a mask may multiply it; `Settings` declares the mask's parameter after it.
    `is_animatable`: keyframes and drivers may change it.
    `masked_parameter`, for a mask: the parameter that it multiplies and is drawn beside.
    """

    name: str
    kind: Kind
    default: Any
    label: str
    description: str
    source: str
    unit: Unit = "none"
    soft_range: Range | None = None
    hard_range: Range | None = None
    choices: tuple[tuple[str, str, str], ...] = ()  # identifier, label, description
    panel: str = ""
    shown_when: Condition | None = None
    active_when: Condition | None = None
    is_painted: bool = False
    is_animatable: bool = True
    masked_parameter: str = ""

    def checked(self, value: Any, place: str, *, name: str = "") -> Any:
        """The value in its canonical type.

        Args:
            name: of the parameter in the message; "": its own.

        Raises:
            HairloomError: the value is not allowed; names it and its range.
        """
        try:
            return self._canonical(value)
        except (TypeError, ValueError, OverflowError) as error:
            problem = f"'{name or self.name}' is {value!r}, but {error}"
            raise HairloomError(problem, place=place, remedy=self._remedy()) from error

    def _canonical(self, value: Any) -> Any:
        if self.kind == "toggle":
            if not isinstance(value, bool):
                raise TypeError("it must be true or false")
            return value
        if self.kind == "choice":
            if value not in [identifier for identifier, _, _ in self.choices]:
                raise ValueError("that is not one of its choices")
            return str(value)
        if self.kind in NAME_KINDS:
            if not isinstance(value, str):
                raise TypeError("it must be a name")
            return value
        if self.kind == "color":
            return self._numbers(value, 3, "red, green and blue")
        if self.kind == "curve":
            return self._numbers(value, len(KNOT_POSITIONS), "from root to tip")
        if self.kind == "integer":
            if isinstance(value, bool) or int(_finite(value)) != value:
                raise TypeError("it must be a whole number")
            return int(self._in_range(_finite(value)))
        return self._in_range(_finite(value))

    def _numbers(self, value: Any, count: int, meaning: str) -> tuple[float, ...]:
        if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != count:
            raise TypeError(f"it must be {count} numbers, {meaning}, with commas between them")
        return tuple(self._in_range(_finite(each)) for each in value)

    def _in_range(self, value: float) -> float:
        low, high = self.hard_range or (-math.inf, math.inf)
        if not low <= value <= high:
            raise ValueError(f"it must lie from {low:g} to {high:g}")
        return value

    def _remedy(self) -> str:
        if self.choices:
            return "Use one of " + ", ".join(identifier for identifier, _, _ in self.choices)
        if self.kind == "toggle":
            return f"Use true or false (default {str(self.default).lower()})"
        if self.kind == "mask":
            return "Use the name of a vertex group, of an attribute or of an image"
        if self.kind == "map":
            return "Use the name of a colour attribute of the surface, or of an image"
        if self.hard_range:
            low, high = self.hard_range
            if self.unit == "angle":
                span = f"{math.degrees(low):g} to {math.degrees(high):g} degrees"
                return f"Use {span}, which is {low:g} to {high:g} here"
            quantity = "values" if self.kind in ("color", "curve") else "a value"
            return f"Use {quantity} from {low:g} to {high:g} (default {self.default})"
        return f"Use a {self.kind} (default {self.default})"


def _finite(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise TypeError("it must be a number")
    if not math.isfinite(value):
        raise ValueError("it must be finite")
    return float(value)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Base of every room's parameter set: frozen, and checked against its declarations on creation.

    Raises:
        HairloomError: a value is outside its hard range or of the wrong kind.
    """

    #: short name, as in preset files, property groups and the docs
    section: ClassVar[str] = ""
    title: ClassVar[str] = ""
    #: its page in the docs, and the heading there, such as cards#limits
    help_page: ClassVar[str] = ""
    owner: ClassVar[Owner] = "job"
    #: sub-panels of the section's panel, in order
    panels: ClassVar[tuple[str, ...]] = ()
    #: the panel that its own follows, if that shows nothing but what is declared here
    panel_after: ClassVar[str] = ""
    #: the text that its panel shows above all settings
    panel_note: ClassVar[str] = ""
    #: the toggle in the header of its panel
    header_toggle: ClassVar[str] = ""
    #: whether keyframes and drivers may change any of its parameters
    is_animatable: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        """Declare, after each parameter that may be painted, the parameter that names its mask."""
        super().__init_subclass__()
        declared: dict[str, Any] = {}
        for name, kind in get_annotations(cls).items():
            declared[name] = kind
            field = vars(cls).get(name)
            parameter = getattr(field, "metadata", {}).get(_METADATA_KEY)
            if parameter is not None and parameter.is_painted:
                declared[mask_parameter(name)] = "str"
                setattr(cls, mask_parameter(name), _mask(name, parameter))
        cls.__annotations__ = declared

    def __post_init__(self) -> None:
        for parameter in self.parameters():
            value = parameter.checked(getattr(self, parameter.name), f"{self.section} settings")
            object.__setattr__(self, parameter.name, value)

    @classmethod
    @cache
    def parameters(cls) -> tuple[Parameter, ...]:
        """The declarations, in the order of the class."""
        overrides = {} if cls.is_animatable else {"is_animatable": False}
        return tuple(
            dataclasses.replace(field.metadata[_METADATA_KEY], name=field.name, **overrides)
            for field in dataclasses.fields(cls)
        )

    def multiplied(self, **factors: float) -> Self:
        """The same with these numbers multiplied by factors, clamped to their hard ranges."""
        return self.clipped(
            **{name: getattr(self, name) * factor for name, factor in factors.items()}
        )

    def clipped(self, **values: float) -> Self:
        """The same with these numbers, clamped to their hard ranges."""
        limits = {p.name: p.hard_range or (-math.inf, math.inf) for p in self.parameters()}
        return dataclasses.replace(
            self,
            **{
                name: min(max(each, limits[name][0]), limits[name][1])
                for name, each in values.items()
            },
        )

    def painted(self, name: str, factor: Floats) -> Floats:
        """A number multiplied by painted factors (n,), clamped to its hard range."""
        (parameter,) = (each for each in self.parameters() if each.name == name)
        return np.clip(getattr(self, name) * factor, *(parameter.hard_range or (None, None)))

    def with_masks_of(self, other: Self) -> Self:
        """The same, with masks and maps of the other settings where these name none.

        What is painted on a particular head is not part of a preset.
        """
        names = [each.name for each in self.parameters() if each.kind in NAME_KINDS]
        return dataclasses.replace(
            self, **{name: getattr(self, name) or getattr(other, name) for name in names}
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as stored in presets and reports."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], place: str) -> Self:
        """Settings from plain data; missing names keep their defaults.

        Raises:
            HairloomError: a name is unknown, or a value is outside its hard range.
        """
        declared = {parameter.name: parameter for parameter in cls.parameters()}
        unknown = sorted(set(values) - set(declared))
        if unknown:
            suggestion = did_you_mean(unknown[0], declared, similarity=_MIN_NAME_SIMILARITY)
            raise HairloomError(
                f"unknown {cls.section} parameter '{unknown[0]}'",
                place=place,
                remedy=f"{suggestion}docs/parameters.md lists all of them",
            )
        return cls(**{name: declared[name].checked(v, place) for name, v in values.items()})


def when(parameter: str, *values: Any, unmet_reason: str = "") -> Condition:
    """The condition that a parameter, as "section.name", has one of these values; without values:
    that it is not 0, empty or false."""
    section, _, name = parameter.partition(".")

    def holds(sections: Sections) -> bool:
        value = getattr(getattr(sections, section), name)
        return value in values if values else bool(value)

    return Condition(holds, lambda _: unmet_reason)


def both(one: Condition, other: Condition) -> Condition:
    return Condition(
        lambda sections: one(sections) and other(sections),
        lambda sections: (other if one(sections) else one).unmet_reason(sections),
    )


def either(one: Condition, other: Condition) -> Condition:
    """The condition that one of two holds; if neither does, the first one's `unmet_reason` is
    shown."""
    return Condition(lambda sections: one(sections) or other(sections), one.unmet_reason)


class _DrawOptions(TypedDict, total=False):
    """Where and when a parameter is drawn, and what may change it; see `Parameter`."""

    panel: str
    shown_when: Condition
    active_when: Condition
    is_painted: bool
    is_animatable: bool


def number(
    default: float,
    *,
    label: str,
    description: str,
    soft: Range,
    hard: Range,
    unit: Unit = "none",
    source: str = "Hairloom",
    **options: Unpack[_DrawOptions],
) -> Any:
    """Declare a real number."""
    return _declare(
        Parameter(
            "", "number", float(default), label, description, source, unit, soft, hard, **options
        )
    )


def integer(
    default: int,
    *,
    label: str,
    description: str,
    soft: Range,
    hard: Range,
    source: str = "Hairloom",
    **options: Unpack[_DrawOptions],
) -> Any:
    """Declare a whole number."""
    return _declare(
        Parameter(
            "", "integer", int(default), label, description, source, "none", soft, hard, **options
        )
    )


def color(
    default: tuple[float, float, float],
    *,
    label: str,
    description: str,
    source: str = "Hairloom",
    maximum: float = 1.0,
    **options: Unpack[_DrawOptions],
) -> Any:
    """Declare a scene-linear Rec.709 colour."""
    span = (0.0, maximum)
    return _declare(
        Parameter(
            "", "color", tuple(default), label, description, source, "none", span, span, **options
        )
    )


def toggle(
    default: bool,
    *,
    label: str,
    description: str,
    source: str = "Hairloom",
    **options: Unpack[_DrawOptions],
) -> Any:
    """Declare an on/off switch."""
    return _declare(Parameter("", "toggle", default, label, description, source, **options))


def choice(
    default: str,
    choices: tuple[tuple[str, str, str], ...],
    *,
    label: str,
    description: str,
    source: str = "Hairloom",
    **options: Unpack[_DrawOptions],
) -> Any:
    """Declare one of several named options, each (identifier, label, description)."""
    return _declare(
        Parameter(
            "",
            "choice",
            default,
            label,
            description,
            source,
            choices=choices,
            **options,
        )
    )


def curve(
    default: Curve,
    *,
    label: str,
    description: str,
    hard: Range,
    source: str = "Hairloom",
    **options: Unpack[_DrawOptions],
) -> Any:
    """Declare values along the strand, see `curve.sample_curve`."""
    return _declare(
        Parameter(
            "", "curve", tuple(default), label, description, source, "none", hard, hard, **options
        )
    )


def color_map(
    *, label: str, description: str, source: str = "Hairloom", **options: Unpack[_DrawOptions]
) -> Any:
    """Declare the name of painted colours, which replace a colour as a mask multiplies a number."""
    return _declare(Parameter("", "map", "", label, description, source, **options))


def mask_parameter(name: str) -> str:
    """The parameter that names the mask of another one."""
    return f"{name}_mask"


def _mask(masked_parameter: str, parameter: Parameter) -> Any:
    description = (
        f"Mask that {parameter.label} is multiplied by: a vertex group or attribute of the "
        "surface, an attribute of the curves, or an image on the surface's UVs. If empty, the "
        "value is the same everywhere"
    )
    label = f"{parameter.label} Mask"
    return _declare(
        Parameter("", "mask", "", label, description, "Hairloom", masked_parameter=masked_parameter)
    )


def _declare(parameter: Parameter) -> Any:
    return dataclasses.field(default=parameter.default, metadata={_METADATA_KEY: parameter})
