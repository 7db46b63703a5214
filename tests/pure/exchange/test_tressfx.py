"""TressFX files against bytes packed by hand from the published layout, and against real grooms."""

from __future__ import annotations

import struct
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files.binary_file import BinaryFile
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_writing import write_strands
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.exchange.tressfx_layout import TressfxFile
from hairloom.addon.strands import StrandSet

pytestmark = pytest.mark.portable

STRANDS, VERTICES = 3, 4


def positions() -> np.ndarray:
    """Three strands of four points in a file's Y-up axes."""
    random = np.random.default_rng(4)
    return random.uniform(-0.2, 0.2, (STRANDS, VERTICES, 3)).astype(np.float32)


def version_4(
    points: np.ndarray,
    *,
    uv: np.ndarray | None = None,
    thickness: np.ndarray | None = None,
    color: np.ndarray | None = None,
    vertex_uv: np.ndarray | None = None,
    version: float = 4.0,
) -> bytes:
    """A version 4 file, packed field by field: 160 bytes of header, then the blocks."""
    strands, vertices = points.shape[:2]
    body = b""
    offsets = {"uv": 0, "vertex_uv": 0, "thickness": 0, "color": 0}
    for strand in points:
        for index, point in enumerate(strand):
            body += struct.pack("<4f", *point, 0.0 if index == 0 else 1.0)
    blocks = {"uv": uv, "vertex_uv": vertex_uv, "thickness": thickness, "color": color}
    for name, values in blocks.items():
        if values is not None:
            offsets[name] = 160 + len(body)
            body += struct.pack(f"<{values.size}f", *values.ravel())
    header = struct.pack("<f", version)
    header += struct.pack("<7I", strands, vertices, 160, *offsets.values())
    return header.ljust(160, b"\0") + body


def version_3(points: np.ndarray, uv: np.ndarray) -> bytes:
    """A version 3 file: 296 bytes of header, float3 positions, strand UVs."""
    strands, vertices = points.shape[:2]
    body = struct.pack(f"<{points.size}f", *points.ravel())
    header = struct.pack("<f4I", 3.0, strands, vertices, 2, 1).ljust(144, b"\0")
    header += struct.pack("<6I", 296, 0, 296 + len(body), 0, 0, 0)
    return header.ljust(296, b"\0") + body + struct.pack(f"<{uv.size}f", *uv.ravel())


def z_up(points: np.ndarray) -> np.ndarray:
    return np.array([[(x, -z, y) for x, y, z in strand] for strand in points.tolist()], np.float32)


def from_top(uv: np.ndarray) -> np.ndarray:
    """UVs with v as in Direct3D, from the top of the picture."""
    return uv * [1.0, -1.0] + [0.0, 1.0]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "groom.tfx"
    path.write_bytes(version_4(positions()))
    return path


def test_version_4_is_read_as_packed(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    uv = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], np.float32)
    thickness = np.array([3e-5, 4e-5, 5e-5], np.float32)
    path.write_bytes(version_4(positions(), uv=uv, thickness=thickness))
    groom = read_tfx(path)
    assert (groom.version, groom.dropped, groom.source) == ("4", {}, path)
    np.testing.assert_array_equal(groom.strands.grid, z_up(positions()))
    np.testing.assert_allclose(groom.strands.root_uv, from_top(uv))
    np.testing.assert_array_equal(groom.strands.radius, np.repeat(thickness, VERTICES))


def test_version_3_is_read_as_packed(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    uv = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], np.float32)
    path.write_bytes(version_3(positions(), uv))
    groom = read_tfx(path)
    assert groom.version == "3"
    np.testing.assert_array_equal(groom.strands.grid, z_up(positions()))
    np.testing.assert_allclose(groom.strands.root_uv, from_top(uv))
    # its header declares two follow hairs and that both ends are held
    assert groom.follow_count == 2 and "2 follow hairs" in groom.notes[0]
    assert groom.is_held.all()


def test_colours_vertex_uvs_and_held_vertices_of_kept_strands(tmp_path: Path) -> None:
    random, path = np.random.default_rng(1), tmp_path / "groom.tfx"
    color = random.random((STRANDS, VERTICES, 4)).astype(np.float32)
    vertex_uv = random.random((STRANDS, VERTICES, 2)).astype(np.float32)
    points = positions()
    points[1, 0] = np.inf
    color[0, 1, 2], vertex_uv[0, 0, 0] = np.nan, np.inf
    path.write_bytes(version_4(points, color=color, vertex_uv=vertex_uv))
    groom = read_tfx(path)
    color[0, :, :3], vertex_uv[0, 0, 0] = np.nan, 0.0  # a colour all along or none
    np.testing.assert_array_equal(groom.groom.color, color[[0, 2], :, :3].reshape(-1, 3))
    np.testing.assert_array_equal(groom.vertex_uv, vertex_uv[[0, 2]].reshape(-1, 2))
    np.testing.assert_array_equal(groom.is_held, [True, False, False, False] * 2)
    assert "alpha of its colours is not kept; 12 of 12 are not opaque" in groom.notes[0]


def test_axis_and_scale(file: Path) -> None:
    strands = read_tfx(file, up="Z", scale=0.01).strands
    np.testing.assert_allclose(strands.grid, positions() * np.float32(0.01), rtol=1e-6)
    with pytest.raises(HairloomError, match="Use Y or Z"):
        read_tfx(file, up="X")


@pytest.mark.parametrize("value", [1.0, 0.0, -1.0, np.nan, np.inf])
def test_thickness_that_is_no_radius_falls_back(tmp_path: Path, value: float) -> None:
    path = tmp_path / "groom.tfx"
    path.write_bytes(version_4(positions(), thickness=np.array([4e-5, value, 5e-5])))
    radius = read_tfx(path).strands.radius.reshape(STRANDS, VERTICES)
    np.testing.assert_allclose(radius[:, 0], [4e-5, 5e-5, 5e-5], rtol=1e-6)


def test_bad_strands_are_dropped_counted_and_named(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    points = positions()
    points[0, 2, 1] = np.nan
    points[1] = points[1, 0]
    path.write_bytes(version_4(points))
    groom = read_tfx(path)
    assert groom.dropped == {"a point that is not finite": 1, "no length": 1}
    np.testing.assert_array_equal(groom.strands.grid, z_up(points)[2:])


@pytest.mark.parametrize(
    ("name", "strands", "vertices"),
    [("front_top", 876, 16), ("side", 3066, 16), ("back", 517, 16), ("tail", 474, 16)],
)
def test_ponytail(shared_data: Path, name: str, strands: int, vertices: int) -> None:
    groom = read_tfx(shared_data / "tressfx_ponytail" / f"{name}.tfx")
    assert groom.strands.grid.shape == (strands, vertices, 3)
    assert (groom.version, groom.dropped) == ("3", {})


def test_sintel(shared_data: Path) -> None:
    groom = read_tfx(shared_data / "sintel" / "SintelHairOriginal-sintel_hair.16points.tfx")
    assert groom.strands.grid.shape == (11_400, 16, 3)
    assert groom.dropped == {}
    low, high = groom.strands.bounds()
    assert 1.3 < low[2] < high[2] < 1.7  # the hair of a standing human, Z up


def grown(strand_count: int, cv_count: int, **more: np.ndarray) -> StrandSet:
    random = np.random.default_rng(strand_count)
    return StrandSet(
        points=random.uniform(-1.0, 1.0, (strand_count * cv_count, 3)),
        offsets=np.arange(strand_count + 1) * cv_count,
        radius=np.repeat(random.uniform(1e-5, 1e-4, strand_count), cv_count),
        group=np.zeros(strand_count, np.int32),
        **more,
    )


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_round_trip_is_exact(tmp_path: Path, up: str) -> None:
    path = tmp_path / "groom.tfx"
    strands = grown(50, 16, root_uv=np.random.default_rng(0).random((50, 2)))
    write_tfx(path, strands, up=up)
    groom = read_tfx(path, up=up)
    for name in ("points", "offsets", "radius"):
        np.testing.assert_array_equal(getattr(groom.strands, name), getattr(strands, name))
    np.testing.assert_allclose(groom.strands.root_uv, strands.root_uv, atol=1e-7)
    written = TressfxFile(path).strand_values("strand_uv", 2)
    assert strands.root_uv is not None and written is not None
    np.testing.assert_allclose(written, from_top(strands.root_uv), atol=1e-7)


def test_a_metre_at_a_known_place_in_units_of_the_file(tmp_path: Path) -> None:
    """Y up and in centimetres, as in TressFX's samples; read back with struct alone."""
    path = tmp_path / "groom.tfx"
    points = [[0.1, 0.2, z] for z in np.linspace(1.0, 2.0, 4)]
    write_tfx(path, StrandSet(points, [0, 4], np.full(4, 5e-5), [0]), scale=0.01)
    content = path.read_bytes()
    root, tip = struct.unpack_from("<3f", content, 160), struct.unpack_from("<3f", content, 208)
    np.testing.assert_allclose(root, [10.0, 100.0, -20.0], rtol=1e-6)
    np.testing.assert_allclose(tip, [10.0, 200.0, -20.0], rtol=1e-6)
    (thickness,) = struct.unpack_from("<I", content, 24)
    np.testing.assert_allclose(struct.unpack_from("<f", content, thickness), 5e-3, rtol=1e-6)


def test_colours_go_through_exactly_and_are_resampled_with_the_points(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    strands = grown(7, 8)
    color = np.random.default_rng(0).random((56, 3)).astype(np.float32)
    assert write_tfx(path, replace(strands, color=color)) == ()
    np.testing.assert_array_equal(read_tfx(path).groom.color, color)
    # colours that equal positions still do
    places = np.abs(strands.points)
    straight = strands.with_points(np.abs(np.repeat(strands.roots, 8, axis=0)) + places * 0.0)
    straight = straight.with_points(straight.points + np.tile(np.arange(8.0), 7)[:, None])
    write_tfx(path, replace(straight, color=straight.points), vertex_count=16)
    read = read_tfx(path, up="Y")
    np.testing.assert_allclose(read.groom.color, read.strands.points, rtol=1e-5)


def test_a_multiple_of_64_repeats_the_last_strand(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    strands = grown(70, 4, root_uv=np.random.default_rng(0).random((70, 2)))
    groom = Groom(replace(strands, color=np.random.default_rng(1).random((280, 3))))
    notes = write_tfx(path, groom, multiple_of_64=True)
    assert "repeated 58 times" in notes[-1]
    read = read_tfx(path)
    last = np.minimum(np.arange(128), 69)
    np.testing.assert_array_equal(read.strands.grid, strands.grid[last])
    for name in ("radius", "root_uv"):
        expected = getattr(strands.take(last), name)
        np.testing.assert_allclose(getattr(read.strands, name), expected, atol=1e-7)
    np.testing.assert_array_equal(read.groom.color, groom.take(last).color)
    assert write_tfx(path, grown(64, 4), multiple_of_64=True) == ()
    assert read_tfx(path).strands.strand_count == 64


def test_held_vertices_and_vertex_uvs(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    write_tfx(path, grown(4, 8), held_count=2, vertex_uv=True)
    read = read_tfx(path)
    np.testing.assert_array_equal(read.is_held.reshape(4, 8), [[True] * 2 + [False] * 6] * 4)
    assert read.vertex_uv is not None
    uv = read.vertex_uv.reshape(4, 8, 2)
    np.testing.assert_allclose(uv[:, 0, 0], [0.125, 0.375, 0.625, 0.875])
    np.testing.assert_allclose(uv[2, :, 1], np.linspace(0, 1, 8), rtol=1e-6)


def test_blocks_begin_at_multiples_of_eight_bytes(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    strands = grown(5, 4, root_uv=np.zeros((5, 2)))
    write_tfx(path, replace(strands, color=np.zeros((20, 3))), vertex_uv=True)
    offsets = struct.unpack_from("<5I", path.read_bytes(), 12)
    assert all(offsets) and not any(offset % 8 for offset in offsets)


@pytest.mark.parametrize("parts", ["strands", "guides", "both"])
def test_guides_or_strands_or_both(tmp_path: Path, parts: str) -> None:
    path, groom = tmp_path / "groom.tfx", Groom(grown(6, 4), is_guide=np.arange(6) < 2)
    write_tfx(path, groom, parts=parts)
    expected = {"strands": groom.without_guides(), "guides": groom.guides(), "both": groom}[parts]
    np.testing.assert_array_equal(read_tfx(path).strands.points, expected.strands.points)


def test_lost_attributes_are_reported(tmp_path: Path) -> None:
    strands = grown(3, 90)
    radius = np.linspace(1e-4, 1e-5, strands.point_count)
    strands = StrandSet(strands.points, strands.offsets, radius, np.arange(3))
    notes = " ".join(write_tfx(tmp_path / "x.tfx", Groom(strands, strand_id=np.arange(3))))
    for lost in ("90 points were resampled to 64 (3 of 3)", "no groups", "tapers", "no strand IDs"):
        assert lost in notes


def test_a_file_for_each_group(tmp_path: Path) -> None:
    strands = grown(12, 4)
    strands = StrandSet(strands.points, strands.offsets, strands.radius, np.arange(12) % 3)
    names = {0: "front/top", 1: "Side", 2: "side"}
    groom = Groom(strands, group_names=names)
    output = StrandExportSettings(by_group=True, up="Z")
    written = write_strands(tmp_path / "hair.tfx", groom, output)
    files, notes = written.files, written.notes
    assert sorted(tmp_path.iterdir()) == sorted(files)
    assert notes == ()
    for group, name in enumerate(("front_top", "Side_1", "side_2")):
        read = read_tfx(tmp_path / f"hair_{name}.tfx", up="Z").strands
        np.testing.assert_array_equal(read.grid, strands.grid[group::3])
    one = write_strands(tmp_path / "one" / "hair.tfx", Groom(grown(3, 4)), output).files
    assert one == (tmp_path / "one" / "hair.tfx",) and one[0].is_file()


REAL = ("tressfx_ponytail/front_top", "tressfx_ponytail/side", "tressfx_ponytail/back",
        "tressfx_ponytail/tail", "sintel/SintelHairOriginal-sintel_hair.16points")  # fmt: skip


@pytest.mark.parametrize("name", REAL)
def test_real_files_read_written_and_read_again(
    shared_data: Path, tmp_path: Path, name: str
) -> None:
    path = tmp_path / "groom.tfx"
    first = read_tfx(shared_data / f"{name}.tfx")
    assert write_tfx(path, first.groom) == ()
    second = read_tfx(path)
    assert (second.version, second.dropped) == ("4", {})
    for field in ("points", "offsets", "radius"):
        a, b = getattr(first.strands, field), getattr(second.strands, field)
        np.testing.assert_array_equal(a, b)
    if first.strands.root_uv is not None:
        np.testing.assert_allclose(second.strands.root_uv, first.strands.root_uv, atol=1e-7)
    again = tmp_path / "again.tfx"
    write_tfx(again, second.groom)
    assert again.read_bytes() == path.read_bytes()


def test_sintels_positions_are_written_bit_for_bit(shared_data: Path, tmp_path: Path) -> None:
    original, path = shared_data / f"{REAL[-1]}.tfx", tmp_path / "groom.tfx"
    write_tfx(path, read_tfx(original).strands)
    expected = np.fromfile(original, "<f4", offset=160)
    np.testing.assert_array_equal(np.fromfile(path, "<f4", len(expected), offset=160), expected)


def test_written_file_holds_what_the_layout_says(tmp_path: Path) -> None:
    """Read back with struct alone."""
    path = tmp_path / "groom.tfx"
    strands = grown(5, 8)
    write_tfx(path, strands)
    content = path.read_bytes()
    version, count, vertices, at, uv, vertex_uv, thickness, color = struct.unpack_from(
        "<f7I", content
    )
    assert (version, count, vertices, at, uv, vertex_uv, color) == (4.0, 5, 8, 160, 0, 0, 0)
    floats = np.array(struct.unpack_from("<160f", content, at)).reshape(5, 8, 4)
    np.testing.assert_array_equal(floats[:, 0, 3], 0.0)
    np.testing.assert_array_equal(floats[:, 1:, 3], 1.0)
    np.testing.assert_array_equal(z_up(floats[..., :3]), strands.grid)
    assert struct.unpack_from("<5f", content, thickness) == tuple(strands.radius[::8])
    assert len(content) == thickness + 5 * 4


@pytest.mark.parametrize(("cv_count", "expected"), [(2, 4), (4, 4), (9, 16), (64, 64), (70, 64)])
def test_vertex_count_is_a_power_of_two(tmp_path: Path, cv_count: int, expected: int) -> None:
    path = tmp_path / "groom.tfx"
    strands = grown(6, cv_count)
    write_tfx(path, strands)
    grid = read_tfx(path).strands.grid
    assert grid.shape == (6, expected, 3)
    np.testing.assert_array_equal(grid[:, [0, -1]], strands.grid[:, [0, -1]])


def test_writing_nothing_or_an_odd_count_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "groom.tfx"
    with pytest.raises(HairloomError, match="no strands"):
        write_tfx(path, grown(3, 4).take(np.array([], np.int64)))
    with pytest.raises(HairloomError, match="12 vertices"):
        write_tfx(path, grown(3, 4), vertex_count=12)
    assert not path.exists()


def patched(offset: int, value: bytes) -> bytes:
    content = bytearray(version_4(positions(), thickness=np.full(STRANDS, 4e-5)))
    content[offset : offset + len(value)] = value
    return bytes(content)


def u32(value: int) -> bytes:
    return struct.pack("<I", value)


def f32(value: float) -> bytes:
    return struct.pack("<f", value)


WHOLE = patched(0, b"")
BAD_FILES = {
    "empty": (b"", "empty"),
    "three bytes": (b"abc", "version, bytes 0 to 4"),
    "short header": (WHOLE[:100], "header, bytes 0 to 160"),
    "short positions": (WHOLE[:200], "positions, bytes 160 to 352"),
    "short thickness": (WHOLE[:-1], "thickness, bytes 352 to 364"),
    "version 2": (patched(0, f32(2.0)), "byte 0, reads as 2"),
    "version 5": (patched(0, f32(5.0)), "byte 0, reads as 5"),
    "version NaN": (patched(0, f32(float("nan"))), "byte 0, reads as nan"),
    "version 3 in a version 4 file": (patched(0, f32(3.0)), "positions would start at byte"),
    "text": (b"# Wavefront OBJ\nv 0 0 0\n" * 20, "not a TressFX 3 or 4 file"),
    "no strands": (patched(4, u32(0)), "no strands (byte 4)"),
    "no vertices": (patched(8, u32(0)), "no vertices a strand (byte 8)"),
    "one vertex": (patched(8, u32(1)), "fewer than two points"),
    "four billion strands": (patched(4, u32(0xFFFFFFFF)), "past the end of the file"),
    "four billion vertices": (patched(8, u32(0xFFFFFFFF)), "past the end of the file"),
    "positions outside": (patched(12, u32(1_000_000)), "positions, bytes 1,000,000 to"),
    "positions in the header": (patched(12, u32(8)), "inside the header"),
    "thickness outside": (patched(24, u32(0xFFFFFF00)), "thickness, bytes"),
    "strand UVs outside": (patched(16, u32(360)), "strand_uv, bytes 360"),
    "all NaN": (version_4(positions() * np.nan), "3 with a point that is not finite"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_named_with_place_and_remedy(tmp_path: Path, name: str) -> None:
    content, expected = BAD_FILES[name]
    path = tmp_path / "groom.tfx"
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(HairloomError) as caught:
        read_tfx(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert expected in caught.value.problem
    assert caught.value.place == str(path)
    assert caught.value.remedy
    assert peak < 1_000_000


def test_folder_and_missing_file(tmp_path: Path) -> None:
    with pytest.raises(HairloomError, match="folder"):
        read_tfx(tmp_path)
    with pytest.raises(HairloomError, match="cannot be read"):
        read_tfx(tmp_path / "missing.tfx")


def test_a_file_that_shrinks_while_it_is_read_is_a_message(tmp_path: Path) -> None:
    path = tmp_path / "hair.tfx"
    path.write_bytes(bytes(1000))
    file = BinaryFile(path)
    path.write_bytes(bytes(500))
    with pytest.raises(HairloomError, match="changed while it was read"):
        file.array("points", 0, "<f4", 200)
