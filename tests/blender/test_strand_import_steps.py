"""Importing strands in steps, as in a window: in a thread, with a child process that Esc ends."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Generator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog
from strand_files import needs_usd
from waiting import wait_until

from hairloom.addon.blender.base.outcome import collected_reports
from hairloom.addon.blender.strands import import_groom
from hairloom.addon.blender.strands.import_groom import import_strands, read_import_surface
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.tressfx import write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.ui.operators_strand_import import HAIRLOOM_OT_import_strands

pytestmark = pytest.mark.usefixtures("extension")

WRITERS: dict[str, Callable[[Path, Groom], Any]] = {
    ".abc": write_groom_alembic,
    ".usdc": write_usd,
    ".tfx": write_tfx,
}
#: a reader that never ends; it writes its process ID
ENDLESS = """
import os, sys, time
open(os.path.join({folder!r}, "number"), "w").write(str(os.getpid()))
time.sleep(600)
"""


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A private folder for temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def endless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Replace the reader by an endless one; returns the file that gets its process ID."""
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS.format(folder=str(tmp_path)))
    command = (sys.executable, str(script))
    monkeypatch.setattr(
        import_groom, "python_for", lambda path: None if path.suffix == ".tfx" else command
    )
    return tmp_path / "number"


def begun(*paths: Path) -> Generator[Any]:
    """The operator's steps, as a click starts them."""
    operator = SimpleNamespace(
        onto_mesh=True,
        up="FILE",
        scale=1.0,
        head_scale=1.0,
        guides="LEAVE",
        _paths=lambda: list(paths),
    )
    steps: Any = HAIRLOOM_OT_import_strands.steps
    result: Generator[Any] = steps(operator, bpy.context)
    return result


def is_there(file: Path) -> bool:
    return file.is_file() and bool(file.read_text())


def runs(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("suffix", [".abc", pytest.param(".usdc", marks=needs_usd)])
def test_esc_half_way_leaves_no_process_no_file_and_no_object(
    tmp_path: Path, temporary: Path, endless: Path, sphere: Any, suffix: str
) -> None:
    """The first file has been read by then, but neither file is in the scene."""
    first, second = tmp_path / "first.tfx", tmp_path / f"second{suffix}"
    for path in (first, second):
        WRITERS[path.suffix](path, Groom(hedgehog()))
    steps = begun(first, second)
    seen = []
    wait_until(lambda: seen.append(next(steps)) or is_there(endless))
    number = int(endless.read_text())
    assert runs(number) and seen[-1].text == f"Reading second{suffix}, 2 of 2"
    assert seen[-1].is_idle and not seen[-1].is_committed
    steps.close()
    wait_until(lambda: not runs(number))
    wait_until(lambda: not list(temporary.iterdir()))
    assert [obj.name for obj in bpy.data.objects] == ["Head"]
    assert len(bpy.data.hair_curves) == 0 and not sphere.add_rest_position_attribute


@pytest.mark.parametrize("suffix", [".abc", pytest.param(".usdc", marks=needs_usd), ".tfx"])
def test_the_button_and_the_command_line_give_the_same(
    tmp_path: Path, sphere: Any, suffix: str
) -> None:
    """The button waits for a thread; the function reads in the main thread."""
    path = tmp_path / f"hair{suffix}"
    WRITERS[suffix](path, Groom(hedgehog()))
    with collected_reports() as reports:
        assert bpy.ops.hairloom.import_strands(filepath=str(path)) == {"FINISHED"}
    ground = read_import_surface(sphere, bpy.context.evaluated_depsgraph_get())
    (other,), outcome = import_strands(path, ground, bpy.context.collection)
    button = bpy.context.view_layer.objects.active
    assert reports.messages == [outcome.result]
    assert tuple(reports.warnings) == outcome.warnings and reports.error is None
    assert {each.name for each in button.data.attributes} == {
        each.name for each in other.data.attributes
    }
    assert button.data.surface == other.data.surface == sphere
    positions = [np.empty(60 * 8 * 3, np.float32) for _ in range(2)]
    for values, each in zip(positions, (button, other), strict=True):
        each.data.position_data.foreach_get("vector", values)
    np.testing.assert_array_equal(*positions)


def test_files_that_cannot_be_used_are_reported_in_their_order(tmp_path: Path) -> None:
    good, bad, worse = (tmp_path / name for name in ("good.tfx", "bad.tfx", "worse.abc"))
    WRITERS[".tfx"](good, Groom(hedgehog()))
    bad.write_bytes(b"")
    worse.write_bytes(b"no hair in here")
    how = {"directory": str(tmp_path), "filepath": str(bad)}
    with collected_reports() as reports:
        files = [{"name": each.name} for each in (bad, good)]
        assert bpy.ops.hairloom.import_strands(files=files, **how) == {"FINISHED"}
    assert reports.error is not None and reports.error.place == str(bad)
    assert len(reports.messages) == 1 and len(bpy.data.hair_curves) == 1
    with collected_reports() as reports:
        files = [{"name": each.name} for each in (bad, worse)]
        assert bpy.ops.hairloom.import_strands(files=files, **how) == {"CANCELLED"}
    assert isinstance(reports.error, HairloomError) and reports.error.place == str(worse)
    assert len(bpy.data.hair_curves) == 1


def test_a_file_is_read_once_even_where_it_does_not_fit(
    tmp_path: Path, sphere: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scale that would fit is found without reading the file again."""
    path = tmp_path / "hair.tfx"
    write_tfx(path, Groom(hedgehog()), scale=0.01)
    read, real = [], import_groom.read_strands
    monkeypatch.setattr(
        import_groom, "read_strands", lambda path, **how: read.append(path) or real(path, **how)
    )
    with pytest.raises(RuntimeError, match=r"a scale of 0\.01"):
        bpy.ops.hairloom.import_strands(filepath=str(path))
    assert read == [path]
