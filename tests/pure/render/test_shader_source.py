"""Composition of shaders as text, without a GPU."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from hairloom.addon.render.shader_source import SHADER_FOLDER, ShaderError, compose
from hairloom.addon.shading.lights import LIGHT_CAPACITY


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "lib_one.glsl").write_text("// one\nfloat one() { return 1.0; }\n")
    (tmp_path / "lib_two.glsl").write_text('#include "lib_one.glsl"\nfloat two;\n')
    return tmp_path


def write(folder: Path, text: str) -> str:
    (folder / "main.glsl").write_text(text)
    return "main.glsl"


def test_includes_come_before_their_users_and_once(folder: Path) -> None:
    name = write(folder, '#include "lib_two.glsl"\n#include "lib_one.glsl"\nvoid main() {}\n')
    lines = compose(name, [folder]).source.splitlines()
    assert lines == ["// one", "float one() { return 1.0; }", "float two;", "void main() {}"]


def test_every_line_knows_its_place(folder: Path) -> None:
    name = write(folder, 'int a;\n#include "lib_two.glsl"\nint b;\n')
    text = compose(name, [folder])
    places = [text.place(line) for line in range(1, 6)]
    expected = ["main.glsl:1", "lib_one.glsl:1", "lib_one.glsl:2", "lib_two.glsl:2", "main.glsl:3"]
    assert places == expected
    assert text.mapped("python_shader.glsl:3:9: Error") == "lib_one.glsl:2:9: Error"
    assert text.place(99) == "composed line 99"


def test_an_unknown_include_names_the_including_file(folder: Path) -> None:
    (folder / "lib_three.glsl").write_text('int c;\n#include "lib_nowhere.glsl"\n')
    name = write(folder, '#include "lib_three.glsl"\n')
    with pytest.raises(ShaderError, match=r"lib_three\.glsl:2: .*'lib_nowhere\.glsl'"):
        compose(name, [folder])


def test_unknown_shader_is_an_error(folder: Path) -> None:
    with pytest.raises(ShaderError, match=r"no shader file 'none\.glsl'"):
        compose("none.glsl", [folder])


def test_names_are_replaced_and_unknown_ones_refused(folder: Path) -> None:
    name = write(folder, "vec4 a[{{light_capacity}}], b[{{ light_capacity }}];\n")
    assert compose(name, [folder]).source == f"vec4 a[{LIGHT_CAPACITY}], b[{LIGHT_CAPACITY}];\n"
    name = write(folder, "int a;\nint b = {{light_count}};\n")
    with pytest.raises(ShaderError, match=r"main\.glsl:2: unknown name 'light_count'"):
        compose(name, [folder])


def test_folders_are_searched_in_turn(folder: Path) -> None:
    name = write(folder, '#include "lib_one.glsl"\n#include "lib_lights.glsl"\n')
    origins = {file for file, _ in compose(name, [folder, SHADER_FOLDER]).origins}
    assert origins == {"lib_one.glsl", "lib_lights.glsl", "lib_angle.glsl", "lib_pi.glsl"}


@pytest.mark.parametrize("file", sorted(SHADER_FOLDER.glob("*.glsl")), ids=lambda file: file.name)
def test_shipped_shaders_compose(file: Path) -> None:
    source = compose(file.name).source
    assert "{{" not in source and "#include" not in source
    assert file.read_text(encoding="utf-8").startswith("//"), "a header comment opens each file"


@pytest.mark.parametrize(
    "file",
    [*SHADER_FOLDER.glob("lib_*.glsl"), *SHADER_FOLDER.glob("struct_*.glsl")],
    ids=lambda file: file.name,
)
def test_libraries_and_structs_hold_no_resources(file: Path) -> None:
    """Any shader or test can then use them with its own resources.

    A sampler parameter of a function does not count: only `uniform` declares a resource.
    """
    code = re.sub(r"//.*", "", file.read_text(encoding="utf-8"))
    assert not re.search(r"\b(uniform|image\w*|buffer|layout|void main)\b", code)


def test_composing_needs_no_gpu() -> None:
    script = (
        "import sys\n"
        "for name in ('bpy', 'gpu'): sys.modules[name] = None\n"
        f"sys.path.insert(0, {str(SHADER_FOLDER.parent / 'tools')!r})\n"
        "from extension_loader import load_package\n"
        "load_package()\n"
        "from hairloom.addon.render.shader_source import compose\n"
        "from hairloom.addon.render import camera, snapshot, view_block\n"
        "compose('strand.frag.glsl')\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
