"""Cem Yuksel's .hair files against bytes packed by hand from his specification."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.hair_file import read_hair_file, write_hair_file
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.groom.widths import with_widths
from hairloom.addon.strands import StrandSet

pytestmark = pytest.mark.portable

SEGMENTS = (2, 3, 1)
POINTS = np.arange(27, dtype=np.float32).reshape(9, 3) * np.float32(0.01)


def packed(
    arrays: int,
    *blocks: bytes,
    strands: int = 3,
    points: int = 9,
    segments: int = 0,
    thickness: float = 8e-5,
    transparency: float = 0.0,
    color: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> bytes:
    """A file packed by hand: 128 bytes of header, and the blocks."""
    header = struct.pack("<4s4I", b"HAIR", strands, points, arrays, segments)
    header += struct.pack("<5f", thickness, transparency, *color)
    return header + b"made by hand".ljust(88, b"\0") + b"".join(blocks)


def floats(values: np.ndarray) -> bytes:
    return struct.pack(f"<{values.size}f", *values.ravel())


SEGMENT_BLOCK = struct.pack("<3H", *SEGMENTS)
WHOLE = packed(3, SEGMENT_BLOCK, floats(POINTS))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "groom.hair"


def test_all_arrays_are_read_as_packed(path: Path) -> None:
    random = np.random.default_rng(0)
    thickness = random.uniform(5e-5, 1e-4, 9).astype(np.float32)
    transparency, color = random.random(9), random.random((9, 3)).astype(np.float32)
    uv = random.random((9, 2)).astype(np.float32)
    blocks = (SEGMENT_BLOCK, *map(floats, (POINTS, thickness, transparency, color, uv)))
    path.write_bytes(packed(63, *blocks))
    read = read_hair_file(path)
    np.testing.assert_array_equal(read.strands.points, POINTS)
    np.testing.assert_array_equal(read.strands.point_counts, [3, 4, 2])
    np.testing.assert_array_equal(read.strands.radius, thickness / 2)
    np.testing.assert_array_equal(read.strands.root_uv, uv[[0, 3, 7]])
    np.testing.assert_array_equal(read.groom.color, color)
    np.testing.assert_allclose(read.transparency, transparency, rtol=1e-6)
    assert "transparency is not kept; 9 of 9 points" in read.notes[0]
    assert (read.info, read.dropped, read.source) == ("made by hand", {}, path)


def test_values_without_an_array_come_from_the_header(path: Path) -> None:
    content = packed(
        2, floats(POINTS), segments=2, thickness=6e-5, transparency=0.5, color=(0.5, 0.25, 0.125)
    )
    path.write_bytes(content)
    read = read_hair_file(path)
    np.testing.assert_array_equal(read.strands.point_counts, [3, 3, 3])
    np.testing.assert_array_equal(read.strands.radius, np.float32(3e-5))
    np.testing.assert_array_equal(read.groom.color, np.tile([0.5, 0.25, 0.125], (9, 1)))
    np.testing.assert_array_equal(read.transparency, 0.5)
    assert read.strands.root_uv is None


def test_a_thickness_that_is_no_diameter_is_found_and_white_is_no_colour(path: Path) -> None:
    path.write_bytes(packed(3, SEGMENT_BLOCK, floats(POINTS), thickness=1.0))
    read = read_hair_file(path)
    found, widths = with_widths(read.strands)
    assert widths.is_found and found.radius.max() < 0.1, "strands are a metre apart, and not long"
    assert read.groom.color is None


def test_axes_and_units(path: Path) -> None:
    """A strand of 100 units of 1 cm along the file's Y is 1 m along Blender's Z."""
    points = np.array([[0, 0, 0], [0, 100, 0]], np.float32)
    path.write_bytes(packed(2, floats(points), strands=1, points=2, segments=1, thickness=0.008))
    strands = read_hair_file(path, up="Y", scale=0.01).strands
    np.testing.assert_allclose(strands.points, [[0, 0, 0], [0, 0, 1]], atol=1e-7)
    np.testing.assert_allclose(strands.radius, 4e-5, rtol=1e-6)


def test_bad_strands_are_dropped_with_all_that_is_theirs(path: Path) -> None:
    points = POINTS.copy()
    points[4] = np.nan
    points[7:] = 1.0
    color = np.random.default_rng(0).random((9, 3)).astype(np.float32)
    color[0, 1] = np.nan
    path.write_bytes(packed(19, SEGMENT_BLOCK, floats(points), floats(color)))
    read = read_hair_file(path)
    assert read.dropped == {"a point that is not finite": 1, "no length": 1}
    np.testing.assert_array_equal(read.strands.points, POINTS[:3])
    assert read.groom.color is not None and read.groom.color.shape == (3, 3)
    assert np.isnan(read.groom.color).all(), "a strand has a colour all along or none"


def ragged(strand_count: int, **more: np.ndarray) -> StrandSet:
    random = np.random.default_rng(strand_count)
    counts = random.integers(2, 20, strand_count)
    points = random.uniform(-1.0, 1.0, (counts.sum(), 3))
    radius = random.uniform(1e-5, 1e-4, len(points))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return StrandSet(points, offsets, radius, np.zeros(strand_count), **more)


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_round_trip_is_exact(path: Path, up: str) -> None:
    strands = ragged(40, root_uv=np.random.default_rng(0).random((40, 2)))
    color = np.random.default_rng(1).random((strands.point_count, 3))
    groom = Groom(replace(strands, color=color))
    assert write_hair_file(path, groom, up=up, uv=True) == ()
    read = read_hair_file(path, up=up)
    for name in ("points", "offsets", "radius", "root_uv"):
        np.testing.assert_array_equal(getattr(read.strands, name), getattr(strands, name))
    np.testing.assert_array_equal(read.groom.color, groom.color)
    assert (read.info, read.notes) == ("Hairloom", ())


@pytest.mark.parametrize("color", [1.0, 0.25])
def test_hair_of_one_colour_stays_so(path: Path, color: float) -> None:
    strands = ragged(4)
    write_hair_file(path, replace(strands, color=np.full((strands.point_count, 3), color)))
    read = read_hair_file(path).groom.color
    assert read is not None
    np.testing.assert_array_equal(read, np.float32(color))


def test_written_file_is_what_the_specification_says(path: Path) -> None:
    """Read back with struct alone; values that all strands share are in the header."""
    strands = StrandSet(POINTS, np.arange(0, 10, 3), np.full(9, 4e-5), np.zeros(3))
    write_hair_file(path, strands, scale=0.01)
    content = path.read_bytes()
    head = struct.unpack_from("<4s4I5f", content)
    assert head[:5] == (b"HAIR", 3, 9, 2, 2)
    np.testing.assert_allclose(head[5:], [8e-3, 0, 1, 1, 1], rtol=1e-6)
    assert len(content) == 128 + 9 * 12
    np.testing.assert_allclose(struct.unpack_from("<27f", content, 128), POINTS.ravel() * 100)


def test_lost_attributes_are_reported(path: Path) -> None:
    strands = StrandSet(
        POINTS, np.arange(0, 10, 3), np.full(9, 4e-5), np.arange(3), np.zeros((3, 2))
    )
    notes = " ".join(write_hair_file(path, Groom(strands, strand_id=np.arange(3))))
    for lost in ("no groups", "no root UVs", "no strand IDs"):
        assert lost in notes


@pytest.mark.parametrize("parts", ["strands", "guides", "both"])
def test_guides_or_strands_or_both(path: Path, parts: str) -> None:
    strands = ragged(6)
    groom = Groom(strands, is_guide=np.arange(6) < 2)
    write_hair_file(path, groom, parts=parts)
    expected = {"strands": groom.without_guides(), "guides": groom.guides(), "both": groom}[parts]
    np.testing.assert_array_equal(read_hair_file(path).strands.points, expected.strands.points)


def test_writing_nothing_or_too_long_strands_is_refused(path: Path) -> None:
    with pytest.raises(HairloomError, match="no strands"):
        write_hair_file(path, ragged(3).take(np.array([], np.int64)))
    counts = np.array([3, 70_000])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    points = np.random.default_rng(0).random((counts.sum(), 3))
    with pytest.raises(HairloomError, match="69,999 segments"):
        write_hair_file(path, StrandSet(points, offsets, np.ones(len(points)), np.zeros(2)))
    assert not path.exists()


def test_sintel_through_a_hair_file(shared_data: Path, path: Path) -> None:
    sintel = shared_data / "sintel" / "SintelHairOriginal-sintel_hair.16points.tfx"
    strands = read_tfx(sintel).strands
    write_hair_file(path, strands)
    read = read_hair_file(path).strands
    np.testing.assert_array_equal(read.points, strands.points)
    np.testing.assert_array_equal(read.offsets, strands.offsets)
    np.testing.assert_array_equal(read.radius, strands.radius)


def u32(place: int, value: int) -> bytes:
    return WHOLE[:place] + struct.pack("<I", value) + WHOLE[place + 4 :]


BAD_FILES = {
    "empty": (b"", "empty"),
    "another file": (b"# Wavefront OBJ\nv 0 0 0\n" * 20, "does not begin with HAIR"),
    "short header": (WHOLE[:60], "header, bytes 0 to 128"),
    "short segments": (WHOLE[:130], "segments, bytes 128 to 134"),
    "short points": (WHOLE[:-1], "points, bytes 134 to 242"),
    "no strands": (u32(4, 0), "no strands"),
    "no points": (u32(12, 1), "no strands"),
    "four billion strands": (u32(4, 0xFFFFFFFF), "past the end of the file"),
    "2^31 points": (u32(8, 1 << 31), "past the end of the file"),
    "fewer points": (u32(8, 8), "9 points together"),
    "default segments that lie": (
        packed(2, floats(POINTS), segments=0xFFFFFFFF),
        "12,884,901,888 points together",
    ),
    "arrays that are not there": (u32(12, 7), "thickness, bytes 242 to 278"),
    "unknown arrays": (u32(12, 3 | 1 << 20), "bits 0x100003"),
    "all NaN": (packed(3, SEGMENT_BLOCK, floats(POINTS * np.nan)), "3 with a point that is not"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_named_with_place_and_remedy(path: Path, name: str) -> None:
    content, expected = BAD_FILES[name]
    path.write_bytes(content)
    with pytest.raises(HairloomError) as caught:
        read_hair_file(path)
    assert expected in caught.value.problem
    assert caught.value.place == str(path)
    assert caught.value.remedy
