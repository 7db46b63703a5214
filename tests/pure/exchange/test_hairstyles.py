"""Hairstyle files: they are read as written, and damage is a clear error."""

import json
import pickle
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.hairstyles import (
    Hairstyle,
    NodeModifier,
    read_hairstyle,
    write_hairstyle,
)
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.strands.rooted_shapes import RootedShapes

RANDOM = np.random.default_rng(3)


def style(length: float = 0.3) -> Hairstyle:
    counts = np.array([2, 7, 4], np.int32)
    shape = RANDOM.uniform(-length, length, (int(counts.sum()), 3)).astype(np.float32)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    shape[offsets[:-1]] = 0.0
    uv, group = RANDOM.random((3, 2), np.float32), np.array([0, 2, 1], np.int32)
    return Hairstyle(
        title="Test",
        guides=RootedShapes(uv, offsets, shape, group),
        source="a test",
        order=7,
        masks={"children": "scalp"},
        modifiers=(NodeModifier("Clump Hair Curves", {"Factor": 0.5, "Seed": 3, "Fast": True}),),
        presets=("looks/brown",),
        settings={"children": {"method": "multi", "clump": 0.25}},
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    written = tmp_path / "test.json"
    write_hairstyle(written, style())
    return written


def test_a_style_comes_back_to_a_hundredth_of_a_millimetre(tmp_path: Path) -> None:
    one, path = style(), tmp_path / "one.json"
    write_hairstyle(path, one)
    other = read_hairstyle(path, ALL_SETTINGS)
    for name in ("title", "source", "order", "masks", "modifiers", "presets", "settings"):
        assert getattr(other, name) == getattr(one, name)
    for name in ("root_uv", "offsets", "group"):
        assert np.array_equal(getattr(other.guides, name), getattr(one.guides, name))
    assert np.abs(other.guides.shape - one.guides.shape).max() <= 1.0001e-5


def test_the_same_style_gives_the_same_bytes(tmp_path: Path) -> None:
    one, contents = style(), []
    for name in ("one", "two"):
        write_hairstyle(tmp_path / f"{name}.json", one)
        contents.append((tmp_path / f"{name}.npz").read_bytes())
    assert contents[0] == contents[1]


def test_guides_too_long_for_the_file_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(HairloomError, match="longer than 65 cm"):
        write_hairstyle(tmp_path / "long.json", style(3.0))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"hairloom_style": 2}, "version 2"),
        ({"settings": {"hats": {}}}, "'hats'"),
        ({"settings": {"children": {"clumps": 1}}}, "clumps"),
        ({"settings": {"children": {"clump": 7.0}}}, "clump"),
        ({"settings": 3}, "settings"),
        ({"masks": {"eyes": "scalp"}}, "masks"),
        ({"masks": {"children": 3}}, "masks"),
        ({"modifiers": 5}, "modifiers"),
        ({"modifiers": [{"nodes": 4}]}, "modifiers"),
        ({"modifiers": [{"nodes": "A", "inputs": {"Factor": [1]}}]}, "modifiers"),
        ({"presets": "looks/brown"}, "presets"),
        ({"order": "first"}, "order"),
    ],
)
def test_invalid_style_texts_are_refused(path: Path, change: dict, problem: str) -> None:
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(HairloomError, match=problem):
        read_hairstyle(path, ALL_SETTINGS)


@pytest.mark.parametrize("text", ["", "{", "[]", "[" * 100_000, "\x00", '{"a": 1'])
def test_text_that_is_no_style(path: Path, text: str) -> None:
    path.write_text(text)
    with pytest.raises(HairloomError):
        read_hairstyle(path, ALL_SETTINGS)


def changed(path: Path, **arrays: np.ndarray) -> None:
    guides = path.with_suffix(".npz")
    with np.load(guides) as file:
        kept = {name: file[name] for name in file.files}
    np.savez(guides, **kept | arrays)


@pytest.mark.parametrize(
    "arrays",
    [
        {"counts": np.array([2, 7, 5], np.int32)},
        {"counts": np.array([2, 10, 1], np.int32)},
        {"counts": np.array([-2, 11, 4], np.int32)},
        {"counts": np.zeros(0, np.int32)},
        {"counts": np.array([2.0, 7.0, 4.0])},
        {"root_uv": np.zeros((2, 2), np.float32)},
        {"root_uv": np.full((3, 2), np.nan, np.float32)},
        {"differences": np.zeros((13, 3), np.int16)},
        {"differences": np.zeros((2, 3, 12), np.uint8)},
        {"group": np.zeros((3, 1), np.int32)},
    ],
)
def test_guides_that_do_not_fit_each_other(path: Path, arrays: dict) -> None:
    changed(path, **arrays)
    with pytest.raises(HairloomError, match=r"guides|array"):
        read_hairstyle(path, ALL_SETTINGS)


def test_guides_that_are_damaged_missing_or_code(path: Path) -> None:
    guides = path.with_suffix(".npz")
    whole = guides.read_bytes()
    for place in range(0, len(whole), 37):
        torn = bytearray(whole)
        torn[place] ^= 0xFF
        guides.write_bytes(bytes(torn))
        # a flipped bit may also lie in a part that is not read
        with suppress(HairloomError):
            read_hairstyle(path, ALL_SETTINGS)
    for content in (b"", whole[: len(whole) // 2], pickle.dumps({"root_uv": 1})):
        guides.write_bytes(content)
        with pytest.raises(HairloomError, match="cannot be read"):
            read_hairstyle(path, ALL_SETTINGS)
    np.savez(guides, root_uv=np.array([{"run": "this"}], object))
    with pytest.raises(HairloomError, match="cannot be read"):
        read_hairstyle(path, ALL_SETTINGS)
    guides.unlink()
    with pytest.raises(HairloomError, match="cannot be read"):
        read_hairstyle(path, ALL_SETTINGS)
