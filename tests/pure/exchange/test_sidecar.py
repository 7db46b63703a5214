"""The sidecar says what the mesh is and how Scheuermann's passes draw it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.exchange.sidecar import write_sidecar


def one_triangle() -> CardMesh:
    return CardMesh(
        positions=np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 3.0]]),
        triangles=np.array([[0, 1, 2]]),
        uv=np.zeros((3, 2)),
        normal=np.tile([0.0, 0.0, 1.0], (3, 1)),
        tangent=np.tile([0.0, 1.0, 0.0], (3, 1)),
        occlusion=np.ones(3),
        card=np.array([0]),
        along=np.zeros(3),
        atlas=AtlasGrid(columns=4),
    )


def test_written_beside_as_plain_data(tmp_path: Path) -> None:
    path = write_sidecar(tmp_path / "hair.v1.glb", one_triangle())
    assert path == tmp_path / "hair.v1.hairloom.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["file"] == "hair.v1.glb"
    assert content["counts"] == {"cards": 1, "triangles": 1, "vertices": 3}
    assert content["bounds"] == {"minimum": [0.0, 0.0, -2.0], "maximum": [1.0, 3.0, 0.0]}
    assert content["texture"]["columns"] == 4
    assert "_AO" not in content["attributes"]


def test_passes_are_those_of_the_paper(tmp_path: Path) -> None:
    path = write_sidecar(tmp_path / "hair.glb", one_triangle(), portable=False)
    content = json.loads(path.read_text(encoding="utf-8"))
    states = [
        (p["color_write"], p["depth_write"], p["depth_test"], p["cull"]) for p in content["passes"]
    ]
    assert states == [
        (False, True, "less", "none"),
        (True, False, "equal", "none"),
        (True, False, "less", "front"),
        (True, True, "less", "back"),
    ]
    assert [p["blend"] != "off" for p in content["passes"]] == [False, False, True, True]
    assert len(content["passes_fallback"]) == 3
    assert "_AO" in content["attributes"]


def test_textures_beside_are_named_with_how_they_are_read(tmp_path: Path) -> None:
    files = {name: f"hair_{name}.png" for name in ("base", "alpha", "shift", "noise", "tangent")}
    path = write_sidecar(
        tmp_path / "hair.glb", one_triangle(), textures=files, highlights="tangent"
    )
    content = json.loads(path.read_text(encoding="utf-8"))["textures"]
    assert {name: content[name]["file"] for name in files} == files
    spaces = {name: content[name]["color_space"].split(":")[0] for name in files}
    assert spaces == {name: "sRGB" if name == "base" else "linear" for name in files}
    assert all({"r", "rgb"} & set(content[name]) for name in files)
    assert content["highlights_by"] == "tangent"
    alone = json.loads(write_sidecar(tmp_path / "hair.glb", one_triangle()).read_text())
    assert "textures" not in alone
