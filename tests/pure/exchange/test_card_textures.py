"""Packed textures as files: every preset in every format, names, and failing writes."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from full_disk import full_disk

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.textures import texture_files
from hairloom.addon.exchange.textures.card_textures import FORMATS, write_card_textures
from hairloom.addon.exchange.textures.mip_maps import level_sizes
from hairloom.addon.exchange.textures.texture_files import read_texture
from hairloom.addon.exchange.textures.texture_packing import MAP_MEANINGS, PRESETS, pack_textures

oiio = pytest.importorskip("OpenImageIO", reason="textures are read and written through it")
needs_compressor = pytest.mark.skipif(find_spec("etcpak") is None, reason="there is no etcpak")

SIZE = (48, 32)
#: halfway between two bytes, so that rounding to bytes does not matter
THRESHOLD = 152.5 / 255
THREE = ("color", "base", "normal", "tangent")
EACH_FORMAT = [
    pytest.param(each, marks=needs_compressor) if each == "dds" else each for each in FORMATS
]
#: largest error of an uncompressed value
STEPS = {"png": 0.51 / 255, "exr": 2.0**-11, "dds_plain": 0.51 / 255}


def smooth_maps() -> dict[str, np.ndarray]:
    """Maps that all vary differently and continue where alpha is 0, as in a bake."""
    x, y = np.linspace(0, 1, SIZE[1]), np.linspace(0, 1, SIZE[0])[:, None]
    maps = {}
    for index, name in enumerate(MAP_MEANINGS):
        waves = [0.5 + 0.4 * np.sin(2 * x + (1 + k) * y + index + k) for k in range(3)]
        maps[name] = np.stack(waves if name in THREE else waves[:1], axis=-1).astype(np.float32)
        maps[name] = maps[name] if name in THREE else maps[name][..., 0]
    maps["alpha"][:, :8] = 0.0
    return maps


@pytest.mark.parametrize("file_format", EACH_FORMAT)
@pytest.mark.parametrize("preset", PRESETS)
def test_texture_files_hold_the_packed_channels(
    preset: str, file_format: str, tmp_path: Path
) -> None:
    maps = smooth_maps()
    written = write_card_textures(
        tmp_path / "Ünder.lock v1.2", maps, preset, file_format=file_format, grid=AtlasGrid(2, 1)
    )
    expected = pack_textures(maps, preset)
    names = [f"Ünder.lock v1.2{each.suffix}{FORMATS[file_format]}" for each in expected]
    assert [each.path.name for each in written] == names
    assert sorted(os.listdir(tmp_path)) == sorted(names)
    for file, texture in zip(written, expected, strict=True):
        named = len(file.layout.channels)
        assert file.layout == replace(texture.layout, channels=texture.layout.channels[:named])
        is_coded = texture.layout.is_color and file_format != "exr"
        found = read_texture(file.path, is_color=is_coded)
        count = texture.pixels.shape[2]
        if file_format == "dds" and texture.layout.is_normal_map:
            count = 2
        assert named == count
        assert found.shape[:2] == SIZE and found.shape[2] >= count
        error = np.abs(found[..., :count] - texture.pixels[..., :count])
        step = STEPS.get(file_format, 0.15)
        # A step of sRGB is wider than one of linear values at the bright end
        assert error.max() <= step * (2.4 if is_coded else 1.0), file.path.name
        assert error.mean() <= 0.012


def test_fine_maps_have_sixteen_bits(tmp_path: Path) -> None:
    written = write_card_textures(tmp_path / "a", smooth_maps(), "hairloom")
    depths = {
        each.layout.suffix: str(oiio.ImageBuf(str(each.path)).spec().format) for each in written
    }
    assert {s for s, depth in depths.items() if depth == "uint16"} == {
        "_tangent", "_depth", "_along", "_strand_id", "_shift",
    }  # fmt: skip
    assert set(depths.values()) == {"uint8", "uint16"}


def test_dds_files_have_every_level_with_its_coverage(tmp_path: Path) -> None:
    maps, grid = smooth_maps(), AtlasGrid(2, 1)
    written = write_card_textures(
        tmp_path / "a", maps, "gltf", file_format="dds_plain", grid=grid, threshold=THRESHOLD
    )
    source = oiio.ImageInput.open(str(written[0].path))
    for level, (width, height) in enumerate(level_sizes(*SIZE[::-1])):
        spec = source.spec_dimensions(0, level)
        assert (spec.width, spec.height) == (width, height)
        if width * height < 32:
            break
        alpha = source.read_image(0, level, 3, 4, oiio.FLOAT)
        for tile in (slice(0, width // 2), slice(width // 2, width)):
            full = maps["alpha"][:, tile.start * SIZE[1] // width : tile.stop * SIZE[1] // width]
            passing = np.mean(alpha.reshape(height, width)[:, tile] >= THRESHOLD)
            assert abs(passing - np.mean(full >= THRESHOLD)) <= 1.01 / (height * width / 2), level
    source.close()


def test_the_background_never_shows_in_smaller_mip_levels(tmp_path: Path) -> None:
    """Also in files without an alpha channel."""
    alpha = np.zeros((32, 32), np.float32)
    alpha[:, 5::8] = 1.0
    base = np.zeros((32, 32, 3), np.float32)
    base[:, 5::8] = 1.0
    (*_, written) = write_card_textures(
        tmp_path / "a", {"alpha": alpha, "base": base}, "hairloom", file_format="dds_plain"
    )
    assert written.layout.suffix == "_base"
    source = oiio.ImageInput.open(str(written.path))
    for level in (3, 4, 5):
        assert source.read_image(0, level, 0, 3, oiio.FLOAT).min() == 1.0
    source.close()


def test_the_writer_can_be_another(tmp_path: Path) -> None:
    """Blender writes the textures where there is no OpenImageIO."""
    writes = []

    def write(path: Path, pixels: np.ndarray, **how: object) -> None:
        writes.append((path.name, pixels.shape[2], how))

    write_card_textures(tmp_path / "a", smooth_maps(), "unreal_compact", write=write)
    assert writes[0] == (
        "a_TangentCoordU.png", 4, {"is_color": False, "depth": "uint8", "is_packed": True},
    )  # fmt: skip
    assert [each[2]["is_color"] for each in writes] == [False, False, True, True]


def test_unknown_texture_formats_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(HairloomError, match=r"'ktx2'.*png, exr, dds"):
        write_card_textures(tmp_path / "a", smooth_maps(), "gltf", file_format="ktx2")


@needs_compressor
def test_without_the_compressor_other_formats_still_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "etcpak", None)
    with pytest.raises(HairloomError, match="etcpak"):
        write_card_textures(tmp_path / "a", smooth_maps(), "gltf", file_format="dds")
    assert not os.listdir(tmp_path)
    for file_format in ("png", "exr", "dds_plain"):
        assert len(write_card_textures(tmp_path / "a", smooth_maps(), "gltf",
                                       file_format=file_format)) == 5  # fmt: skip


@pytest.mark.parametrize("file_format", EACH_FORMAT)
def test_a_full_disk_leaves_the_old_files(file_format: str, tmp_path: Path) -> None:
    asset = tmp_path / "a"
    noise = np.random.default_rng(3).random((96, 96, 3)).astype(np.float32)
    maps = {"color": noise, "alpha": noise[..., 0]}
    (written,) = write_card_textures(asset, maps, "gltf", file_format=file_format)[:1]
    before, names = written.path.read_bytes(), sorted(os.listdir(tmp_path))
    assert len(before) > 8000
    with full_disk(4000), pytest.raises(HairloomError, match="cannot be written"):
        write_card_textures(asset, {"color": noise, "alpha": noise[..., 1]}, "gltf",
                            file_format=file_format)  # fmt: skip
    assert written.path.read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == names


@pytest.mark.parametrize("file_format", EACH_FORMAT)
def test_a_folder_without_write_permission_is_refused(file_format: str, tmp_path: Path) -> None:
    folder = tmp_path / "closed"
    folder.mkdir()
    (folder / "a_baseColor.png").write_bytes(b"old")
    folder.chmod(0o555)
    if os.access(folder, os.W_OK):  # root may write anywhere: a file in place of a folder
        folder = folder / "a_baseColor.png"
    with pytest.raises(HairloomError, match="cannot be written"):
        write_card_textures(folder / "a", smooth_maps(), "gltf", file_format=file_format)
    assert (tmp_path / "closed" / "a_baseColor.png").read_bytes() == b"old"
    (tmp_path / "closed").chmod(0o755)


def test_a_writer_that_fails_midway_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a_along.png"
    maps = {"along": smooth_maps()["along"]}
    write_card_textures(tmp_path / "a", maps, "hairloom")
    before = path.read_bytes()

    def dies(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hairloom.addon.exchange.files.atomic.os.replace", dies)
    for file_format in ("png", "exr", "dds_plain"):
        with pytest.raises(HairloomError, match="No space left"):
            write_card_textures(tmp_path / "a", maps, "hairloom", file_format=file_format)
    assert path.read_bytes() == before and os.listdir(tmp_path) == [path.name]
    assert texture_files.has_openimageio()
