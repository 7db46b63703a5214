"""The blocks `View` and `Lights` of drawing shaders."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..shading.lights import kinds_needed, pack_lights, packed_lights
from .camera import Camera
from .shader_feature import ShaderFeature
from .snapshot import Snapshot


def view_feature(camera: Camera, width: int, height: int) -> ShaderFeature:
    """The feature with the block `View` for a target of this size [pixels]."""
    return ShaderFeature(blocks={"view": ("View", view_values(camera, width, height))})


def lights_feature(snapshot: Snapshot) -> ShaderFeature:
    """The feature with the block `Lights`, and the defines for the kinds of lights that a program
    supports; WORLD: light from all around."""
    kinds, has_world = kinds_needed(packed_lights(snapshot.lights)), snapshot.has_world
    block = pack_lights(snapshot.lights, snapshot.ambient, snapshot.harmonics)
    return ShaderFeature(
        name=f"{kinds}{has_world:d}",
        blocks={"lights": ("Lights", block)},
        defines={"LIGHT_KINDS": kinds, "WORLD": int(has_world)},
    )


def view_values(camera: Camera, width: int, height: int) -> Floats:
    """`View` of struct_view.glsl in std140, (40,) float32; GLSL stores matrices by columns.

    Args:
        width, height: of the target [pixels].
    """
    projection = np.asarray(camera.projection, np.float64)
    view_projection = projection @ np.asarray(camera.view, np.float64)
    viewport = np.array([width, height, camera.sample, 0.0])
    return np.concatenate(
        [view_projection.T.ravel(), projection.T.ravel(), camera.eye, viewport]
    ).astype(np.float32)
