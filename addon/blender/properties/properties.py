"""Blender properties from parameter declarations, and back to checked settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)

from ...errors import HairloomError
from ...params import Parameter, Settings
from ...params.curve import KNOT_POSITIONS
from ..base.objects import head_of
from ..base.vertex_weights import color_choices, mask_choices, weight_names

type Changed = Callable[[bpy.types.ID], None]

#: unit of a parameter -> how Blender shows it
_DISPLAY_OPTIONS = {
    "none": {},
    "length": {"subtype": "DISTANCE"},
    "angle": {"subtype": "ANGLE"},
    "time": {"subtype": "TIME_ABSOLUTE"},
    "rate": {},
    "speed": {"unit": "VELOCITY"},
    "acceleration": {"unit": "ACCELERATION"},
    "factor": {"subtype": "FACTOR"},
    "percent": {"subtype": "PERCENTAGE"},
    "pixels": {"subtype": "PIXEL"},
}
#: decimals that a field shows; lengths may be fractions of a millimetre
_PRECISION = {"length": 5, "rate": 2, "pixels": 2}
#: Blender stores float32, which holds this many decimal digits
_STORED_DIGITS = 7
_MAX_INTEGER = 2**31 - 1
#: Labels and buttons are translated by our own tables alone: Blender's words for them may not fit.
TRANSLATION_CONTEXT, BUTTON_CONTEXT = "Hairloom", "Hairloom Button"
#: Lets library overrides of linked grooms have their own settings.
OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}


def property_group(settings: type[Settings], changed: Changed | None = None) -> type[Any]:
    """A PropertyGroup class with one property per parameter, in the same order.

    Args:
        changed: called with the data-block that owns the group, as soon as a value is edited; not
            by keyframes and drivers.
    """
    namespace = {
        "__doc__": settings.title,
        "__annotations__": property_annotations(settings.parameters(), changed),
        "settings": settings,
    }
    return type(f"HAIRLOOM_PG_{settings.section}", (bpy.types.PropertyGroup,), namespace)


def property_annotations(
    parameters: Iterable[Parameter], changed: Changed | None = None, *, clamps: bool = True
) -> dict[str, Any]:
    """name -> Blender property, for the `__annotations__` of a group or an operator.

    Args:
        clamps: whether Blender silently uses the nearest valid number for one that is out of
            range; if not, `settings_of` refuses it.
    """
    return {each.name: _property(each, changed, clamps) for each in parameters}


def settings_of[S: Settings](group: Any, settings: type[S]) -> S:
    """The values in a property group (or operator) made from these settings, checked.

    An operator may have only some of them; the others are defaults.

    Raises:
        HairloomError: a value cannot be used, such as one that a driver has made; names the object
            or the operator, and the labels that its panel shows.
    """
    present = [each for each in settings.parameters() if hasattr(group, each.name)]
    values = {each.name: _value(group, each) for each in present}
    try:
        return settings(**values)
    except HairloomError:
        for each in present:
            each.checked(values[each.name], _place(group, settings), name=each.label)
        raise


def _place(group: Any, settings: type[Settings]) -> str:
    """Where the artist finds these settings: object and section, or the operator."""
    if isinstance(group, bpy.types.Operator):
        return str(group.bl_label)
    owner = group.id_data
    users = (obj for obj in bpy.data.objects if obj.data == owner.original)
    return f"{next(users, owner).name}, {settings.title}"


def weights_of_surface(group: Any, _context: bpy.types.Context, text: str) -> list[str]:
    """The weights and images on the surface of this hair, for the search of a growth mask."""
    owner, head = group.id_data, None
    if isinstance(owner, bpy.types.Curves):
        head = owner.surface
    elif owner.type == "CURVES":
        head = head_of(owner)
    return matching_maps(head, text)


def masks_of_groom(group: Any, _context: bpy.types.Context, text: str) -> list[str]:
    """All weights, attributes and images that may be a mask of this hair, for the search."""
    owner = group.id_data
    if isinstance(owner, bpy.types.Curves):
        hair = next((each for each in bpy.data.objects if each.data == owner), None)
        surface = owner.surface
    else:
        hair, surface = owner, head_of(owner) if owner.type == "CURVES" else None
    is_hair = hair is not None and hair.type == "CURVES"
    names = mask_choices(hair if is_hair else None, surface)
    return [name for name in names if text.lower() in name.lower()]


def colors_of_groom(group: Any, _context: bpy.types.Context, text: str) -> list[str]:
    """All colours of the surface, and images, that may colour this hair, for the search."""
    owner = group.id_data
    hair = next((each for each in bpy.data.objects if each.data == owner), None)
    surface = None if hair is None else head_of(hair)
    return [name for name in color_choices(surface) if text.lower() in name.lower()]


#: kind of a parameter that names painted data -> its search function
_SEARCHES = {"mask": masks_of_groom, "map": colors_of_groom}


def matching_maps(obj: bpy.types.Object | None, text: str) -> list[str]:
    """The weights of a mesh, and the images, whose names contain the text."""
    return [name for name in mask_choices(None, obj) if text.lower() in name.lower()]


def matching_weights(obj: bpy.types.Object | None, text: str) -> list[str]:
    """The weights of a mesh whose names contain the text."""
    names = [] if obj is None or obj.type != "MESH" else weight_names(obj)
    return [name for name in names if text.lower() in name.lower()]


def _property(parameter: Parameter, changed: Changed | None, clamps: bool) -> Any:
    common: dict[str, Any] = {
        "name": parameter.label,
        "description": parameter.description,
        "translation_context": TRANSLATION_CONTEXT,
        "default": parameter.default,
        "update": None if changed is None else _update(changed),
        "override": OVERRIDABLE,
        "options": {"ANIMATABLE"} if parameter.is_animatable else set(),
    }
    if parameter.kind == "toggle":
        return BoolProperty(**common)
    if parameter.kind == "choice":
        return EnumProperty(items=parameter.choices, **common)
    if parameter.kind in _SEARCHES:
        search = _SEARCHES[parameter.kind]
        return StringProperty(search=search, **common | {"options": set()})
    common |= _ranges(parameter, clamps)
    if parameter.kind == "integer":
        return IntProperty(**common)
    if parameter.kind == "color":
        return FloatVectorProperty(size=3, subtype="COLOR", **common)
    if parameter.kind == "curve":
        return FloatVectorProperty(size=len(KNOT_POSITIONS), precision=2, **common)
    return FloatProperty(
        precision=_precision(parameter), **_DISPLAY_OPTIONS[parameter.unit], **common
    )


def _precision(parameter: Parameter) -> int:
    """Decimals that a field shows; enough for its default, if that has at most five."""
    shown = _PRECISION.get(parameter.unit, 3)
    if parameter.unit == "angle":  # shown in degrees, stored in radians
        return shown
    precise = (
        each for each in range(shown, 6) if round(parameter.default, each) == parameter.default
    )
    return next(precise, shown)


def _ranges(parameter: Parameter, clamps: bool) -> dict[str, float]:
    limits: dict[str, float] = {}
    hard = parameter.hard_range if clamps else None
    soft = parameter.soft_range or parameter.hard_range
    for prefix, span in (("", hard), ("soft_", soft)):
        if span is None:
            continue
        low, high = span
        if parameter.kind == "integer":
            low, high = (int(max(-_MAX_INTEGER, min(x, _MAX_INTEGER))) for x in span)
        limits |= {f"{prefix}min": low, f"{prefix}max": high}
    return limits


def _update(changed: Changed) -> Callable[[Any, bpy.types.Context], None]:
    def update(group: Any, _context: bpy.types.Context) -> None:
        changed(group.id_data)

    return update


def _value(group: Any, parameter: Parameter) -> Any:
    value = getattr(group, parameter.name)
    if parameter.kind in {"color", "curve"}:
        return tuple(_without_rounding_error(channel) for channel in value)
    if parameter.kind == "number":
        # 30 degrees in radians have more digits than are stored, so declared values come first
        declared = (parameter.default, *(parameter.hard_range or ()))
        return next(
            (one for one in declared if np.float32(one) == value), _without_rounding_error(value)
        )
    return value


def _without_rounding_error(value: float) -> float:
    """The decimal that was stored: 0.01 becomes 0.00999999978, which is below a minimum of 0.01."""
    return float(f"{value:.{_STORED_DIGITS}g}")
