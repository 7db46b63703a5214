"""Shader programs in other compilers: Vulkan's GLSL, SPIR-V, Metal's language and HLSL.

Blender gives a program's text to the driver of the running backend. This writes the same text with
the same declarations for glslang, and collects the errors of glslang, spirv-val and SPIRV-Cross. It
finds errors of our text, not of Blender's own wrapper for Metal. The compilers are
Debian's glslang-tools, spirv-tools and spirv-cross: those of this machine, or of the Debian that
tools/window_blender has installed.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

COMPILERS = ("glslangValidator", "spirv-val", "spirv-cross")
#: Blender's words for types, and GLSL's
_TYPES = {
    **{"FLOAT": "float", "INT": "int", "UINT": "uint", "MAT4": "mat4", "MAT3": "mat3"},
    **{f"{kind}VEC{n}": f"{kind.lower()}vec{n}" for kind in ("", "I", "U") for n in (2, 3, 4)},
}
_SAMPLERS = {
    **{
        f"{kind}_{shape}": f"sampler{shape}"
        for kind in ("FLOAT", "DEPTH")
        for shape in ("2D", "3D")
    },
    **{f"{kind}_2D_ARRAY": "sampler2DArray" for kind in ("FLOAT", "DEPTH")},
    "UINT_2D": "usampler2D",
    "FLOAT_1D": "sampler1D",
}
_COMPONENTS = {"float": 1, "int": 1, "uint": 1, "mat3": 9, "mat4": 16}
_QUALIFIERS = {"READ": "readonly ", "WRITE": "writeonly ", "READ_WRITE": ""}
_SUFFIXES = {"vertex": "vert", "fragment": "frag", "compute": "comp"}
_BUILTINS = """#define gl_VertexID gl_VertexIndex
#define gl_InstanceID gl_InstanceIndex
"""
#: limits of programs on Metal, from Blender's sources (see docs/dev/gpu.md); and the formats of
#: images that a program may both read and write
METAL_LIMITS = {
    "samplers": 64,
    "images": 8,
    "buffers": 31 - 2 - 7,
    "push_bytes": 4096,
    "inputs": 31,
    "varying_floats": 60,
    "outputs": 8,
    "group_size": 512,
    "image_atomics": 0,
    "early_tests": 0,
    "shared_memory": 0,
    "unreadable_images": 0,
}
_READ_WRITE = {"R32F", "R32UI", "R32I", "RGBA32F", "RGBA32UI", "RGBA32I", "RGBA16F"}


#: runs the compilers on each stage in a folder; a file of messages is left only if one fails
_SCRIPT = """
for file in *.vert *.frag *.comp; do
    [ -e "$file" ] || continue
    logged() { "$@" >"$file.log" 2>&1 && rm "$file.log"; }
    { logged glslangValidator -V --quiet "$file" -o "$file.spv" &&
        logged spirv-val --target-env vulkan1.0 "$file.spv"; } ||
        { mv "$file.log" "$file.spirv_failed"; continue; }
    logged spirv-cross "$file.spv" --msl --msl-version 20200 || mv "$file.log" "$file.metal_failed"
    logged spirv-cross "$file.spv" --hlsl --shader-model 50 || mv "$file.log" "$file.hlsl_failed"
done
"""
_WINDOW_BLENDER = Path(__file__).resolve().parent / "window_blender"


def is_possible() -> bool:
    """Whether the compilers are on this machine or in the Debian of tools/window_blender."""
    return all(map(shutil.which, COMPILERS)) or all(
        (_debian() / "usr" / "bin" / name).exists() for name in COMPILERS
    )


def _debian() -> Path:
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "hairloom" / "sid"


def compile_all(folder: Path) -> dict[str, dict[str, str]]:
    """The compilers' messages by kind ("spirv", "metal", "hlsl") and file, of failures alone.

    Args:
        folder: within the repository, which is all that the other Debian sees.
    """
    script = ["sh", "-ec", f"cd '{folder}'{_SCRIPT}"]
    if not all(map(shutil.which, COMPILERS)):
        script = [str(_WINDOW_BLENDER), "run", *script]
    subprocess.run(script, check=True, timeout=600)
    return {
        kind: {
            log.stem: log.read_text(encoding="utf-8").strip()[:400]
            for log in folder.glob(f"*.{kind}_failed")
        }
        for kind in ("spirv", "metal", "hlsl")
    }


def texts(recipe: Any, structs: str) -> dict[str, str]:
    """Each stage of a recipe as a whole file of Vulkan's GLSL, by its suffix."""
    return {
        _SUFFIXES[stage]: "\n".join([*_declarations(recipe, structs, stage), text.source])
        for stage, text in recipe.texts.items()
    }


def _declarations(recipe: Any, structs: str, stage: str) -> list[str]:
    lines = ["#version 450", f"#define GPU_{stage.upper()}_SHADER", _BUILTINS]
    lines += [f"#define {name} {value}" for name, value in recipe.defines]
    lines.append(structs)
    binding = 0
    for kind, name in recipe.blocks:
        lines.append(
            f"layout(std140, set=0, binding={binding}) uniform {name}_block {{ {kind} {name}; }};"
        )
        binding += 1
    for kind, name in recipe.textures:
        lines.append(f"layout(set=0, binding={binding}) uniform {_SAMPLERS[kind]} {name};")
        binding += 1
    for image_format, name, *access in recipe.images:
        kind = "uimage2D" if image_format.endswith("UI") else "image2D"
        lines.append(
            f"layout(set=0, binding={binding}, {image_format.lower()}) uniform "
            f"{_QUALIFIERS[access[0] if access else 'WRITE']}{kind} {name};"
        )
        binding += 1
    constants = [("int", name) for name in recipe.integers]
    constants += [(_TYPES[kind], name) for kind, name in recipe.numbers]
    if constants:
        members = " ".join(f"{kind} {name};" for kind, name in constants)
        lines.append(f"layout(push_constant) uniform pushed_constants {{ {members} }};")
    if stage == "compute":
        x, y = (*recipe.group_size, 1)[:2]
        return [*lines, f"layout(local_size_x={x}, local_size_y={y}) in;"]
    if stage == "vertex":
        lines += _with_locations("in", ((kind, name) for kind, name in recipe.inputs))
    else:
        lines += _with_locations("out", ((kind, name) for kind, name in recipe.outputs))
    qualifier = "out" if stage == "vertex" else "in"
    for location, (interpolation, kind, name) in enumerate(recipe.varyings):
        lines.append(
            f"layout(location={location}) {interpolation} {qualifier} {_TYPES[kind]} {name};"
        )
    return lines


def _with_locations(qualifier: str, members: Any) -> list[str]:
    return [
        f"layout(location={location}) {qualifier} {_TYPES[kind]} {name};"
        for location, (kind, name) in enumerate(members)
    ]


def resource_counts(recipe: Any) -> dict[str, int]:
    """What a program needs, by the names of METAL_LIMITS."""
    source = "\n".join(text.source for text in recipe.texts.values())
    constants = ["int"] * len(recipe.integers) + [_TYPES[kind] for kind, _ in recipe.numbers]
    read_write = [image[0] for image in recipe.images if image[2:] == ("READ_WRITE",)]
    group = 1
    for side in recipe.group_size if recipe.compute else ():
        group *= side
    return {
        "samplers": len(recipe.textures),
        "images": len(recipe.images),
        "buffers": len(recipe.blocks) + len(recipe.inputs),
        # a vec3 takes as much as a vec4
        "push_bytes": sum(
            16 if _components(kind) == 3 else 4 * _components(kind) for kind in constants
        ),
        "inputs": len(recipe.inputs),
        "varying_floats": sum(_components(_TYPES[kind]) for _, kind, _ in recipe.varyings),
        "outputs": len(recipe.outputs),
        "group_size": group,
        "image_atomics": len(re.findall(r"imageAtomic\w+", source)),
        "early_tests": source.count("early_fragment_tests"),
        "shared_memory": len(re.findall(r"^\s*shared\s", source, re.MULTILINE)),
        "unreadable_images": sum(image_format not in _READ_WRITE for image_format in read_write),
    }


def _components(kind: str) -> int:
    return _COMPONENTS.get(kind) or int(kind[-1])


def exceeded_metal_limits(counts: Mapping[str, int]) -> list[str]:
    """The demands that exceed Metal's limits."""
    return [
        f"{name} {counts[name]}" for name, maximum in METAL_LIMITS.items() if counts[name] > maximum
    ]
