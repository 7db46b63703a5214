"""The sidecar describes the mesh and how Scheuermann's passes draw it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.exchange.cards.card_formats import FBX, FORMATS, GLB, USD
from hairloom.addon.exchange.cards.index_buffer import index_buffer
from hairloom.addon.exchange.cards.sidecar import (
    CardFile,
    conflicting_owner,
    files_of_earlier_export,
    sidecar_content,
    sidecar_text,
)

jsonschema = pytest.importorskip("jsonschema", reason="it is missing: `make setup` installs it")

SCHEMA = json.loads(
    (Path(__file__).parents[3] / "docs" / "sidecar.schema.json").read_text(encoding="utf-8")
)


def triangles(count: int = 1, **cards: np.ndarray) -> CardMesh:
    """Triangles side by side; each pair is a card."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 3.0]])
    return CardMesh(
        positions=np.concatenate([corners + [number, 0.0, 0.0] for number in range(count)]),
        triangles=np.arange(count * 3).reshape(-1, 3),
        uv=np.zeros((count * 3, 2)),
        normal=np.tile([0.0, 0.0, 1.0], (count * 3, 1)),
        tangent=np.tile([0.0, 1.0, 0.0], (count * 3, 1)),
        occlusion=np.ones(count * 3),
        card=np.arange(count) // 2,
        along=np.zeros(count * 3),
        atlas=AtlasGrid(columns=4, rows=2, padding=(0.1, 0.05)),
        **cards,
    )


def card_file(**changes: Any) -> CardFile:
    return replace(CardFile("hair.v1.glb", GLB, (triangles(),), ("hair_v1",)), **changes)


def read(cards: CardFile) -> dict[str, Any]:
    """The content of the file, validated against the schema."""
    content = json.loads(sidecar_text(cards))
    jsonschema.Draft202012Validator(SCHEMA).validate(content)
    return content


def test_the_schema_is_one_and_can_refuse() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    for damage in ({"format": "stl"}, {"hairloom_sidecar": 1}, {"unknown": 1}, {"levels": []}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(sidecar_content(card_file()) | damage, SCHEMA)


def test_the_sidecar_describes_the_mesh() -> None:
    content = read(card_file())
    assert content["file"] == "hair.v1.glb"
    assert content["counts"] == {"cards": 1, "triangles": 1, "vertices": 3}
    assert content["bounds"] == {"minimum": [0.0, 0.0, -2.0], "maximum": [1.0, 3.0, 0.0]}
    atlas = content["atlas"]
    assert (atlas["columns"], atlas["rows"], atlas["padding"]) == (4, 2, [0.1, 0.05])
    assert "_AO" not in content["attributes"]
    assert "_AO" in read(card_file(portable=False))["attributes"]


@pytest.mark.parametrize(
    ("file_format", "lowest"),
    [(GLB, [0.0, 0.0, -2.0]), (FBX, [0.0, 0.0, -200.0]), (USD, [0.0, 0.0, 0.0])],
)
def test_lengths_are_in_the_units_and_axes_of_the_file(file_format, lowest) -> None:
    content = read(card_file(format=file_format, errors=(0.5,)))
    assert content["bounds"]["minimum"] == lowest
    in_metres = content["levels"][0]["error"] * content["space"]["metres_per_unit"]
    assert in_metres == pytest.approx(0.5)


@pytest.mark.parametrize("file_format", FORMATS, ids=lambda each: each.name)
def test_every_format_follows_the_schema(file_format) -> None:
    assert read(card_file(format=file_format))["format"] == file_format.name


def test_ranges_tell_groups_layers_and_cards_apart() -> None:
    """Six triangles of three cards; the first card comes between the others."""
    mesh = triangles(6, group=np.array([0, 0, 7]), layer=np.array([1, 0, 0]))
    mesh = replace(mesh, card=np.array([1, 1, 0, 0, 2, 2]))
    (level,) = read(card_file(levels=(mesh,)))["levels"]
    assert level["ranges"] == {
        "group": [0, 0, 7],
        "layer": [0, 1, 0],
        "first": [0, 6, 12],
        "count": [6, 6, 6],
    }
    assert level["cards_in_order"] == {
        "card": [1, 0, 2],
        "first": [0, 6, 12],
        "count": [6, 6, 6],
    }
    assert level["indices"] == 18


def test_cards_are_listed_only_where_each_is_whole() -> None:
    mesh = replace(triangles(6), card=np.array([0, 0, 1, 1, 0, 0]))
    (level,) = read(card_file(levels=(mesh,)))["levels"]
    assert "cards_in_order" not in level
    assert level["ranges"] == {"group": [0], "first": [0], "count": [18]}
    whole = replace(mesh, card=np.sort(mesh.card))
    (level,) = read(card_file(levels=(whole,)))["levels"]
    assert level["cards_in_order"] == {"card": [0, 1], "first": [0, 12], "count": [12, 6]}


def test_alpha_of_baked_strands_grows_at_a_slant() -> None:
    textures = {"alpha": {"file": "hair_alpha.png", "channels": "r"}}
    even = {"mean_facing": 0.8, "min_facing": 0.1}
    content = read(card_file(textures=textures, view_compensated_alpha=even))["textures"]
    assert content["view_compensated_alpha"].items() > even.items()
    assert "view_compensated_alpha" not in read(card_file(textures=textures))["textures"]


def test_levels_are_found_in_the_index_buffer() -> None:
    levels = (triangles(6), triangles(2))
    back = [mesh.triangles[::-1] for mesh in levels]
    buffer = index_buffer(levels, back)
    indices = np.frombuffer(buffer.content, "<u2")
    content = read(
        card_file(levels=levels, nodes=("a_LOD0", "a_LOD1"), indices=("a.indices.bin", buffer))
    )
    assert content["index_buffer"]["type"] == buffer.type == "uint16"
    assert "back_faces" in content["draw_order"]
    for level, mesh, other in zip(content["levels"], levels, back, strict=True):
        for first, expected in (("buffer_first", mesh.triangles), ("buffer_back_first", other)):
            found = indices[level[first] :][: level["indices"]]
            np.testing.assert_array_equal(found.reshape(-1, 3), expected)


def test_many_vertices_need_wide_indices() -> None:
    """The index 65,535 ends a strip in some engines."""
    for count, kind, width in ((21_845, "uint16", 2), (21_846, "uint32", 4)):
        mesh = triangles(count)
        buffer = index_buffer([mesh])
        assert (buffer.type, len(buffer.content)) == (kind, count * 3 * width)
        last = np.frombuffer(buffer.content, f"<u{width}")[-1]
        assert last == len(mesh.positions) - 1


def test_passes_are_those_of_the_paper() -> None:
    content = read(card_file())
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


def test_textures_beside_are_named_with_how_they_are_read() -> None:
    roles = {
        "base": {"file": "hair_color.png", "channels": "rgb"},
        "alpha": {"file": "hair_color.png", "channels": "a"},
        "tangent": {"file": "hair_tangent.png", "channels": "rgb", "inverted": "g"},
    }
    content = read(card_file(textures=roles, highlights="tangent", base_gain=1.5))["textures"]
    assert {name: content[name]["file"] for name in roles} == {
        name: role["file"] for name, role in roles.items()
    }
    spaces = [content[name]["color_space"] for name in roles]
    assert spaces == ["sRGB", "linear", "linear"]
    assert content["base"]["gain"] == 1.5 and "gain" not in content["alpha"]
    assert content["tangent"]["inverted"] == "g"
    assert content["highlights_by"] == "tangent"
    assert read(card_file())["textures"] == {}
    roles["base"] |= {"file": "hair_color.exr", "color_space": "linear"}
    assert read(card_file(textures=roles))["textures"]["base"]["color_space"] == "linear"


def test_a_sidecar_that_is_nested_deeply_is_read_or_none_of_ours(tmp_path: Path) -> None:
    """Depths that can be read, that are perhaps too deep to traverse, and that cannot be read."""
    ours = {f"hair{suffix}" for suffix in (".hairloom.json", ".mtl", ".bin", ".glb")}
    for depth, found in ((400, [ours]), (900, [ours, set()]), (100_000, [set()])):
        nested = (
            '{"hairloom_sidecar": 1, "file": "hair.glb", "x": ' + "[" * depth + "]" * depth + "}"
        )
        (tmp_path / "hair.hairloom.json").write_text(nested)
        assert files_of_earlier_export(tmp_path / "hair.glb") in found


def test_lists_of_numbers_stand_in_one_line() -> None:
    text = sidecar_text(card_file(levels=(triangles(6),)))
    assert '"minimum": [0.0, 0.0, -2.0]' in text
    assert '"first": [0, 6, 12]' in text


def test_a_sidecar_of_another_mesh_that_is_there_is_known(tmp_path: Path) -> None:
    (tmp_path / "hair.v1.hairloom.json").write_text(sidecar_text(card_file()))
    assert conflicting_owner(tmp_path / "hair.v1.fbx") == ""  # the mesh is gone
    (tmp_path / "hair.v1.glb").touch()
    assert conflicting_owner(tmp_path / "hair.v1.fbx") == "hair.v1.glb"
    assert (
        conflicting_owner(tmp_path / "hair.v1.glb")
        == conflicting_owner(tmp_path / "brows.glb")
        == ""
    )


def test_names_in_the_sidecar_keep_their_spaces() -> None:
    name = 'hair [  2  ] "a".glb'
    text = sidecar_text(replace(card_file(), name=name))
    assert json.loads(text)["file"] == name
    assert re.search(r"\[-?\d[^\n]*\d\]", text), "lists of numbers stand in one line"
