"""Fixtures of the GPU tests: compute shaders that write values, and scenes to draw."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic

SHADERS = Path(__file__).parent / "shaders"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        is_here = item.path.is_relative_to(Path(__file__).parent)
        if is_here and "gpu_context" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.draws)


@pytest.fixture(scope="session")
def frame(gpu_context: Any) -> Any:
    """The module `frame`, with a GPU context."""
    from hairloom.addon.render import frame

    return frame


@pytest.fixture(scope="session")
def square_camera() -> Callable[..., Any]:
    """A function that makes an orthographic camera along +y for x and z from 0 to `size` [m]."""

    def make(size: float) -> Any:
        middle = size / 2
        return Camera(
            look_at((middle, -100.0, middle), (middle, 0.0, middle)),
            orthographic(size, 1.0, 0.0, 200.0),
        )

    return make


@pytest.fixture
def compute(gpu_context: Any) -> Callable[..., np.ndarray]:
    """A function that runs a compute shader of tests/gpu/shaders over a grid and returns
    (height, width, 4)."""
    from hairloom.addon.render.shader_program import ShaderRecipe, program
    from hairloom.addon.render.shader_source import SHADER_FOLDER
    from hairloom.addon.render.textures import texture_from, texture_to_array, volume_from

    def run(
        file: str,
        size: tuple[int, int],
        *,
        textures: Mapping[str, np.ndarray] | None = None,
        blocks: Mapping[str, tuple[str, np.ndarray]] | None = None,
        samplers: Mapping[str, tuple[str, Any]] | None = None,
        **recipe: Any,
    ) -> np.ndarray:
        """`textures` are arrays (h, w, 4) or (d, h, w, 4), `blocks` (struct, std140 values), and
        `samplers` (sampler type, texture on the GPU), all by name.
        """
        shader = program(
            ShaderRecipe(
                name=file,
                compute=file,
                textures=(
                    *((f"FLOAT_{a.ndim - 1}D", name) for name, a in (textures or {}).items()),
                    *((kind, name) for name, (kind, _) in (samplers or {}).items()),
                ),
                images=(("RGBA32F", "result"),),
                blocks=tuple((struct, name) for name, (struct, _) in (blocks or {}).items()),
                folders=(SHADERS, SHADER_FOLDER),
                **recipe,
            )
        )
        result = gpu_context.types.GPUTexture(size, format="RGBA32F")
        inputs = {
            name: volume_from(array) if array.ndim == 4 else texture_from(array, "RGBA32F")
            for name, array in (textures or {}).items()
        }
        inputs |= {name: texture for name, (_, texture) in (samplers or {}).items()}
        buffers = {
            name: gpu_context.types.GPUUniformBuf(values)
            for name, (_, values) in (blocks or {}).items()
        }
        shader.bind(textures=inputs, images={"result": result}, blocks=buffers)
        gpu_context.compute.dispatch(shader.shader, -(-size[0] // 8), -(-size[1] // 8), 1)
        pixels = texture_to_array(result)
        gpu_context.shader.unbind()
        return pixels

    return run
