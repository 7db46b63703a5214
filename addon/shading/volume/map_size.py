"""Size of opacity maps: that of the settings, as far as GPU and memory allow.

A map has as many texels a side as the settings say, as long as that fits: many lights with many
layers at the largest resolution would take gigabytes, allocated before anything is drawn. Maps that
do not fit get fewer texels: they are blurred, but as dark as they should be.

Strands that represent many hairs get a map coarse enough to be as even as these hairs. In texels
finer than the strands' spacing, light would pass between strands, where the represented hairs are:
by Jensen's inequality the mean of exp(-tau) grows with the unevenness of tau. A look-up is a tent
of two texels, so texels of half the spacing blend over one spacing. Meshes keep the full number of
texels, since their edges are sharp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .opacity import layer_ends
from .settings import VolumeSettings

#: texels of a map along the side of a block in which its deep layers have one start
START_TEXELS = 4
#: colour slots that a framebuffer has
MAX_SLOTS = 6
#: bytes of sums of four layers in float32; of the depth of the first mesh; of first and last hair
#: in every block, and the planes through them
_LAYERS_BYTES, _MESH_BYTES, _SPAN_BYTES = 16, 4, 8 + 32
#: texels across the spacing of strands that represent several hairs; minimum across all hair
_TEXELS_APART, _FEWEST_TEXELS = 2.0, 16
#: [texels] of a texture on every GPU that Blender supports
_LARGEST_SIDE = 16384


@dataclass(frozen=True)
class MapSize:
    """Size of all maps of a groom.

    side: texels along a side of a map, whole blocks of START_TEXELS.
    slots: textures of four layers that are drawn into at once.
    passes: how often they are drawn, which is also the number of array layers that one map takes.
    map_count: maps, one a light.
    mesh_side: texels along a side of the depths of meshes.
    """

    side: int
    slots: int
    passes: int
    map_count: int
    is_deep: bool
    mesh_side: int

    @property
    def texels(self) -> int:
        """Texels of four layers that a map has in depth."""
        return self.slots * self.passes

    @property
    def bytes(self) -> int:
        """Memory on the GPU."""
        # one texture alone would not be an array
        arrays = max(self.map_count * self.passes, 2) * self.slots * _LAYERS_BYTES
        meshes = max(self.map_count, 2) * _MESH_BYTES
        spans = _SPAN_BYTES * self.map_count / START_TEXELS**2 if self.is_deep else 0.0
        return int(self.side**2 * (arrays + spans) + self.mesh_side**2 * meshes)


def requested_size(settings: VolumeSettings, map_count: int) -> MapSize:
    """The size that the settings ask for."""
    layers = len(layer_ends(settings))
    slots = min(-(-layers // 4), MAX_SLOTS)
    side = -(-settings.resolution // START_TEXELS) * START_TEXELS
    is_deep = settings.shadows == "deep"
    return MapSize(side, slots, -(-layers // (4 * slots)), max(map_count, 1), is_deep, side)


def fitted_size(
    settings: VolumeSettings, map_count: int, max_bytes: int, largest_side: int = _LARGEST_SIDE
) -> MapSize:
    """The size that is drawn: fewer texels per side if the size that is asked for does not fit.

    Args:
        map_count: lights that cast shadows.
        max_bytes: for all maps [bytes].
        largest_side: of a texture on this GPU.
    """
    size = requested_size(settings, map_count)
    per_texel = size.bytes / size.side**2
    # the texture `starts` holds the maps above one another
    side = min(size.side, largest_side, int(np.sqrt(max_bytes / per_texel)))
    if size.is_deep:
        side = min(side, largest_side * START_TEXELS // size.map_count)
    side = max(side // START_TEXELS, 1) * START_TEXELS
    return replace(size, side=side, mesh_side=side)


def size_for_spacing(size: MapSize, spacing: float, radius: float) -> MapSize:
    """The size with texels coarse enough that hair looks as even as it is.

    Args:
        spacing: of strands whose hairs fill the space between them; 0: none do. radius: of the ball
            around all hair; both in one unit.
    """
    if spacing <= 0.0:
        return size
    across = max(_TEXELS_APART * 2.0 * radius / spacing, _FEWEST_TEXELS)
    side = -(-int(min(across, size.side)) // START_TEXELS) * START_TEXELS
    return replace(size, side=min(side, size.side))


def size_note(settings: VolumeSettings, map_count: int, max_bytes: int, drawn_size: MapSize) -> str:
    """A note for the artist if maps are smaller than the settings say, else empty.

    Args:
        map_count, max_bytes: as of `fitted_size`, which gave `drawn_size`.
    """
    requested = requested_size(settings, map_count)
    if drawn_size == requested:
        return ""
    megabytes = requested.bytes / 2**20, max_bytes / 2**20
    lights = "1 light" if requested.map_count == 1 else f"{requested.map_count} lights"
    if requested.bytes <= max_bytes:
        reason, memory = "are larger than this GPU's textures", ""
    else:
        reason = f"would take {megabytes[0]:,.0f} MB and may take {megabytes[1]:,.0f}"
        memory = ", or raise GPU Memory in the preferences"
    return (
        f"Shadows: maps of {requested.side} x {requested.side} texels for {lights} "
        f"{reason}, so they have {drawn_size.side} x {drawn_size.side}. Lower Resolution, the "
        f"number of layers, or Max Lights in Shadows{memory}."
    )
