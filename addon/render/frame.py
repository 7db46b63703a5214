"""Rendering of one picture: meshes, strands and cards, with samples averaged to pixels.

A still is the mean of several pictures, each lit by another point of every light that has a size.
So shadows have penumbras, and errors of single shadow maps average out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Floats
from ..shading.lights import packed_lights
from ..shading.mesh_shadow_settings import MeshShadowSettings
from ..shading.settings import StrandSettings
from . import gpu_objects
from .camera import Camera
from .camera_window import jittered, sample_place
from .card_pass import CardPass
from .light_samples import lights_at
from .mesh_pass import MeshPass
from .shader_program import ShaderRecipe, program
from .shafts_pass import finish_with_shafts
from .snapshot import Snapshot
from .strand_pass import StrandPass, noise_free_samples
from .textures import drawing_into, texture_to_array

#: the largest side that a target may have on every GPU that Blender supports
LARGEST_SIDE = 16384
_NOTHING = (0.0, 0.0, 0.0, 0.0)

_BOX_RECIPE = ShaderRecipe(
    name="box_filter",
    compute="box_filter.comp.glsl",
    textures=(("FLOAT_2D", "samples_of"),),
    images=(("RGBA32F", "picture"),),
    integers=("samples_across",),
)


def render_image(
    snapshot: Snapshot,
    camera: Camera,
    width: int,
    height: int,
    samples: int = 2,
    *,
    background: tuple[float, float, float, float] = _NOTHING,
    passes: tuple[MeshPass, StrandPass] | None = None,
    card_pass: CardPass | None = None,
) -> Floats:
    """Draw a snapshot, (height, width, 4) float32 scene-linear, premultiplied, row 0 at the bottom.

    Args:
        width, height: [pixels].
        samples: samples across a pixel: 3 draws 3 x 3 and averages them.
        background: premultiplied rgba.
        passes, card_pass: those of an earlier call, so that only changes are uploaded.

    Raises:
        ValueError: a size that is not supported by every GPU.
        ShaderError: a shader does not compile here.
    """
    largest = max(width, height) * samples
    if min(width, height, samples) < 1 or largest > LARGEST_SIDE:
        raise ValueError(f"a picture of {width} x {height} with {samples} samples across")
    mesh_pass, strand_pass = passes or (MeshPass(), StrandPass())
    size = width * samples, height * samples
    color = gpu_objects.texture(size, format="RGBA32F")
    depth = gpu_objects.texture(size, format="DEPTH_COMPONENT32F")
    target = gpu_objects.framebuffer(depth_slot=depth, color_slots=(color,))
    card_pass = card_pass or CardPass()
    opacity = strand_pass.opacity(snapshot) or card_pass.opacity(snapshot)
    shadows = None
    if opacity is not None:
        shadows = mesh_pass.mesh_shadows.maps(
            snapshot.all_casters, packed_lights(snapshot.lights), MeshShadowSettings()
        )
    with drawing_into(target):
        # shafts use alpha to find what stands before a light
        target.clear(color=_NOTHING if snapshot.shafts.use_shafts else background, depth=1.0)
        mesh_pass.draw(snapshot, camera, *size, opacity=opacity, shadows=shadows)
        strand_pass.draw(snapshot, camera, *size, samples=samples)
        card_pass.draw(snapshot, camera, *size, opacity=opacity)
    picture = color if samples == 1 else _averaged(color, samples)
    if snapshot.shafts.use_shafts:
        finish_with_shafts(
            picture, color, depth, camera, snapshot.lights, snapshot.shafts, background
        )
    return texture_to_array(picture)


def render_still(
    snapshot: Snapshot,
    camera: Camera,
    width: int,
    height: int,
    samples: int,
    *,
    center: Floats,
    passes: tuple[MeshPass, StrandPass],
    card_pass: CardPass,
    on_sample: Callable[[int], object] = lambda done: None,
) -> Floats:
    """As `render_image`, with soft shadows: each sample of a pixel is a separate picture, lit by
    one point of each light.

    Args:
        center: (3,) [m], the point that the disks of lamps face.
        on_sample: called with the number of samples that are done, of `still_samples`.

    Raises:
        ValueError, ShaderError: as `render_image`.
    """
    total = np.zeros((height, width, 4), np.float64)
    count = still_samples(snapshot.strand_settings, samples)
    for sample in range(count):
        on_sample(sample)
        place = sample_place(sample, samples)
        total += render_image(
            replace(snapshot, lights=lights_at(snapshot.lights, sample, center)),
            jittered(camera, place, width, height, sample),
            width,
            height,
            1,
            passes=passes,
            card_pass=card_pass,
        )
    on_sample(count)
    return (total / count).astype(np.float32)


def still_samples(settings: StrandSettings, samples: int) -> int:
    """The number of pictures that `render_still` draws, for samples along each side of a pixel."""
    return max(samples**2, noise_free_samples(settings))


def _averaged(color: Any, samples: int) -> Any:
    """A texture with `samples` x `samples` texels per pixel, averaged to one texel per pixel."""
    width, height = color.width // samples, color.height // samples
    picture = gpu_objects.texture((width, height), format="RGBA32F")
    shader = program(_BOX_RECIPE)
    shader.bind(
        textures={"samples_of": color},
        images={"picture": picture},
        integers={"samples_across": samples},
    )
    shader.dispatch(width, height)
    return picture
