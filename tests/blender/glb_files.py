"""GLB files of cards: written, read with numpy alone, and checked by Khronos's validator."""

from __future__ import annotations

import json
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import node_or_skip

from hairloom.addon.cards.card_mesh import CardMesh

pytest.importorskip("bpy", reason="writing a GLB needs Blender or the bpy module")

from hairloom.addon.blender.cards.exporters import CardLook, write_card_mesh
from hairloom.addon.exchange.cards.card_formats import GLB
from hairloom.addon.exchange.files.file_set import atomic_file_set

VALIDATOR_FOLDER = Path(__file__).parents[2] / "tools" / "node"


def write_glb(
    path: Path,
    mesh: CardMesh,
    texture: np.ndarray | None,
    *,
    name: str = "Hair cards",
    portable: bool = True,
) -> None:
    """Write a GLB that holds one level of cards and no sidecar."""
    look = CardLook(card=texture)
    with atomic_file_set(path) as folder:
        write_card_mesh(folder / path.name, [mesh], GLB, look, name=name, portable=portable)


class Glb:
    """A GLB file, read with the standard library and numpy alone."""

    _WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
    _DTYPE = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "u1"}

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        json_length, _ = struct.unpack_from("<I4s", content, 12)
        self.json: dict[str, Any] = json.loads(content[20 : 20 + json_length])
        self._binary = content[20 + json_length + 8 :]

    @property
    def primitive(self) -> dict[str, Any]:
        """The only primitive of the only mesh."""
        (mesh,) = self.json["meshes"]
        (primitive,) = mesh["primitives"]
        return primitive

    def view(self, index: int) -> bytes:
        view = self.json["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self._binary[start : start + view["byteLength"]]

    def accessor(self, index: int) -> np.ndarray:
        accessor = self.json["accessors"][index]
        dtype, width = self._DTYPE[accessor["componentType"]], self._WIDTH[accessor["type"]]
        values = np.frombuffer(
            self.view(accessor["bufferView"]),
            dtype,
            accessor["count"] * width,
            accessor.get("byteOffset", 0),
        )
        return values.reshape(-1, width)

    def corners(self, name: str) -> np.ndarray:
        """An attribute at each corner of each triangle, in index order, (triangles, 3, width)."""
        indices = self.accessor(self.primitive["indices"]).reshape(-1, 3)
        return self.accessor(self.primitive["attributes"][name])[indices]


def to_blender(vectors: np.ndarray) -> np.ndarray:
    """Vectors in glTF's axes, converted to Blender's axes."""
    return np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)


def validator_report(path: Path) -> dict[str, Any]:
    """The report of Khronos's validator."""
    if not (VALIDATOR_FOLDER / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("Khronos's glTF validator is missing: `make setup` installs it")
    script = (
        "require('gltf-validator').validateBytes(new Uint8Array("
        "require('fs').readFileSync(process.argv[1])), {maxIssues: 20})"
        ".then(report => console.log(JSON.stringify(report)))"
    )
    result = subprocess.run(
        [node_or_skip(), "-e", script, str(path)],
        cwd=VALIDATOR_FOLDER,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return json.loads(result.stdout)
