"""The passes of the render engine: their names and channels in Blender, and which are enabled."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...render.cryptomatte import PAIRS
from ...render.nearest import FAR_AWAY
from . import hair_scene


@dataclass(frozen=True)
class RenderPass:
    """A pass. channels: their names. kind: of its socket. empty: the value of nothing."""

    name: str
    channels: str
    kind: str = "VALUE"
    empty: float = 0.0


COMBINED = RenderPass("Combined", "RGBA", "COLOR")
DEPTH = RenderPass("Depth", "Z", empty=FAR_AWAY)
NORMAL = RenderPass("Normal", "XYZ", "VECTOR")
VECTOR = RenderPass("Vector", "XYZW", "VECTOR")
OBJECT_INDEX = RenderPass("Object Index", "X")
#: index of the nearest strand, counted from 1
STRAND_INDEX = RenderPass("Strand Index", "X")
#: direction from root to tip, world space
TANGENT = RenderPass("Hair Tangent", "XYZ", "VECTOR")
#: coverage of hair
HAIR_ALPHA = RenderPass("Hair Alpha", "X")
#: the fraction of light that hair lets through to meshes; hair scenes always have this pass
SHADOW = RenderPass("Hair Shadow", "RGB", "COLOR", empty=1.0)
#: only in hair scenes: shafts of light, to be added to the picture
SHAFTS = RenderPass("Hair Shafts", "RGB", "COLOR")
#: prefix of the names of Cryptomatte passes
CRYPTOMATTE = "CryptoObject"
#: names of the passes that hold data of the nearest surface or strand at each pixel's centre
DATA = frozenset(each.name for each in (DEPTH, NORMAL, VECTOR, OBJECT_INDEX, STRAND_INDEX, TANGENT))
#: settings of view layers -> the passes that they enable: Blender's own, then those of hair
_BLENDER_PASSES = {
    "use_pass_z": DEPTH,
    "use_pass_normal": NORMAL,
    "use_pass_vector": VECTOR,
    "use_pass_object_index": OBJECT_INDEX,
}
_HAIR_PASSES = {
    "use_strand_index": STRAND_INDEX,
    "use_tangent": TANGENT,
    "use_alpha": HAIR_ALPHA,
    "use_shadow": SHADOW,
}


def enabled_passes(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Iterator[RenderPass]:
    """The enabled passes beside the picture."""
    is_hair_scene = hair_scene.drawn_scene(scene) is not None
    for owner, passes in ((layer, _BLENDER_PASSES), (layer.hairloom, _HAIR_PASSES)):
        for name, each in passes.items():
            if getattr(owner, name) or (is_hair_scene and each is SHADOW):
                yield each
    if layer.use_pass_cryptomatte_object:
        yield from cryptomatte_passes(layer)
    if is_hair_scene:
        yield SHAFTS


def cryptomatte_passes(layer: bpy.types.ViewLayer) -> list[RenderPass]:
    """The passes for the view layer's number of levels."""
    count = -(-layer.pass_cryptomatte_depth // PAIRS)
    return [RenderPass(f"{CRYPTOMATTE}{number:02}", "RGBA", "COLOR") for number in range(count)]


def empty_value(name: str) -> float:
    """The value of a pass of this name where nothing is seen."""
    others = (DEPTH, SHADOW)
    return next((each.empty for each in others if each.name == name), 0.0)


def write(render_pass: Any, values: Floats) -> None:
    """Fill a pass of Blender's with (height, width, channels) values, row 0 at the bottom."""
    render_pass.rect.foreach_set(np.ascontiguousarray(values, np.float32).ravel())


def passes_in(result: Any) -> dict[str, Any]:
    """Blender's own passes of a result, by name."""
    return {each.name: each for layer in result.layers for each in layer.passes}
