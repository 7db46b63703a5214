"""A file is written completely or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files import atomic, file_moves, file_set
from hairloom.addon.exchange.files.atomic import (
    atomic_write,
    check_folder_writable,
    check_writable,
    remedy_for,
    write_bytes_atomic,
    write_failure_reason,
    write_text_atomic,
)
from hairloom.addon.exchange.files.file_set import atomic_file_set

pytestmark = pytest.mark.portable


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_temporary_path_is_beside_and_has_the_suffix(tmp_path: Path) -> None:
    target = tmp_path / "cards.v2.glb"
    with atomic_write(target) as temporary:
        assert temporary.parent == target.parent
        assert temporary.suffix == ".glb"
        assert not temporary.exists() and not target.exists()
        temporary.write_bytes(b"whole")
        assert not target.exists()
    assert target.read_bytes() == b"whole"
    assert names(tmp_path) == ["cards.v2.glb"]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failing_writer_leaves_what_was_there(
    tmp_path: Path, failure: type[BaseException]
) -> None:
    target = tmp_path / "groom.tfx"
    target.write_bytes(b"old")
    with pytest.raises(failure), atomic_write(target) as temporary:
        temporary.write_bytes(b"half")
        raise failure
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["groom.tfx"]


def test_a_writer_that_writes_nothing_is_an_error(tmp_path: Path) -> None:
    target = tmp_path / "groom.tfx"
    with pytest.raises(HairloomError, match="nothing was written"), atomic_write(target):
        pass
    assert names(tmp_path) == []


def test_missing_folders_are_made(tmp_path: Path) -> None:
    target = tmp_path / "new" / "folder" / "report.json"
    write_text_atomic(target, "héllo\n")
    assert target.read_bytes() == "héllo\n".encode()


def test_unwritable_paths_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    (tmp_path / "folder").mkdir()
    for target in (in_the_way / "groom.tfx", tmp_path / "folder", tmp_path / ("x" * 300)):
        with pytest.raises(HairloomError) as caught, atomic_write(target):
            pytest.fail("the block must not run")
        assert caught.value.place == str(target)
        assert "Choose a" in caught.value.remedy
    assert names(tmp_path) == ["file", "folder"]


def test_a_place_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file" / "new" / "a.glb", tmp_path):
        with pytest.raises(HairloomError) as caught:
            check_writable(target)
        assert caught.value.place == str(target)
    check_writable(tmp_path / "new" / "folder" / "a.glb")
    assert names(tmp_path) == ["file"], "nothing is written"


def test_a_folder_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for target, message in ((tmp_path / "file", "a file has this name"), (Path("/proc/a"), "into")):
        with (
            pytest.MonkeyPatch.context() as patched,
            pytest.raises(HairloomError, match=message) as caught,
        ):
            patched.setattr(os, "access", lambda *_: False)  # root may write anywhere
            check_folder_writable(target)
        assert caught.value.place == str(target)
    check_folder_writable(tmp_path / "new" / "folder")
    assert names(tmp_path) == ["file"], "nothing is written"


def test_a_remedy_fits_the_reason() -> None:
    assert "space" in remedy_for(os.strerror(errno.ENOSPC))
    assert "space" not in remedy_for(os.strerror(errno.EACCES))
    assert "may write to" in remedy_for(os.strerror(errno.EROFS))
    assert "name" in remedy_for("a folder has this name")
    assert "space" in (unknown := remedy_for("what a library says")) and "may write" in unknown


def test_a_library_that_does_not_say_that_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, message = tmp_path / "a.usdc", "Couldn't map file: bad arguments to mmap()"
    assert write_failure_reason(path, message) == message
    full = shutil.disk_usage(tmp_path)._replace(free=0)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: full)
    assert write_failure_reason(path, message) == os.strerror(errno.ENOSPC)


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX")
def test_the_mode_is_that_of_any_new_file_or_of_the_file_replaced(tmp_path: Path) -> None:
    plain, target = tmp_path / "plain", tmp_path / "groom.tfx"
    plain.write_bytes(b"")
    write_bytes_atomic(target, b"1")
    assert target.stat().st_mode == plain.stat().st_mode
    target.chmod(0o600)
    write_bytes_atomic(target, b"2")
    assert target.stat().st_mode & 0o777 == 0o600


@pytest.mark.skipif(os.name != "posix", reason="links need rights on Windows")
def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    link = tmp_path / "link.tfx"
    link.symlink_to(tmp_path / "real" / "groom.tfx")
    write_bytes_atomic(link, b"content")
    assert link.is_symlink()
    assert (tmp_path / "real" / "groom.tfx").read_bytes() == b"content"


def test_a_file_that_another_program_holds_stays_and_the_new_one_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows, where an open file cannot be replaced."""
    target = tmp_path / "groom.tfx"
    target.write_bytes(b"old")
    (tmp_path / "groom new.tfx").write_bytes(b"from before")
    monkeypatch.setattr(file_moves.os, "replace", held)
    with (
        pytest.raises(HairloomError, match=r"groom new 2\.tfx"),
        atomic_write(target) as temporary,
    ):
        temporary.write_bytes(b"new")
    with pytest.raises(HairloomError, match="Access is denied"):
        write_bytes_atomic(target, b"in a moment")
    assert target.read_bytes() == b"old"
    assert (tmp_path / "groom new 2.tfx").read_bytes() == b"new"
    assert len(names(tmp_path)) == 3


def held(_source: Path, _target: Path) -> None:
    raise PermissionError(13, "Access is denied")


def test_a_file_that_is_held_for_a_moment_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, tries = os.replace, []

    def at_first(source: Path, target: Path) -> None:
        tries.append(target)
        if len(tries) < 3:
            held(source, target)
        replace(source, target)

    monkeypatch.setattr(file_moves, "MAX_WAIT", 10.0)
    monkeypatch.setattr(file_moves, "_PAUSE", 0.001)
    monkeypatch.setattr(file_moves.os, "replace", at_first)
    write_bytes_atomic(tmp_path / "groom.tfx", b"new")
    assert (tmp_path / "groom.tfx").read_bytes() == b"new" and len(tries) == 3


def write_alone(target: Path) -> None:
    with atomic_write(target) as temporary:
        temporary.write_bytes(b"new")


def write_set(target: Path) -> None:
    with atomic_file_set(target) as folder:
        (folder / target.name).write_bytes(b"new")


def test_a_complete_file_of_a_cancelled_write_replaces_nothing(tmp_path: Path) -> None:
    target = tmp_path / "groom.tfx"
    target.write_bytes(b"old")

    @contextmanager
    def cancelled() -> Iterator[None]:
        raise KeyboardInterrupt
        yield

    token = file_moves.commit_context.set(cancelled)
    try:
        for write in (write_alone, write_set):
            with pytest.raises(KeyboardInterrupt):
                write(target)
    finally:
        file_moves.commit_context.reset(token)
    assert target.read_bytes() == b"old" and names(tmp_path) == ["groom.tfx"]


@pytest.mark.skipif(os.name != "posix", reason="folders are not flushed on Windows")
def test_a_drive_that_flushes_no_names_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fsync = os.fsync

    def refused(descriptor: int) -> None:
        if os.path.isdir(f"/proc/self/fd/{descriptor}"):
            raise OSError(22, "Invalid argument")
        fsync(descriptor)

    monkeypatch.setattr(file_moves.os, "fsync", refused)
    write_bytes_atomic(tmp_path / "groom.tfx", b"new")
    assert (tmp_path / "groom.tfx").read_bytes() == b"new"


def test_a_name_of_255_bytes_is_written(tmp_path: Path) -> None:
    name = "x" * 251 + ".tfx"
    write_bytes_atomic(tmp_path / name, b"new")
    assert names(tmp_path) == [name]


@pytest.mark.skipif(os.name != "posix", reason="names are UTF-16 on Windows")
def test_a_name_that_is_not_utf_8_is_a_message(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"h\xffair.tfx")
    for write in (write_alone, write_set, check_writable):
        with pytest.raises(HairloomError, match="not UTF-8") as caught:
            write(path)
        str(caught.value).encode("utf-8")
    assert names(tmp_path) == []


@pytest.mark.parametrize("write", [write_alone, write_set])
def test_a_write_protected_file_is_refused_before_any_work(
    write: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "groom.tfx"
    target.write_bytes(b"old")
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: path != target and access(path, mode))
    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", lambda *_: pytest.fail("the block must not run"))
        for refused in (write, check_writable):
            with pytest.raises(HairloomError, match="write-protected") as caught:
                refused(target)
            assert caught.value.place == str(target) and "Allow" in caught.value.remedy
    assert target.read_bytes() == b"old" and names(tmp_path) == ["groom.tfx"]


@pytest.mark.parametrize("write", [write_alone, write_set])
def test_a_new_file_is_on_the_disk_before_it_has_the_old_ones_mode(
    write: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a mode of 0444, only root could open it again to flush it."""
    (tmp_path / "groom.tfx").write_bytes(b"old")
    calls: list[str] = []
    for module, name in ((atomic, "flush_file"), (file_set, "flush_file"), (shutil, "copymode")):
        monkeypatch.setattr(module, name, lambda *_, name=name: calls.append(name))
    write(tmp_path / "groom.tfx")
    assert calls == ["flush_file", "copymode"]
