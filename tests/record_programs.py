"""A pytest plugin that records all programs that tests compile, for test_cross_compile.py:

pytest -p record_programs TESTS, with the folder in HAIRLOOM_PROGRAMS

For each program it writes a file per stage, in Vulkan's GLSL, and a line of JSON: the program's
name, the file that each stage begins with, and the features that it needs.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import cross_compile
import pytest

_FOLDER = Path(os.environ["HAIRLOOM_PROGRAMS"])
_written: set[Any] = set()


@pytest.fixture(autouse=True)
def _recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    from hairloom.addon.render import dynamics_pass, shader_program

    compiled = shader_program._compiled

    def recorded(recipe: Any) -> Any:
        made = compiled(recipe)
        if recipe not in _written:
            _written.add(recipe)
            _write(recipe, shader_program)
        return made

    monkeypatch.setattr(shader_program, "_compiled", recorded)
    monkeypatch.setattr(dynamics_pass, "pair_format", lambda: "RGBA32F")  # Metal's


def _write(recipe: Any, shader_program: Any) -> None:
    number, structs = len(_written), shader_program.struct_sources(recipe)
    files = {suffix: f"{number}.{suffix}" for suffix in cross_compile.texts(recipe, structs)}
    for suffix, text in cross_compile.texts(recipe, structs).items():
        (_FOLDER / files[suffix]).write_text(text, encoding="utf-8")
    record = {
        "name": recipe.name,
        "stages": [each for each in (recipe.vertex, recipe.fragment, recipe.compute) if each],
        "files": sorted(files.values()),
        "demands": cross_compile.resource_counts(recipe),
    }
    with (_FOLDER / "programs.jsonl").open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(record) + "\n")
