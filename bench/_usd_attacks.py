"""Seeded malicious USD texts, and what reading them costs."""

from __future__ import annotations

import os
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.usd.groom_usd_read import read_usd

type _Random = np.random.Generator

_CURVE = (
    'def BasisCurves "Hair" {{\n int[] curveVertexCounts = [{count}]\n'
    ' uniform token type = "linear"\n point3f[] points = [{points}]\n}}\n'
)


def usd_attacks(count: int, seed: int) -> dict[str, float]:
    """Read this many; crashes are failures without a HairloomError that has a remedy.

    longest_seconds: wall-clock time, in which other load counts. longest_processor_seconds: of this
    process and of the one that reads.
    """
    found = {"usda_attacks": count, "usda_crashes": 0}
    found |= {"longest_seconds": 0.0, "longest_processor_seconds": 0.0}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            random = np.random.default_rng([seed, number])
            attack = _ATTACKS[number % len(_ATTACKS)]
            path = Path(folder) / f"attack.{('usda', 'usd')[number % 2]}"
            path.write_text("#usda 1.0\n" + _damaged(attack(random), random), encoding="utf-8")
            start, processed = time.perf_counter(), _processor_seconds()
            try:
                read_usd(path)
            except HairloomError as error:
                if not error.remedy:
                    found["usda_crashes"] += 1
            except Exception as error:
                print(f"attack {number}, {attack.__name__}: {error!r}", flush=True)
                found["usda_crashes"] += 1
            wall, processor = time.perf_counter() - start, _processor_seconds() - processed
            found["longest_seconds"] = max(found["longest_seconds"], wall)
            found["longest_processor_seconds"] = max(found["longest_processor_seconds"], processor)
    # of the largest child [kB]
    found["memory_mb"] = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
    return found


def _processor_seconds() -> float:
    """Of this process, and of its children that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _damaged(text: str, random: _Random) -> str:
    """The text; in a third of all cases with random letters changed."""
    if random.integers(3):
        return text
    letters = list(text)
    for place in random.integers(len(letters), size=int(random.integers(1, 20))):
        letters[place] = chr(int(random.integers(32, 1000)))
    return "".join(letters)


def _curve(count: int) -> str:
    return _CURVE.format(count=count, points=", ".join(f"({n}, 0, 0)" for n in range(count)))


def _dictionaries(random: _Random) -> str:
    depth = int(random.integers(100, 40_000))
    return "(\n customLayerData = {\n" + "dictionary a = {\n" * depth + "}" * depth + "\n}\n)\n"


def _prims(random: _Random) -> str:
    depth = int(random.integers(100, 100_000))
    return 'def "a" {\n' * depth + "}" * depth


def _laughs(random: _Random) -> str:
    levels, is_instanceable = int(random.integers(5, 40)), bool(random.integers(2))
    leaf = _curve(int(random.integers(2, 100))) if random.integers(2) else 'def "leaf" {}\n'
    also = "instanceable = true\n " if is_instanceable else ""
    text = ['(defaultPrim = "World")\n', f'class "C0" {{\n{leaf}}}\n']
    for level in range(1, levels + 1):
        children = "".join(
            f' def "{side}" (\n {also}references = </C{level - 1}>\n ) {{}}\n' for side in "abc"
        )
        text.append(f'class "C{level}" {{\n{children}}}\n')
    return "".join(text) + f'def "World" (references = </C{levels}>) {{}}\n'


def _cycle(random: _Random) -> str:
    count = int(random.integers(1, 200))
    return "".join(
        f'def "p{n}" (references = </p{(n + 1) % count}>) {{}}\n' for n in range(count)
    ) + _curve(3)


def _layers(random: _Random) -> str:
    other = ("attack.usda", "attack.usd", "/dev/zero", "/dev/stdin", "/proc/self/mem", "..", "")
    name = other[int(random.integers(len(other)))]
    kind = ("subLayers = [@{}@]", "customLayerData = {{ asset a = @{}@ }}")[int(random.integers(2))]
    return f"(\n {kind.format(name)}\n)\n" + f'def "a" (payload = @{name}@</a>) {{}}\n' + _curve(4)


def _counts(random: _Random) -> str:
    counts = (2**31 - 1, -1, 0, 2**31, 10**30, 64)
    count = counts[int(random.integers(len(counts)))]
    return _curve(64).replace("curveVertexCounts = [64]", f"curveVertexCounts = [{count}, 64]")


def _samples(random: _Random) -> str:
    times = ", ".join(f"{n}: [({n}, 0, 0), (0, 1, {n})]" for n in range(random.integers(2, 5000)))
    curve = _curve(2)
    return curve[: curve.rindex("}")] + f" point3f[] points.timeSamples = {{ {times} }}\n}}\n"


def _primvars(random: _Random) -> str:
    length = int(random.integers(10, 300_000))
    curve = _curve(3)
    return (
        curve[: curve.rindex("}")]
        + f' string[] primvars:groom_group_name = ["{"x" * length}"] (interpolation = "uniform")\n'
        + f" int[] primvars:groom_group_name:indices = [{', '.join('0' * 1000)}]\n}}\n"
    )


def _variants(random: _Random) -> str:
    depth = int(random.integers(2, 300))
    inner = _curve(3)
    for _ in range(depth):
        inner = f'variantSet "v" = {{ "a" {{\n{inner}\n}} }}\n'
    return f'def "a" (variants = {{ string v = "a" }}\n prepend variantSets = "v") {{\n{inner}}}\n'


_ATTACKS: tuple[Callable[[_Random], str], ...] = (
    *(_dictionaries, _prims, _laughs, _cycle, _layers),
    *(_counts, _samples, _primvars, _variants),
)
