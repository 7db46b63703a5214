"""The GPU's look-up of Marschner's tables against Python's, on random angles and absorptions."""

from __future__ import annotations

from pathlib import Path

import gpu
import numpy as np

from hairloom.addon.render.marschner_textures import MARSCHNER, MARSCHNER_TEXTURES
from hairloom.addon.render.shader_program import ShaderRecipe, program
from hairloom.addon.render.shader_source import SHADER_FOLDER
from hairloom.addon.render.textures import UniformBlock, texture_from, texture_to_array
from hairloom.addon.shading.marschner.look import fibre_of, pack_fibre
from hairloom.addon.shading.marschner.tables import DEFAULT_SIZE, look_up, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings

SHADERS = Path(__file__).resolve().parents[1] / "tests" / "gpu" / "shaders"
SIDE = 256
#: fraction of the largest value; smaller values are compared as if they were this large
LEAST = 1.0e-5


def glsl_relative_error() -> float:
    """The largest relative error of 65,536 times 3 values."""
    shading = ShadingSettings()
    angles, absorptions = _random_ways()
    shader = program(
        ShaderRecipe(
            name="bench_look_up",
            compute="marschner_look_up.glsl",
            structs=("struct_fibre.glsl",),
            settings=(ShadingSettings,),
            blocks=(("Fibre", "fibre"),),
            textures=(
                *(("FLOAT_2D", name) for name in ("angles", "absorptions")),
                *MARSCHNER_TEXTURES,
            ),
            images=(("RGBA32F", "result"),),
            folders=(SHADERS, SHADER_FOLDER),
        )
    )
    result = gpu.types.GPUTexture((SIDE, SIDE), format="RGBA32F")
    # referenced here, as binding keeps nothing alive
    textures = {
        "angles": texture_from(angles, "RGBA32F"),
        "absorptions": texture_from(absorptions, "RGBA32F"),
        **MARSCHNER.textures(shading, DEFAULT_SIZE),
    }
    fibre_block = UniformBlock().holding(pack_fibre(shading))
    shader.bind(textures=textures, images={"result": result}, blocks={"fibre": fibre_block})
    gpu.compute.dispatch(shader.shader, SIDE // 8, SIDE // 8, 1)
    found = texture_to_array(result)[..., :3]
    gpu.shader.unbind()
    fibre = fibre_of(shading)
    theta_i, theta_r, phi, level = np.moveaxis(angles.astype(np.float64), -1, 0)
    absorption, strengths = absorptions[..., :3].astype(np.float64), np.array(fibre.strengths)
    tables = marschner_tables(fibre, DEFAULT_SIZE)
    expected = look_up(tables, theta_i, theta_r, phi, absorption, strengths, level)
    # as lighting uses it: at grazing angles, S itself is unbounded
    cosine = np.cos(theta_i)[..., None]
    apart, size = np.abs(found - expected) * cosine, np.abs(expected) * cosine
    return float((apart / np.maximum(size, LEAST * size.max())).max())


def _random_ways() -> tuple[np.ndarray, np.ndarray]:
    """Random theta_i, theta_r, phi, level, half of them near the first highlight; and
    absorptions."""
    chance = np.random.default_rng(11)
    steepest = 0.49 * np.pi
    angles = np.zeros((SIDE, SIDE, 4), np.float32)
    theta_i = chance.uniform(-steepest, steepest, (SIDE, SIDE))
    theta_r = chance.uniform(-steepest, steepest, (SIDE, SIDE))
    near = -theta_i[::2] + chance.normal(0.0, 0.1, (SIDE // 2, SIDE))
    theta_r[::2] = np.clip(near, -steepest, steepest)
    angles[..., 0], angles[..., 1] = theta_i, theta_r
    angles[..., 2] = chance.uniform(0.0, np.pi, (SIDE, SIDE))
    angles[..., 3] = chance.uniform(0.0, 5.0, (SIDE, SIDE))
    absorptions = np.zeros((SIDE, SIDE, 4), np.float32)
    absorptions[..., :3] = 10.0 ** chance.uniform(-2.0, 1.0, (SIDE, SIDE, 3))
    return angles, absorptions
