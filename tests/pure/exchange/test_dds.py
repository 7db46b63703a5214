"""DDS files: headers against the specification, and all levels as OpenImageIO reads them."""

from __future__ import annotations

import struct
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from mip_chains import mip_chain

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.textures import dds
from hairloom.addon.exchange.textures.dds import write_dds
from hairloom.addon.exchange.textures.mip_maps import level_sizes
from hairloom.addon.exchange.textures.srgb import srgb_decoded

oiio = pytest.importorskip("OpenImageIO", reason="DDS files are read through it")
needs_compressor = pytest.mark.skipif(find_spec("etcpak") is None, reason="there is no etcpak")

#: DXGI_FORMAT values of dxgiformat.h
RGBA8, RGBA8_SRGB, BC4, BC5, BC7, BC7_SRGB = 28, 29, 80, 83, 98, 99
#: bytes per block of 4 x 4 texels
BLOCK = {BC4: 8, BC5: 16, BC7: 16, BC7_SRGB: 16}


def smooth_picture(width: int, height: int, channels: int) -> np.ndarray:
    """A picture with correlated channels, as in photographs, and without equal rows."""
    x, y = np.linspace(0, 1, width), np.linspace(0, 1, height)[:, None]
    channel = [0.5 + 0.45 * np.sin(3.0 * x + (2.0 + k) * y + k) for k in range(channels)]
    return np.stack(np.broadcast_arrays(*channel), axis=-1).astype(np.float32)


def levels_of(width: int, height: int, channels: int) -> list[np.ndarray]:
    return mip_chain(smooth_picture(width, height, channels))


def read_levels(path: Path) -> list[np.ndarray]:
    """All levels as decoded by OpenImageIO, which has its own decoder, row 0 at the bottom."""
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), config)
    assert source is not None, oiio.geterror()
    levels = []
    while source.seek_subimage(0, len(levels)):
        level = len(levels)
        spec = source.spec_dimensions(0, level)
        pixels = source.read_image(0, level, 0, spec.nchannels, oiio.FLOAT)
        levels.append(pixels.reshape(spec.height, spec.width, spec.nchannels)[::-1])
    source.close()
    return levels


def header_of(path: Path) -> dict[str, int | bytes]:
    """The fields of DDS_HEADER and DDS_HEADER_DXT10, by their documented layout, little-endian."""
    data = path.read_bytes()[:148]
    names = ["magic", "size", "flags", "height", "width", "pitch", "depth", "levels"]
    found = dict(zip(names, struct.unpack_from("<4s7I", data), strict=True))
    form = struct.unpack_from("<2I4s5I", data, 76)
    found |= dict(zip(("format_size", "format_flags", "letters"), form, strict=False))
    found |= dict(
        zip(("caps", "caps2", "caps3", "caps4"), struct.unpack_from("<4I", data, 108), strict=True)
    )
    tenth = ("dxgi", "dimension", "misc", "array_size", "alpha_mode")
    return found | dict(zip(tenth, struct.unpack_from("<5I", data, 128), strict=True))


CASES = [
    (1, False, False, BC4, RGBA8, 3),
    (2, False, False, BC5, RGBA8, 3),
    (3, False, False, BC7, RGBA8, 3),
    (3, True, False, BC7_SRGB, RGBA8_SRGB, 3),
    (4, True, True, BC7_SRGB, RGBA8_SRGB, 1),
    (4, False, False, BC7, RGBA8, 4),
]


@pytest.mark.parametrize(
    "is_compressed", [pytest.param(True, marks=needs_compressor), pytest.param(False)]
)
@pytest.mark.parametrize(
    ("channels", "is_color", "has_coverage", "block_format", "plain_format", "alpha_mode"), CASES
)
@pytest.mark.parametrize(("width", "height"), [(64, 32), (37, 21)])
def test_header_and_size(
    width: int,
    height: int,
    channels: int,
    is_color: bool,
    has_coverage: bool,
    block_format: int,
    plain_format: int,
    alpha_mode: int,
    is_compressed: bool,
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.dds"
    write_dds(
        path,
        levels_of(width, height, channels),
        is_color=is_color,
        has_coverage=has_coverage,
        is_compressed=is_compressed,
    )
    header, form = header_of(path), block_format if is_compressed else plain_format
    sizes = level_sizes(width, height)
    bytes_of_levels = [
        -(-wide // 4) * -(-high // 4) * BLOCK[form] if is_compressed else wide * high * 4
        for wide, high in sizes
    ]
    assert header["magic"] == b"DDS " and header["size"] == 124
    assert (header["width"], header["height"]) == (width, height)
    assert header["levels"] == len(sizes)
    # CAPS, HEIGHT, WIDTH, PIXELFORMAT, MIPMAPCOUNT, and LINEARSIZE or PITCH
    assert header["flags"] == 0x1 | 0x2 | 0x4 | 0x1000 | 0x20000 | (
        0x80000 if is_compressed else 0x8
    )
    assert header["pitch"] == (bytes_of_levels[0] if is_compressed else width * 4)
    assert (header["format_size"], header["format_flags"]) == (32, 0x4)
    assert header["letters"] == b"DX10"
    assert header["caps"] == 0x1000 | 0x8 | 0x400000  # TEXTURE, COMPLEX, MIPMAP
    assert header["caps2"] == header["caps3"] == header["caps4"] == 0
    assert header["dxgi"] == form and header["dimension"] == 3 and header["array_size"] == 1
    assert header["misc"] == 0 and header["alpha_mode"] == alpha_mode
    assert path.stat().st_size == 148 + sum(bytes_of_levels)


def block_ranges(level: np.ndarray) -> np.ndarray:
    """(height, width, channels): the range of each channel in a texel's block [1 / 255]."""
    height, width = level.shape[:2]
    full = np.pad(level, ((0, -height % 4), (0, -width % 4), (0, 0)), mode="edge")
    blocks = full.reshape(full.shape[0] // 4, 4, full.shape[1] // 4, 4, -1)
    span = 255.0 * (blocks.max(axis=(1, 3)) - blocks.min(axis=(1, 3)))
    return np.repeat(np.repeat(span, 4, axis=0), 4, axis=1)[:height, :width]


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize(
    "is_compressed", [pytest.param(True, marks=needs_compressor), pytest.param(False)]
)
@pytest.mark.parametrize(("width", "height"), [(64, 64), (48, 20)])
def test_every_level_comes_back(
    width: int, height: int, is_compressed: bool, channels: int, tmp_path: Path
) -> None:
    """BC4 and BC5 have 8 values over a block's range, so errors are at most a 14th of it.

    More is added by rounding, ours and the reader's. BC7 fits lines through colours; its limit for
    channels that vary independently is empirical.
    """
    path, levels = tmp_path / "a.dds", levels_of(width, height, channels)
    write_dds(path, levels, is_compressed=is_compressed)
    found = read_levels(path)
    assert [each.shape[:2] for each in found] == [each.shape[:2] for each in levels]
    for level, back in zip(levels, found, strict=True):
        error = 255.0 * np.abs(back[..., :channels] - level)
        span = block_ranges(level[::-1])[::-1]  # blocks begin at the top
        if not is_compressed:
            assert error.max() <= 0.51
        elif channels <= 2:
            assert (error <= span / 14.0 + 1.6).all(), level.shape
        else:
            assert (error <= 0.5 * span.max(axis=-1, keepdims=True) + 3.0).all(), level.shape
            assert error.mean() <= 0.12 * span.mean() + 1.0, level.shape
        if channels == 3:
            assert (back[..., 3:] >= 0.99).all()


@needs_compressor
def test_colours_are_stored_as_srgb_and_alpha_as_it_is(tmp_path: Path) -> None:
    """Colours are kept also where alpha is 0."""
    image = np.zeros((16, 16, 4), np.float32) + [0.2, 0.5, 0.05, 0.25]
    image[:8, :, 3] = 0.0
    for is_compressed in (True, False):
        write_dds(
            tmp_path / "c.dds",
            mip_chain(image.astype(np.float32)),
            is_color=True,
            has_coverage=True,
            is_compressed=is_compressed,
        )
        full = read_levels(tmp_path / "c.dds")[0]
        np.testing.assert_allclose(srgb_decoded(full[..., :3]), image[..., :3], atol=0.01)
        np.testing.assert_allclose(full[..., 3], image[..., 3], atol=0.01)


@needs_compressor
def test_normal_maps_keep_x_and_y_in_bc5(tmp_path: Path) -> None:
    """An engine computes z from them. Uncompressed files keep all three."""
    vectors = np.random.default_rng(2).normal(size=(8, 8, 3)) * [0.3, 0.3, 0] + [0, 0, 1]
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    vectors = np.repeat(np.repeat(vectors, 4, axis=0), 4, axis=1)
    coded = (0.5 * vectors + 0.5).astype(np.float32)
    path = tmp_path / "n.dds"
    write_dds(path, [coded], is_normal_map=True)
    assert header_of(path)["dxgi"] == BC5
    xy = 2.0 * read_levels(path)[0][..., :2] - 1.0
    z = np.sqrt(1.0 - (xy**2).sum(axis=-1))
    np.testing.assert_allclose(np.dstack([xy, z]), vectors, atol=0.02)
    write_dds(path, [coded], is_normal_map=True, is_compressed=False)
    assert header_of(path)["dxgi"] == RGBA8
    np.testing.assert_allclose(read_levels(path)[0][..., :3], coded, atol=0.003)


@needs_compressor
def test_hair_survives_compression(tmp_path: Path) -> None:
    """Single strands before nothing, the hardest case of cards: errors of alpha, and of colours
    where alpha is high."""
    random = np.random.default_rng(9)
    alpha = np.zeros((128, 128), np.float32)
    for middle in random.uniform(4, 124, 20):
        across = np.abs(np.arange(128) + 0.5 - middle - 3 * np.sin(np.arange(128)[:, None] / 20))
        alpha = np.maximum(alpha, np.clip(1.5 - across, 0.0, 1.0)).astype(np.float32)
    base = 0.2 + 0.3 * smooth_picture(128, 128, 3)
    path = tmp_path / "h.dds"
    image = np.dstack([base, alpha]).astype(np.float32)
    write_dds(path, [image], is_color=True, has_coverage=True)
    back = read_levels(path)[0]
    assert np.abs(back[..., 3] - alpha).mean() < 0.01
    assert np.mean((back[..., 3] >= 0.5) == (alpha >= 0.5)) > 0.99
    seen = alpha > 0.5
    assert np.abs(srgb_decoded(back[..., :3]) - base)[seen].mean() < 0.02


def test_without_a_compressor_there_is_a_plain_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "etcpak", None)
    path = tmp_path / "a.dds"
    with pytest.raises(HairloomError, match=r"etcpak.*cannot be loaded.*uncompressed DDS"):
        write_dds(path, levels_of(8, 8, 4))
    assert not path.exists()
    write_dds(path, levels_of(8, 8, 4), is_compressed=False)
    assert len(read_levels(path)) == 4


def test_too_large_and_unwritable(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("a file")
    with pytest.raises(HairloomError, match="cannot be written"):
        write_dds(tmp_path / "file" / "a.dds", levels_of(4, 4, 1), is_compressed=False)
    huge = np.broadcast_to(np.float32(0), (2, 20000, 1))
    with pytest.raises(HairloomError, match="too many"):
        write_dds(tmp_path / "a.dds", [huge], is_compressed=False)


@needs_compressor
def test_a_compressor_that_fails_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import etcpak

    path = tmp_path / "a.dds"
    path.write_bytes(b"old")

    def fails(*_arguments: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr(etcpak, "compress_bc7", fails)
    with pytest.raises(MemoryError):
        write_dds(path, levels_of(8, 8, 3))
    assert path.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 1


def test_the_module_names_every_format_once() -> None:
    assert dds._COMPRESSED == {1: BC4, 2: BC5, 3: BC7, 4: BC7}
    assert dds._PLAIN == RGBA8
