"""Files that belong together are replaced all at once, or the old ones stay."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from pathlib import Path

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files import file_moves, file_set, stale_temp_files
from hairloom.addon.exchange.files.atomic import write_bytes_atomic
from hairloom.addon.exchange.files.file_set import atomic_file_set

pytestmark = pytest.mark.portable

FILES = ("hair.glb", "hair_base.png", "hair.json")


def write(folder: Path, content: str, names: tuple[str, ...] = FILES) -> None:
    for name in names:
        (folder / name).write_text(content)


def contents(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in sorted(folder.iterdir())}


def test_all_files_come_at_the_end_under_their_names(tmp_path: Path) -> None:
    target = tmp_path / "new" / "hair.glb"
    with atomic_file_set(target) as folder:
        write(folder, "whole")
        assert [path.name.startswith(".") for path in target.parent.iterdir()] == [True]
    assert contents(target.parent) == dict.fromkeys(sorted(FILES), "whole")


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failing_writer_leaves_what_was_there(
    tmp_path: Path, failure: type[BaseException]
) -> None:
    write(tmp_path, "old")
    with pytest.raises(failure), atomic_file_set(tmp_path / "hair.glb") as folder:
        write(folder, "new", FILES[:2])
        raise failure
    assert contents(tmp_path) == dict.fromkeys(sorted(FILES), "old")


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_new_folders_are_removed_if_the_write_fails(
    tmp_path: Path, failure: type[BaseException]
) -> None:
    (tmp_path / "mine").mkdir()
    with pytest.raises(failure), atomic_file_set(tmp_path / "mine/a/b/hair.glb") as folder:
        write(folder, "new", FILES[:2])
        raise failure
    assert list(tmp_path.iterdir()) == [tmp_path / "mine"]
    assert list((tmp_path / "mine").iterdir()) == []


def test_errors_name_the_target_folder_instead_of_the_staging_folder(tmp_path: Path) -> None:
    with (
        pytest.raises(HairloomError) as caught,
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        raise HairloomError("it is full", place=str(folder / "hair_base.png"), remedy="Wait")
    assert str(caught.value) == f"{tmp_path / 'hair_base.png'}: it is full. Wait."


@pytest.mark.parametrize("last", range(3))
def test_a_disk_that_fills_up_while_files_are_replaced_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, last: int
) -> None:
    """A file that did not exist before does not exist afterwards."""
    write(tmp_path, "old", FILES[:2])
    replace, left = os.replace, [last]

    def full(source: Path, target: Path) -> None:
        # old files can be moved back
        if "old" not in Path(source).parts and Path(target).parent == tmp_path:
            left[0] -= 1
            if left[0] == -1:
                raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(file_moves.os, "replace", full)
    with (
        pytest.raises(HairloomError, match="No space left"),
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        write(folder, "new")
    assert contents(tmp_path) == dict.fromkeys(FILES[:2], "old")


def test_a_folder_of_the_same_name_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "hair_base.png").mkdir()
    with (
        pytest.raises(HairloomError, match="a folder has this name") as caught,
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        write(folder, "new")
    assert caught.value.place == str(tmp_path / "hair_base.png")
    assert [path.name for path in tmp_path.iterdir()] == ["hair_base.png"]


def test_unwritable_paths_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    for target in (in_the_way / "hair.glb", tmp_path / ("x" * 300)):
        with pytest.raises(HairloomError) as caught, atomic_file_set(target):
            pytest.fail("the block must not run")
        assert caught.value.place == str(target)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_writer_without_the_main_file_is_an_error(tmp_path: Path) -> None:
    with (
        pytest.raises(HairloomError, match="nothing was written"),
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        write(folder, "new", FILES[1:])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="links need rights on Windows")
def test_a_link_stays_a_link_and_keeps_its_content_in_a_failure(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    real = tmp_path / "elsewhere" / "hair.glb"
    real.write_text("old")
    link = tmp_path / "hair.glb"
    link.symlink_to(real)
    with atomic_file_set(link) as folder:
        write(folder, "new")
    assert link.is_symlink() and real.read_text() == "new"


@pytest.mark.parametrize("moved", range(4))
def test_a_writer_killed_while_files_are_replaced_is_finished_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moved: int
) -> None:
    """Killed after `moved` files: the next writer completes the set, so that old and new files do
    not stay mixed."""
    write(tmp_path, "old", FILES[:2])
    replace, left = os.replace, [moved]

    class KilledError(BaseException):
        pass

    def killed(source: Path, target: Path) -> None:
        if not left[0]:
            raise KilledError
        left[0] -= 1
        replace(source, target)

    with monkeypatch.context() as dying:
        dying.setattr(file_moves.os, "replace", killed)
        dying.setattr(file_set, "_restore", lambda *_: None)
        dying.setattr(file_set.shutil, "rmtree", lambda *_, **__: None)
        dying.setattr(Path, "unlink", lambda *_, **__: None)
        dying.setattr(stale_temp_files.os, "getpid", lambda: 4_000_000)
        with contextlib.suppress(KilledError), atomic_file_set(tmp_path / "hair.glb") as folder:
            write(folder, "new")
    write_bytes_atomic(tmp_path / "another.tfx", b"")
    (tmp_path / "another.tfx").unlink()
    assert contents(tmp_path) == dict.fromkeys(sorted(FILES), "new")


def test_a_file_that_was_saved_since_is_newer_than_a_killed_writers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as dying:
        dying.setattr(stale_temp_files.os, "getpid", lambda: 4_000_000)
        staging = stale_temp_files.temporary_path(tmp_path / "hair.glb", "")
    staging.mkdir()
    write(staging, "new")
    (staging / stale_temp_files.COMPLETE_MARKER).touch()
    os.utime(staging / stale_temp_files.COMPLETE_MARKER, (1, 1))
    write(tmp_path, "artist's", FILES[:1])
    stale_temp_files.remove_stale_files(tmp_path)
    assert contents(tmp_path) == {
        "hair.glb": "artist's",
        "hair.json": "new",
        "hair_base.png": "new",
    }


@pytest.mark.parametrize("held", FILES)
def test_a_file_that_another_program_holds_keeps_all_and_the_new_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held: str
) -> None:
    """As on Windows, where an open file cannot be replaced."""
    write(tmp_path, "old")
    replace = os.replace

    def refused(source: Path, target: Path) -> None:
        if Path(target) == tmp_path / held:
            raise PermissionError(errno.EACCES, "Access is denied", str(source), None, str(target))
        replace(source, target)

    monkeypatch.setattr(file_moves.os, "replace", refused)
    with (
        pytest.raises(HairloomError, match="hair new") as caught,
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        write(folder, "new")
    assert caught.value.place == str(tmp_path / held)
    assert contents(tmp_path / "hair new") == dict.fromkeys(sorted(FILES), "new")
    shutil.rmtree(tmp_path / "hair new")
    assert contents(tmp_path) == dict.fromkeys(sorted(FILES), "old")


def test_who_holds_a_file_is_waited_for_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows, where an open file cannot be replaced. Files that were not replaced are not
    moved back."""
    write(tmp_path, "old")
    moved: list[str] = []

    def held(source: Path, target: Path) -> None:
        moved.append(target.name)
        if target == tmp_path / FILES[1]:
            raise PermissionError(errno.EACCES, "held", str(target))
        os.replace(source, target)

    monkeypatch.setattr(file_set, "move_file", held)
    with (
        pytest.raises(HairloomError, match="all are as they were"),
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        write(folder, "new")
    assert moved.count(FILES[1]) == 1
    assert {(tmp_path / name).read_text() for name in FILES} == {"old"}


def test_a_write_protected_file_beside_the_main_one_keeps_all_and_the_new_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, "old")
    protected, access = tmp_path / FILES[1], os.access
    monkeypatch.setattr(os, "access", lambda path, mode: path != protected and access(path, mode))
    with (
        pytest.raises(HairloomError, match=r"write-protected.*hair new") as caught,
        atomic_file_set(tmp_path / "hair.glb") as folder,
    ):
        write(folder, "new")
    assert caught.value.place == str(protected)
    assert contents(tmp_path / "hair new") == dict.fromkeys(sorted(FILES), "new")
    shutil.rmtree(tmp_path / "hair new")
    assert contents(tmp_path) == dict.fromkeys(sorted(FILES), "old")
