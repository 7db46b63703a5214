"""Scenes that verbs save: a complete new file or the old one, even if Blender reports no error."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest
from full_disk import full_disk

from hairloom.addon.blender.command_line.scene_files import (
    is_complete_blend,
    open_scene,
    save_scene,
)
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files import file_moves

pytestmark = pytest.mark.usefixtures("extension")


@pytest.mark.parametrize("is_compressed", [True, False])
def test_a_file_that_is_cut_short_anywhere_is_not_whole(
    tmp_path: Path, sphere: Any, is_compressed: bool
) -> None:
    path, cut = tmp_path / "whole.blend", tmp_path / "cut.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=is_compressed)
    assert is_complete_blend(path)
    content = path.read_bytes()
    size = len(content)
    for length in (0, 3, 10, 1000, size // 2, *range(size - 100, size)):
        cut.write_bytes(content[:length])
        assert not is_complete_blend(cut), f"{length} of {size}"
    if is_compressed:  # space became free again before the end was written
        cut.write_bytes(content[: size // 2] + content[size // 2 + 100 :])
        assert not is_complete_blend(cut)


@pytest.mark.parametrize("part", [0.0, 0.3, 0.9, 0.999])
def test_a_full_disk_leaves_the_previous_scene(tmp_path: Path, sphere: Any, part: float) -> None:
    """Blender itself takes a truncated file as finished, and replaces the old one with it."""
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    before = path.read_bytes()
    limit = int(part * len(before))
    with full_disk(limit), pytest.raises(HairloomError, match="cannot be written") as raised:
        save_scene()
    assert raised.value.place == str(path) and " disk" in raised.value.remedy
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
    with full_disk(limit), pytest.raises(HairloomError, match="cannot be written"):
        save_scene(tmp_path / "new.blend")
    assert list(tmp_path.iterdir()) == [path]


def test_the_versions_before_are_kept_as_in_blender(
    tmp_path: Path, sphere: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    contents = [path.read_bytes()]
    paths = bpy.context.preferences.filepaths
    monkeypatch.setattr(paths, "save_version", 2)
    for number in range(3):
        sphere.location.x = number + 1.0
        save_scene()
        contents.append(path.read_bytes())
    assert sorted(each.name for each in tmp_path.iterdir()) == [
        "wig.blend",
        "wig.blend1",
        "wig.blend2",
    ]
    assert (tmp_path / "wig.blend1").read_bytes() == contents[2]
    assert (tmp_path / "wig.blend2").read_bytes() == contents[1]
    open_scene(path)
    assert bpy.data.objects["Head"].location.x == 3.0
    monkeypatch.setattr(paths, "save_version", 0)
    save_scene(tmp_path / "other.blend")
    assert not list(tmp_path.glob("other.blend?"))


def test_a_scene_that_is_open_elsewhere_stays_and_the_new_one_is_kept(
    tmp_path: Path, sphere: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Under Windows' rule, an open file cannot be replaced: the new scene is kept beside it."""
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    before, real = path.read_bytes(), file_moves.os.replace

    def held(source: Any, target: Any) -> None:
        if Path(target) == path:
            raise PermissionError(13, "Access is denied", str(source), None, str(target))
        real(source, target)

    monkeypatch.setattr(file_moves.os, "replace", held)
    with pytest.raises(HairloomError, match="as it was") as raised:
        save_scene()
    assert "wig new.blend" in raised.value.remedy
    assert path.read_bytes() == before and is_complete_blend(tmp_path / "wig new.blend")
