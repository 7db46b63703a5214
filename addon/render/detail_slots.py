"""Strands in slots of equally many pieces, which the GPU itself fills: what moves is drawn so.

The gpu module has no indirect draw, and to read back how many strands are drawn in how many pieces
waits for the GPU. So what moves is one draw of as many slots as the last count of its view
suggests:

    detail ----> factors, totals, asked      one invocation a strand, as the others
    asked -----> demand                      all added up
    demand ----> slots                       in which of them each strand is

    asked  RGBA32F:       what a strand asks for, see detail.comp.glsl
    demand R32UI 6 x 1:   what all do, see lib_detail_slots.glsl
    slots  RGBA32UI:      likewise; what is not in use has no pieces

Where more slots are wanted than there are, strands are drawn in fewer pieces, each of them from its
root to its tip. Where more fragments are to be expected than the lists of pixels have room for, a
part of the strands is drawn, and these are wider. So nothing vanishes that was not counted.
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
#: how many times more slots are made than are needed: a view that comes nearer soon needs more
_SPARE = 1.5

_TEXTURES = (("FLOAT_2D", "totals"), ("FLOAT_2D", "strand_widths"), ("FLOAT_2D", "asked"))
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
    """The slots of one groom in one view. Making one touches no GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Let go of all that lies on the GPU."""
        self._asked: Any = None
        self._demand: Any = None
        self._slots: Any = None
        self._textures: dict[str, Any] = {}
        self._integers: dict[str, int] = {}

    def asked(self, strand_count: int) -> Any:
        """The texture into which the pass of detail writes what strands ask for."""
        size = strand_rows_size(strand_count, 1)
        if self._asked is None or (self._asked.width, self._asked.height) != size:
            self._asked = gpu_objects.texture(size, format="RGBA32F")
        return self._asked

    def count(self, totals: Any, strand_widths: Any, strand_count: int, slot_pieces: int) -> None:
        """Add it up on the GPU.

        Args:
            totals: see detail_pass.py. strand_widths: factor of each strand's width.
            slot_pieces: pieces that a slot has.
        """
        if self._demand is None:
            self._demand = gpu_objects.texture((DEMANDS, 1), format="R32UI")
        self._demand.clear(format="UINT", value=(0,))
        self._textures = {"totals": totals, "strand_widths": strand_widths, "asked": self._asked}
        self._integers = {"strand_count": strand_count, "slot_pieces": slot_pieces}
        self._dispatch(_DEMAND_RECIPE, {"demand": self._demand}, self._integers)

    def demanded(self) -> list[int]:
        """What was added up; waits for the GPU."""
        return [int(each) for each in np.asarray(self._demand.read()).ravel()]

    def filled(self, slot_count: int, capacity: int) -> Any:
        """The texture of slots once all strands that were counted are in it.

        Args:
            slot_count: how many may be in use.
            capacity: fragments that have room.
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
