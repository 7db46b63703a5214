"""Valid files of every format of strands, and presets, and methods to damage them.

Every file follows from a seed and a number, so that `damaged_content(FORMAT, SEED, number)` makes
it again.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
from extension_loader import REPOSITORY

from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.groom import Groom, GroomMotion
from hairloom.addon.exchange.groom_presets import PRESETS
from hairloom.addon.exchange.hair_file import HEADER, write_hair_file
from hairloom.addon.exchange.tressfx import write_tfx
from hairloom.addon.exchange.tressfx_layout import HEADER_3, HEADER_4
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.strands import StrandSet

#: extreme counts and offsets
EXTREME_COUNTS = (0, 1, 2, 3, 63, 65, 255, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
EXTREME_NUMBERS = (np.nan, np.inf, -np.inf, 3.0e38, -3.0e38, 1.0e-45, -0.0, 1.0e9)
TOKENS = (
    *("NaN", "Infinity", "-Infinity", "1e999", "-1", "null", "true", "[]", "{}", '"x"', '""'),
    *(
        "9" * 400,
        "9" * 5000,
        "[" * 200_000,
        '{"a":' * 50_000,
        '"\\ud800"',
        "0.0000001",
        "[[1,2],3]",
    ),
    *("0.5", "0.25", "1", "0", '"other"'),
)


def damaged_content(kind: str, seed: int, number: int) -> bytes:
    """The damaged file of this number."""
    random = np.random.default_rng([seed, number])
    small, large = originals(kind)
    files = large if number % 20 == 0 and large else small
    content = bytearray(files[int(random.integers(len(files)))])
    mutations = TEXT_MUTATIONS if kind == "preset" else MUTATIONS
    for _ in range(int(random.integers(1, 4))):
        content = mutations[int(random.integers(len(mutations)))](content, random)
    return bytes(content)


@cache
def originals(kind: str) -> tuple[tuple[bytes, ...], tuple[bytes, ...]]:
    """Valid files of a format, small ones and large ones, to be damaged."""
    if kind == "preset":
        return tuple(file.read_bytes() for file in sorted(REPOSITORY.glob("presets/*/*.json"))), ()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"sound.{kind}"
        write_files = WRITERS[kind]
        large = () if kind in LIBRARY_FORMATS else tuple(write_files(path, 6000))
        return tuple(write_files(path, 5)), large


def sample(strand_count: int, seed: int = 0, *, point_count: int = 0) -> Groom:
    """A groom with all attributes of the formats; strands of 3 to 8 points, or of `point_count`."""
    random = np.random.default_rng([strand_count, seed])
    counts = random.integers(3, 9, strand_count)
    if point_count:
        counts[:] = point_count
    offsets = np.concatenate([[0], np.cumsum(counts)])
    points = random.uniform(-0.2, 0.2, (offsets[-1], 3)).astype(np.float32)
    radius = random.uniform(2.0e-5, 9.0e-5, strand_count).astype(np.float32)
    strands = StrandSet(
        points,
        offsets,
        np.repeat(radius, counts),
        np.arange(strand_count) % 3,
        random.random((strand_count, 2)),
        color=random.random((len(points), 3)),
    )
    return Groom(strands)


def _tfx_files(path: Path, strand_count: int) -> Iterator[bytes]:
    groom = sample(strand_count, point_count=8)
    for more in ({"vertex_uv": True}, {"multiple_of_64": True}):
        write_tfx(path, groom, **more)
        yield path.read_bytes()
    yield tressfx_3(groom.strands, path.read_bytes())


def tressfx_3(strands: StrandSet, floats: bytes) -> bytes:
    """A file of version 3 with all blocks; `floats` fill those beyond the positions."""
    header = np.zeros(1, HEADER_3)
    count, vertices = strands.strand_count, len(strands.grid[0])
    header["version"], header["strand_count"], header["vertex_count"] = 3.0, count, vertices
    header["follow_count"] = 2
    body, at = strands.points.tobytes(), HEADER_3.itemsize
    header["positions"] = at
    widths = {"thickness": 1, "strand_uv": 2, "color": 4 * vertices, "vertex_uv": 2 * vertices}
    for name, width in widths.items():
        header[name] = at + len(body)
        body += floats[HEADER_4.itemsize :][: 4 * width * count]
    return header.tobytes() + body


def _hair_files(path: Path, strand_count: int) -> Iterator[bytes]:
    write_hair_file(path, sample(strand_count), uv=True)
    content = path.read_bytes()
    yield content
    write_hair_file(path, sample(strand_count, point_count=4).strands)
    yield path.read_bytes()
    # all arrays, transparency among them
    header = np.frombuffer(content, HEADER, 1).copy()
    points = int(header["point_count"][0])
    cut = HEADER.itemsize + 2 * strand_count + 16 * points
    header["arrays"] |= 8
    clear = np.zeros(points, "<f4").tobytes()
    yield header.tobytes() + content[HEADER.itemsize : cut] + clear + content[cut:]


def _alembic_files(path: Path, strand_count: int) -> Iterator[bytes]:
    for preset in PRESETS.values():
        write_groom_alembic(path, sample(strand_count), preset)
        yield path.read_bytes()
    groom = sample(strand_count)
    write_groom_alembic(path, groom, motion=_motion(groom))
    yield path.read_bytes()


def _usd_files(path: Path, strand_count: int) -> Iterator[bytes]:
    groom = sample(strand_count)
    for motion in (None, _motion(groom)):
        write_usd(path, groom, motion=motion)
        yield path.read_bytes()


def _motion(groom: Groom) -> GroomMotion:
    """Two frames."""
    return GroomMotion([groom.strands.points, groom.strands.points + np.float32(0.01)], 24.0)


WRITERS: dict[str, Callable[[Path, int], Iterator[bytes]]] = {
    "tfx": _tfx_files,
    "hair": _hair_files,
    "abc": _alembic_files,
    "usdc": _usd_files,
    "usda": _usd_files,
}
#: formats that libraries parse
LIBRARY_FORMATS = ("abc", "usdc", "usda")


def _flip_bits(content: bytearray, random: np.random.Generator) -> bytearray:
    for _ in range(int(random.integers(1, 17))):
        if content:
            content[int(random.integers(len(content)))] ^= 1 << int(random.integers(8))
    return content


def _damage_header(content: bytearray, random: np.random.Generator) -> bytearray:
    for _ in range(int(random.integers(1, 5))):
        end = min(len(content), 300)
        if end:
            content[int(random.integers(end))] = int(random.integers(256))
    return content


def _extreme_count(content: bytearray, random: np.random.Generator) -> bytearray:
    near_length = len(content) + int(random.integers(-20, 20))
    value = int(random.choice([*EXTREME_COUNTS, near_length & 0xFFFFFFFF, len(content) // 16]))
    return _put(content, random, 64, value.to_bytes(4, "little"))


def _extreme_number(content: bytearray, random: np.random.Generator) -> bytearray:
    for _ in range(int(random.integers(1, 9))):
        value = np.array([random.choice(EXTREME_NUMBERS)]).astype("<f4").tobytes()
        content = _put(content, random, len(content), value)
    return content


def _swap_words(content: bytearray, random: np.random.Generator) -> bytearray:
    end = min(len(content), 176) // 4
    if end > 1:
        a, b = (4 * int(word) for word in random.choice(end, 2, replace=False))
        content[a : a + 4], content[b : b + 4] = content[b : b + 4], content[a : a + 4]
    return content


def _truncate(content: bytearray, random: np.random.Generator) -> bytearray:
    return content[: int(random.integers(len(content) + 1))]


def _extend(content: bytearray, random: np.random.Generator) -> bytearray:
    return content + random.bytes(int(random.integers(1, 200)))


def _remove_bytes(content: bytearray, random: np.random.Generator) -> bytearray:
    begin = int(random.integers(len(content) + 1))
    del content[begin : begin + int(random.integers(1, 64))]
    return content


def _repeat_bytes(content: bytearray, random: np.random.Generator) -> bytearray:
    begin = int(random.integers(len(content) + 1))
    part = content[begin : begin + int(random.integers(1, 200))]
    return content[:begin] + part + content[begin:]


def _clear_bytes(content: bytearray, random: np.random.Generator) -> bytearray:
    begin = int(random.integers(len(content) + 1))
    part = content[begin : begin + int(random.integers(1, 200))]
    content[begin : begin + len(part)] = bytes([int(random.choice([0, 0xFF]))]) * len(part)
    return content


def _replace_token(content: bytearray, random: np.random.Generator) -> bytearray:
    """A number or a text of a JSON file becomes something else."""
    tokens = list(re.finditer(rb'-?\d[\d.eE+-]*|"[^"]*"|true|false', content))
    if not tokens:
        return content
    token = tokens[int(random.integers(len(tokens)))]
    replacement = TOKENS[int(random.integers(len(TOKENS)))].encode()
    return content[: token.start()] + replacement + content[token.end() :]


def _change_number(content: bytearray, random: np.random.Generator) -> bytearray:
    """A number of a JSON file changes by up to a tenth, which may stay in its range."""
    numbers = list(re.finditer(rb"-?\d+\.\d+", content))
    if not numbers:
        return content
    number = numbers[int(random.integers(len(numbers)))]
    changed = repr(float(number[0]) * float(random.uniform(0.9, 1.1))).encode()
    return content[: number.start()] + changed + content[number.end() :]


def _put(content: bytearray, random: np.random.Generator, end: int, value: bytes) -> bytearray:
    words = min(end, len(content)) // 4
    if words:
        at = 4 * int(random.integers(words))
        content[at : at + 4] = value
    return content


MUTATIONS = (
    _flip_bits,
    _damage_header,
    _extreme_count,
    _extreme_number,
    _swap_words,
    _truncate,
    _extend,
    _remove_bytes,
    _repeat_bytes,
    _clear_bytes,
)
TEXT_MUTATIONS = (
    *(_flip_bits, _truncate, _extend, _remove_bytes, _repeat_bytes, _clear_bytes),
    *[_replace_token] * 4,
    *[_change_number] * 4,
)
