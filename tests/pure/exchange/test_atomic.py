"""A file is there complete or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files.atomic import (
    atomic_write,
    check_place,
    write_bytes_atomic,
    write_text_atomic,
)

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


def test_impossible_places_are_named_before_anything_is_written(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    (tmp_path / "folder").mkdir()
    for target in (in_the_way / "groom.tfx", tmp_path / "folder", tmp_path / ("x" * 300)):
        with pytest.raises(HairloomError) as caught, atomic_write(target):
            pytest.fail("the block must not run")
        assert caught.value.place == str(target)
        assert "Choose a folder" in caught.value.remedy
    assert names(tmp_path) == ["file", "folder"]


def test_a_place_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file" / "new" / "a.glb", tmp_path):
        with pytest.raises(HairloomError) as caught:
            check_place(target)
        assert caught.value.place == str(target)
    check_place(tmp_path / "new" / "folder" / "a.glb")
    assert names(tmp_path) == ["file"], "nothing is written"


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
