"""Leads riding strands out of colliders on the GPU: `refine.lead_out` after RidePass, on textures
in the layouts of `strand_layout`.

    strand_spans  RGBA32F: the points of each strand, see strand_layout.StrandLayout; w the last
                  point that moves rigidly with the root
    solids, rounds, fields: the colliders, see collider_textures.py
    rest_points, root_motions: the motion of points with their roots, see ride_pass.py
    clearances    R32F: distance that each point keeps where its root carries it [m]
    states        RGBA32F: state of each strand, x whether it is led out, see lead_out.comp.glsl
    near_strands, near_counts RGBA32F: strands that are too near, see lead_out.comp.glsl
    segment_bends RGBA32F: xyz bend of the segment that ends at a point, see lead_out.Deflections
    led_points    RGBA32F: xyz position of points that are led out [m, world]
    led_texels    RG32F: texels of points that were led out earlier
    cv_points     RGBA32F: xyz position now [m, world], changed in place
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ..arrays import Ints, number_in_piece
from ..dynamics.colliders import PosedCollider
from ..refine.lead_out import (
    ATTEMPTS,
    BISECTIONS,
    DIRECTION_COUNT,
    RETURN_RATE,
    SWEEPS,
    Clearance,
    LedOut,
)
from .capabilities import can_read_own_writes
from .collider_textures import ColliderTextures, SolidKinds, UploadedColliders
from .shader_program import ShaderRecipe, program
from .shader_source import LEAD_BLOCK
from .strand_layout import StrandLayout, from_strand_rows, strand_rows, strand_rows_size
from .textures import cleared_texture, texture_from, texture_to_array

_GROUP = (64, 1)
#: replaces infinity on the GPU [m]
_INFINITE = np.float32(1.0e30)
#: larger than any bend of a segment
_MAX_RETURN_ANGLE = 4.0
#: Most iterations of all loops of a shader; software drivers end one after a few more.
_MAX_ITERATIONS = 60_000
#: step -> its images
_IMAGES = {
    "CARRY_ROOTS": (("cv_points", "READ_WRITE"), ("states", "READ_WRITE")),
    "FIND_NEAR": (("states", "READ_WRITE"),),
    "COUNT_NEAR": (("near_counts", "WRITE"),),
    "LIST_NEAR": (("near_strands", "WRITE"),),
    "KEEP_BENDS": (
        ("cv_points", "READ_WRITE"),
        ("states", "READ_WRITE"),
        ("segment_bends", "READ_WRITE"),
    ),
    "LEAD_OUT": (
        ("cv_points", "READ_WRITE"),
        ("states", "READ_WRITE"),
        ("led_points", "READ_WRITE"),
    ),
    "STORE_POINTS": (
        ("cv_points", "READ_WRITE"),
        ("states", "READ_WRITE"),
        ("segment_bends", "READ_WRITE"),
        ("led_points", "READ_WRITE"),
    ),
}
_CARRY_TEXTURES = ("strand_spans", "rest_points", "root_motions")
_TEXTURES = {
    "CARRY_ROOTS": _CARRY_TEXTURES,
    "FIND_NEAR": (*_CARRY_TEXTURES, "cv_points", "clearances"),
    "COUNT_NEAR": ("states",),
    "LIST_NEAR": ("states", "near_counts"),
    "KEEP_BENDS": ("strand_spans", "near_strands"),
    "LEAD_OUT": (*_CARRY_TEXTURES, "near_strands", "clearances"),
    "STORE_POINTS": (*_CARRY_TEXTURES, "near_strands"),
}
_POINT_RANGE = ("root_motion_count", "first_point", "point_end")
_INTEGERS = {
    "CARRY_ROOTS": _POINT_RANGE,
    "FIND_NEAR": _POINT_RANGE,
    "COUNT_NEAR": (),
    "LIST_NEAR": (),
    "KEEP_BENDS": ("lane_count",),
    "LEAD_OUT": (*_POINT_RANGE, "lane_count", "first_attempt", "attempt_end"),
    "STORE_POINTS": ("root_motion_count", "lane_count"),
}
#: step -> most strands per invocation
_STRANDS_PER_INVOCATION = {
    "COUNT_NEAR": LEAD_BLOCK,
    "LIST_NEAR": LEAD_BLOCK,
    "KEEP_BENDS": 8,
    "LEAD_OUT": 8,
    "STORE_POINTS": 8,
}
#: step -> its numbers
_NUMBERS = {
    "CARRY_ROOTS": ("return_angle",),
    "FIND_NEAR": ("max_clearance",),
    "KEEP_BENDS": ("return_angle",),
    "LEAD_OUT": ("max_clearance",),
    "STORE_POINTS": ("max_clearance",),
}
#: steps that read colliders
_STEPS_WITH_COLLIDERS = ("FIND_NEAR", "LEAD_OUT")
STORED_POINTS_RECIPE = ShaderRecipe(
    name="set_points",
    compute="set_points.comp.glsl",
    textures=(("FLOAT_2D", "led_points"), ("FLOAT_2D", "led_texels")),
    images=(("RGBA32F", "cv_points", "READ_WRITE"),),
    integers=("point_count",),
    group_size=_GROUP,
)


@cache
def lead_out_recipe(steps: tuple[str, ...], solids: SolidKinds | None) -> ShaderRecipe:
    """The program of one step, or of several that are done one after the other for each strand.

    Args:
        steps: keys of _IMAGES, see lead_out.comp.glsl.
        solids: kinds of the colliders that it reads; None: it reads none.
    """
    defines = tuple((step, 1) for step in steps)
    names, integers = _of_all(_TEXTURES, steps), ("strand_count", *_of_all(_INTEGERS, steps))
    if solids is not None:
        names += solids.textures
        integers += solids.integers
        defines += solids.defines
    return ShaderRecipe(
        name=f"lead_out_{'_'.join(steps).lower()}",
        compute="lead_out.comp.glsl",
        textures=tuple(("FLOAT_2D", name) for name in names),
        images=tuple(("RGBA32F", *image) for image in _of_all(_IMAGES, steps)),
        integers=integers,
        numbers=tuple(("FLOAT", name) for name in _of_all(_NUMBERS, steps)),
        group_size=_GROUP,
        defines=defines,
    )


def _of_all(needs: Mapping[str, tuple[Any, ...]], steps: tuple[str, ...]) -> tuple[Any, ...]:
    """The union of what some steps need, without duplicates."""
    return tuple(dict.fromkeys(need for step in steps for need in needs.get(step, ())))


class LeadOutPass:
    """Leads the strands of one groom out of colliders. Creating one does not touch the GPU.

    Args:
        layout: of cv_points.
        colliders: uploads shared with other passes.
    """

    def __init__(self, layout: StrandLayout, colliders: UploadedColliders) -> None:
        self._layout, self._colliders = layout, colliders
        self._clearance: Clearance | None = None
        self._solids: ColliderTextures | None = None
        self.release()

    def set_clearance(self, clearance: Clearance | None) -> None:
        """Use the clearance of a motion from now on; None: it has none yet."""
        if clearance is not self._clearance:
            self.release()
            self._clearance = clearance

    def begin_frame(
        self, posed: tuple[PosedCollider, ...], iterations_per_point: int, elapsed: float = np.inf
    ) -> LeadOutInputs | None:
        """The inputs of a frame in which strands are led out of these; None if they are not.

        Args:
            iterations_per_point: loop iterations per point in the pass that moves strands, see
                `LeadOutInputs.finds_near_while_riding`.
            elapsed: time since the frame that this one continues [s]; infinite if it continues
                none.

        Raises:
            HairloomError: a collider that the GPU does not support.
        """
        if self._clearance is None or not posed or not self._layout.strand_count:
            self._textures.pop("states", None)
            return None
        self._upload(self._clearance)
        solids = self._solids = self._colliders.textures_of(posed)
        names = ("strand_spans", "clearances")
        textures = {name: self._textures[name] for name in names}
        textures["solids"] = solids.solids(posed)
        for name, texture in (("rounds", solids.rounds), ("fields", solids.fields)):
            if texture is not None:
                textures[name] = texture
        iterations = self._layout.max_point_count * (
            iterations_per_point + solids.distance_iterations
        )
        kinds = solids.kinds
        return LeadOutInputs(
            textures,
            self._textures["states"],
            kinds,
            {name: len(posed) for name in kinds.integers},
            self._clearance.max_distance,
            min(RETURN_RATE * elapsed, _MAX_RETURN_ANGLE),
            iterations <= _MAX_ITERATIONS,
        )

    def lead(
        self,
        cv_points: Any,
        inputs: LeadOutInputs,
        carry_textures: dict[str, Any],
        root_motion_count: int,
    ) -> None:
        """Lead strands out, see `refine.lead_out.lead_out`.

        Args:
            inputs: of this frame; if `finds_near_while_riding`, the pass before has found the
                strands that are too near.
            carry_textures: the textures rest_points and root_motions.
            root_motion_count: number of root motions.

        Raises:
            ShaderError: the shader does not compile here.
        """
        textures = self._textures | carry_textures | inputs.textures | {"cv_points": cv_points}
        integers = {"root_motion_count": root_motion_count, **inputs.integers}
        numbers = {"max_clearance": inputs.max_clearance, "return_angle": inputs.return_angle}
        steps = () if inputs.finds_near_while_riding else ("CARRY_ROOTS", "FIND_NEAR")
        for step in (*steps, "COUNT_NEAR", "LIST_NEAR"):
            self._run((step,), textures, integers, numbers)
        fits_one_dispatch = self._points_per_dispatch() >= ATTEMPTS * self._layout.max_point_count
        # each further dispatch costs as much as leading some strands
        if fits_one_dispatch and can_read_own_writes():
            all_attempts = {**integers, "first_attempt": 0, "attempt_end": ATTEMPTS}
            self._run(("KEEP_BENDS", "LEAD_OUT", "STORE_POINTS"), textures, all_attempts, numbers)
            return
        self._run(("KEEP_BENDS",), textures, integers, numbers)
        for attempt in (0,) if fits_one_dispatch else range(ATTEMPTS):
            end = ATTEMPTS if fits_one_dispatch else attempt + 1
            attempt_integers = {**integers, "first_attempt": attempt, "attempt_end": end}
            self._run(("LEAD_OUT",), textures, attempt_integers, numbers)
        self._run(("STORE_POINTS",), textures, integers, numbers)

    def put(self, cv_points: Any, led: LedOut) -> None:
        """Set strands to the points to which they were led earlier, see `LedOut.put`.

        Raises:
            ShaderError: the shader does not compile here.
        """
        count = len(led.points)
        if not count:
            return
        spans = self._layout.spans[led.strands]
        counts = spans[:, 2].astype(int)
        texels = np.repeat(spans[:, :2], counts, axis=0)
        texels[:, 0] += number_in_piece(counts)
        points = np.pad(led.points, ((0, 0), (0, 1)))
        shader = program(STORED_POINTS_RECIPE)
        textures = {
            "led_points": texture_from(strand_rows(points[:, None]), "RGBA32F"),
            "led_texels": texture_from(strand_rows(texels[:, None]), "RG32F"),
        }
        shader.bind(
            textures=textures, images={"cv_points": cv_points}, integers={"point_count": count}
        )
        shader.dispatch(count)

    def led_strands(self) -> Ints:
        """The strands that the last `lead` has led out, (n,), read back."""
        states = self._textures.get("states")
        if states is None:
            return np.zeros(0, np.int32)
        flags = from_strand_rows(texture_to_array(states), self._layout.strand_count, 1)
        return np.flatnonzero(flags[:, 0, 0]).astype(np.int32)

    def release(self) -> None:
        """Release everything on the GPU; the next frame uploads it again."""
        self._textures: dict[str, Any] = {}

    def _upload(self, clearance: Clearance) -> None:
        """Upload constant data, and make the textures that the shaders write."""
        layout, textures = self._layout, self._textures
        if "clearances" not in textures:
            values = np.maximum(clearance.points, -_INFINITE)[:, None]
            textures["clearances"] = texture_from(layout.pixels(values), "R32F")
            spans = layout.spans[:, None].copy()
            spans[:, 0, 3] = clearance.held
            textures["strand_spans"] = texture_from(strand_rows(spans), "RGBA32F")
            textures["led_points"] = cleared_texture(layout.size)
            textures["segment_bends"] = cleared_texture(layout.size)
            blocks = -(-layout.strand_count // LEAD_BLOCK)
            textures["near_counts"] = cleared_texture(strand_rows_size(blocks, 1))
            textures["near_strands"] = cleared_texture(strand_rows_size(layout.strand_count + 1, 1))
        if "states" not in textures:
            size = strand_rows_size(layout.strand_count, 1)
            textures["states"] = cleared_texture(size)

    def _run(
        self,
        steps: tuple[str, ...],
        textures: dict[str, Any],
        integers: dict[str, int],
        numbers: dict[str, float],
    ) -> None:
        """Run some steps for all points of all strands, in as few dispatches as drivers allow."""
        assert self._solids is not None
        reads_colliders = any(step in _STEPS_WITH_COLLIDERS for step in steps)
        recipe = lead_out_recipe(steps, self._solids.kinds if reads_colliders else None)
        shader, count = program(recipe), self._layout.strand_count
        invocations = -(-count // _STRANDS_PER_INVOCATION.get(steps[0], 1))
        all_integers = integers | {"strand_count": count, "lane_count": invocations}
        points_per_dispatch = self._points_per_dispatch() if reads_colliders else _MAX_ITERATIONS
        end = self._layout.max_point_count if "first_point" in recipe.integers else 1
        for first in range(0, end, points_per_dispatch):
            all_integers |= {"first_point": first, "point_end": first + points_per_dispatch}
            shader.bind(
                textures={name: textures[name] for _, name in recipe.textures},
                images={name: textures[name] for _, name, *_ in recipe.images},
                integers={name: all_integers[name] for name in recipe.integers},
                numbers={name: numbers[name] for _, name in recipe.numbers},
            )
            shader.dispatch(invocations)

    def _points_per_dispatch(self) -> int:
        """How many points of a strand one dispatch can lead, including the steps KEEP_BENDS and
        STORE_POINTS."""
        assert self._solids is not None
        per_point = 4 + (SWEEPS + DIRECTION_COUNT + BISECTIONS + 4) * (
            1 + self._solids.distance_iterations
        )
        return max(_MAX_ITERATIONS // (per_point * _STRANDS_PER_INVOCATION["LEAD_OUT"]), 1)


@dataclass(frozen=True)
class LeadOutInputs:
    """The inputs for leading strands out of colliders in one frame.

    textures: strand_spans, clearances and the colliders. states: an image. kinds, integers: of the
    colliders. max_clearance: largest distance that points keep [m]. return_angle: angle by which
    segments turn back since the frame before [rad]. finds_near_while_riding: whether the pass that
    moves strands can do the steps CARRY_ROOTS and FIND_NEAR.
    """

    textures: dict[str, Any]
    states: Any
    kinds: SolidKinds
    integers: dict[str, int]
    max_clearance: float
    return_angle: float
    finds_near_while_riding: bool
