"""Malicious USD files: each is refused in time, and in another process."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiers import few_in_commits

pytest.importorskip("pxr", reason="it is missing: `make setup` installs it")

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
from hairloom.addon.exchange.usd.usd_reader import Arrays, pack_prims, unpack_prims

CURVE = (
    'def BasisCurves "Hair" {\n int[] curveVertexCounts = [64]\n uniform token type = "linear"\n'
    f" point3f[] points = [{', '.join(f'({n}, 0, 0)' for n in range(64))}]\n}}\n"
)


def nested_dictionaries() -> str:
    depth = 36_000
    opening = "dictionary a = {\n" * depth
    return f"#usda 1.0\n(\n customLayerData = {{\n{opening}{'}' * depth}\n}}\n)\n"


def nested_prims() -> str:
    depth = 100_000
    return "#usda 1.0\n" + 'def "a" {\n' * depth + "}" * depth


def laughs(levels: int, leaf: str, *, is_instanceable: bool = True) -> str:
    """A file in which each class contains the one before twice, the last one 2^levels leaves."""
    also = "instanceable = true\n " if is_instanceable else ""
    text = ['#usda 1.0\n(defaultPrim = "World")\n', f'class "C0" {{\n{leaf}}}\n']
    for level in range(1, levels + 1):
        children = "".join(
            f' def "{side}" (\n {also}references = </C{level - 1}>\n ) {{}}\n' for side in "ab"
        )
        text.append(f'class "C{level}" {{\n{children}}}\n')
    return "".join(text) + f'def "World" (references = </C{levels}>) {{}}\n'


def refers_to_damaged(tmp_path: Path) -> str:
    (tmp_path / "damaged.usdc").write_bytes(b"PXR-USDC" + bytes(range(256)) * 20)
    return '#usda 1.0\ndef "a" (references = @./damaged.usdc@</a>) {}\n' + CURVE


ATTACKS: dict[str, Callable[[], str]] = {
    "dictionaries in dictionaries": nested_dictionaries,
    "prims in prims": nested_prims,
    "a billion prims": lambda: laughs(30, 'def "leaf" {}\n'),
    "a billion prims that are none's instances": lambda: laughs(
        30, 'def "leaf" {}\n', is_instanceable=False
    ),
    "four million times 64 points": lambda: laughs(22, CURVE),
}


@pytest.mark.parametrize("name", few_in_commits(ATTACKS))
def test_an_attack_is_refused_in_time(name: str, tmp_path: Path) -> None:
    path = tmp_path / "attack.usda"
    path.write_text(ATTACKS[name]())
    assert path.stat().st_size < 1.4e6
    with pytest.raises(HairloomError) as caught:
        read_usd(path)
    assert caught.value.place == str(path) and caught.value.remedy


def test_a_text_that_refers_to_a_damaged_crate_does_not_reach_this_process(tmp_path: Path) -> None:
    path = tmp_path / "groom.usda"
    path.write_text(refers_to_damaged(tmp_path))
    assert read_usd(path).groom.strands.strand_count == 1, "what can be read is"


def test_a_few_instances_are_hair(tmp_path: Path) -> None:
    """A small file of the same kind is read: those above are refused for their size alone."""
    path = tmp_path / "groom.usda"
    path.write_text(laughs(4, CURVE))
    begun = time.perf_counter()
    assert read_usd(path).groom.strands.strand_count == 16
    assert time.perf_counter() - begun < 60.0


def test_notes_on_many_prims_are_combined(tmp_path: Path) -> None:
    """A line for each would make thousands."""
    path = tmp_path / "groom.usda"
    path.write_text(laughs(4, CURVE))
    notes = read_usd(path).notes
    assert sum("it has no widths" in note for note in notes) == 1
    assert any("16 prims, such as /" in note and "it has no widths" in note for note in notes)


def test_packed_prims_can_be_unpacked() -> None:
    """Arrays of one layout are concatenated in the file, for prims with different attributes."""
    random = np.random.default_rng(0)
    prims: list[Arrays] = [
        {
            "points": random.random((n, 3)).astype(np.float32 if n % 3 else np.float64),
            "matrix": random.random((4, 4)),
            "moves": np.array(n > 3),
            "traits": np.array(["a" * n, "\u00e9\ud83d"]),
            "name": np.array(f"prim {n}"),
            **({"widths": np.arange(n)} if n % 2 else {}),
            **({"primvar/groom_group_name": np.array([], np.str_)} if n == 2 else {}),
        }
        for n in range(6)
    ]
    given = [dict(prim) for prim in prims]
    found = unpack_prims(pack_prims(prims))
    for mine, theirs in zip(found, given, strict=True):
        assert mine.keys() == theirs.keys()
        for name, array in theirs.items():
            assert np.array_equal(mine[name], array), name
            assert mine[name].shape == array.shape and mine[name].dtype == array.dtype, name


def test_many_prims_are_a_few_arrays() -> None:
    """An array in a file costs more than reading a prim: with arrays for each, 20,000 prims took
    9 s."""
    prims = [{"points": np.zeros((2, 3)), "name": np.array("a")} for _ in range(1000)]
    assert len(pack_prims(prims)) < 10
