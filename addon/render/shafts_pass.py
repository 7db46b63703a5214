"""Shafts of light into a finished picture; the reference is shading/shafts.py."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..shading.lights import Light
from ..shading.shafts import REACH, LightOnScreen, PolarGrid, lights_on_screen
from ..shading.shafts_settings import ShaftSettings
from . import gpu_objects
from .camera import Camera
from .shader_program import ShaderRecipe, program

_STRUCTS, _BLOCKS = ("struct_shafts.glsl",), (("Shafts", "shafts"),)
_CASTER = ShaderRecipe(
    name="shafts_caster",
    compute="shafts_caster.comp.glsl",
    structs=_STRUCTS,
    blocks=_BLOCKS,
    textures=(("FLOAT_2D", "samples_of"), ("FLOAT_2D", "depth_of")),
    images=(("R32F", "caster"),),
    integers=("samples_across",),
)
_BLUR = ShaderRecipe(
    name="shafts_blur",
    compute="shafts_blur.comp.glsl",
    structs=_STRUCTS,
    blocks=_BLOCKS,
    textures=(("FLOAT_2D", "caster"),),
    images=(("R32F", "rays"),),
    group_size=(64,),
)
_ADD = ShaderRecipe(
    name="shafts_add",
    compute="shafts_add.comp.glsl",
    structs=_STRUCTS,
    blocks=_BLOCKS,
    textures=(("FLOAT_2D", "rays"),),
    images=(("RGBA32F", "picture", "READ_WRITE"),),
)
_UNDER = ShaderRecipe(
    name="under",
    compute="under.comp.glsl",
    images=(("RGBA32F", "picture", "READ_WRITE"),),
    numbers=(("VEC4", "background"),),
)


def add_shafts(
    picture: Any,
    drawn: Any,
    depth: Any,
    camera: Camera,
    lights: Sequence[Light],
    settings: ShaftSettings,
) -> None:
    """Add the haze of the lights in view, and the shafts in it, to a picture on the GPU.

    Where no light is in view, or shafts are off, the picture stays as it is to the bit.

    Args:
        picture: RGBA32F texture, scene-linear and premultiplied; it is changed. It was drawn over
            nothing, since alpha says what stands before a light; see `put_under`.
        drawn, depth: the colour and depth that it was averaged from, with a whole number of texels
            along each side of a pixel; `drawn` may be the picture itself.
    """
    width, height = picture.width, picture.height
    seen = lights_on_screen(lights, camera.view, camera.projection, width, height, settings)
    for light in seen:
        _add_light(picture, drawn, depth, light, settings.samples)


def put_under(picture: Any, background: tuple[float, float, float, float]) -> None:
    """Put a premultiplied colour under a picture that was drawn over nothing."""
    shader = program(_UNDER)
    shader.bind(images={"picture": picture}, numbers={"background": background})
    gpu.compute.dispatch(shader.shader, -(-picture.width // 8), -(-picture.height // 8), 1)
    gpu.shader.unbind()


def _add_light(picture: Any, drawn: Any, depth: Any, light: LightOnScreen, samples: int) -> None:
    width, height = picture.width, picture.height
    grid = PolarGrid.over(light.center, width, height, samples)
    block = gpu_objects.uniform_buffer(pack_shafts(light, grid))
    caster = gpu_objects.texture((width, height), format="R32F")
    rays = gpu_objects.texture((grid.radii, grid.angles), format="R32F")
    pixels = -(-width // 8), -(-height // 8)
    steps: tuple[tuple[ShaderRecipe, dict[str, Any], dict[str, Any], tuple[int, int]], ...] = (
        (_CASTER, {"samples_of": drawn, "depth_of": depth}, {"caster": caster}, pixels),
        (_BLUR, {"caster": caster}, {"rays": rays}, (-(-grid.angles // 64), 1)),
        (_ADD, {"rays": rays}, {"picture": picture}, pixels),
    )
    for recipe, textures, images, groups in steps:
        shader = program(recipe)
        shader.bind(
            blocks={"shafts": block},
            textures=textures,
            images=images,
            integers={"samples_across": drawn.width // width} if recipe.integers else {},
        )
        gpu.compute.dispatch(shader.shader, *groups, 1)
    gpu.shader.unbind()


def pack_shafts(light: LightOnScreen, grid: PolarGrid) -> Floats:
    """The block of gpu_shaders/struct_shafts.glsl in std140, (16,) float32."""
    middle = np.cos(grid.middle), np.sin(grid.middle)
    floats: list[float] = [*light.radiance, light.depth, *grid.center, *middle, grid.span]
    floats += [grid.nearest, grid.step, np.exp(-grid.step / light.length)]
    floats += [-np.expm1(-grid.nearest / light.length), 1.0 / (REACH * light.length)]
    whole = np.array([grid.angles, grid.is_round], np.int32)
    return np.concatenate([np.array(floats, np.float32), whole.view(np.float32)])
