"""Cryptomatte: published hashes, and the content of ranks."""

from __future__ import annotations

import json

import numpy as np
import pytest

from hairloom.addon.render.cryptomatte import Coverages, matte_bits, matte_id, metadata, murmur3


@pytest.mark.parametrize(
    ("key", "seed", "found"),
    [
        # from SMHasher's verification and its users
        (b"", 0, 0),
        (b"", 1, 0x514E28B7),
        (b"", 0xFFFFFFFF, 0x81F16F39),
        (b"\xff\xff\xff\xff", 0, 0x76293B50),
        (b"!Ce\x87", 0, 0xF55B516B),
        (b"!Ce", 0, 0x7E4A8634),
        (b"!C", 0, 0xA0F7B07A),
        (b"!", 0, 0x72661CF4),
        (b"Hello, world!", 0x9747B28C, 0x24884CBA),
    ],
)
def test_the_hash_is_murmur_3(key: bytes, seed: int, found: int) -> None:
    assert murmur3(key, seed) == found


@pytest.mark.parametrize(
    ("name", "found"),
    [
        # from the tests of the Nuke plug-in that came with the specification
        ("hello", 6.0705627102400005616e-17),
        ("равнина", -1.3192631212399999468e-25),
        ("mädchen", 6.2361298211599995797e25),
    ],
)
def test_ids_are_those_of_the_specification(name: str, found: float) -> None:
    assert matte_id(name) == np.float32(found)


def test_all_ids_are_normal_floats() -> None:
    names = [f"Object.{number:03}" for number in range(20000)]
    ids = np.array([matte_id(name) for name in names])
    exponents = np.array([matte_bits(name) >> 23 & 255 for name in names])
    assert any(murmur3(name.encode()) >> 23 & 255 in (0, 255) for name in names)
    assert np.isfinite(ids).all() and (exponents > 0).all() and (exponents < 255).all()


def test_pictures_have_what_covers_most_first() -> None:
    coverages = Coverages(1, 3, levels=3)
    for left in (0.5, 0.25):
        coverages.add("Hair", np.float32([[left, 0.0, 0.1]]))
        coverages.add("Head", np.float32([[0.25, 1.0, 0.9]]))
    first, second = coverages.pictures(2)
    assert first.shape == second.shape == (1, 3, 4)
    hair, head = matte_id("Hair"), matte_id("Head")
    np.testing.assert_array_equal(first[0, 0], np.float32([hair, 0.375, head, 0.25]))
    np.testing.assert_array_equal(first[0, 1], np.float32([head, 1.0, 0.0, 0.0]))
    np.testing.assert_allclose(first[0, 2], np.float32([head, 0.9, hair, 0.1]), rtol=1e-6)
    assert not second.any()


def test_a_pixel_has_room_for_as_many_objects_as_levels() -> None:
    coverages = Coverages(1, 1, levels=2)
    for sample in range(2):
        for name in "ABC":
            coverages.add(name, np.full((1, 1), 0.25 + 0.1 * sample, np.float32))
    (picture,) = coverages.pictures(2)
    assert set(picture[0, 0, ::2]) == {matte_id("A"), matte_id("B")}
    assert picture[0, 0, 1::2] == pytest.approx([0.3, 0.3])


def test_metadata_lists_all_names() -> None:
    fields = metadata("ViewLayer.CryptoObject", ["Hair", "Head", 'a "quoted", name', "Hair"])
    place = "cryptomatte/542cafa"
    assert set(fields) == {f"{place}/{key}" for key in ("name", "hash", "conversion", "manifest")}
    assert fields[f"{place}/name"] == "ViewLayer.CryptoObject"
    names = json.loads(fields[f"{place}/manifest"])
    assert list(names) == ["Hair", "Head", 'a "quoted", name']
    assert all(f"{matte_bits(name):08x}" == found for name, found in names.items())
