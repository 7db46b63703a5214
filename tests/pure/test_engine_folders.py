"""The folders of docs/engines are complete, since each is copied into a project alone."""

import json
import re
from pathlib import Path

import pytest
from engine_folders import missing_files
from extension_loader import REPOSITORY

ENGINES = REPOSITORY / "docs" / "engines"


@pytest.mark.parametrize("name", ["godot", "three", "unity"])
def test_a_folder_names_no_file_outside_of_it(name: str) -> None:
    assert not missing_files(ENGINES / name)


def test_a_file_that_is_missing_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.gd").write_text('const A := preload("b.gd")\n', encoding="utf-8")
    (tmp_path / "c.gdshader").write_text('#include "../d.gdshaderinc"\n', encoding="utf-8")
    assert missing_files(tmp_path) == {"b.gd", "../d.gdshaderinc"}


def test_no_script_of_godot_knows_where_its_folder_is() -> None:
    for file in (ENGINES / "godot").iterdir():
        assert "res://addons" not in file.read_text(encoding="utf-8"), file.name


def test_the_npm_package_has_all_of_its_files() -> None:
    folder = ENGINES / "three"
    package = json.loads((folder / "package.json").read_text(encoding="utf-8"))
    assert {*package["files"], "package.json"} == {file.name for file in folder.iterdir()}
    assert all((folder / file).is_file() for file in package["exports"].values())
    exported = set(
        re.findall(
            r"^export (?:async )?(?:class|function) (\w+)",
            (folder / "hairloom_cards.js").read_text(encoding="utf-8"),
            re.M,
        )
    )
    declared = set(
        re.findall(
            r"^export (?:class|function) (\w+)",
            (folder / "hairloom_cards.d.ts").read_text(encoding="utf-8"),
            re.M,
        )
    )
    assert exported == declared


def test_every_file_of_the_unity_package_has_a_name_of_its_own() -> None:
    """A unique GUID. Without .meta files Unity gives a file another GUID in each project, which
    breaks references."""
    folder = ENGINES / "unity"
    files = {each for each in folder.rglob("*") if each.suffix != ".meta"}
    metas = {each: each.with_name(f"{each.name}.meta") for each in files}
    assert set(metas.values()) == set(folder.rglob("*.meta"))
    names = [
        re.search(r"^guid: ([0-9a-f]{32})$", meta.read_text(encoding="utf-8"), re.M)
        for meta in metas.values()
    ]
    assert all(names) and len({name[1] for name in names if name}) == len(files)
