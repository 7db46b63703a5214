"""Bakes an atlas on the GPU: flattened strands, drawn from straight above.

Block by block: one draw of all samples of the block into three targets and a depth buffer, then a
compute shader that filters them to texels. Reference: cards/bake.py. The textures' texels:

    cv_places    RGBA32F: xy place, zw half width            for each CV
    cv_tangents  RGBA32F: xyz tangent, w depth
    cv_attributes     RGBA32F: xyz base, w occlusion
    cv_rest      RGBA32F: x fraction of samples that count, y strand_id, z along

    sample_place    RGBA16F: x along, y strand_id, z depth, w occlusion
    sample_tangent  RGBA16F: xyz tangent, w place across the strand
    sample_base     RGBA16F: xyz base, w 1 where there is hair
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from ..cards.atlas_maps import AtlasMaps
from ..cards.bake import SAMPLES, Block, atlas_blocks, with_min_width
from ..cards.bake_strands import FlatStrands
from ..cards.steps import result_of
from . import gpu_objects
from .shader_program import ShaderProgram, ShaderRecipe, program
from .strand_layout import strand_rows
from .textures import drawing_into, drawing_state, texture_from, texture_to_array

#: Texels along each side of a compute group.
_GROUP = 8
_SAMPLES_OF = ("sample_place", "sample_tangent", "sample_base")
_TEXELS_OF = ("texel_place", "texel_base", "texel_tangent", "texel_normal")
_CVS = ("cv_places", "cv_tangents", "cv_attributes", "cv_rest")


def atlas_recipe(*, is_sparse: bool) -> ShaderRecipe:
    """The program that draws strands; `is_sparse`: some are thinner than a sample."""
    return ShaderRecipe(
        name=f"atlas{'_sparse' * is_sparse}",
        vertex="atlas.vert.glsl",
        fragment="atlas.frag.glsl",
        textures=tuple(("FLOAT_2D", name) for name in _CVS),
        integers=(
            "cv_count",
            "first_strand",
            *(("first_column", "first_row") if is_sparse else ()),
        ),
        numbers=(("VEC2", "block_start"), ("FLOAT", "atlas_size"), ("VEC2", "block_samples")),
        varyings=(
            ("flat", "INT", "strand_number"),
            ("flat", "FLOAT", "strand_id"),
            ("smooth", "VEC2", "along_and_side"),
            ("smooth", "VEC2", "depth_and_fraction"),
            ("smooth", "VEC3", "strand_tangent"),
            ("smooth", "VEC4", "base_and_occlusion"),
        ),
        outputs=tuple(("VEC4", name) for name in _SAMPLES_OF),
        defines=(("SPARSE", int(is_sparse)),),
    )


_TEXEL_RECIPE = ShaderRecipe(
    name="atlas_texels",
    compute="atlas_texels.comp.glsl",
    textures=tuple(("FLOAT_2D", name) for name in _SAMPLES_OF),
    images=tuple(("RGBA32F", name) for name in _TEXELS_OF),
    group_size=(_GROUP, _GROUP),
)


def baked_maps(flat: FlatStrands, size: int) -> AtlasMaps:
    """All steps of `baking` at once."""
    return result_of(baking(flat, size))


def baking(flat: FlatStrands, size: int) -> Generator[None, None, AtlasMaps]:
    """Bake the maps of an atlas, one block per step; zero where no strand is, as in sample_maps.

    Args:
        size: of the atlas [pixels].

    Raises:
        ShaderError: a shader does not compile here.
    """
    texels = np.zeros((4, size, size, 4), np.float32)
    if len(flat):
        for block, made in _blocks(_Bake.of(flat, size)):
            rows = slice(block.bottom, block.bottom + block.height)
            texels[:, rows, block.left : block.left + block.width] = made
            yield
    place, base, tangent, normal = texels
    return AtlasMaps(
        alpha=base[..., 3].copy(),
        base=base[..., :3].copy(),
        normal=normal[..., :3].copy(),
        tangent=tangent[..., :3].copy(),
        depth=place[..., 2].copy(),
        along=place[..., 0].copy(),
        strand_id=place[..., 1].copy(),
        occlusion=place[..., 3].copy(),
        base_gain=flat.base_gain,
    )


@dataclass(frozen=True)
class _Bake:
    """The inputs for drawing blocks.

    half: half widths of the strands as drawn.
    textures: of the CVs. is_sparse: some strands are thinner than a sample.
    """

    flat: FlatStrands
    half: Floats
    size: int
    textures: dict[str, Any]
    is_sparse: bool

    @classmethod
    def of(cls, flat: FlatStrands, size: int) -> _Bake:
        half, fraction = with_min_width(flat, size)
        number = np.broadcast_to(flat.strand_id[:, None], fraction.shape)
        values = (
            np.concatenate([flat.place, half], axis=-1),
            np.concatenate([flat.tangent, flat.depth[..., None]], axis=-1),
            np.concatenate([flat.base, flat.occlusion[..., None]], axis=-1),
            np.stack([fraction, number, flat.along, np.zeros_like(fraction)], axis=-1),
        )
        textures = {
            name: texture_from(strand_rows(value), "RGBA32F")
            for name, value in zip(_CVS, values, strict=True)
        }
        return cls(flat, half, size, textures, is_sparse=bool((fraction < 1.0).any()))


def _blocks(bake: _Bake) -> Iterator[tuple[Block, Floats]]:
    """The blocks that have hair, each with its texels (4, height, width, 4)."""
    blocks = atlas_blocks(bake.size)
    width, height = blocks[0].width, blocks[0].height
    shape = blocks[0].samples_across, height * SAMPLES
    samples = {name: _texture(*shape, "RGBA16F") for name in _SAMPLES_OF}
    depth = _texture(*shape, "DEPTH_COMPONENT32F")
    target = gpu_objects.framebuffer(depth_slot=depth, color_slots=tuple(samples.values()))
    texels = {name: _texture(width, height, "RGBA32F") for name in _TEXELS_OF}
    ribbon = _ribbon(bake.flat.place.shape[1])
    for block in blocks:
        reached = block.overlapping(bake.flat, bake.half, bake.size)
        if len(reached):
            first, last = int(reached[0]), int(reached[-1])
            with drawing_into(target), drawing_state(depth_test="LESS_EQUAL"):
                target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
                shader = _bound(bake, block, shape, first)
                ribbon.draw_instanced(
                    shader.shader, instance_start=0, instance_count=last - first + 1
                )
            shader = program(_TEXEL_RECIPE)
            shader.bind(textures=samples, images=texels)
            shader.dispatch(width, height)
            made = [texture_to_array(texels[name])[: block.height] for name in _TEXELS_OF]
            yield block, np.stack(made)


def _bound(bake: _Bake, block: Block, shape: tuple[int, int], first_strand: int) -> ShaderProgram:
    shader = program(atlas_recipe(is_sparse=bake.is_sparse))
    integers = {"cv_count": bake.flat.place.shape[1], "first_strand": first_strand}
    if bake.is_sparse:
        integers["first_column"] = block.left * SAMPLES
        integers["first_row"] = block.bottom * SAMPLES
    numbers = {
        "block_start": (block.left, block.bottom),
        "atlas_size": float(bake.size),
        "block_samples": shape,
    }
    shader.bind(textures=bake.textures, integers=integers, numbers=numbers)
    return shader


def _texture(width: int, height: int, texture_format: str) -> Any:
    return gpu_objects.texture((width, height), format=texture_format)


def _ribbon(cv_count: int) -> Any:
    """A strip of vertices without attributes: two per CV."""
    return gpu_objects.bare_batch("TRI_STRIP", 2 * cv_count)
