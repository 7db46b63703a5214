"""Names that every program and file system takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange import strand_formats
from hairloom.addon.exchange.cards import card_formats
from hairloom.addon.exchange.files.file_names import identifier_name, name_in_other_case


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("Haar/Ä.001", "Haar_Ä_001"),
        ("Haar/A\u0308.001", "Haar_Ä_001"),
        ("髪 1", "髪_1"),
        ("2nd: C:\\hair", "_2nd__C__hair"),
        ("../..", "hair"),
        ("", "hair"),
        ("Hair_LOD0", "Hair_LOD0"),
        ("x²\n\0", "x___"),
    ],
)
def test_names_are_identifiers(name: str, plain: str) -> None:
    assert identifier_name(name) == plain
    assert identifier_name(name).isidentifier()


def test_a_name_that_differs_in_case_alone_is_found(tmp_path: Path) -> None:
    (tmp_path / "Hair.glb").touch()
    assert (
        name_in_other_case(tmp_path / "Hair.glb") == "" == name_in_other_case(tmp_path / "hair.fbx")
    )
    assert name_in_other_case(tmp_path / "nowhere" / "hair.glb") == ""
    if not (tmp_path / "hair.glb").exists():  # a case-sensitive file system
        assert name_in_other_case(tmp_path / "hair.glb") == "Hair.glb"


@pytest.mark.parametrize("path", ["", "/", ".."])
@pytest.mark.parametrize(("formats", "name"), [(card_formats, "glb"), (strand_formats, "hair")])
def test_a_path_without_a_name_gets_no_suffix(path: str, formats: Any, name: str) -> None:
    with pytest.raises(HairloomError, match=f"it names no file. Name one, such as hair.{name}"):
        formats.format_of(Path(path), name)
    assert formats.format_of(Path(path) / "Hair.001", name)[0].name == f"Hair.001.{name}"
