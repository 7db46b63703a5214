"""Draws shafts of light into a finished picture; the reference is shading/shafts.py."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..shading.bright_shafts import wants_bright
from ..shading.lights import Light
from ..shading.shafts import LightOnScreen, PolarGrid, lights_on_screen
from ..shading.shafts_settings import ShaftSettings
from . import gpu_objects
from .bright_pass import BrightShafts, one_texel
from .camera import Camera
from .shader_program import ShaderRecipe, program
from .shafts_block import BLOCKS, STRUCTS, pack_shafts

_CASTER = ShaderRecipe(
    name="shafts_caster",
    compute="shafts_caster.comp.glsl",
    structs=STRUCTS,
    blocks=BLOCKS,
    textures=(("FLOAT_2D", "samples_of"), ("FLOAT_2D", "depth_of")),
    images=(("R32F", "caster"),),
    integers=("samples_across", "is_separate"),
)
_BLUR = ShaderRecipe(
    name="shafts_blur",
    compute="shafts_blur.comp.glsl",
    structs=STRUCTS,
    blocks=BLOCKS,
    textures=(("FLOAT_2D", "caster"),),
    images=(("R32F", "rays"),),
    group_size=(64,),
)
_ADD = ShaderRecipe(
    name="shafts_add",
    compute="shafts_add.comp.glsl",
    structs=STRUCTS,
    blocks=BLOCKS,
    textures=(("FLOAT_2D", "rays"),),
    images=(("RGBA32F", "picture", "READ_WRITE"),),
)
_UNDER = ShaderRecipe(
    name="under",
    compute="under.comp.glsl",
    images=(("RGBA32F", "picture", "READ_WRITE"),),
    numbers=(("VEC4", "background"),),
)


def finish_with_shafts(
    picture: Any,
    hair_picture: Any,
    depth: Any,
    camera: Camera,
    lights: Sequence[Light],
    settings: ShaftSettings,
    background: tuple[float, float, float, float],
) -> None:
    """Add all shafts to a picture without a background, and composite it over a colour.

    Args: as of `add_shafts` and `put_under`.
    """
    # before `add_shafts`, since shafts from lights must not count as bright parts
    behind = one_texel(background) if wants_bright(settings) else None
    bright = BrightShafts(picture, behind, camera, settings)
    add_shafts(picture, hair_picture, depth, camera, lights, settings)
    put_under(picture, background)
    bright.add_to(picture)


def draw_separate_shafts(
    target: Any,
    hair_picture: Any,
    depth: Any,
    background: Any,
    camera: Camera,
    lights: Sequence[Light],
    settings: ShaftSettings,
) -> None:
    """Add all shafts to a texture of their own.

    Args:
        target: RGBA32F, black at first.
        hair_picture, depth: hair with holes for meshes, and the depth of both.
        background: of the hair, which is another engine's picture, as of `BrightShafts`.
            Others as of `add_shafts`.
    """
    bright = BrightShafts(hair_picture, background, camera, settings)
    add_shafts(target, hair_picture, depth, camera, lights, settings, is_separate=True)
    bright.add_to(target)


def add_shafts(
    picture: Any,
    hair_picture: Any,
    depth: Any,
    camera: Camera,
    lights: Sequence[Light],
    settings: ShaftSettings,
    *,
    is_separate: bool = False,
) -> None:
    """Add the haze of the lights in view, and the shafts in it, to a picture on the GPU.

    If no light is in view, or shafts are off, the picture stays bit-identical.

    Args:
        picture: RGBA32F texture, scene-linear and premultiplied, changed in place. It must not have
            a background, since its alpha determines what stands before a light; see `put_under`.
        hair_picture, depth: the colour and depth from which it was averaged, with a whole number of
            texels along each side of a pixel; `hair_picture` may be the picture itself.
        is_separate: meshes are holes in `hair_picture`, so that only their depth shows them.
    """
    width, height = picture.width, picture.height
    seen = lights_on_screen(lights, camera.view, camera.projection, width, height, settings)
    for light in seen:
        _add_light(picture, hair_picture, depth, light, settings.samples, is_separate)


def put_under(picture: Any, background: tuple[float, float, float, float]) -> None:
    """Composite a picture without a background over a premultiplied colour."""
    shader = program(_UNDER)
    shader.bind(images={"picture": picture}, numbers={"background": background})
    shader.dispatch(picture.width, picture.height)


def _add_light(
    picture: Any,
    hair_picture: Any,
    depth: Any,
    light: LightOnScreen,
    samples: int,
    is_separate: bool,
) -> None:
    width, height = picture.width, picture.height
    grid = PolarGrid.over(light.center, width, height, samples)
    block = gpu_objects.uniform_buffer(pack_shafts(light, grid))
    caster = gpu_objects.texture((width, height), format="R32F")
    rays = gpu_objects.texture((grid.radii, grid.angles), format="R32F")
    integers = {"samples_across": hair_picture.width // width, "is_separate": int(is_separate)}
    steps: tuple[tuple[ShaderRecipe, dict[str, Any], dict[str, Any], tuple[int, int]], ...] = (
        (
            _CASTER,
            {"samples_of": hair_picture, "depth_of": depth},
            {"caster": caster},
            (width, height),
        ),
        (_BLUR, {"caster": caster}, {"rays": rays}, (grid.angles, 1)),
        (_ADD, {"rays": rays}, {"picture": picture}, (width, height)),
    )
    for recipe, textures, images, size in steps:
        shader = program(recipe)
        shader.bind(
            blocks={"shafts": block},
            textures=textures,
            images=images,
            integers=integers if recipe.integers else {},
        )
        shader.dispatch(*size)
