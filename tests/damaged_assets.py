"""Exports as other programs and users leave them: each function changes a folder with
`cards.glb`."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hairloom.addon.exchange.cards.glb_file import GlbFile
from hairloom.addon.exchange.textures.texture_files import read_texture, write_texture

NAME = "Zöpfe 头发"


def sidecar_of(folder: Path) -> dict[str, Any]:
    (path,) = folder.glob("*.hairloom.json")
    return dict(json.loads(path.read_text(encoding="utf-8")))


def change_sidecar(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    (path,) = folder.glob("*.hairloom.json")
    content = sidecar_of(folder)
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")


def without_sidecar(folder: Path) -> None:
    (folder / "cards.hairloom.json").unlink()


def with_garbage_sidecar(folder: Path) -> None:
    (folder / "cards.hairloom.json").write_text("{no", encoding="utf-8")


def with_renamed_files(folder: Path) -> None:
    """Mesh and sidecar renamed; the sidecar still refers to cards.glb."""
    for end in (".glb", ".hairloom.json"):
        (folder / f"cards{end}").rename(folder / f"{NAME}{end}")


def with_other_levels(folder: Path) -> None:
    """The sidecar of another hair lies beside the mesh."""

    def change(content: dict[str, Any]) -> None:
        for level in content["levels"]:
            level["node"] = f"other_{level['node']}"

    change_sidecar(folder, change)


def without_textures(folder: Path) -> None:
    roles = sidecar_of(folder)["textures"]
    for role in ("tangent", "normal", "base"):
        if role in roles:
            (folder / roles[role]["file"]).unlink()


def with_cut_off_table(folder: Path) -> None:
    table = folder / sidecar_of(folder)["material"]["tables"]["azimuthal"]["file"]
    table.write_bytes(table.read_bytes()[:50_000])


def without_index_buffer(folder: Path) -> None:
    (folder / sidecar_of(folder)["index_buffer"]["file"]).unlink()


def _finest(file: GlbFile) -> dict[str, Any]:
    """The primitive of the finest level."""
    node = file.content["nodes"][file.node("cards_LOD0")]
    return dict(file.content["meshes"][node["mesh"]]["primitives"][0])


def _change_glb(folder: Path, change: Callable[[GlbFile], None]) -> None:
    path = folder / "cards.glb"
    file = GlbFile.of(path.read_bytes(), str(path))
    change(file)
    path.write_bytes(file.data())


def with_reordered_triangles(folder: Path) -> None:
    """The same triangles in another order, as after vertex cache optimisation."""

    def change(file: GlbFile) -> None:
        accessor = file.content["accessors"][_finest(file)["indices"]]
        view = file.content["bufferViews"][accessor["bufferView"]]
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        kind = {5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
        indices = np.frombuffer(file.binary, kind, accessor["count"], begin).reshape(-1, 3)
        content = np.random.default_rng(3).permutation(indices).tobytes()
        file.binary[begin : begin + len(content)] = content

    _change_glb(folder, change)


def without_unused(folder: Path) -> None:
    """Without the second UV map, which no plain material needs."""

    def change(file: GlbFile) -> None:
        for mesh in file.content["meshes"]:
            mesh["primitives"][0]["attributes"].pop("TEXCOORD_1")

    _change_glb(folder, change)


def with_quantised_positions(folder: Path) -> None:
    """KHR_mesh_quantization of positions: 16 bits, scaled back by the node."""

    def change(file: GlbFile) -> None:
        content = file.content
        for node in content["nodes"]:
            if "mesh" not in node:
                continue
            attributes = content["meshes"][node["mesh"]]["primitives"][0]["attributes"]
            positions = np.asarray(file.values(attributes["POSITION"]), float)
            scale = float(np.abs(positions).max())
            steps = np.round(positions / scale * 32767.0).astype("<i2")
            padded = np.zeros((len(steps), 4), "<i2")  # each vertex begins at 4 bytes
            padded[:, :3] = steps
            file.binary += b"\0" * (-len(file.binary) % 4)
            view = {"buffer": 0, "byteOffset": len(file.binary), "byteLength": padded.nbytes}
            content["bufferViews"].append(view | {"byteStride": 8})
            file.binary += padded.tobytes()
            accessor = {
                "bufferView": len(content["bufferViews"]) - 1,
                "componentType": 5122,
                "normalized": True,
                "count": len(steps),
                "type": "VEC3",
                "min": steps.min(axis=0).tolist(),
                "max": steps.max(axis=0).tolist(),
            }
            attributes["POSITION"] = len(content["accessors"])
            content["accessors"].append(accessor)
            node["scale"] = [scale] * 3
        for key in ("extensionsUsed", "extensionsRequired"):
            content.setdefault(key, []).append("KHR_mesh_quantization")

    _change_glb(folder, change)


def with_mirrored_cards(folder: Path) -> None:
    """No damage: the tangent frames of cards that an artist has mirrored, on one side of the hair.
    The direction of their strands does not change.
    """

    def change(file: GlbFile) -> None:
        for mesh in file.content["meshes"]:
            attributes = mesh["primitives"][0]["attributes"]
            tangents = np.asarray(file.values(attributes["TANGENT"]), np.float32)
            is_mirrored = np.asarray(file.values(attributes["POSITION"]))[:, 0] < 0.0
            tangents[is_mirrored] *= -1.0
            attributes["TANGENT"] = file.add(tangents, "VEC4", target=34962)

    _change_glb(folder, change)


def with_turned_tangents(folder: Path) -> None:
    """No damage: tangents packed as for some engines, with 1 - x in green and y in red."""
    file = folder / sidecar_of(folder)["textures"]["tangent"]["file"]
    pixels = read_texture(file, is_color=False)[::-1, :, :3]
    turned = np.stack([pixels[..., 1], 1.0 - pixels[..., 0], pixels[..., 2]], axis=-1)
    write_texture(file, turned, is_color=False, depth="uint16", is_packed=True)

    def change(content: dict[str, Any]) -> None:
        content["textures"]["tangent"] |= {"channels": "grb", "inverted": "g"}

    change_sidecar(folder, change)


#: damage -> words of the one message about it; "": no message
DAMAGES: dict[Callable[[Path], None], str] = {
    without_sidecar: "is missing",
    with_garbage_sidecar: "is no sidecar",
    with_renamed_files: "names cards.glb",
    with_other_levels: "its sidecar",
    without_textures: "is missing",
    with_cut_off_table: "cannot be read",
    without_index_buffer: "is missing",
    with_reordered_triangles: "another program has changed",
    without_unused: "another program has changed",
    with_quantised_positions: "",  # 65,536 steps: not visible
}


def damaged_copy(folder: Path, target: Path, damage: Callable[[Path], None]) -> Path:
    """A damaged copy of an export's files."""
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for file in folder.iterdir():
        if file.is_file():
            shutil.copy2(file, target)
    damage(target)
    return target
