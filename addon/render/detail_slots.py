"""Slots with the same number of pieces, which the GPU assigns to moving strands.

The gpu module has no indirect draw, and reading back how many strands are drawn in how many pieces
would wait for the GPU. So moving hair is drawn as one draw whose number of slots is estimated from
the last count of its view:

    detail --------> factors, totals, strand_demand  one invocation per strand, as in the next two
    strand_demand -> demand                          sums
    demand --------> slots                           the slots of each strand

    strand_demand RGBA32F: the demand of each strand, see detail.comp.glsl
    demand R32UI 6 x 1:    the sums, see lib_detail_slots.glsl
    slots RGBA32UI:        see lib_detail_slots.glsl; unused slots have no pieces

If strands want more slots than there are, they are drawn in fewer pieces, still from root to tip.
If more fragments are expected than fit into the lists of pixels, only a part of the strands is
drawn, and wider. So a wrong estimate makes no hair vanish.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from . import gpu_objects
from .shader_program import ShaderRecipe, program
from .strand_layout import strand_rows_size

#: numbers of `demand`
DEMANDS = 6
#: factor on the slots that are needed now, since a view that comes nearer soon needs more
_SPARE = 1.5

_TEXTURES = (("FLOAT_2D", "totals"), ("FLOAT_2D", "strand_widths"), ("FLOAT_2D", "strand_demand"))
_DEMAND_RECIPE = ShaderRecipe(
    name="detail_demand",
    compute="detail_demand.comp.glsl",
    textures=_TEXTURES,
    images=(("R32UI", "demand", "READ_WRITE"),),
    integers=("strand_count", "slot_pieces"),
    group_size=(64, 1),
)
_SLOTS_RECIPE = replace(
    _DEMAND_RECIPE,
    name="detail_slots",
    compute="detail_slots.comp.glsl",
    images=(*_DEMAND_RECIPE.images, ("RGBA32UI", "slots")),
    integers=(*_DEMAND_RECIPE.integers, "slot_count", "capacity"),
)


class DetailSlots:
    """The slots of one groom in one view. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU."""
        self._strand_demand: Any = None
        self._demand: Any = None
        self._slots: Any = None
        self._textures: dict[str, Any] = {}
        self._integers: dict[str, int] = {}

    def strand_demand(self, strand_count: int) -> Any:
        """The texture into which the detail pass writes the demand of strands."""
        size = strand_rows_size(strand_count, 1)
        if (
            self._strand_demand is None
            or (self._strand_demand.width, self._strand_demand.height) != size
        ):
            self._strand_demand = gpu_objects.texture(size, format="RGBA32F")
        return self._strand_demand

    def sum_demand(
        self, totals: Any, strand_widths: Any, strand_count: int, slot_pieces: int
    ) -> None:
        """Sum the demand on the GPU.

        Args:
            totals: see detail_pass.py. strand_widths: factor on each strand's width.
            slot_pieces: pieces of a slot.
        """
        if self._demand is None:
            self._demand = gpu_objects.texture((DEMANDS, 1), format="R32UI")
        self._demand.clear(format="UINT", value=(0,))
        self._textures = {
            "totals": totals,
            "strand_widths": strand_widths,
            "strand_demand": self._strand_demand,
        }
        self._integers = {"strand_count": strand_count, "slot_pieces": slot_pieces}
        self._dispatch(_DEMAND_RECIPE, {"demand": self._demand}, self._integers)

    def demand_sums(self) -> list[int]:
        """The sums. Waits for the GPU."""
        return [int(each) for each in np.asarray(self._demand.read()).ravel()]

    def filled_slots(self, slot_count: int, capacity: int) -> Any:
        """The texture of slots, filled with all counted strands.

        Args:
            slot_count: most slots that may be used.
            capacity: number of fragments that fit.
        """
        if self._slots is None or self._slots.width * self._slots.height < slot_count:
            size = strand_rows_size(int(slot_count * _SPARE), 1)
            self._slots = gpu_objects.texture(size, format="RGBA32UI")
        self._slots.clear(format="UINT", value=(0, 0, 0, 0))
        images = {"demand": self._demand, "slots": self._slots}
        integers = {**self._integers, "slot_count": slot_count, "capacity": capacity}
        self._dispatch(_SLOTS_RECIPE, images, integers)
        return self._slots

    def _dispatch(
        self, recipe: ShaderRecipe, images: Mapping[str, Any], integers: Mapping[str, int]
    ) -> None:
        shader = program(recipe)
        shader.bind(textures=self._textures, images=images, integers=integers)
        shader.dispatch(integers["strand_count"])
