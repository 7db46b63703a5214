"""Texture files: every format and depth there and back, and files that are not pictures."""

from __future__ import annotations

import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.textures import texture_files
from hairloom.addon.exchange.textures.srgb import srgb_decoded, srgb_encoded
from hairloom.addon.exchange.textures.texture_files import DEPTHS, read_texture, write_texture

oiio = pytest.importorskip("OpenImageIO", reason="textures are read and written through it")

#: depth -> largest error of a value in [0, 1]
STEPS = {"uint8": 0.5 / 255, "uint16": 0.5 / 65535, "half": 2.0**-12, "float": 0.0}
FORMATS = [(suffix, depth) for suffix, depths in DEPTHS.items() for depth in depths]


def random_picture(channels: int) -> np.ndarray:
    """A picture in which any swap of rows or columns shows; in the first row alpha is 0."""
    image = np.random.default_rng(7).random((13, 9, channels)).astype(np.float32)
    if channels in (2, 4):
        image[0, :, -1] = 0.0
        image[1:, :, -1] = np.maximum(image[1:, :, -1], 0.2)
    return image


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize(("suffix", "depth"), FORMATS)
def test_values_come_back(suffix: str, depth: str, channels: int, tmp_path: Path) -> None:
    path, image = tmp_path / f"texture{suffix}", random_picture(channels)
    write_texture(path, image, is_color=False, depth=depth)
    found = read_texture(path, is_color=False)
    assert found.shape == image.shape and found.dtype == np.float32
    kept = np.ones(image.shape, bool)
    step = STEPS[depth]
    if suffix == ".exr" and channels in (2, 4):  # it holds colours times alpha
        kept[0, :, :-1] = False
        assert (found[0, :, :-1] == 0.0).all()
        step = 4.0 * step + 1e-6
    assert np.abs(found - image)[kept].max() <= step + 1e-7
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_colour_stays_where_alpha_is_zero(tmp_path: Path) -> None:
    """By default OpenImageIO would make it black."""
    image = np.full((4, 4, 4), 0.8, np.float32)
    image[..., 3] = 0.0
    for suffix, depth in FORMATS:
        if suffix != ".exr":
            write_texture(tmp_path / f"a{suffix}", image, is_color=True, depth=depth)
            found = read_texture(tmp_path / f"a{suffix}", is_color=True)
            np.testing.assert_allclose(found, image, atol=0.005)


def test_colours_are_srgb_in_integers_and_linear_in_floats(tmp_path: Path) -> None:
    image = np.full((2, 2, 3), 0.5, np.float32)
    for suffix, depth in FORMATS:
        path = tmp_path / f"c{suffix}"
        write_texture(path, image, is_color=True, depth=depth)
        stored = read_texture(path, is_color=False)
        expected = 0.7353570 if depth.startswith("uint") else 0.5
        np.testing.assert_allclose(stored, expected, atol=0.003)
        np.testing.assert_allclose(read_texture(path, is_color=True), 0.5, atol=0.003)


def test_row_zero_is_the_lowest(tmp_path: Path) -> None:
    image = np.zeros((3, 2), np.float32)
    image[0] = 1.0
    write_texture(tmp_path / "rows.png", image, is_color=False)
    top_down = oiio.ImageBuf(str(tmp_path / "rows.png")).get_pixels(oiio.FLOAT)
    assert top_down[:, 0, 0].tolist() == [0.0, 0.0, 1.0]
    assert read_texture(tmp_path / "rows.png", is_color=False)[..., 0].tolist() == image.tolist()


def test_the_srgb_curve() -> None:
    """Against values of IEC 61966-2-1, and a round trip."""
    linear = np.array([0.0, 0.0031308, 0.18, 0.5, 1.0])
    coded = np.array([0.0, 0.04045, 0.461356, 0.735357, 1.0])
    np.testing.assert_allclose(srgb_encoded(linear), coded, atol=1e-5)
    every = np.linspace(0.0, 1.0, 1001)
    np.testing.assert_allclose(srgb_decoded(srgb_encoded(every)), every, atol=1e-6)


def png_header(width: int, height: int) -> bytes:
    """A PNG that declares this size but has no pixels."""
    head = struct.pack(">II5B", width, height, 8, 0, 0, 0, 0)
    chunk = b"IHDR" + head
    return (
        b"\x89PNG\r\n\x1a\n"
        + struct.pack(">I", len(head))
        + chunk
        + struct.pack(">I", zlib.crc32(chunk))
    )


BAD = {
    "empty": b"",
    "garbage": bytes(np.random.default_rng(1).integers(0, 256, 4000, dtype=np.uint8)),
    "text": b"this is no picture\n" * 20,
    "too wide": png_header(20000, 2) + b"\0" * 50,
    "too many pixels": png_header(16000, 16000) + b"\0" * 50,
    "a billion pixels": png_header(1 << 30, 1 << 30) + b"\0" * 50,
}


@pytest.mark.parametrize("suffix", [".png", ".exr", ".tif", ".jpg", ".unknown"])
@pytest.mark.parametrize("kind", BAD)
def test_files_that_are_no_pictures_are_refused(kind: str, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(BAD[kind])
    with pytest.raises(HairloomError) as error:
        read_texture(path, is_color=True)
    assert error.value.place == str(path) and error.value.remedy
    assert "\n" not in str(error.value)


def test_missing_pictures_and_folders_are_refused(tmp_path: Path) -> None:
    for path, problem in ((tmp_path / "none.png", "no such file"), (tmp_path, "folder")):
        with pytest.raises(HairloomError, match=problem):
            read_texture(path, is_color=True)


@pytest.mark.parametrize(("suffix", "depth"), FORMATS)
def test_damaged_files_read_as_pictures_or_say_why(suffix: str, depth: str, tmp_path: Path) -> None:
    """A cut file always gives an error, changed bytes give a picture or an error."""
    random, path = np.random.default_rng(11), tmp_path / f"texture{suffix}"
    write_texture(path, random_picture(4), is_color=False, depth=depth)
    whole, errors = path.read_bytes(), 0
    for length in np.linspace(0, len(whole) * 3 // 4, 12).astype(int):
        path.write_bytes(whole[:length])
        with pytest.raises(HairloomError):
            read_texture(path, is_color=False)
    for reach in [80] * 20 + [len(whole)] * 20:
        spoiled = bytearray(whole)
        for place in random.integers(0, min(reach, len(whole)), 4):
            spoiled[place] = random.integers(256)
        path.write_bytes(spoiled)
        try:
            found = read_texture(path, is_color=False)
            assert found.ndim == 3 and found.size
        except HairloomError as error:
            errors += 1
            assert str(path) in str(error)
    assert errors > 5, "the damage must be seen"


def test_a_failed_write_is_reported_and_leaves_no_file(tmp_path: Path) -> None:
    image = random_picture(3)
    (tmp_path / "file").write_text("a file")
    for path, depth, problem in (
        (tmp_path / "a.jpg", None, "cannot be written as '.jpg'"),
        (tmp_path / "a.png", "float", "cannot store float"),
        (tmp_path / "file" / "a.png", None, "cannot be written"),
    ):
        with pytest.raises(HairloomError, match=problem):
            write_texture(path, image, is_color=True, depth=depth)
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_failed_write_keeps_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.png"
    write_texture(path, random_picture(3), is_color=True)
    before = path.read_bytes()
    monkeypatch.setattr(oiio.ImageOutput, "create", lambda _path: None)
    with pytest.raises(HairloomError, match="cannot be written"):
        write_texture(path, random_picture(1), is_color=True)
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(("suffix", "depth"), FORMATS)
@pytest.mark.parametrize("most_bytes", [0, 2000, 12000])
def test_a_full_disk_is_reported_and_keeps_the_old_file(
    suffix: str, depth: str, most_bytes: int, tmp_path: Path
) -> None:
    """Not all of OpenImageIO's writers report it."""
    resource = pytest.importorskip("resource", reason="limits are those of POSIX")
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")
    noise = np.random.default_rng(2).random((96, 96, 3)).astype(np.float32)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, hard))
    try:
        with pytest.raises(HairloomError, match="cannot be written"):
            write_texture(path, noise, is_color=True, depth=depth)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 1


def test_packed_textures_are_never_multiplied(tmp_path: Path) -> None:
    """EXR files do not treat the fourth channel as alpha; it is read back as written."""
    image = random_picture(4)
    for suffix, depth in FORMATS:
        path = tmp_path / f"p{suffix}"
        write_texture(path, image, is_color=False, depth=depth, is_packed=True)
        stored = oiio.ImageBuf(str(path), 0, 0, straight_spec()).get_pixels(oiio.FLOAT)[::-1]
        np.testing.assert_allclose(stored, image, atol=0.003)
        np.testing.assert_allclose(read_texture(path, is_color=False), image, atol=0.003)


def straight_spec() -> oiio.ImageSpec:
    """The configuration with which OpenImageIO returns values as they are stored."""
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    return config


def test_without_openimageio_there_is_a_plain_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    for call in (
        lambda: read_texture(tmp_path / "a.png", is_color=True),
        lambda: write_texture(tmp_path / "a.png", random_picture(3), is_color=True),
    ):
        with pytest.raises(HairloomError, match=r"OpenImageIO.*missing.*install"):
            call()
    assert not texture_files.has_openimageio()


@pytest.mark.parametrize(("suffix", "depth"), FORMATS)
def test_a_file_has_no_time(suffix: str, depth: str, tmp_path: Path) -> None:
    """The same pixels give the same bytes whenever they are written."""
    path = tmp_path / f"texture{suffix}"
    write_texture(path, random_picture(3), is_color=False, depth=depth)
    date = oiio.ImageInput.open(str(path)).spec().get_string_attribute("DateTime")
    assert date == ("" if suffix == ".png" else "1970:01:01 00:00:00")
