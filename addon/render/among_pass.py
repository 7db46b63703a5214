"""Hair among hair on the GPU: `dynamics.among.feel` for guides that are in textures.

    hair_at_rest   RGBA32F in the layout of strand_layout.strand_rows: for each CV x its density at
                   rest, y the density above which it is crowded, z its mass, w the painted factor
                   on the volume
    cell_sums      RGBA32F: for each cell x mass, yzw motion times mass, whole numbers
    densities      RGBA32F: the same, smoothed
    gradients      RGBA32F: xyz gradient of the smoothed mass

    other_places, other_steps   RGBA32F, a texel for each CV of other hair: its place and mass, and
                   its motion in a substep

CVs are drawn as points and summed by blending, which needs no atomics. Sums are exact as long as
they fit into the 24 bits of a float.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics.among import BEGIN, MOTION, Among, HairGrid, Others
from . import gpu_objects
from .ribbons import Ribbons
from .shader_program import ShaderProgram, ShaderRecipe, program
from .strand_layout import strand_rows
from .textures import UniformBlock, drawing_into, drawing_state, texture_from

_GROUP = (16, 4)
_FEWEST = 1024


@lru_cache(maxsize=32)
def deposit_recipe(cv_count: int) -> ShaderRecipe:
    """The program that deposits CVs into the cells."""
    names = ("positions", "previous_positions", "hair_at_rest")
    return ShaderRecipe(
        name="among_deposit",
        vertex="among_deposit.vert.glsl",
        fragment="among_deposit.frag.glsl",
        structs=("struct_among.glsl",),
        blocks=(("Among", "among"),),
        textures=tuple(("FLOAT_2D", name) for name in names),
        varyings=(("flat", "VEC4", "lanes"),),
        outputs=(("VEC4", "cell_sums"),),
        defines=(("CV_COUNT", cv_count),),
    )


OTHERS_RECIPE = ShaderRecipe(
    name="among_others",
    vertex="among_others.vert.glsl",
    fragment="among_deposit.frag.glsl",
    structs=("struct_among.glsl",),
    blocks=(("Among", "among"),),
    textures=(("FLOAT_2D", "other_places"), ("FLOAT_2D", "other_steps")),
    varyings=(("flat", "VEC4", "lanes"),),
    outputs=(("VEC4", "cell_sums"),),
)

FIELDS_RECIPE = ShaderRecipe(
    name="among_fields",
    compute="among_fields.comp.glsl",
    structs=("struct_among.glsl",),
    blocks=(("Among", "among"),),
    textures=(("FLOAT_2D", "cell_sums"),),
    images=(("RGBA32F", "densities"), ("RGBA32F", "gradients")),
)


@lru_cache(maxsize=32)
def feel_recipe(cv_count: int, pairs: str) -> ShaderRecipe:
    """The program that applies friction, and computes what pushes the guides until the next run.

    Args:
        pairs: see capabilities.pair_format.
    """
    return ShaderRecipe(
        name="among_feel",
        compute="among_feel.comp.glsl",
        structs=("struct_among.glsl",),
        blocks=(("Among", "among"),),
        textures=tuple(("FLOAT_2D", name) for name in ("densities", "gradients", "hair_at_rest")),
        images=(
            ("RGBA32F", "positions", "READ_WRITE"),
            (pairs, "previous_positions", "READ_WRITE"),
            ("RGBA32F", "pushes"),
        ),
        group_size=_GROUP,
        defines=(("CV_COUNT", cv_count),),
    )


class AmongPass:
    """The grid of one groom's guides on the GPU. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._block, self._points = UniformBlock(), Ribbons()
        self._grid: HairGrid | None = None
        self._volume: Floats | None = None
        self._counts: tuple[int, int, int] | None = None
        self._textures: dict[str, Any] = {}
        self._target: Any = None

    def feel(self, among: Among, guides: dict[str, Any], speed_ratio: float, pairs: str) -> None:
        """Update the motion of guides, and what pushes them.

        Args:
            guides: the textures positions, previous_positions and pushes of dynamics_pass.
            speed_ratio: length of the coming substep over that of the one before it.
            pairs: the format of previous_positions.
        """
        if among.grid is not self._grid or among.volume is not self._volume:
            self._make(among.grid, among.volume)
        if among.place.counts != self._counts:
            self._make_cells(among.place.counts)
        cv_count, guide_count = among.grid.density.shape
        x, y, z = among.place.counts
        block = self._block.holding(_block_of(among, speed_ratio))
        if among.others is not None:
            self._textures |= _textures_of(among.others)
        textures = {**guides, **self._textures}
        with (
            drawing_into(self._target),
            drawing_state(depth_test="NONE", depth_write=False, blend="ADDITIVE_PREMULT"),
        ):
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0))
            shader = _bound(deposit_recipe(cv_count), block, textures)
            self._points.points(guide_count * cv_count).draw(shader.shader)
            if among.others is not None:
                shader = _bound(OTHERS_RECIPE, block, textures)
                self._points.points(_room_for(len(among.others.mass))).draw(shader.shader)
        for recipe, size in (
            (FIELDS_RECIPE, (x * z, y)),
            (feel_recipe(cv_count, pairs), (cv_count, guide_count)),
        ):
            _bound(recipe, block, textures).dispatch(*size)

    def _make(self, grid: HairGrid, volume: Floats | None) -> None:
        mass = np.broadcast_to(grid.mass, grid.density.shape)
        part = np.broadcast_to(np.float32(1.0) if volume is None else volume, mass.shape)
        numbers = np.stack([grid.density.T, grid.full.T, mass.T, part.T], axis=-1)
        self._textures["hair_at_rest"] = texture_from(strand_rows(numbers), "RGBA32F")
        self._grid, self._volume = grid, volume

    def _make_cells(self, counts: tuple[int, int, int]) -> None:
        x, y, z = counts
        for name in ("cell_sums", "densities", "gradients"):
            self._textures[name] = gpu_objects.texture((x * z, y), format="RGBA32F")
        self._target = gpu_objects.framebuffer(color_slots=(self._textures["cell_sums"],))
        self._counts = counts


def _room_for(count: int) -> int:
    """How many points are drawn for CVs of other hair: rounded up, so that few batches are made."""
    return max(1 << max(count - 1, 0).bit_length(), _FEWEST)


def _textures_of(others: Others) -> dict[str, Any]:
    count = len(others.mass)
    places, steps = np.zeros((2, _room_for(count), 1, 4), np.float32)
    places[:count, 0, :3], places[:count, 0, 3] = others.here.T, others.mass
    steps[:count, 0, :3] = others.step.T
    found = {"other_places": places, "other_steps": steps}
    return {name: texture_from(strand_rows(rows), "RGBA32F") for name, rows in found.items()}


def _bound(recipe: ShaderRecipe, block: Any, textures: dict[str, Any]) -> ShaderProgram:
    shader = program(recipe)
    shader.bind(
        blocks={"among": block},
        textures={name: textures[name] for _, name in recipe.textures},
        images={name: textures[name] for _, name, *_ in recipe.images},
    )
    return shader


def _block_of(among: Among, speed_ratio: float) -> Floats:
    """`Among` of gpu_shaders/struct_among.glsl in std140, float32."""
    grid, place, strength = among.grid, among.place, among.strength
    values = np.zeros((8, 4), np.float32)
    values[0].view(np.int32)[:] = (*place.counts, grid.density.shape[1])
    values[1] = (*place.middle, grid.cell)
    values[2:5, :3], values[2:5, 3] = place.into, BEGIN
    scale = strength.scale(grid.cell)
    values[5] = strength.push, strength.pull, strength.friction, scale
    values[6, :3] = speed_ratio, MOTION / grid.cell, strength.ahead
    values[7].view(np.int32)[:3] = place.low
    return values.ravel()
