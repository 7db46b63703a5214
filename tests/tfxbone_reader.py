"""Reads .tfxbone files field by field, as TressFX's loader does."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from hairloom.addon.exchange.tfxbone import INFLUENCES, BoneWeights


def read_tfxbone(path: Path) -> BoneWeights:
    """The bone weights of a file; bone -1 means none."""
    content = path.read_bytes()
    (bone_count,), at = struct.unpack_from("<i", content), 4
    names: dict[int, str] = {}
    for _ in range(bone_count):
        index, length = struct.unpack_from("<2i", content, at)
        names[index] = content[at + 8 : at + 8 + length].rstrip(b"\0").decode()
        at += 8 + length
    (strand_count,) = struct.unpack_from("<i", content, at)
    strand = struct.Struct("<i" + "if" * INFLUENCES)
    rows = list(strand.iter_unpack(content[at + 4 :]))
    assert [row[0] for row in rows] == list(range(strand_count)), "strands in their order"
    place = {index: number for number, index in enumerate(names)}
    bone = [[0 if index == -1 else place[index] for index in row[1::2]] for row in rows]
    return BoneWeights(tuple(names.values()), np.array(bone), np.array([row[2::2] for row in rows]))
