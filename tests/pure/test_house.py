"""The rules of the code base: which room may import which, no circular imports, and no code that
only tests use.

The rooms within `blender/` have an order, and each imports only from those before it. The table is
in tools/house_rules.py.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from house_rules import (
    ADDON,
    BLENDER_ROOMS,
    FLOWS,
    MAX_MUTABLE,
    PURE,
    import_circle,
    is_declaration,
    module_name,
    mutable_names,
    renamed_arguments,
    unused_names,
    violations,
)


def test_rooms_import_only_what_they_may() -> None:
    assert violations(ADDON) == []


def test_ui_may_know_what_pure_rooms_declare_and_nothing_else() -> None:
    assert is_declaration(".exchange.strand_formats.SUFFIXES")
    assert is_declaration(".cards.export_settings.CardExportSettings")
    for name in (
        "strand_writing.write_strands",
        "nothing_formats.SUFFIXES",
        "files.file_names.identifier_name",
    ):
        assert not is_declaration(f".exchange.{name}")


def test_the_order_names_every_room_of_blender() -> None:
    folders = {path.name for path in (ADDON / "blender").iterdir() if any(path.glob("*.py"))}
    assert folders == set(BLENDER_ROOMS)


def test_imports_never_run_in_a_circle() -> None:
    assert import_circle() == []


def test_forbidden_imports_and_circles_are_seen(tmp_path: Path) -> None:
    """The two tests above can fail."""
    files = {
        "strands/one.py": (
            "import bpy\nimport scipy\nfrom ..blender.scene import curves\nfrom .two import x\n"
        ),
        "blender/scene/source.py": (
            "import bpy\nfrom ..preview.live import x\nfrom ..base.report import y\n"
        ),
        "strands/two.py": "import numpy\nfrom ..errors import HairloomError\nfrom .one import y\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert [line.split(" imports ")[1] for line in violations(tmp_path)] == [
        ".blender.preview.live.x: preview stands after scene in the order of the rooms: "
        "move what both need down",
        "bpy",
        "scipy",
        ".blender.scene.curves",
    ]
    assert {"strands.one", "strands.two"} <= set(import_circle(tmp_path))


def test_processes_are_started_in_one_place() -> None:
    """That place sets their folder, environment and input, and ends them."""
    starters = {path.name for path in ADDON.rglob("*.py") if _starts_processes(path.read_text())}
    assert starters == {"child_process.py"}


@pytest.mark.parametrize(
    ("code", "starts"),
    [
        ("import subprocess", True),
        ("import numpy, subprocess as s", True),
        ("from subprocess import run, TimeoutExpired", True),
        ("from subprocess import TimeoutExpired", False),
        ("import multiprocessing.pool", True),
        ("from concurrent.futures import ProcessPoolExecutor", True),
        ("os.system('ls')", True),
        ("os.execv('ls', [])", True),
        ("import os", False),
    ],
)
def test_starting_a_process_is_seen(code: str, starts: bool) -> None:
    assert _starts_processes(code) is starts


def _starts_processes(code: str) -> bool:
    if not re.search(rf"\b({'|'.join(_STARTERS)}|ProcessPoolExecutor|os)\b", code):
        return False  # most modules: parsing them all would take long
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            if any(each.name.split(".")[0] in _STARTERS for each in node.names):
                return True
        elif isinstance(node, ast.ImportFrom):
            names = {each.name for each in node.names}
            if names & {"ProcessPoolExecutor"} or (
                node.module in _STARTERS and names != {"TimeoutExpired"}
            ):
                return True
        elif isinstance(node, ast.Attribute):
            is_os = isinstance(node.value, ast.Name) and node.value.id == "os"
            if is_os and node.attr.startswith(("system", "popen", "exec", "spawn", "posix_spawn")):
                return True
    return False


_STARTERS = {"subprocess", "multiprocessing", "pty"}


def test_nothing_is_there_for_tests_alone() -> None:
    """A function that only tests call belongs in the tests, unless it is the twin that a shader is
    tested against."""
    assert unused_names() == [], "delete them, or name them in KEPT_NAMES with the reason"


def test_few_modules_hold_what_changes() -> None:
    found = mutable_names()
    assert len(found) <= MAX_MUTABLE, found


def test_unused_and_mutable_names_are_seen(tmp_path: Path) -> None:
    """The two tests above can fail."""
    (tmp_path / "addon").mkdir()
    (tmp_path / "gpu_shaders").mkdir()
    (tmp_path / "gpu_shaders" / "one.glsl").write_text("float twin() {}")
    (tmp_path / "addon" / "one.py").write_text(
        "found, NAMES, count = {}, [], 0\n_seen = set()\n"
        "def used(): return NAMES\ndef twin(): used()\n"
        "def orphan():\n    global total\n    total = 1\n    _seen.add(1)\n"
        "def other(found): found[1] = 2\ntotal = 0\n"
    )
    assert [each.split()[1] for each in unused_names(tmp_path)] == ["orphan", "other"]
    assert mutable_names(tmp_path / "addon") == ["one.py: _seen", "one.py: total"]


def test_docstrings_name_arguments_that_there_are(tmp_path: Path) -> None:
    assert renamed_arguments() == []
    text = "Turn.\n\n    Args:\n        a, way: [m].\n        b: x.\n    "
    (tmp_path / "one.py").write_text(f'def turned(a, *, b):\n    """{text}"""\n')
    assert renamed_arguments(tmp_path) == ["one.py: turned: way"]


def test_importing_the_pure_rooms_needs_no_blender() -> None:
    """At run time too: a fresh interpreter without bpy imports every pure module."""
    modules = [
        module_name(file).removesuffix(".__init__")
        for room in sorted(PURE)
        for file in sorted((ADDON / room).rglob("*.py"))
    ]
    script = (
        "import sys, importlib\n"
        "for name in ('bpy', 'gpu', 'mathutils'): sys.modules[name] = None\n"
        f"sys.path.insert(0, {str(ADDON.parent / 'tools')!r})\n"
        "from extension_loader import load_package\n"
        "load_package()\n"
        f"for name in {modules + sorted(FLOWS)!r}:\n"
        "    importlib.import_module('hairloom.addon.' + name)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
