"""Programs compiled for targets that do not run here: SPIR-V, Metal's language and HLSL.

Tests that use many programs are run once more in their own process, which records all programs that
they compile. Blender wraps our text for Metal in its own way: programs that pass here can still
fail there, but those that fail here also fail there.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import cross_compile
import pytest
from extension_loader import REPOSITORY

from hairloom.addon.render.shader_program import ShaderRecipe
from hairloom.addon.render.shader_source import SHADER_FOLDER

pytestmark = pytest.mark.skipif(
    bool(bpy.app.binary_path), reason="programs are written down by Blender as a module"
)
needs_compilers = pytest.mark.skipif(
    not cross_compile.is_possible(),
    reason="apt-get install glslang-tools spirv-tools spirv-cross, or tools/window_blender install",
)
#: tests whose programs draw strands and cards without atomics
FEW = (
    "tests/gpu/test_no_atomics.py::test_no_program_with_atomics_is_made_where_they_are_forbidden",
)
#: tests that compile programs of every file of gpu_shaders/, see `test_all_files_are_compiled`
ALL = (
    *FEW,
    "tests/gpu/test_no_atomics.py::test_atomics_that_do_nothing_are_noticed",
    "tests/blender/test_engine_scene.py::test_hair_can_be_a_holdout",
    "tests/blender/test_engine_scene.py::test_the_camera_may_be_inside_of_hair_and_head",
    "tests/blender/test_engine_scene.py::test_view_layers_and_holdouts",
    "tests/blender/test_hair_scene.py::test_shadow_on_a_mesh_is_as_dark_as_in_cycles",
    "tests/blender/test_solvers.py::test_switching_the_solver_continues_the_motion",
    "tests/blender/test_solvers.py::test_both_agree_on_a_shaken_head",
    "tests/gpu/test_accumulation.py::test_the_mean_is_drawn_over_the_picture_at_its_corner",
    "tests/gpu/test_atlas_pass.py::test_the_pass_agrees_with_the_reference",
    "tests/gpu/test_body_shadow.py::test_skin_is_as_much_darker_on_the_screen_as_hair_leaves_of_its_light",
    "tests/gpu/test_card_passes.py::test_a_normal_map_bends_the_normal",
    "tests/gpu/test_card_passes.py::test_states_are_those_of_the_paper",
    "tests/gpu/test_card_shadows.py::test_a_card_behind_cards_has_the_light_that_they_leave",
    "tests/gpu/test_bright_pass.py::test_a_mesh_that_shines_shows_its_light_and_one_that_does_not_is_as_before",
    "tests/gpu/test_bright_pass.py::test_the_shafts_of_a_window_are_the_reference",
    "tests/gpu/test_card_shadows.py::test_cards_shade_the_skin_and_a_mesh_shades_cards",
    "tests/gpu/test_card_shadows.py::test_view_compensated_cards_shade_equally_from_all_sides_of_their_strands",
    "tests/gpu/test_debug_views.py::test_the_detail_view_shows_factors_by_colour",
    "tests/gpu/test_dynamics_pass.py::test_hair_among_hair_equals_numpy",
    "tests/gpu/test_dynamics_pass.py::test_grooms_that_feel_each_other_equal_numpy",
    "tests/gpu/test_frame.py::test_positive_shift_moves_the_highlight_to_the_tips",
    "tests/gpu/test_hold_pass.py::test_equals_numpy",
    "tests/gpu/test_inter_groom_shadow.py::test_a_mesh_has_the_shadow_of_all_grooms",
    "tests/gpu/test_inter_groom_shadow.py::test_hair_has_the_shadow_of_other_grooms",
    "tests/gpu/test_lead_out_pass.py::test_equals_numpy",
    "tests/gpu/test_lead_out_pass.py::test_points_that_were_led_out_earlier_are_stored",
    "tests/gpu/test_cached_picture.py::test_a_cached_picture_is_shown_as_it_was_drawn",
    "tests/gpu/test_light_kinds.py::test_light_kinds_that_are_left_out_would_add_nothing",
    "tests/gpu/test_moving_strands.py::test_moving_hair_does_not_wait_for_the_gpu_and_looks_as_at_rest",
    "tests/gpu/test_opacity_tiles.py::test_maps_of_several_lights_lie_below_one_another",
    "tests/gpu/test_own_colors.py::test_hair_of_two_colours_is_drawn_as_two_looks",
    "tests/gpu/test_scene_data.py::test_vertex_values_are_interpolated_to_pixels",
    "tests/gpu/test_scene_data.py::test_tangents_are_those_of_the_strands_as_strong_as_they_cover",
    "tests/gpu/test_scene_data.py::test_strands_thinner_than_a_pixel_are_found_and_nearest_wherever_they_are",
    "tests/gpu/test_shadow_lights.py::test_a_lamp_amidst_the_hair_leaves_the_shadows_of_others_as_they_are",
    "tests/gpu/test_shafts_pass.py::test_a_background_comes_under_what_was_drawn_over_nothing",
    "tests/gpu/test_shafts_pass.py::test_the_shaders_are_the_reference",
    "tests/gpu/test_soft_picture.py::test_one_sample_equals_the_hard_shadow",
    "tests/gpu/test_skin_pass.py::test_without_softness_the_shadow_is_that_of_other_meshes",
    "tests/gpu/test_uneven_strands.py::test_both_at_once_are_both_alone",
    "tests/gpu/test_uneven_strands.py::test_few_points_are_the_same_curves_as_many",
    "tests/gpu/test_uneven_strands.py::test_tint_and_taper_go_by_length_however_points_are_spaced",
)
#: prefixes of the names of programs that are not used on Metal, which draws no layers: moving hair
#: is counted for layers only, and views without layers take no samples
NOT_ON_METAL = (
    "probe",
    "detail_demand",
    "detail_slots",
    "opacity_starts",
    "strand_gather",
    "strand_count",
    "strand_layers_order",
    "body_shadow_sample",
)
#: errors specific to Direct3D, which Blender does not use: another layout of constants, no points
NOT_IN_HLSL = ("cannot be expressed with either HLSL packing", "Unsupported builtin in HLSL: 1")
PLAIN = ShaderRecipe(name="x", compute="x.comp.glsl")


@pytest.fixture(scope="module", params=["few", pytest.param("all", marks=pytest.mark.slow)])
def chosen(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def folder(chosen: str) -> Iterator[Path]:
    """The folder with the programs, written by `record_programs`."""
    (REPOSITORY / "out").mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="programs_", dir=REPOSITORY / "out") as name:
        _record(Path(name), ALL if chosen == "all" else FEW)
        yield Path(name)


def _record(folder: Path, tests: tuple[str, ...]) -> None:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "record_programs",
        "-p",
        "no:cacheprovider",
    ]
    done = subprocess.run(
        [*command, *tests],
        cwd=REPOSITORY,
        env={**os.environ, "HAIRLOOM_PROGRAMS": str(folder)},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-500:]


@pytest.fixture(scope="module")
def programs(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "programs.jsonl").read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines]


def is_on_metal(program: dict[str, Any]) -> bool:
    name: str = program["name"]
    is_for_it = name.startswith(("opacity_starts_of_depths", "probe_dispatch"))
    return is_for_it or not name.startswith(NOT_ON_METAL)


def test_all_files_are_compiled(programs: list[dict[str, Any]], chosen: str) -> None:
    """Every shader file of a stage is compiled; for a new file, add a test to ALL that draws with
    it."""
    seen = {stage for program in programs for stage in program["stages"]}
    files = {path.name for path in SHADER_FOLDER.glob("*.*.glsl")}
    assert seen <= files and (chosen == "few" or files == seen)


def test_no_program_needs_what_metal_has_not(programs: list[dict[str, Any]]) -> None:
    beyond = {
        program["name"]: missing
        for program in programs
        if is_on_metal(program)
        and (missing := cross_compile.exceeded_metal_limits(program["demands"]))
    }
    assert beyond == {}


@needs_compilers
def test_programs_are_valid_spirv_and_metal(programs: list[dict[str, Any]], folder: Path) -> None:
    """The figures programs_spirv_invalid and programs_msl_failed are 0."""
    found = cross_compile.compile_all(folder)
    of_metal = {file for each in programs if is_on_metal(each) for file in each["files"]}
    hlsl = {
        file: message
        for file, message in found["hlsl"].items()
        if not any(known in message for known in NOT_IN_HLSL)
    }
    assert len(of_metal) > (200 if chosen == "all" else 20)
    assert found["spirv"] == {}
    assert {file: message for file, message in found["metal"].items() if file in of_metal} == {}
    assert hlsl == {}


@needs_compilers
def test_what_is_wrong_is_found(folder: Path) -> None:
    cases = {
        "good": "imageStore(picture, ivec2(0), vec4(1.0));",
        "name": "imageStore(picture, ivec2(0), vec4(nothing));",
        "access": "imageLoad(picture, ivec2(0));",
    }
    with tempfile.TemporaryDirectory(dir=folder) as name:
        for case, source in cases.items():
            (Path(name) / "x.comp.glsl").write_text(f"void main() {{ {source} }}")
            recipe = replace(PLAIN, images=(("RGBA32F", "picture"),), folders=(Path(name),))
            (Path(name) / f"{case}.comp").write_text(cross_compile.texts(recipe, "")["comp"])
        found = cross_compile.compile_all(Path(name))
    assert found["spirv"].keys() == {"name.comp", "access.comp"}
    assert "nothing" in found["spirv"]["name.comp"] and "writeonly" in found["spirv"]["access.comp"]
    assert not found["metal"] and not found["hlsl"]


def test_what_is_beyond_metal_is_found(tmp_path: Path) -> None:
    (tmp_path / "x.comp.glsl").write_text("void main() { imageAtomicAdd(counts, ivec2(0), 1u); }")
    plain = replace(PLAIN, images=(("R32UI", "counts", "READ_WRITE"),), folders=(tmp_path,))
    cases = (
        (plain, "image_atomics 1"),
        (replace(plain, images=(("RG32F", "x", "READ_WRITE"),)), "unreadable_images 1"),
        (replace(plain, group_size=(32, 32)), "group_size 1024"),
        (replace(plain, numbers=(("MAT4", "x"),) * 65), "push_bytes 4160"),
        (replace(plain, textures=(("FLOAT_2D", "x"),) * 65), "samplers 65"),
    )
    for recipe, complaint in cases:
        assert complaint in cross_compile.exceeded_metal_limits(
            cross_compile.resource_counts(recipe)
        )
