"""Forces between hair on the GPU: `dynamics.hair_grid.friction_and_push` for guides that are in
textures.

    hair_at_rest   RGBA32F in the layout of strand_layout.strand_rows: for each CV x its density at
                   rest, y the density above which it is crowded, z its mass, w the painted factor
                   on the volume
    cell_sums      RGBA32F: for each cell x mass, yzw motion times mass, whole numbers
    densities      RGBA32F: the same, smoothed
    gradients      RGBA32F: xyz gradient of the smoothed mass

    other_positions, other_motions   RGBA32F, a texel for each CV of other hair: its place and mass,
        and
                   its motion in a substep

CVs are drawn as points and summed by blending, which needs no atomics. Sums are exact as long as
they fit into the 24 bits of a float.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics.hair_grid import GRID_OFFSET, MOTION_UNITS, HairGrid, HairInteraction, NeighbourCvs
from . import gpu_objects
from .ribbons import Ribbons
from .shader_program import ShaderProgram, ShaderRecipe, program
from .strand_layout import strand_rows
from .textures import UniformBlock, drawing_into, drawing_state, texture_from

_GROUP = (16, 4)
_MIN_POINTS = 1024


@lru_cache(maxsize=32)
def deposit_recipe(cv_count: int) -> ShaderRecipe:
    """The program that deposits CVs into the cells."""
    names = ("positions", "previous_positions", "hair_at_rest")
    return ShaderRecipe(
        name="hair_grid_deposit",
        vertex="hair_grid_deposit.vert.glsl",
        fragment="hair_grid_deposit.frag.glsl",
        structs=("struct_hair_grid.glsl",),
        blocks=(("HairGrid", "grid"),),
        textures=tuple(("FLOAT_2D", name) for name in names),
        varyings=(("flat", "VEC4", "mass_motion"),),
        outputs=(("VEC4", "cell_sums"),),
        defines=(("CV_COUNT", cv_count),),
    )


NEIGHBOUR_RECIPE = ShaderRecipe(
    name="hair_grid_deposit_other",
    vertex="hair_grid_deposit_other.vert.glsl",
    fragment="hair_grid_deposit.frag.glsl",
    structs=("struct_hair_grid.glsl",),
    blocks=(("HairGrid", "grid"),),
    textures=(("FLOAT_2D", "other_positions"), ("FLOAT_2D", "other_motions")),
    varyings=(("flat", "VEC4", "mass_motion"),),
    outputs=(("VEC4", "cell_sums"),),
)

FIELDS_RECIPE = ShaderRecipe(
    name="hair_grid_fields",
    compute="hair_grid_fields.comp.glsl",
    structs=("struct_hair_grid.glsl",),
    blocks=(("HairGrid", "grid"),),
    textures=(("FLOAT_2D", "cell_sums"),),
    images=(("RGBA32F", "densities"), ("RGBA32F", "gradients")),
)


@lru_cache(maxsize=32)
def forces_recipe(cv_count: int, pairs: str) -> ShaderRecipe:
    """The program that applies friction, and computes what pushes the guides until the next run.

    Args:
        pairs: see capabilities.pair_format.
    """
    return ShaderRecipe(
        name="hair_grid_forces",
        compute="hair_grid_forces.comp.glsl",
        structs=("struct_hair_grid.glsl",),
        blocks=(("HairGrid", "grid"),),
        textures=tuple(("FLOAT_2D", name) for name in ("densities", "gradients", "hair_at_rest")),
        images=(
            ("RGBA32F", "positions", "READ_WRITE"),
            (pairs, "previous_positions", "READ_WRITE"),
            ("RGBA32F", "pushes"),
        ),
        group_size=_GROUP,
        defines=(("CV_COUNT", cv_count),),
    )


class HairGridPass:
    """The grid of one groom's guides on the GPU. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._block, self._points = UniformBlock(), Ribbons()
        self._grid: HairGrid | None = None
        self._volume: Floats | None = None
        self._counts: tuple[int, int, int] | None = None
        self._textures: dict[str, Any] = {}
        self._target: Any = None

    def update_pushes(
        self, interaction: HairInteraction, guides: dict[str, Any], speed_ratio: float, pairs: str
    ) -> None:
        """Update the motion of guides, and what pushes them.

        Args:
            guides: the textures positions, previous_positions and pushes of dynamics_pass.
            speed_ratio: length of the coming substep over that of the one before it.
            pairs: the format of previous_positions.
        """
        if interaction.grid is not self._grid or interaction.volume is not self._volume:
            self._make(interaction.grid, interaction.volume)
        if interaction.placement.counts != self._counts:
            self._make_cells(interaction.placement.counts)
        cv_count, guide_count = interaction.grid.rest_density.shape
        x, y, z = interaction.placement.counts
        block = self._block.holding(_block_of(interaction, speed_ratio))
        if interaction.neighbour_cvs is not None:
            self._textures |= _textures_of(interaction.neighbour_cvs)
        textures = {**guides, **self._textures}
        with (
            drawing_into(self._target),
            drawing_state(depth_test="NONE", depth_write=False, blend="ADDITIVE_PREMULT"),
        ):
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0))
            shader = _bound(deposit_recipe(cv_count), block, textures)
            self._points.points(guide_count * cv_count).draw(shader.shader)
            if interaction.neighbour_cvs is not None:
                shader = _bound(NEIGHBOUR_RECIPE, block, textures)
                self._points.points(_point_capacity(len(interaction.neighbour_cvs.mass))).draw(
                    shader.shader
                )
        for recipe, size in (
            (FIELDS_RECIPE, (x * z, y)),
            (forces_recipe(cv_count, pairs), (cv_count, guide_count)),
        ):
            _bound(recipe, block, textures).dispatch(*size)

    def _make(self, grid: HairGrid, volume: Floats | None) -> None:
        mass = np.broadcast_to(grid.mass, grid.rest_density.shape)
        part = np.broadcast_to(np.float32(1.0) if volume is None else volume, mass.shape)
        numbers = np.stack(
            [grid.rest_density.T, grid.pressure_threshold.T, mass.T, part.T], axis=-1
        )
        self._textures["hair_at_rest"] = texture_from(strand_rows(numbers), "RGBA32F")
        self._grid, self._volume = grid, volume

    def _make_cells(self, counts: tuple[int, int, int]) -> None:
        x, y, z = counts
        for name in ("cell_sums", "densities", "gradients"):
            self._textures[name] = gpu_objects.texture((x * z, y), format="RGBA32F")
        self._target = gpu_objects.framebuffer(color_slots=(self._textures["cell_sums"],))
        self._counts = counts


def _point_capacity(count: int) -> int:
    """How many points are drawn for CVs of other hair: rounded up, so that few batches are made."""
    return max(1 << max(count - 1, 0).bit_length(), _MIN_POINTS)


def _textures_of(neighbour_cvs: NeighbourCvs) -> dict[str, Any]:
    count = len(neighbour_cvs.mass)
    positions, motions = np.zeros((2, _point_capacity(count), 1, 4), np.float32)
    positions[:count, 0, :3], positions[:count, 0, 3] = neighbour_cvs.position.T, neighbour_cvs.mass
    motions[:count, 0, :3] = neighbour_cvs.motion.T
    found = {"other_positions": positions, "other_motions": motions}
    return {name: texture_from(strand_rows(rows), "RGBA32F") for name, rows in found.items()}


def _bound(recipe: ShaderRecipe, block: Any, textures: dict[str, Any]) -> ShaderProgram:
    shader = program(recipe)
    shader.bind(
        blocks={"grid": block},
        textures={name: textures[name] for _, name in recipe.textures},
        images={name: textures[name] for _, name, *_ in recipe.images},
    )
    return shader


def _block_of(interaction: HairInteraction, speed_ratio: float) -> Floats:
    """`HairGrid` of gpu_shaders/struct_hair_grid.glsl in std140, float32."""
    grid, placement, strength = interaction.grid, interaction.placement, interaction.strength
    values = np.zeros((8, 4), np.float32)
    values[0].view(np.int32)[:] = (*placement.counts, grid.rest_density.shape[1])
    values[1] = (*placement.middle, grid.cell)
    values[2:5, :3], values[2:5, 3] = placement.world_to_cells, GRID_OFFSET
    scale = strength.displacement_factor(grid.cell)
    values[5] = strength.pressure, strength.cohesion, strength.friction, scale
    values[6, :3] = speed_ratio, MOTION_UNITS / grid.cell, strength.look_ahead
    values[7].view(np.int32)[:3] = placement.lowest_cell
    return values.ravel()
