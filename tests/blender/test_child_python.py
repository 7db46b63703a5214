"""The Python that runs readers: one with this Blender's packages, otherwise Blender itself."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon.blender.strands import child_python  # noqa: E402
from hairloom.addon.exchange.files.child_process import python_program, same_packages  # noqa: E402
from hairloom.addon.exchange.files.subprocess_reader import run_reader, this_python  # noqa: E402

SCRIPT = "import os, sys, numpy\nopen(sys.argv[-1], 'w').write(numpy.__file__)\nos._exit({code})\n"


@pytest.fixture
def afresh():
    """`python_command` without its cache, which otherwise lasts for a session."""
    child_python.find_python.cache_clear()
    yield child_python.python_command
    child_python.find_python.cache_clear()


def numpy_of(command, folder):
    """The path of numpy in a command's Python, found by a script that runs as a reader does."""
    script, path, result = folder / "script.py", folder / "groom.abc", folder / "result"
    script.write_text(SCRIPT.format(code=0))
    path.write_bytes(b"any")
    run_reader(script, path, [result], library="Any", python=command)
    return result.read_text()


def test_child_python_has_the_packages_of_this_one(afresh, tmp_path):
    import numpy

    assert numpy_of(afresh(), tmp_path) == numpy.__file__


def test_packages_of_this_python_load_in_the_child(afresh):
    command = afresh()
    environment = os.environ | same_packages()
    loaded = [
        module
        for module in ("numpy", "alembic3d", "pxr.Usd")
        if importlib.util.find_spec(module.split(".")[0])
    ]
    assert "numpy" in loaded
    for module in loaded:
        subprocess.run([*command, "-c", f"import {module}"], env=environment, check=True)


def test_only_formats_of_libraries_start_a_child(afresh):
    assert child_python.python_for(Path("a.tfx")) is None
    assert child_python.python_for(Path("a.hair")) is None
    assert child_python.python_for(Path("a.ABC")) == child_python.python_for(Path("a.usda"))
    assert child_python.python_for(Path("a.abc")) == afresh()


@pytest.mark.skipif(not bpy.app.binary_path, reason="here Blender is a module, not a program")
def test_blender_itself_runs_a_script(tmp_path):
    import numpy

    assert numpy_of(child_python.blender_command(), tmp_path) == numpy.__file__


def test_a_python_without_the_packages_is_skipped(afresh, monkeypatch, tmp_path):
    """If no Python has the packages, it is Blender; if Blender is a Python module, it is none."""
    lacking = tmp_path / "python-lacking"
    lacking.write_text("#!/bin/sh\nexit 1\n")
    lacking.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(lacking))
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert afresh() == child_python.blender_command()


def test_a_python_that_is_only_slow_is_tried_again(afresh, monkeypatch):
    """A slow first import, as from a cold disk, does not decide for the whole session."""
    is_slow = True
    real = child_python.run_child

    def run(command, *, seconds):
        if is_slow:
            raise subprocess.TimeoutExpired(command, seconds)
        return real(command, seconds=seconds)

    monkeypatch.setattr(child_python, "run_child", run)
    assert afresh() == child_python.blender_command()
    is_slow = False
    assert Path(afresh()[0]).stem.startswith("python")
    is_slow = True
    assert Path(afresh()[0]).stem.startswith("python"), "one that was found is kept"


def test_a_slow_python_does_not_hide_the_next_one(afresh, monkeypatch):
    slow = python_program("/slow/python")
    real = child_python.run_child

    def run(command, *, seconds):
        if tuple(command[: len(slow)]) == slow:
            raise subprocess.TimeoutExpired(command, seconds)
        return real(command, seconds=seconds)

    monkeypatch.setattr(child_python, "_programs", lambda: ["/slow/python", sys.executable])
    monkeypatch.setattr(child_python, "run_child", run)
    assert afresh() == python_program(sys.executable)


def test_a_program_that_is_no_python_is_not_taken(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "executable", "/opt/blender/blender")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert list(child_python._programs()) == []
    with pytest.raises(Exception, match=r"no Python can be started .*opt/blender"):
        this_python(tmp_path)


def test_the_python_of_the_folder_of_modules_is_found(monkeypatch, tmp_path):
    """As in official builds, where `sys.executable` is Blender."""
    program = tmp_path / "bin" / f"python{sys.version_info[0]}.{sys.version_info[1]}"
    program.parent.mkdir()
    program.touch()
    monkeypatch.setattr(sys, "executable", "/opt/blender/blender")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert next(child_python._programs()) == str(program)
