"""Exports of small card meshes, and the files beside them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy
import jsonschema

from hairloom.addon.blender.command_line import command_line

SCHEMA = json.loads(
    (Path(__file__).parents[2] / "docs" / "sidecar.schema.json").read_text(encoding="utf-8")
)
SMALL_OPTIONS = (
    *(
        "--set",
        "children.method=none",
        "--set",
        "grow.strand_count=100",
        "--set",
        "guides.guide_count=10",
    ),
    *("--set", "card_occlusion.rays=16", "--set", "cards.source=guides"),
    *("--set", "cards.order_by=distance"),
    *("--set", "atlas.source=made"),
    *("--set", "card_texture.height=64", "--set", "card_texture.variant_width=32"),
)
BAKED_OPTIONS = (
    *(
        "--set",
        "cards.source=clusters",
        "--set",
        "cards.card_count=8",
        "--set",
        "atlas.source=baked",
    ),
    *("--set", "atlas.size=512", "--set", "atlas.columns=4", "--set", "atlas.rows=2"),
)


def export_cards(output: Path, *options: str) -> int:
    return command_line.run(["cards", *SMALL_OPTIONS, *options, "--output", str(output)])


def read_sidecar(path: Path) -> dict[str, Any]:
    """The sidecar of an export, valid by the schema; all files that it names must exist."""
    content = json.loads(path.with_suffix(".hairloom.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(content)
    textures = content["textures"].values()
    roles = [value for value in textures if isinstance(value, dict) and "file" in value]
    tables = content["material"]["tables"].values()
    beside = [each["file"] for each in (*roles, *tables, content.get("index_buffer", roles[0]))]
    for file in (content["file"], *beside, *content["texture_files"]):
        assert (path.parent / file).is_file(), file
    return content


def grow_hair(sphere: Any, name: str) -> Any:
    bpy.ops.object.select_all(action="DESELECT")
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.hairloom.grow(strand_count=200, length=0.05)
    hair = bpy.context.object
    hair.name = name
    hair.data.hairloom.guides.guide_count = 10
    hair.data.hairloom.card_occlusion.rays = 16
    hair.data.hairloom.cards.source, hair.data.hairloom.atlas.source = "guides", "made"
    return hair
