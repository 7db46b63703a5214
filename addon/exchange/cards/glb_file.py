"""A GLB taken apart, so that data can be added to it, and put together again.

Khronos, "glTF 2.0 Specification", section 4.4: a header, a chunk of JSON, and one of bytes.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_MAGIC, _VERSION, _JSON, _BYTES = b"glTF", 2, b"JSON", b"BIN\0"
#: numpy's type -> componentType
_COMPONENTS = {"uint8": 5121, "uint16": 5123, "uint32": 5125, "float32": 5126}
_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(eq=False)
class GlbFile:
    """The parts of a GLB. content: its JSON; binary: its bytes, which accessors point into."""

    content: dict[str, Any]
    binary: bytearray

    @classmethod
    def of(cls, data: bytes, place: str) -> GlbFile:
        """Raises HairloomError: no GLB of version 2, or one that is cut off."""
        try:
            magic, version, length = _HEADER.unpack_from(data)
            json_length, kind = _CHUNK.unpack_from(data, _HEADER.size)
            begin = _HEADER.size + _CHUNK.size
            if (magic, version, length, kind) != (_MAGIC, _VERSION, len(data), _JSON):
                raise ValueError("its header is wrong")
            content = json.loads(data[begin : begin + json_length])
            at = begin + json_length
            byte_length, kind = _CHUNK.unpack_from(data, at)
            binary = bytearray(data[at + _CHUNK.size :][:byte_length])
            if kind != _BYTES or len(binary) != byte_length:
                raise ValueError("its bytes are cut off")
        except (struct.error, ValueError) as error:
            raise HairloomError(
                f"this is not a complete GLB ({error})", place=place, remedy="Write it again"
            ) from error
        return cls(content, binary)

    def data(self) -> bytes:
        """The whole file."""
        self.content["buffers"][0]["byteLength"] = len(self.binary)
        text = json.dumps(self.content, separators=(",", ":"), ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        length = _HEADER.size + 2 * _CHUNK.size + len(text) + len(binary)
        return b"".join(
            (
                _HEADER.pack(_MAGIC, _VERSION, length),
                _CHUNK.pack(len(text), _JSON),
                text,
                _CHUNK.pack(len(binary), _BYTES),
                binary,
            )
        )

    def values(self, number: int) -> Floats | Ints:
        """The values of an accessor, (count, width), which must lie densely, as Blender's do."""
        accessor = self.content["accessors"][number]
        view = self.content["bufferViews"][accessor["bufferView"]]
        width = _WIDTHS[accessor["type"]]
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        dtype, count = _TYPES[accessor["componentType"]], accessor["count"] * width
        values: Floats | Ints = np.frombuffer(self.binary, dtype, count, begin).reshape(-1, width)
        return values.copy()

    def add(self, values: Floats | Ints, kind: str, *, target: int | None = None) -> int:
        """Put an array into the file; the number of its accessor.

        Args:
            values: (count, width) or (count,).
            kind: such as "VEC3".
            target: 34962 for attributes of vertices.
        """
        view = self.add_bytes(np.ascontiguousarray(values).tobytes())
        if target is not None:
            self.content["bufferViews"][view]["target"] = target
        accessor = {
            "bufferView": view,
            "componentType": _COMPONENTS[values.dtype.name],
            "count": len(values),
            "type": kind,
        }
        if kind == "SCALAR":  # which times of animations must have
            accessor |= {"min": [float(values.min())], "max": [float(values.max())]}
        return self.append("accessors", accessor)

    def add_bytes(self, data: bytes) -> int:
        """Put bytes into the file; the number of their view."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data
        return self.append("bufferViews", view)

    def append(self, kind: str, entry: dict[str, Any]) -> int:
        """Put an entry at the end of a list such as "nodes"; its number there."""
        entries: list[dict[str, Any]] = self.content.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def node(self, name: str) -> int:
        """The number of the mesh's node of this name; a bone may have the same name."""
        (number,) = (
            number
            for number, node in enumerate(self.content["nodes"])
            if "mesh" in node and node["name"] == name
        )
        return number
