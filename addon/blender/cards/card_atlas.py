"""The atlas of a groom's cards: its strands laid flat and drawn, on the GPU where there is one."""

from __future__ import annotations

from collections.abc import Callable, Generator

import gpu
import numpy as np

from ...cards.atlas import AtlasPlan
from ...cards.atlas_maps import AtlasMaps, dilated
from ...cards.bake import sampled_maps
from ...cards.bake_strands import FlatStrands, flat_strands
from ...pipeline import Rig
from ...render.atlas_pass import baked_maps, baking
from ...shading.drawn_strands import drawn_radius, strand_variation
from ...shading.settings import ShadingSettings, StrandSettings
from ..base.gpu_context import ensure_gpu

#: Draws flat strands into an atlas of this size [pixels].
type AtlasDraw = Callable[[FlatStrands, int], AtlasMaps]


def drawn_maps(flat: FlatStrands, size: int) -> AtlasMaps:
    """Here and now; the main thread's."""
    return baked_maps(flat, size) if has_gpu() else sampled_maps(flat, size)


def drawing_maps(flat: FlatStrands, size: int) -> Generator[None, None, AtlasMaps]:
    """The same in steps."""
    if not has_gpu():
        return sampled_maps(flat, size)
    return (yield from baking(flat, size))


def baked_atlas(
    rig: Rig,
    plan: AtlasPlan,
    shading: ShadingSettings,
    drawn: StrandSettings,
    draw: AtlasDraw = drawn_maps,
) -> AtlasMaps:
    """The maps of all tiles, which go on where there is no hair.

    Args:
        drawn: how wide strands are drawn.
        draw: everything else may be done in any thread.
    """
    grid = rig.strands.grid
    count, cv_count = grid.shape[:2]
    radius = drawn_radius(rig.strands.radius.reshape(count, cv_count), drawn)
    colors = strand_variation(np.arange(count), cv_count, shading)
    flat = flat_strands(plan, grid, radius, colors)
    return dilated(draw(flat, plan.size), plan.grid)


def has_gpu() -> bool:
    """Blender in the background has none until it is asked for, and on some machines none then."""
    try:
        ensure_gpu()
        gpu.platform.backend_type_get()
    except (SystemError, RuntimeError):
        return False
    return True
