"""HLSL shading on the GPU, translated into GLSL by glslang and SPIRV-Cross."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np

from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.tables import marschner_tables


def probe_hlsl(hlsl: Path, text: str, sandbox: str, folder: Path) -> np.ndarray:
    """The result of a fragment program in HLSL, see `probe_glsl`.

    Args:
        hlsl: the file to write `text` to, where the sandbox's programs can read it.
        folder: for the translated program.
    """
    hlsl.write_text(text, encoding="utf-8")
    program = hlsl.with_suffix(".spv")
    compile_it = ["glslangValidator", "-D", "-V", "-S", "frag", "-e", "main", "-o", str(program)]
    compile_it += ["--auto-map-bindings", "--auto-map-locations", str(hlsl)]
    for command in (compile_it, ["spirv-cross", "--version", "430", str(program)]):
        done = subprocess.run([sandbox, "run", *command], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    return probe_glsl(folder / "hlsl.glsl", _as_function(done.stdout), "at = place; main_of_hlsl()")


def _as_function(text: str) -> str:
    """A fragment program of SPIRV-Cross as a function: plain variables, and our textures."""
    text = re.sub(r"#version.*", "", text)
    text = re.sub(r"layout\(location = \d+\) in vec2 (\w+);", r"vec2 \1;\n#define at \1", text)
    result = r"vec4 \1;\n#define result_of_probe \1"
    text = re.sub(r"layout\(location = \d+\) out vec4 (\w+);", result, text)
    sampler = (
        r"(?:layout\(binding = \d+\) )?uniform sampler2D (\w*?(longitudinal|azimuthal|paths)\w*);"
    )
    text = re.sub(sampler, r"#define \1 \2", text)
    return text.replace("void main()", "void main_of_hlsl()")


def probe_glsl(file: Path, text: str, call: str) -> np.ndarray:
    """Both models at 4,096 places, (64, 128, 4)."""
    import gpu

    from hairloom.addon.render.shader_program import ShaderRecipe, program
    from hairloom.addon.render.shader_source import SHADER_FOLDER
    from hairloom.addon.render.textures import texture_from, texture_to_array

    file.write_text(text + PROBE_MAIN.replace("CALL", call), encoding="utf-8")
    fibre = marschner_tables(Fibre(), 32)
    tables = {
        "longitudinal": fibre.longitudinal[0],
        "azimuthal": fibre.azimuthal,
        "paths": fibre.paths,
    }
    recipe = ShaderRecipe(
        name=file.stem,
        compute=file.name,
        textures=tuple(("FLOAT_2D", name) for name in tables),
        images=(("RGBA32F", "result"),),
        folders=(file.parent, SHADER_FOLDER),
    )
    shader = program(recipe)
    result = gpu.types.GPUTexture((128, 64), format="RGBA32F")
    textures = {name: texture_from(table, "RGBA32F") for name, table in tables.items()}
    shader.bind(textures=textures, images={"result": result})
    gpu.compute.dispatch(shader.shader, 16, 8, 1)
    pixels = texture_to_array(result)
    gpu.shader.unbind()
    return np.asarray(pixels)


PROBE_MAIN = """
void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec2 place = vec2(float(pixel.x / 2 + 64 * pixel.y) * 0.05, float(pixel.x % 2));
  CALL;
  imageStore(result, pixel, result_of_probe);
}
"""
