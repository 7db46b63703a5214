"""Damaged files of Blender's own exporters: groom readers and mesh readers refuse or read them.

tests/pure/exchange/test_fuzz.py does the same with files that Hairloom has written.
"""

from __future__ import annotations

import importlib.util
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from strand_files import needs_usd
from swinging import key_x
from tiers import few_by_name

from hairloom.addon.blender.scene import mesh_files
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.strand_reading import read_strands

needs_alembic = pytest.mark.skipif(
    importlib.util.find_spec("alembic3d") is None, reason="no alembic3d here"
)
SUFFIXES = (
    pytest.param("abc", marks=needs_alembic),
    pytest.param("usdc", marks=needs_usd),
    pytest.param("usda", marks=needs_usd),
)
#: of this process and of each reader in another one [s] [bytes]
MAX_SECONDS, MAX_MEMORY = 20.0, 1 << 30
#: bytes at the beginning that count as a header, and at the end, where tables of contents are
HEADER, FOOTER = 300, 2000
FEW, MANY = range(1), range(1, 300)


def damaged(content: bytes, number: int) -> bytes:
    """The content with up to four bits flipped, bytes removed or bytes inserted, by turns, in its
    header, anywhere, or at its end."""
    random, result = np.random.default_rng([77, number]), bytearray(content)
    first = (0, 0, max(len(content) - FOOTER, 0))[number // 3 % 3]
    last = (min(HEADER, len(content)), len(content), len(content))[number // 3 % 3]
    for _ in range(int(random.integers(1, 5))):
        at = min(int(random.integers(first, last)), len(result) - 1)
        if number % 3 == 0:
            result[at] ^= 1 << int(random.integers(8))
        elif number % 3 == 1:
            end = len(result) if random.random() < 0.5 else at + int(random.integers(1, 64))
            result[max(at, 8) : end] = b""
        else:
            result[at:at] = random.bytes(int(random.integers(1, 64)))
    return bytes(result)


def peak_of_children() -> int:
    """The most memory that any process took which this one has started [bytes]."""
    return 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss


@pytest.fixture
def exported(
    sphere: Any, new_hair: Callable[..., Any], tmp_path: Path
) -> Callable[[str], tuple[Path, bytes]]:
    """A function that has Blender export a moving head with hair; returns the file's content, and
    the path for damaged ones."""

    def export(suffix: str) -> tuple[Path, bytes]:
        options = bpy.app.build_options
        if not (options.alembic if suffix == "abc" else options.usd):
            pytest.skip("this Blender was built without this format")
        new_hair(sphere)
        key_x(sphere, {frame: 0.1 * frame for frame in (1, 3)})
        path = tmp_path / f"sound.{suffix}"
        if suffix == "abc":
            bpy.ops.wm.alembic_export(filepath=str(path), start=1, end=3)
        else:
            bpy.context.scene.frame_end = 3
            bpy.ops.wm.usd_export(filepath=str(path), export_animation=suffix == "usdc")
        assert read_strands(path).strands.strand_count == 60
        return path.with_stem("damaged"), path.read_bytes()

    return export


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("numbers", few_by_name({"few": FEW, "many": MANY}, "many"))
def test_damaged_grooms_of_blender_are_read_or_refused(
    exported: Callable[[str], tuple[Path, bytes]], suffix: str, numbers: range
) -> None:
    """In time, and without filling the memory."""
    path, content = exported(suffix)
    allowed = max(MAX_MEMORY, peak_of_children())  # other tests may have started larger ones
    for number in numbers:
        path.write_bytes(damaged(content, number))
        started = time.perf_counter()
        try:
            assert np.isfinite(read_strands(path).strands.points).all()
        except HairloomError as error:
            assert path.name in error.place and error.remedy, number
        assert time.perf_counter() - started < MAX_SECONDS, number
        assert peak_of_children() <= allowed, number


@needs_usd
@pytest.mark.parametrize("suffix", ["usdc", "usd"])
def test_a_damaged_binary_usd_head_never_reaches_blenders_importer(
    exported: Callable[[str], tuple[Path, bytes]], suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It filled 4 GB, and took 35 s, with 75 kB whose table of contents was overwritten."""
    path, content = exported("usdc")
    path = path.with_suffix(f".{suffix}")
    path.write_bytes(content)
    assert len(mesh_files.read_mesh_file(path, need_uv=False)[0].triangles) > 100
    end = int.from_bytes(content[16:24], "little")  # where the table of contents is
    path.write_bytes(content[:end] + b"\xc1\xff\xff\x00" + content[end + 4 :])
    calls: list[str] = []
    monkeypatch.setitem(mesh_files._IMPORTERS, f".{suffix}", calls.append)
    with pytest.raises(HairloomError, match="not valid") as caught:
        mesh_files.read_mesh_file(path, need_uv=False)
    assert caught.value.place == str(path) and not calls
