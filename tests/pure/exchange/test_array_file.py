"""Arrays in .npz files: the same as numpy reads, and only ValueError for damaged files."""

from __future__ import annotations

import io
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.exchange.files.array_file import read_arrays

pytestmark = pytest.mark.portable

ARRAYS = {
    "guides": np.arange(24, dtype=np.float32).reshape(2, 4, 3),
    "heads": np.asfortranarray(np.arange(12.0).reshape(3, 4)),
    "frame_rate": np.array(24.0),
    "names": np.array(["scalp", "fringe"]),
    "none": np.zeros((0, 3), np.int32),
}
#: harmful parts of the text that describes an array
TOKENS = (b"9" * 30, b"(((", b"-1", b"1e9", b"[" * 3000, b"|O", b"|V0", b"'", b"None", b"\0", b"4,")


def content_of(arrays: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def test_arrays_are_those_that_numpy_reads(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(content_of(ARRAYS))
    found = read_arrays(path)
    with np.load(path) as expected:
        assert list(found) == expected.files
        for name in expected.files:
            np.testing.assert_array_equal(found[name], expected[name])
            assert found[name].dtype == expected[name].dtype and found[name].flags.writeable


def described(text: bytes) -> bytes:
    """A file with one array whose description is this text, with valid checksums."""
    head = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a.npy", head + bytes(64))
    return stream.getvalue()


@pytest.mark.parametrize(
    "text",
    [
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (2000000000, 100)}\n",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (" + b"9" * 40 + b",)}\n",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (-4,)}\n",
        b"{'descr': '|O', 'fortran_order': False, 'shape': (4,)}\n",
        b"{'descr': '|V0', 'fortran_order': False, 'shape': (4,)}\n",
        b"{'descr': ((((, 'fortran_order'\n",
        b"[" * 5000,
        b"",
    ],
)
def test_a_false_array_header_is_refused_without_allocating_memory(
    tmp_path: Path, text: bytes
) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(described(text))
    tracemalloc.start()
    with pytest.raises(ValueError):
        read_arrays(path)
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


def test_a_file_that_would_unpack_to_more_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, a=np.zeros(1_000_000))
    with pytest.raises(ValueError, match="exceeds its actual size"):
        read_arrays(path)


def test_damage_is_a_value_error(tmp_path: Path) -> None:
    random, whole = np.random.default_rng(4), content_of(ARRAYS)
    path = tmp_path / "a.npz"
    refused = 0
    for number in range(1500):
        path.write_bytes(damaged_zip(whole, random) if number % 2 else damaged(whole, random))
        try:
            read_arrays(path)
        except (ValueError, OSError):
            refused += 1
    assert 1000 < refused < 1500


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    changed = bytearray(content)
    for _ in range(int(random.integers(1, 6))):
        place = int(random.integers(len(changed)))
        match random.integers(3):
            case 0:
                changed[place] ^= 1 << int(random.integers(8))
            case 1:
                changed[place : place + 4] = bytes([int(random.choice([0, 255]))] * 4)
            case _:
                token = TOKENS[int(random.integers(len(TOKENS)))]
                changed[place : place + int(random.integers(4))] = token
    return bytes(changed)


def damaged_zip(content: bytes, random: np.random.Generator) -> bytes:
    """The same file with changed descriptions and valid checksums."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as new:
        for name in old.namelist():
            array = old.read(name)
            head = damaged(array[:128], random) if random.random() < 0.5 else array[:128]
            new.writestr(name, head + array[128:])
    return stream.getvalue()
