"""Everything that tools and benchmarks import exists: many run only once per release, and no type
checker reads them."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest
from extension_loader import REPOSITORY

FOLDERS = [REPOSITORY / "tools", REPOSITORY / "bench"]
PROGRAMS = sorted(path for folder in FOLDERS for path in folder.glob("*.py"))


def file_of(module: str) -> Path | None:
    """The file, or the folder, of a module of ours."""
    top, _, rest = module.partition(".")
    folders = [REPOSITORY / rest.replace(".", "/")] if top == "hairloom" else []
    folders += [folder / module.replace(".", "/") for folder in FOLDERS if top != "hairloom"]
    for path in folders:
        if path.is_dir():
            return path
        if path.with_suffix(".py").is_file():
            return path.with_suffix(".py")
    return None


@cache
def names_in(path: Path) -> set[str]:
    """The names that can be imported from a file or a folder."""
    if path.is_dir():
        inside = {each.stem for each in path.iterdir()}
        start = path / "__init__.py"
        return inside | (names_in(start) if start.is_file() else set())
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found.add(name)
            case ast.TypeAlias(name=ast.Name(id=name)) | ast.Name(id=name, ctx=ast.Store()):
                found.add(name)
            case ast.Import(names=names) | ast.ImportFrom(names=names):
                found |= {each.asname or each.name for each in names}
    return found


def missing(text: str) -> list[str]:
    """Names that a program imports from files of ours that do not define them."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.ImportFrom) or node.module is None:
            continue
        path = file_of(node.module)
        if path is None:
            found += [node.module] * node.module.startswith("hairloom")
            continue
        names = names_in(path)
        found += [f"{node.module}.{each.name}" for each in node.names if each.name not in names]
    return found


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_what_a_program_imports_is_there(path: Path) -> None:
    assert missing(path.read_text(encoding="utf-8")) == []


def test_what_is_not_there_is_seen() -> None:
    assert missing("from hairloom.addon.rig_flow import Rig, Pose") == []
    assert missing("from hairloom.addon import rig_flow, motion_flow") == []
    assert missing("from hairloom.addon.rig_flow import Rug") == ["hairloom.addon.rig_flow.Rug"]
    assert missing("from hairloom.addon.nothing import Rig") == ["hairloom.addon.nothing"]
    assert missing("from small_pictures import write_large") == ["small_pictures.write_large"]
