"""Failing shaders report the place of the error; running shaders have complete bindings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

SHADERS = Path(__file__).parent / "shaders"


@pytest.fixture
def recipes(gpu_context: Any) -> Any:
    from hairloom.addon.render import shader_program

    return shader_program


def test_compile_error_names_our_file_and_line(recipes: Any, capfd: Any) -> None:
    from hairloom.addon.render.shader_source import SHADER_FOLDER, ShaderError

    recipe = recipes.ShaderRecipe(
        name="broken", compute="broken.glsl", folders=(SHADERS, SHADER_FOLDER)
    )
    with pytest.raises(ShaderError, match=r"broken\.glsl:6") as caught:
        recipes.program(recipe)
    assert "undeclared_thing" in str(caught.value)
    assert "python_shader" not in str(caught.value)
    assert "undeclared_thing" not in capfd.readouterr().out, "the log was caught, not printed"


def test_each_recipe_is_compiled_once(recipes: Any) -> None:
    from dataclasses import replace

    from hairloom.addon.render.frame import _BOX_RECIPE

    first, again = (recipes.program(replace(_BOX_RECIPE)) for _ in range(2))
    assert first is again


def test_missing_and_unknown_resources_are_refused(recipes: Any) -> None:
    from hairloom.addon.render.frame import _BOX_RECIPE
    from hairloom.addon.render.shader_source import ShaderError

    shader = recipes.program(_BOX_RECIPE)
    with pytest.raises(ShaderError, match="samples_of"):
        shader.bind(images={"picture": None}, integers={"samples_across": 2})
    with pytest.raises(ShaderError, match="other"):
        shader.bind(
            textures={"samples_of": None},
            images={"picture": None},
            integers={"samples_across": 2, "other": 1},
        )


def test_an_image_may_be_read_and_written(recipes: Any, gpu_context: Any) -> None:
    """A one-dimensional image with a define: each texel of a row is multiplied in place."""
    import numpy as np

    from hairloom.addon.render.textures import texture_from, texture_to_array

    recipe = recipes.ShaderRecipe(
        name="times",
        compute="times.glsl",
        images=(("RGBA32F", "numbers", "READ_WRITE"),),
        group_size=(16,),
        defines=(("FACTOR", 3),),
        folders=(SHADERS,),
    )
    numbers = np.arange(80, dtype=np.float32).reshape(1, 20, 4)
    texture = texture_from(numbers, "RGBA32F")
    for times in (3, 9):
        shader = recipes.program(recipe)
        shader.bind(images={"numbers": texture})
        gpu_context.compute.dispatch(shader.shader, 2, 1, 1)
        gpu_context.shader.unbind()
        assert (texture_to_array(texture) == numbers * times).all()


def test_an_unknown_access_is_refused(recipes: Any) -> None:
    from hairloom.addon.render.shader_source import ShaderError

    with pytest.raises(ShaderError, match="READ_WRITE"):
        recipes.ShaderRecipe(name="odd", images=(("RGBA32F", "numbers", "APPEND"),))


def test_release_forgets_all_and_shaders_come_back(recipes: Any) -> None:
    from hairloom.addon.render.frame import _BOX_RECIPE

    before = recipes.program(_BOX_RECIPE)
    recipes.release()
    recipes.release()
    assert recipes.program(_BOX_RECIPE) is not before
