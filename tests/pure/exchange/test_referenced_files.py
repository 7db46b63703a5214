"""The files that a file depends on are found by the names in it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hairloom.addon.exchange.referenced_files import missing_materials, referenced_files


def made(folder: Path, *names: str) -> list[Path]:
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"content")
    return [folder / name for name in names]


def test_buffers_and_pictures_of_gltf(tmp_path: Path) -> None:
    files = made(tmp_path, "my head.bin", "pics/skin.png")
    uris = ["my%20head.bin", "gone.bin", "data:application/octet-stream;base64,AAAA"]
    content = {"buffers": [{"uri": uri} for uri in uris], "images": [{"uri": "pics/skin.png"}, {}]}
    (tmp_path / "head.gltf").write_text(json.dumps(content))
    assert referenced_files(tmp_path / "head.gltf") == [files[0], tmp_path / "gone.bin", files[1]]
    (tmp_path / "head.gltf").write_text("[1")
    assert referenced_files(tmp_path / "head.gltf") == []


def test_materials_and_pictures_of_obj(tmp_path: Path) -> None:
    made(tmp_path, "my skin.mtl", "eyes.mtl", "teeth.mtl", "pics/my face.png", "iris.png")
    obj = "# mtllib none.mtl\nmtllib my skin.mtl\nv 0 0 0\nmtllib eyes.mtl teeth.mtl\r\n"
    (tmp_path / "head.obj").write_text(obj)
    (tmp_path / "my skin.mtl").write_text("newmtl a\n map_Kd -s 1 1 1 pics/my face.png\n")
    (tmp_path / "eyes.mtl").write_text("map_Bump iris.png\nmap_d gone.png\n")
    assert names(tmp_path / "head.obj") == {
        *("my skin.mtl", "eyes.mtl", "teeth.mtl", "pics/my face.png", "iris.png", "gone.png")
    }


def names(path: Path) -> set[str]:
    return {file.relative_to(path.parent).as_posix() for file in referenced_files(path)}


def test_missing_materials_and_pictures_of_obj(tmp_path: Path) -> None:
    """They may appear later, and then a result has to be made again."""
    made(tmp_path, "eyes.mtl")
    obj = tmp_path / "head.obj"
    obj.write_text("mtllib my skin.mtl\nmtllib eyes.mtl teeth.mtl\nmtllib my skin.mtl\n")
    assert {"my skin.mtl", "eyes.mtl", "teeth.mtl"} <= names(obj)
    assert missing_materials(obj) == ["my skin.mtl", "teeth.mtl"]
    (tmp_path / "eyes.mtl").write_text("map_Kd -s 1.0 1.5 1 my iris.png\n")
    assert "my iris.png" in names(obj) and "1.5" not in names(obj)
    made(tmp_path, "my skin.mtl", "teeth.mtl")
    assert missing_materials(obj) == []
    assert missing_materials(*made(tmp_path, "hair.tfx")) == []


def test_layers_and_pictures_of_usd(tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="usd-core is missing: `make setup` installs it")
    made(tmp_path, "skin.png")
    (tmp_path / "hair.usda").write_text(
        '#usda 1.0\ndef Xform "hair"\n{\n    asset picture = @./skin.png@\n}\n'
    )
    (tmp_path / "all.usda").write_text(
        '#usda 1.0\ndef Xform "all" (\n    references = @./hair.usda@</hair>\n)\n{\n}\n'
    )
    found = {file.name for file in referenced_files(tmp_path / "all.usda")}
    assert found == {"hair.usda", "skin.png"}


def test_other_files_name_none(tmp_path: Path) -> None:
    assert referenced_files(*made(tmp_path, "hair.tfx")) == []
