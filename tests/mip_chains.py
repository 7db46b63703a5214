"""All mip maps of one picture, as lists."""

from __future__ import annotations

from hairloom.addon.arrays import Floats
from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.exchange.textures.mip_maps import DIRECTIONS, mip_levels


def mip_chain(
    image: Floats,
    *,
    alpha: Floats | None = None,
    is_direction: bool = False,
    grid: AtlasGrid | None = None,
) -> list[Floats]:
    """All levels of one image, itself first; see `mip_levels`.

    Args:
        image: (height, width) or (height, width, channels) in [0, 1].
        alpha: (height, width), the weight of each texel.
        is_direction: the image holds unit vectors d as 0.5 d + 0.5.
    """
    name = DIRECTIONS[0] if is_direction else "base"
    maps = {name: image} | ({} if alpha is None else {"alpha": alpha})
    return [level[name] for level in mip_levels(maps, grid=grid)]


def alpha_chain(
    alpha: Floats, *, threshold: float = 0.5, grid: AtlasGrid | None = None
) -> list[Floats]:
    """All levels of an alpha (height, width), itself first; each keeps its coverage."""
    levels = mip_levels({"alpha": alpha}, grid=grid, threshold=threshold)
    return [level["alpha"] for level in levels]
