"""The figure of the flows in docs/dev/architecture.md shows calls that the code makes."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import flow_figure
import pytest
from flow_figure import FLOORS, FLOWS, Step, arrows, steps_of

ADDON = Path(__file__).parents[2] / "addon"


def is_defined(step: Step, addon: Path) -> bool:
    """Whether the step's file defines its function or class, at any level."""
    tree = ast.parse((addon / step.file).read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.ClassDef)
    return any(isinstance(node, kinds) and node.name == step.name for node in ast.walk(tree))


def modules_imported(file: str, addon: Path) -> set[str]:
    """Files of addon/ that a file imports, as modules or names from them, also through a
    package."""
    path = addon / file
    found: set[Path] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
        found.add(base.with_suffix(".py"))
        found |= {base / f"{alias.name}.py" for alias in node.names}
        if (base / "__init__.py").exists() and path.name != "__init__.py":
            package = (base / "__init__.py").relative_to(addon).as_posix()
            found |= {addon / name for name in modules_imported(package, addon)}
    return {path.relative_to(addon).as_posix() for path in found if path.exists()}


def fault(caller: Step, called: Step, addon: Path) -> str:
    """The problem of an arrow, or ""."""
    arrow = f"{caller.file} {caller.name} -> {called.file} {called.name}"
    if FLOORS.index(called.floor) < FLOORS.index(caller.floor):
        return f"{arrow}: points up"
    if called.file == caller.file:
        return f"{arrow}: stays in its file"
    if called.file not in modules_imported(caller.file, addon):
        return f"{arrow}: no such import"
    text = (addon / caller.file).read_text(encoding="utf-8")
    return "" if re.search(rf"\b{called.name}\b", text) else f"{arrow}: is not called there"


@pytest.mark.parametrize("title", FLOWS)
def test_every_arrow_is_an_import_and_a_name(title: str) -> None:
    tops = steps_of(FLOWS[title])
    steps = [*tops, *(called for _, called in arrows(tops))]
    assert [step for step in steps if not is_defined(step, ADDON)] == []
    faults = [fault(caller, called, ADDON) for caller, called in arrows(tops)]
    assert [each for each in faults if each] == []


def test_the_figure_is_current_and_shown() -> None:
    assert flow_figure.FIGURE.read_text(encoding="utf-8") == flow_figure.figure(), "run make docs"
    page = ADDON.parent / "docs" / "dev" / "architecture.md"
    assert f"images/{flow_figure.FIGURE.name}" in page.read_text(encoding="utf-8")


def test_a_wrong_arrow_is_seen(tmp_path: Path) -> None:
    files = {
        "ui/button.py": "from ..render import draw\nfrom ..rig_flow import prepare\ndraw.frame()\n",
        "render/__init__.py": "",
        "render/draw.py": "def frame(): ...\ndef other(): ...\n",
        "rig_flow.py": "def prepare(): ...\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    button, draw = Step("ui/button.py", "press"), Step("render/draw.py", "frame")
    other, prepare = Step("render/draw.py", "other"), Step("rig_flow.py", "prepare")
    pairs = [(button, draw), (button, prepare), (button, other), (draw, prepare), (draw, button)]
    faults = [fault(*pair, tmp_path).rpartition(": ")[2] for pair in pairs]
    assert faults == ["", "", "is not called there", "no such import", "points up"]
    assert not is_defined(Step("render/draw.py", "gone"), tmp_path)
    with pytest.raises(ValueError, match="indented"):
        steps_of("a.py f\n    b.py g")
