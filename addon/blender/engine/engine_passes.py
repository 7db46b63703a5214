"""The passes of the render engine: what Blender's compositor and files know each by, and when there
is which."""

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
    """channels: their names. kind: of a socket. empty: what it holds where nothing is."""

    name: str
    channels: str
    kind: str = "VALUE"
    empty: float = 0.0


COMBINED = RenderPass("Combined", "RGBA", "COLOR")
DEPTH = RenderPass("Depth", "Z", empty=FAR_AWAY)
NORMAL = RenderPass("Normal", "XYZ", "VECTOR")
VECTOR = RenderPass("Vector", "XYZW", "VECTOR")
OBJECT_INDEX = RenderPass("Object Index", "X")
#: of the strand that is nearest, counted from 1
STRAND_INDEX = RenderPass("Strand Index", "X")
#: from root to tip, world space
TANGENT = RenderPass("Hair Tangent", "XYZ", "VECTOR")
#: how much hair covers
HAIR_ALPHA = RenderPass("Hair Alpha", "X")
#: the fraction of their light that hair leaves to meshes; hair scenes have it always
SHADOW = RenderPass("Hair Shadow", "RGB", "COLOR", empty=1.0)
#: of hair scenes: shafts of light, to be added to the picture
SHAFTS = RenderPass("Hair Shafts", "RGB", "COLOR")
#: what the names of a Cryptomatte's pictures begin with
CRYPTOMATTE = "CryptoObject"
#: what is nearest in the middle of each pixel, by name
DATA = frozenset(each.name for each in (DEPTH, NORMAL, VECTOR, OBJECT_INDEX, STRAND_INDEX, TANGENT))
#: settings of view layers -> what they ask for; Blender's own, and ours
_ASKED = {
    "use_pass_z": DEPTH,
    "use_pass_normal": NORMAL,
    "use_pass_vector": VECTOR,
    "use_pass_object_index": OBJECT_INDEX,
}
_ASKED_OF_US = {
    "use_strand_index": STRAND_INDEX,
    "use_tangent": TANGENT,
    "use_alpha": HAIR_ALPHA,
    "use_shadow": SHADOW,
}


def wanted_passes(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Iterator[RenderPass]:
    """What there is beside the picture."""
    is_hair_scene = hair_scene.drawn_by(scene) is not None
    for owner, asked in ((layer, _ASKED), (layer.hairloom, _ASKED_OF_US)):
        for name, found in asked.items():
            if getattr(owner, name) or (is_hair_scene and found is SHADOW):
                yield found
    if layer.use_pass_cryptomatte_object:
        yield from cryptomatte_passes(layer)
    if is_hair_scene:
        yield SHAFTS


def cryptomatte_passes(layer: bpy.types.ViewLayer) -> list[RenderPass]:
    """As many as hold the levels that are asked for."""
    count = -(-layer.pass_cryptomatte_depth // PAIRS)
    return [RenderPass(f"{CRYPTOMATTE}{number:02}", "RGBA", "COLOR") for number in range(count)]


def empty_of(name: str) -> float:
    """What a pass of this name holds where nothing is."""
    known = (DEPTH, SHADOW)
    return next((each.empty for each in known if each.name == name), 0.0)


def write(into: Any, values: Floats) -> None:
    """Fill a pass of Blender's with (height, width, channels) values, row 0 at the bottom."""
    into.rect.foreach_set(np.ascontiguousarray(values, np.float32).ravel())


def passes_in(result: Any) -> dict[str, Any]:
    """Blender's own passes of a result, by name."""
    return {each.name: each for layer in result.layers for each in layer.passes}
