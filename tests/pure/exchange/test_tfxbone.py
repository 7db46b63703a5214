"""Bones of TressFX grooms against bytes packed by hand, and weights against known ones."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from tfxbone_reader import read_tfxbone

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.tfxbone import (
    BoneWeights,
    bones_at_roots,
    strongest_bones,
    write_tfxbone,
)
from hairloom.addon.strands import StrandSet

NAMES = ("head", "jaw", "neck_01")
Influence = tuple[int, float]


def packed(
    strands: list[list[Influence]], names: tuple[str, ...] = NAMES, first_index: int = 0
) -> bytes:
    """A file packed by hand; strands with fewer than four influences are padded with none."""
    content = struct.pack("<i", len(names))
    for index, name in enumerate(names, first_index):
        text = name.encode() + b"\0"
        content += struct.pack("<ii", index, len(text)) + text
    content += struct.pack("<i", len(strands))
    for index, influences in enumerate(strands):
        content += struct.pack("<i", index)
        for bone, weight in (influences + [(-1, 0.0)] * 4)[:4]:
            content += struct.pack("<if", bone, weight)
    return content


STRANDS: list[list[Influence]] = [[(0, 1.0)], [(2, 0.5), (1, 0.25), (0, 0.25)]]
WHOLE = packed(STRANDS)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "groom.tfxbone"


def test_written_file_is_what_the_loader_reads(path: Path) -> None:
    """Byte for byte, except that an influence without weight names the first bone instead of
    none."""
    path.write_bytes(WHOLE)
    weights = read_tfxbone(path)
    write_tfxbone(path, weights)
    filled = [(each + [(0, 0.0)] * 4)[:4] for each in STRANDS]
    assert path.read_bytes() == packed(filled)


def test_round_trip_is_exact(path: Path) -> None:
    random = np.random.default_rng(0)
    names = tuple(f"Knochen_{index}_ä" for index in range(30))
    weights = strongest_bones(names, random.random((500, 30)))
    write_tfxbone(path, weights)
    read = read_tfxbone(path)
    assert read.names == names
    np.testing.assert_array_equal(read.bone, weights.bone)
    np.testing.assert_array_equal(read.weight, weights.weight)


def test_a_groom_that_was_filled_up_has_bones_for_all(path: Path) -> None:
    path.write_bytes(WHOLE)
    weights = read_tfxbone(path)
    write_tfxbone(path, weights, strand_count=64)
    read = read_tfxbone(path)
    assert read.strand_count == 64
    np.testing.assert_array_equal(read.weight[1:], np.repeat(weights.weight[1:], 63, axis=0))


def test_the_strongest_four_carry() -> None:
    weights = strongest_bones(tuple("abcdef"), np.array([[0.1, 0.4, 0.0, 0.2, 0.1, 0.2]]))
    assert weights.bone[0].tolist() == [1, 3, 5, 0]
    np.testing.assert_allclose(weights.weight[0], np.array([4, 2, 2, 1]) / 9, rtol=1e-6)
    fewer = strongest_bones(("a", "b"), np.array([[0.0, 3.0], [0.0, 0.0]]))
    assert fewer.bone[:, 0].tolist() == [1, 0]
    np.testing.assert_array_equal(fewer.weight, [[1, 0, 0, 0], [1, 0, 0, 0]])


def test_roots_follow_the_skin_between_its_vertices() -> None:
    strands = StrandSet(
        np.random.default_rng(0).random((4, 3)),
        [0, 2, 4],
        np.ones(4),
        np.zeros(2),
        root_triangle=[1, 0],
        root_barycentric=[[0.5, 0.25, 0.25], [0.0, 0.0, 1.0]],
    )
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    vertex_weights = np.array([[1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [1.0, 0.0]])
    weights = bones_at_roots(strands, triangles, ("head", "jaw"), vertex_weights)
    # vertices 1, 3, 2: head 0.25 + 0.125, jaw 0.5 + 0.125
    np.testing.assert_allclose(weights.weight[0, :2], [0.625, 0.375])
    assert weights.bone[0, :2].tolist() == [1, 0]
    np.testing.assert_allclose(weights.weight[1, :2], [0.5, 0.5])
    unbound = StrandSet(strands.points, strands.offsets, strands.radius, strands.group)
    with pytest.raises(HairloomError, match="not bound"):
        bones_at_roots(unbound, triangles, ("head", "jaw"), vertex_weights)


def test_weights_that_cannot_be_are_refused(path: Path) -> None:
    one = np.array([[1.0, 0.0, 0.0, 0.0]])
    for bone, weight, problem in (
        ([[3, 0, 0, 0]], one, "beyond the 3"),
        ([[-1, 0, 0, 0]], one, "beyond the 3"),
        ([[0, 0, 0, 0]], one * 0.9, "not 1"),
        ([[0, 0, 0]], one, "shape"),
    ):
        with pytest.raises(HairloomError, match=problem):
            BoneWeights(NAMES, np.array(bone), weight)
    with pytest.raises(HairloomError, match="no bones to write"):
        write_tfxbone(path, BoneWeights(NAMES, np.zeros((0, 4)), np.zeros((0, 4))))
    assert not path.exists()
