"""Bones of TressFX grooms against bytes packed by hand, and weights against ones known."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.tfxbone import (
    BoneWeights,
    bones_at_roots,
    read_tfxbone,
    strongest_bones,
    write_tfxbone,
)
from hairloom.addon.strands import StrandSet

NAMES = ("head", "jaw", "neck_01")
Influence = tuple[int, float]


def packed(
    strands: list[list[Influence]], names: tuple[str, ...] = NAMES, first_index: int = 0
) -> bytes:
    """A file field by field; strands of fewer than four influences are filled up by none."""
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


def test_a_file_is_read_as_packed(path: Path) -> None:
    path.write_bytes(WHOLE)
    read = read_tfxbone(path)
    assert (read.weights.names, read.notes) == (NAMES, ())
    np.testing.assert_array_equal(read.weights.bone, [[0, 0, 0, 0], [2, 1, 0, 0]])
    np.testing.assert_array_equal(read.weights.weight, [[1, 0, 0, 0], [0.5, 0.25, 0.25, 0]])


def test_bones_go_by_the_index_of_the_file(path: Path) -> None:
    path.write_bytes(packed([[(12, 0.75), (10, 0.25)]], first_index=10))
    weights = read_tfxbone(path).weights
    assert [weights.names[bone] for bone in weights.bone[0, :2]] == ["neck_01", "head"]


def test_weights_are_renormalised_and_missing_ones_said(path: Path) -> None:
    influences: list[list[Influence]] = [
        [(0, 0.46), (1, 0.46)],
        [(-1, 0.7), (1, 0.3)],
        [(1, 0.0)],
        [(1, np.nan), (2, np.inf), (0, -1.0), (2, 2.0)],
    ]
    path.write_bytes(packed(influences))
    read = read_tfxbone(path)
    expected = [[0.5, 0.5, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]
    np.testing.assert_allclose(read.weights.weight, expected, rtol=1e-6)
    np.testing.assert_array_equal(read.weights.bone[[1, 2, 3], [1, 0, 3]], [1, 0, 2])
    assert len(read.notes) == 1 and "1 strands had no weights" in read.notes[0]


def test_written_file_is_what_the_loader_reads(path: Path) -> None:
    """Byte for byte, but for bones of no weight: the first bone instead of none."""
    path.write_bytes(WHOLE)
    weights = read_tfxbone(path).weights
    write_tfxbone(path, weights)
    filled = [(each + [(0, 0.0)] * 4)[:4] for each in STRANDS]
    assert path.read_bytes() == packed(filled)


def test_round_trip_is_exact(path: Path) -> None:
    random = np.random.default_rng(0)
    names = tuple(f"Knochen_{index}_ä" for index in range(30))
    weights = strongest_bones(names, random.random((500, 30)))
    write_tfxbone(path, weights)
    read = read_tfxbone(path).weights
    assert read.names == names
    np.testing.assert_array_equal(read.bone, weights.bone)
    np.testing.assert_array_equal(read.weight, weights.weight)


def test_a_groom_that_was_filled_up_has_bones_for_all(path: Path) -> None:
    path.write_bytes(WHOLE)
    weights = read_tfxbone(path).weights
    write_tfxbone(path, weights, strand_count=64)
    read = read_tfxbone(path).weights
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


BAD_FILES = {
    "empty": (b"", "empty"),
    "three bytes": (b"\1\0\0", "bone count, bytes 0 to 4"),
    "text": (b"# Wavefront OBJ\nv 0 0 0\n", "would hold 1,633,099,811 bones"),
    "negative bones": (struct.pack("<i", -1) + WHOLE[4:], "-1 bones"),
    "more bones": (struct.pack("<i", 4000) + WHOLE[4:], "bone 3 would have 0 bytes (byte 49)"),
    "a name past the end": (WHOLE[:8] + struct.pack("<i", 1 << 30) + WHOLE[12:], "name of bone 0"),
    "a negative name": (WHOLE[:8] + struct.pack("<i", -5) + WHOLE[12:], "-5 bytes (byte 8)"),
    "no bones": (packed(STRANDS, ()), "no bones (byte 0)"),
    "no strands": (packed([]), "no strands"),
    "short weights": (WHOLE[:-1], "weights, bytes"),
    "2^31 strands": (
        packed([])[:-4] + struct.pack("<i", 0x7FFFFFFF) + bytes(72),
        "past the end of the file",
    ),
    "a bone that is not there": (packed([[(0, 1.0)], [(7, 1.0)]]), "strand 1 hangs on bone 7"),
    "an index twice": (WHOLE[:17] + struct.pack("<i", 0) + WHOLE[21:], "the same index"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_named_with_place_and_remedy(path: Path, name: str) -> None:
    content, expected = BAD_FILES[name]
    path.write_bytes(content)
    with pytest.raises(HairloomError) as caught:
        read_tfxbone(path)
    assert expected in caught.value.problem
    assert caught.value.place == str(path)
    assert caught.value.remedy
