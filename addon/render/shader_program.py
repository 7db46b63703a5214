"""Compiled shaders from recipes, cached until exit, with checks that all resources are bound.

Shaders are never dropped while Blender runs: one that is collected while bound is used after it is
freed. `release()` is for exit: a GPU object that outlives Blender's GPU context, such as one alive
when a script calls sys.exit(), crashes Blender.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import gpu

from ..params import Settings
from ..params.glsl import struct_source
from . import gpu_objects
from .shader_source import SHADER_FOLDER, ShaderError, ShaderText, compose

#: accesses of a compute shader to an image, with Blender's qualifiers
ACCESSES = {"WRITE": {"WRITE"}, "READ": {"READ"}, "READ_WRITE": {"READ", "WRITE"}}
#: Blender's image types of formats that are not floats
_IMAGE_KINDS = {"R32UI": "UINT_2D", "RGBA32UI": "UINT_2D"}


@dataclass(frozen=True)
class ShaderRecipe:
    """All inputs of a shader program. Slots are assigned in the order of declaration.

    vertex, fragment, compute: file names in `folders`.
    structs: files with the structs that blocks use; they come before everything else.
    settings: parameter sets whose structs, named after the classes, blocks use as well.
    blocks: (struct, name) of each uniform block.
    textures: (sampler type, name).
    images: (format, name) of images that shaders write; (format, name, access) with one of ACCESSES
        for those that they read.
    integers: names of INT push constants (UINT ones stay 0 on OpenGL); numbers: (type, name).
    inputs: (type, name) of vertex attributes; varyings: (interpolation, type, name).
    outputs: (type, name) of fragment outputs.
    group_size: compute local size in x, or in x and y.
    defines: (name, value) for the preprocessor, so that one file makes several programs.
    """

    name: str
    vertex: str = ""
    fragment: str = ""
    compute: str = ""
    structs: tuple[str, ...] = ()
    settings: tuple[type[Settings], ...] = ()
    blocks: tuple[tuple[str, str], ...] = ()
    textures: tuple[tuple[str, str], ...] = ()
    images: tuple[tuple[str, ...], ...] = ()
    integers: tuple[str, ...] = ()
    numbers: tuple[tuple[str, str], ...] = ()
    inputs: tuple[tuple[str, str], ...] = ()
    varyings: tuple[tuple[str, str, str], ...] = ()
    outputs: tuple[tuple[str, str], ...] = ()
    group_size: tuple[int, ...] = (8, 8)
    defines: tuple[tuple[str, int], ...] = ()
    folders: tuple[Path, ...] = (SHADER_FOLDER,)

    def __post_init__(self) -> None:
        for _, name, *access in self.images:
            if access and tuple(access) not in {(known,) for known in ACCESSES}:
                raise ShaderError(f"{self.name}: image {name} is none of {', '.join(ACCESSES)}")

    @property
    def texts(self) -> dict[str, ShaderText]:
        """Each stage composed, by stage name."""
        files = {"vertex": self.vertex, "fragment": self.fragment, "compute": self.compute}
        return {stage: compose(file, self.folders) for stage, file in files.items() if file}


class ShaderProgram:
    """A compiled shader that checks that all resources are bound."""

    def __init__(self, recipe: ShaderRecipe) -> None:
        self.recipe = recipe
        self.shader = _compiled(recipe)

    def bind(
        self,
        *,
        blocks: Mapping[str, Any] | None = None,
        textures: Mapping[str, Any] | None = None,
        images: Mapping[str, Any] | None = None,
        integers: Mapping[str, int] | None = None,
        numbers: Mapping[str, Any] | None = None,
    ) -> None:
        """Bind the shader and each declared resource; call before every draw or dispatch.

        Blender's binding slots are global, and an unbound resource crashes Vulkan. The caller must
        keep the resources alive until it has drawn: freeing one unbinds it.

        Raises:
            ShaderError: a declared resource is missing, or one is given that is not declared.
        """
        recipe = self.recipe
        self._require("block", [name for _, name in recipe.blocks], blocks)
        self._require("texture", [name for _, name in recipe.textures], textures)
        self._require("image", [name for _, name, *_ in recipe.images], images)
        self._require("integer", recipe.integers, integers)
        self._require("number", [name for _, name in recipe.numbers], numbers)
        self.shader.bind()
        for name, block in (blocks or {}).items():
            self.shader.uniform_block(name, block)
        for name, texture in (textures or {}).items():
            self.shader.uniform_sampler(name, texture)
        for name, image in (images or {}).items():
            self.shader.image(name, image)
        for name, integer in (integers or {}).items():
            self.shader.uniform_int(name, integer)
        for name, number in (numbers or {}).items():
            self.shader.uniform_float(name, number)

    def run(self, width: int, height: int = 1) -> None:
        """Run the bound compute shader for this many invocations, rounded up to whole groups."""
        across, down = (*self.recipe.group_size, 1)[:2]
        gpu.compute.dispatch(self.shader, -(-width // across), -(-height // down), 1)

    def dispatch(self, width: int, height: int = 1) -> None:
        """As `run`, and unbind the shader after it."""
        self.run(width, height)
        gpu.shader.unbind()

    def _require(self, kind: str, declared: Any, given: Mapping[str, Any] | None) -> None:
        difference = set(declared) ^ set(given or {})
        if difference:
            names = ", ".join(sorted(difference))
            raise ShaderError(f"{self.recipe.name}: {kind} not both declared and bound: {names}")


class Releasable(Protocol):
    """An owner of GPU objects that can release them and make them again."""

    def release(self) -> None: ...


_PROGRAMS: dict[ShaderRecipe, ShaderProgram] = {}
_KEEPERS: weakref.WeakSet[Releasable] = weakref.WeakSet()


def program(recipe: ShaderRecipe) -> ShaderProgram:
    """The compiled shader of a recipe, compiled on the first call, in a context that can draw.

    Raises:
        ShaderError: it does not compose or compile; the message contains file, line and log.
    """
    if recipe not in _PROGRAMS:
        _PROGRAMS[recipe] = ShaderProgram(recipe)
    return _PROGRAMS[recipe]


def released_with_shaders(keeper: Releasable) -> None:
    """Have `release()` also release this one, as long as it exists."""
    _KEEPERS.add(keeper)


@atexit.register
def release() -> None:
    """At exit: release all shaders and the GPU objects of all passes."""
    for keeper in list(_KEEPERS):
        keeper.release()
    if _PROGRAMS:
        gpu.shader.unbind()
        _PROGRAMS.clear()
    gpu_objects.forget()


def _compiled(recipe: ShaderRecipe) -> Any:
    texts = recipe.texts
    info = _create_info(recipe, texts)
    with _standard_output() as log:
        try:
            return gpu.shader.create_from_info(info)
        except Exception as error:
            problem = str(error)
    raise ShaderError(f"{recipe.name}: {problem}\n{_mapped(log.text(), texts)}")


def _create_info(recipe: ShaderRecipe, texts: Mapping[str, ShaderText]) -> Any:
    info = gpu.types.GPUShaderCreateInfo()
    for name, value in recipe.defines:
        info.define(name, str(value))
    if structs := struct_sources(recipe):
        info.typedef_source(structs)
    for slot, (kind, name) in enumerate(recipe.blocks):
        info.uniform_buf(slot, kind, name)
    for slot, (kind, name) in enumerate(recipe.textures):
        info.sampler(slot, kind, name)
    for slot, (image_format, name, *access) in enumerate(recipe.images):
        qualifiers = ACCESSES[access[0] if access else "WRITE"]
        kind = _IMAGE_KINDS.get(image_format, "FLOAT_2D")
        if image_format == "R32UI" and uses_image_atomics(texts):
            kind = "UINT_2D_ATOMIC"
        info.image(slot, image_format, kind, name, qualifiers=qualifiers)
    for name in recipe.integers:
        info.push_constant("INT", name)
    for kind, name in recipe.numbers:
        info.push_constant(kind, name)
    if "compute" in texts:
        info.local_group_size(*recipe.group_size)
        info.compute_source(texts["compute"].source)
    else:
        _declare_drawing(info, recipe, texts)
    return info


def struct_sources(recipe: ShaderRecipe) -> str:
    """The source of the structs for its blocks, which comes before everything else."""
    structs = [compose(file, recipe.folders).source for file in recipe.structs]
    structs += [struct_source(settings, settings.__name__) for settings in recipe.settings]
    return "\n".join(structs)


def uses_image_atomics(texts: Mapping[str, ShaderText]) -> bool:
    """Whether a program uses image atomics, which not every backend has, see capabilities.py."""
    return any("imageAtomic" in text.source for text in texts.values())


def _declare_drawing(info: Any, recipe: ShaderRecipe, texts: Mapping[str, ShaderText]) -> None:
    for slot, (kind, name) in enumerate(recipe.inputs):
        info.vertex_in(slot, kind, name)
    if recipe.varyings:
        interface = gpu.types.GPUStageInterfaceInfo(f"{recipe.name}_interface")
        for interpolation, kind, name in recipe.varyings:
            getattr(interface, interpolation)(kind, name)
        info.vertex_out(interface)
    for slot, (kind, name) in enumerate(recipe.outputs):
        info.fragment_out(slot, kind, name)
    if "gl_FragDepth" in texts["fragment"].source:
        info.depth_write("ANY")  # without it Metal has no such variable
    info.vertex_source(texts["vertex"].source)
    info.fragment_source(texts["fragment"].source)


def _mapped(log: str, texts: Mapping[str, ShaderText]) -> str:
    """The log with places in our files. A line that names a stage sets it for itself and the lines
    after it."""
    stage, lines = next(iter(texts)), []
    for line in log.splitlines():
        for candidate in texts:
            if f"{candidate}shader" in line.replace(" ", "").lower():
                stage = candidate
        lines.append(texts[stage].mapped(line))
    return "\n".join(lines)


class _Log:
    """The text captured from standard output."""

    def __init__(self) -> None:
        self.file = tempfile.TemporaryFile()  # noqa: SIM115 - closed by text()

    def text(self) -> str:
        with self.file as file:
            file.seek(0)
            return file.read().decode("utf-8", "replace")


@contextlib.contextmanager
def _standard_output() -> Iterator[_Log]:
    """Capture the output of Blender's C code, where the compiler's log is printed."""
    log = _Log()
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
        kept = os.dup(1)
    except OSError:  # a Blender without a console has no standard output
        yield log
        return
    os.dup2(log.file.fileno(), 1)
    try:
        yield log
    finally:
        os.dup2(kept, 1)
        os.close(kept)
