"""USD files that were written to do harm: each is refused in time, and not in this process."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("pxr", reason="it is missing: `make setup` installs it")

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.usd.groom_usd_read import read_usd

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
    """Each class holds the one before twice, so that the last one holds 2^levels leaves."""
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


@pytest.mark.parametrize("name", ATTACKS)
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
    """What is refused above is refused for its size alone."""
    path = tmp_path / "groom.usda"
    path.write_text(laughs(4, CURVE))
    begun = time.perf_counter()
    assert read_usd(path).groom.strands.strand_count == 16
    assert time.perf_counter() - begun < 60.0
