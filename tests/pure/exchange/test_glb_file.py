"""Reading and writing GLB files."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.cards.glb_file import GlbFile

pytestmark = pytest.mark.portable


def written(content: dict[str, object], binary: bytes) -> bytes:
    """A GLB packed by hand from the specification."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


EMPTY = written({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4}]}, b"abcd")


def test_arrays_that_are_added_can_be_read_again() -> None:
    file = GlbFile.of(EMPTY, "x")
    arrays = {
        "VEC4": np.arange(12, dtype=np.uint8).reshape(3, 4),
        "VEC3": np.arange(6, dtype=np.float32).reshape(2, 3),
        "SCALAR": np.array([3.5, 1.5], np.float32),
    }
    numbers = {kind: file.add(values, kind) for kind, values in arrays.items()}
    again = GlbFile.of(file.data(), "x")
    for kind, values in arrays.items():
        np.testing.assert_array_equal(again.values(numbers[kind]).squeeze(), values)
    times = again.content["accessors"][numbers["SCALAR"]]
    assert (times["min"], times["max"]) == ([1.5], [3.5])
    assert again.binary[:4] == b"abcd"
    assert all(view["byteOffset"] % 4 == 0 for view in again.content["bufferViews"])


def test_nodes_of_meshes_are_known_by_name() -> None:
    """Bones can have the same name or none and are ignored."""
    file = GlbFile.of(EMPTY, "x")
    file.append("nodes", {"name": "hair"})
    numbers = [file.append("nodes", {"name": name, "mesh": 0}) for name in ("hair", "Ä")]
    file.append("nodes", {"name": "Ä"})
    file.append("nodes", {})
    assert [GlbFile.of(file.data(), "x").node(name) for name in ("hair", "Ä")] == numbers


@pytest.mark.parametrize(
    "data",
    [b"", EMPTY[:30], EMPTY[:-1], b"glTX" + EMPTY[4:], EMPTY.replace(b'"asset"', b'"asset}')],
)
def test_damaged_glb_files_are_refused_with_a_message(data: bytes) -> None:
    with pytest.raises(HairloomError, match="not a complete GLB"):
        GlbFile.of(data, "x")
