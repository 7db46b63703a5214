"""Reading and writing what a groom holds besides its strands, as attributes of hair curves.

Blender lists them in Data properties > Attributes, and its modifiers pass them on. Names follow
Epic's "Alembic for Grooms Specification" 1.5. Each closest guide has its own attribute, because
Blender has no attribute type of three integers.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ...arrays import Ints
from ...exchange.groom import Groom
from ...exchange.read_groom import finite_or_zero
from ..base.attributes import read_attribute, set_attribute

STRAND_ID = "groom_id"
GUIDE = "groom_guide"
CLOSEST_GUIDES = ("groom_closest_guide_1", "groom_closest_guide_2", "groom_closest_guide_3")
GUIDE_WEIGHTS = "groom_guide_weights"
#: custom property of the Curves data-block: group as text -> its name
GROUP_NAMES = "groom_group_names"


def store_groom(curves: bpy.types.Curves, groom: Groom) -> None:
    """Write everything but the strands of a groom to hair curves made from its strands."""
    if groom.strand_id is not None:
        set_attribute(curves, STRAND_ID, "CURVE", groom.strand_id)
    if groom.is_guide is not None:
        set_attribute(curves, GUIDE, "CURVE", groom.is_guide)
    if groom.closest_guides is not None and groom.guide_weights is not None:
        for name, ids in zip(CLOSEST_GUIDES, groom.closest_guides.T, strict=True):
            set_attribute(curves, name, "CURVE", ids)
        set_attribute(curves, GUIDE_WEIGHTS, "CURVE", groom.guide_weights)
    if groom.group_names:
        store_group_names(curves, groom.group_names)


def store_group_names(curves: bpy.types.Curves, names: Mapping[int, str]) -> None:
    """Name the groups of hair curves."""
    curves[GROUP_NAMES] = {str(group): name for group, name in names.items()}


def stored_groom(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, curve_indices: Ints
) -> dict[str, Any]:
    """What the evaluated hair holds besides its strands: the other arguments of `Groom`.

    IDs are left out if two curves share one, as copied curves do; closest guides are left out if
    one of them no longer exists.

    Args:
        curve_indices: (strand_count,) of the curves that became strands, from `read_curves`.

    Returns:
        group_names, and whichever of strand_id, is_guide, closest_guides and guide_weights the
        hair has.
    """
    curves = hair.evaluated_get(depsgraph).data
    fields: dict[str, Any] = {"group_names": group_names(hair)}
    guide = read_attribute(curves, GUIDE, "CURVE")
    if guide is not None:
        fields["is_guide"] = guide[curve_indices] != 0
    ids = _integer_attribute(curves, STRAND_ID, curve_indices)
    if ids is None or len(np.unique(ids)) < len(ids):
        return fields
    fields["strand_id"] = ids
    closest = [_integer_attribute(curves, name, curve_indices) for name in CLOSEST_GUIDES]
    weights = read_attribute(curves, GUIDE_WEIGHTS, "CURVE", 3)
    if weights is not None and all(each is not None for each in closest):
        guides = np.stack(closest, axis=1)  # type: ignore[arg-type]
        if np.isin(guides, ids).all():
            fields |= {
                "closest_guides": guides,
                "guide_weights": finite_or_zero(weights[curve_indices]),
            }
    return fields


def group_names(hair: bpy.types.Object) -> dict[int, str]:
    """Group -> name, for named groups of hair curves.

    Read from the original data, since modifiers drop custom properties.
    """
    stored = hair.original.data.get(GROUP_NAMES)
    if not hasattr(stored, "to_dict"):
        return {}
    named = stored.to_dict().items()
    return {int(key): name for key, name in named if _is_number(key) and isinstance(name, str)}


def _is_number(text: str) -> bool:
    return text.removeprefix("-").isdecimal() and abs(int(text)) < 1 << 31


def _integer_attribute(curves: bpy.types.Curves, name: str, curve_indices: Ints) -> Ints | None:
    values = read_attribute(curves, name, "CURVE")
    return None if values is None or values.dtype.kind != "i" else values[curve_indices]
