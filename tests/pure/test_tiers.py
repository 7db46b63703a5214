"""For each slow test that a commit leaves to `make test-all`, it runs another that fails for the
same kind of fault."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]


def marks_of(function: ast.FunctionDef) -> dict[str, ast.expr]:
    """The marks of a test: name -> decorator."""
    found = {}
    for decorator in function.decorator_list:
        name = ast.unparse(decorator.func if isinstance(decorator, ast.Call) else decorator)
        if name.startswith("pytest.mark."):
            found[name.removeprefix("pytest.mark.")] = decorator
    return found


@cache
def marked_in(file: Path) -> dict[str, dict[str, ast.expr]]:
    """The tests of a file with their marks."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return {
        node.name: marks_of(node)
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


def left_out(folder: Path) -> Iterator[tuple[Path, str, Path, str]]:
    """Slow tests that name another test for commits: file and name of both."""
    for file in sorted(folder.rglob("test_*.py")):
        for name, marks in marked_in(file).items():
            slow = marks.get("slow")
            if isinstance(slow, ast.Call):
                (named,) = (ast.literal_eval(each.value) for each in slow.keywords)
                path, _, other = named.rpartition("::")
                yield file, name, folder.parent / path if path else file, other


def wrong(folder: Path) -> list[str]:
    return [
        f"{file.name}: {name} names {other}"
        for file, name, other_file, other in left_out(folder)
        if not other_file.is_file()
        or other not in (known := marked_in(other_file))
        or "slow" in known[other]
    ]


def test_what_a_commit_runs_instead_is_there_and_not_slow() -> None:
    assert wrong(TESTS) == []


@pytest.mark.parametrize(
    "other",
    ["def test_b(): pass", "@pytest.mark.slow\ndef test_c(): pass", "def test_c(): pass"],
    ids=["gone", "slow", "there"],
)
def test_one_that_is_gone_or_slow_is_seen(tmp_path: Path, other: str) -> None:
    folder = tmp_path / "tests"
    folder.mkdir()
    text = f'@pytest.mark.slow(instead="test_c")\ndef test_a(): pass\n{other}\n'
    (folder / "test_x.py").write_text(text)
    expected = [] if other == "def test_c(): pass" else ["test_x.py: test_a names test_c"]
    assert wrong(folder) == expected
