"""The web page beside an export, from the command line and the dialog, with its embedded files."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from glb_files import Glb

bpy = pytest.importorskip("bpy", reason="exporters need Blender or the bpy module")
pytest.importorskip("jsonschema", reason="it is missing: `make setup` installs it")

from card_exports import BAKED_OPTIONS, export_cards, grow_hair, read_sidecar  # noqa: E402

from hairloom.addon.blender.cards import files  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")

LEVELS = ("--levels", "2")


def asset_of(path: Path) -> dict[str, Any]:
    """The asset embedded in a page, its files as bytes."""
    (content,) = re.findall(r'id="asset">(.*?)</script>', path.read_text("utf-8"), re.S)
    asset = json.loads(content)
    asset["files"] = {
        name: gzip.decompress(data) if each.get("gzip") else data
        for name, each in asset["files"].items()
        for data in [base64.b64decode(each["data"])]
    }
    return asset


@pytest.mark.slow(instead="test_a_page_is_part_of_the_set")
def test_a_page_holds_all_that_its_sidecar_names(tmp_path: Path) -> None:
    """The page has the GLB's triangles in each level, an order of back faces, and the head."""
    assert (
        export_cards(
            tmp_path / "hair.glb", *BAKED_OPTIONS, *LEVELS, "--page", "--page-texture", "512"
        )
        == 0
    )
    beside, asset = read_sidecar(tmp_path / "hair.glb"), asset_of(tmp_path / "hair.html")
    assert beside["page"] == "hair.html"
    own = json.loads(asset["files"]["hair.hairloom.json"])
    roles = [each for each in own["textures"].values() if isinstance(each, dict) and "file" in each]
    tables = own["material"]["tables"].values()
    named = {each["file"] for each in (*roles, *tables, own["index_buffer"])} | {own["file"]}
    assert named <= set(asset["files"]) and len(named) == 10
    assert own["material"]["values"] == beside["material"]["values"]
    (tmp_path / "small.glb").write_bytes(asset["files"]["hair.glb"])
    small, whole = Glb(tmp_path / "small.glb"), Glb(tmp_path / "hair.glb")
    for one, two in zip(small.json["meshes"], whole.json["meshes"], strict=True):
        indices = [
            file.accessor(mesh["primitives"][0]["indices"])
            for file, mesh in ((small, one), (whole, two))
        ]
        np.testing.assert_array_equal(*indices)
    back = np.frombuffer(asset["files"]["indices.bin"], "<u2")
    for level in own["levels"]:
        found = back[level["buffer_back_first"] :][: level["indices"]]
        assert np.array_equal(np.sort(found), np.sort(small_indices(small, level["node"])))
    head = np.frombuffer(asset["files"]["head.positions"], np.float32).reshape(-1, 3)
    corners = np.frombuffer(asset["files"]["head.triangles"], np.uint32)
    assert corners.max() < len(head)
    attributes = whole.json["meshes"][0]["primitives"][0]["attributes"]
    along = whole.accessor(attributes["TEXCOORD_1"])[:, 1]
    roots = whole.accessor(attributes["POSITION"])[along == along.min()]
    away = np.linalg.norm(roots[:, None] - head, axis=-1).min(axis=1)
    assert np.median(away) < 0.01, "cards stand on the head [m]"
    assert [each["triangles"] for each in asset["levels"]] == [
        each["triangles"] for each in beside["levels"]
    ]


def small_indices(file: Glb, node: str) -> np.ndarray:
    (mesh,) = (each["mesh"] for each in file.json["nodes"] if each["name"] == node)
    return file.accessor(file.json["meshes"][mesh]["primitives"][0]["indices"]).ravel()


def test_a_page_is_part_of_the_set(tmp_path: Path) -> None:
    """Another export replaces the page. Someone else's page is kept under another name."""
    assert export_cards(tmp_path / "hair.glb", "--levels", "1", "--page", "--no-page-head") == 0
    names = sorted(each.name for each in tmp_path.iterdir())
    first = (tmp_path / "hair.html").read_bytes()
    assert "hair.html" in names and not [each for each in names if each.startswith(".")]
    assert "head.positions" not in asset_of(tmp_path / "hair.html")["files"]
    assert export_cards(tmp_path / "hair.glb", *LEVELS, "--page", "--no-page-head") == 0
    assert sorted(each.name for each in tmp_path.iterdir()) == names
    assert (tmp_path / "hair.html").read_bytes() != first
    assert export_cards(tmp_path / "other.glb", "--levels", "1") == 0
    (tmp_path / "other.html").write_text("mine", encoding="utf-8")
    assert export_cards(tmp_path / "other.glb", "--levels", "1", "--page") == 0
    assert (tmp_path / "other old.html").read_text("utf-8") == "mine"


@pytest.mark.slow(
    instead="tests/blender/test_card_files.py::test_a_failure_in_the_middle_leaves_the_old_files"
)
def test_old_files_stay_if_a_page_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise HairloomError("it broke", place="page", remedy="Wait")

    assert export_cards(tmp_path / "hair.glb", "--levels", "1", "--page") == 0
    before = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    monkeypatch.setattr(files, "write_page", fail)
    assert export_cards(tmp_path / "hair.glb", *LEVELS, "--page") == 1
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == before


def test_a_page_beside_another_format_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export_cards(tmp_path / "hair.obj", "--page") == 1
    assert "a web page needs a GLB" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_dialog_writes_a_page_into_the_folder(sphere: Any, tmp_path: Path) -> None:
    """Quotes and HTML in the hair's name do no harm."""
    grow_hair(sphere, "</script> \"Zopf\" 'ä'")
    options = {"own_levels": True, "levels": 1, "page": True, "own_folder": True}
    bpy.ops.hairloom.export_cards(filepath=str(tmp_path / "Zöpfe.glb"), **options)
    asset = asset_of(tmp_path / "Zöpfe" / "Zöpfe.html")
    assert asset["mesh"] == "Zöpfe.glb" and "Zöpfe.hairloom.json" in asset["files"]
