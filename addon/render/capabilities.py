"""Capabilities of the GPU, probed once per start, and the fallbacks for missing ones.

Drivers may accept a program and do nothing, so the results of probes are read back. Passes query
this module before they make a program that not every backend supports:

    image_atomics   strands as lists per pixel (strand_layers.py), else hashed
                    (hashed_strands.py); starts of deep layers, else by depth tests
                    (opacity_pass.py)

The preferences, and HAIRLOOM_IMAGE_ATOMICS=never in the environment, turn them off, to find out
whether they are the cause of a problem. See docs/dev/gpu.md.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import gpu
import numpy as np

from . import gpu_objects
from .shader_program import ShaderRecipe, program
from .textures import drawing_into, drawing_state, texture_to_array

#: choices for image atomics
ATOMICS_CHOICES = ("automatic", "never")
#: environment variable; overrides the choice in Blender
ATOMICS_VARIABLE = "HAIRLOOM_IMAGE_ATOMICS"
#: formats of all textures that passes make
FORMATS = (
    *("R16F", "R32F", "RG32F", "RGBA16F", "RGBA32F"),
    *("R32UI", "RGBA32UI", "DEPTH_COMPONENT32F"),
)
#: why they are not even probed: a program with early_fragment_tests does not compile on Metal, and
#: textures made by scripts lack the flag that atomics need there
_METAL = "Blender gives scripts no textures for them on Metal"
#: samples per pixel of a still whose strands are hashed as a fallback for layers
NOISE_FREE_SAMPLES = 16
_SIDE = 16
_DISPATCH_RECIPE = ShaderRecipe(
    name="probe_dispatch", compute="probe_dispatch.comp.glsl", images=(("RGBA32F", "probed"),)
)
_ATOMICS_RECIPE = ShaderRecipe(
    name="probe_atomics",
    vertex="whole_target.vert.glsl",
    fragment="probe_atomics.frag.glsl",
    images=(("R32UI", "probed", "READ_WRITE"),),
    outputs=(("VEC4", "color"),),
)


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """The results of the probes.

    backend: as Blender names it. image_atomics: whether they are used.
    atomics_problem: why they are not used; else empty.
    missing_formats: of FORMATS. texture_size: largest side [texels]. texture_layers: of an array.
    group_size, group_count: limits of compute shaders in x, y and z.
    dispatch_ms: duration of a small dispatch until it is read back; None where it fails.
    probe_ms: duration of all probes.
    """

    backend: str
    image_atomics: bool
    atomics_problem: str
    missing_formats: tuple[str, ...]
    texture_size: int
    texture_layers: int
    group_size: tuple[int, int, int]
    group_count: tuple[int, int, int]
    dispatch_ms: float | None
    probe_ms: float


_chosen = "automatic"


def choose_image_atomics(choice: str) -> None:
    """Choose one of ATOMICS_CHOICES, from the next draw on."""
    global _chosen
    assert choice in ATOMICS_CHOICES, choice
    _chosen = choice


def capabilities() -> Capabilities:
    """Capabilities of the GPU, probed by the first call, which needs a context that can draw."""
    return _probe(_reason_atomics_are_off())


def pair_format() -> str:
    """The texture format for two numbers per texel that one program both reads and writes. For
    that, Metal supports only one or four channels (Apple's feature set tables, "Texture Buffer
    Pixel Formats")."""
    return "RGBA32F" if gpu.platform.backend_type_get() == "METAL" else "RG32F"


def can_read_own_writes() -> bool:
    """Whether an invocation can read texels that it has written. On Metal that needs a fence (Metal
    Shading Language Specification, "Texture Functions"), which scripts cannot have."""
    return bool(gpu.platform.backend_type_get() != "METAL")


def fails_in_idle_branches() -> bool:
    """Whether a program may crash in a branch that no pixel of a block takes, as Mesa's software
    Vulkan does in the shading of hashed strands."""
    is_vulkan = gpu.platform.backend_type_get() == "VULKAN"
    return is_vulkan and "llvmpipe" in gpu.platform.renderer_get()


def _reason_atomics_are_off() -> str | None:
    """Why the user has turned image atomics off; None where they are on."""
    if os.environ.get(ATOMICS_VARIABLE, "").lower() == "never":
        return f"turned off by {ATOMICS_VARIABLE}"
    return "turned off in the preferences" if _chosen == "never" else None


@cache
def _probe(off_reason: str | None) -> Capabilities:
    begin = time.perf_counter()
    backend = str(gpu.platform.backend_type_get())
    # where atomics are off, their program is never made, in case a driver refuses it
    problem = off_reason or (_METAL if backend == "METAL" else _atomics_problem())
    dispatch_ms = _dispatch_ms()
    missing = tuple(each for each in FORMATS if not _has_format(each))
    size, count = (
        gpu.capabilities.max_work_group_size_get,
        gpu.capabilities.max_work_group_count_get,
    )
    found = Capabilities(
        backend=backend,
        image_atomics=not problem,
        atomics_problem=problem,
        missing_formats=missing,
        texture_size=gpu.capabilities.max_texture_size_get(),
        texture_layers=gpu.capabilities.max_texture_layers_get(),
        group_size=(size(0), size(1), size(2)),
        group_count=(count(0), count(1), count(2)),
        dispatch_ms=dispatch_ms,
        probe_ms=0.0,
    )
    return replace(found, probe_ms=1.0e3 * (time.perf_counter() - begin))


def _atomics_problem() -> str:
    """What is wrong with image atomics, by the results of a small draw; empty if nothing."""
    try:
        found = _atomic_counts()
    except Exception as error:  # a driver may fail at any point, each with an error of its own
        return f"{type(error).__name__}: {error}"
    count = _SIDE * _SIDE
    # the last exchange leaves one of the numbers, the others are returned
    expected = [count, 0, count - 1, count * (count + 1) // 2]
    read = [*found[:3], found[3] + found[4]]
    return "" if read == expected else f"they give {read}, not {expected}"


def _atomic_counts() -> list[int]:
    """Results of atomics over all fragments: their count, the minimum and maximum of their numbers,
    the number that the last exchange left, and the sum of those that exchanges returned.
    """
    probed = gpu_objects.texture((5, 1), format="R32UI")
    probed.clear(format="UINT", value=(0,))
    color = gpu_objects.texture((_SIDE, _SIDE), format="RGBA32F")
    target = gpu_objects.framebuffer(color_slots=(color,))
    triangle = gpu_objects.triangle()
    shader = program(_ATOMICS_RECIPE)
    with drawing_into(target), drawing_state(depth_test="NONE", depth_write=False):
        shader.bind(images={"probed": probed})
        triangle.draw(shader.shader)
    color.read()
    return [int(each) for each in np.asarray(probed.read()).ravel()]


def _dispatch_ms() -> float | None:
    """How long a small dispatch takes [ms]; None where its result is wrong."""
    try:
        times = [_timed_dispatch() for _ in range(2)]  # the first one may still compile
    except Exception as error:  # as above; the self-test fails, and this is why
        print(f"Hairloom: a small dispatch on the GPU fails: {type(error).__name__}: {error}")
        return None
    return times[-1]


def _timed_dispatch() -> float | None:
    begin = time.perf_counter()
    probed = gpu_objects.texture((_SIDE, _SIDE), format="RGBA32F")
    shader = program(_DISPATCH_RECIPE)
    shader.bind(images={"probed": probed})
    shader.dispatch(_SIDE, _SIDE)
    numbers = texture_to_array(probed)[..., 0].ravel()
    took = 1.0e3 * (time.perf_counter() - begin)
    return took if np.array_equal(numbers, np.arange(_SIDE * _SIDE)) else None


def _has_format(name: str) -> bool:
    try:
        made: Any = gpu_objects.texture((4, 4), format=name)
    except (RuntimeError, ValueError):
        return False
    return bool(made.width == 4)
