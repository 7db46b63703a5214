"""Writers under Windows' rules: path length, names without case, open files."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from windows_rules import MAX_PATH_LENGTH, windows_rules

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files.atomic import write_bytes_atomic
from hairloom.addon.exchange.files.file_names import avoid_device_name, unique_names
from hairloom.addon.exchange.files.file_set import atomic_file_set, back_up_foreign_files
from hairloom.addon.exchange.files.stale_temp_files import remove_stale_files, temporary_path

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows has rules of its own")


def write_set(path: Path) -> None:
    with atomic_file_set(path) as folder:
        (folder / path.name).write_bytes(b"new")
        (folder / f"{path.stem}_base.png").write_bytes(b"new")
        back_up_foreign_files(folder, path)


def write_alone(path: Path) -> None:
    write_bytes_atomic(path, b"new")


def deep(folder: Path, length: int) -> Path:
    """A new folder whose path has this many letters."""
    while len(str(folder)) < length:
        folder /= "x" * min(50, max(length - len(str(folder)) - 1, 1))
    folder.mkdir(parents=True)
    return folder


@pytest.mark.parametrize("write", [write_alone, write_set])
def test_a_path_that_is_too_long_is_reported_as_such(
    tmp_path: Path, write: Callable[[Path], None]
) -> None:
    """The file's own path is short enough, but that of its temporary file is not."""
    path = deep(tmp_path, MAX_PATH_LENGTH - 30) / "groom.tfx"
    path.write_bytes(b"old")
    assert len(str(path)) < MAX_PATH_LENGTH
    with windows_rules(), pytest.raises(HairloomError) as raised:
        write(path)
    assert f"and {MAX_PATH_LENGTH} work here" in raised.value.problem and raised.value.place == str(
        path
    )
    assert raised.value.remedy == "Choose a folder with a shorter path"
    assert path.read_bytes() == b"old" and list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("write", [write_alone, write_set])
def test_a_path_that_is_just_short_enough_is_written(
    tmp_path: Path, write: Callable[[Path], None]
) -> None:
    path = deep(tmp_path, MAX_PATH_LENGTH - 90) / "groom.tfx"
    with windows_rules():
        write(path)
    assert path.read_bytes() == b"new"


def test_another_reason_is_not_taken_for_the_length(tmp_path: Path) -> None:
    (tmp_path / "groom.tfx").mkdir()
    with windows_rules(), pytest.raises(HairloomError, match="a folder has this name") as raised:
        write_alone(tmp_path / "groom.tfx")
    assert "letters" not in raised.value.problem


def test_a_neighbour_whose_name_differs_in_case_is_kept(tmp_path: Path) -> None:
    """On Windows both names are one file, so the new one would replace it."""
    own = tmp_path / "HAIR_BASE.PNG"
    own.write_bytes(b"the artist's")
    with windows_rules():
        write_set(tmp_path / "hair.glb")
    contents = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    assert contents["hair_base old.png"] == b"the artist's"
    assert sorted(contents.values()) == [b"new", b"new", b"the artist's"]


@pytest.mark.parametrize("write", [write_alone, write_set])
def test_a_file_that_is_open_stays_and_the_new_ones_are_kept(
    tmp_path: Path, write: Callable[[Path], None]
) -> None:
    path = tmp_path / "groom.tfx"
    path.write_bytes(b"old")
    with windows_rules(open_files=[path]), pytest.raises(HairloomError, match="Access is denied"):
        write(path)
    assert path.read_bytes() == b"old"
    kept = tmp_path / "groom new"
    assert not [each for each in tmp_path.iterdir() if each not in (path, kept)]
    with windows_rules():
        write(path)
    assert path.read_bytes() == b"new"


def test_what_a_killed_writer_left_may_be_open(tmp_path: Path) -> None:
    """A virus scanner may have it open; then a later writer removes it."""
    folder = temporary_path(tmp_path / "a.tfx", suffix="")
    file = temporary_path(tmp_path / "b.tfx")
    dead = [each.with_name(each.name.replace(f"-{os.getpid()}-", "-99999999-")) for each in
            (folder, file)]  # fmt: skip
    dead[0].mkdir()
    (dead[0] / "a.tfx").touch()
    dead[1].touch()
    with windows_rules(open_files=[dead[0] / "a.tfx", dead[1]]):
        remove_stale_files(tmp_path)
        write_alone(tmp_path / "c.tfx")
    assert all(each.exists() for each in dead)
    with windows_rules():
        remove_stale_files(tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["c.tfx"]


def test_names_that_are_one_there_get_numbers() -> None:
    names = ["Hair", "hair", "Caf\u00e9", "Cafe\u0301", "hair_2", "Beard"]
    assert unique_names(names) == [
        "Hair",
        "hair_2",
        "Caf\u00e9",
        "Cafe\u0301_2",
        "hair_2_2",
        "Beard",
    ]
    assert [avoid_device_name(each) for each in ("con", "Aux.001", "console", "nul")] == [
        "_con",
        "_Aux.001",
        "console",
        "_nul",
    ]
