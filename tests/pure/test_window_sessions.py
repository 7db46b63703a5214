"""What holds for window sessions and needs no window to be seen."""

from __future__ import annotations

import ast
import re
from pathlib import Path

WINDOW = Path(__file__).parents[1] / "window"
ADDON = Path(__file__).parents[2] / "addon"


def test_the_modules_that_sessions_look_at_are_there() -> None:
    driver = ast.parse((WINDOW / "driver.py").read_text(encoding="utf-8"))
    (table,) = (
        ast.literal_eval(node.value)
        for node in driver.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "MODULES"
    )
    for module in table.values():
        path = ADDON.joinpath(*module.split("."))
        assert path.with_suffix(".py").is_file() or (path / "__init__.py").is_file(), module
    texts = " ".join(file.read_text(encoding="utf-8") for file in WINDOW.glob("*.py"))
    assert set(re.findall(r'of_hairloom\("([^"]*)"\)', texts)) == set(table)


def test_no_session_waits_for_ticks() -> None:
    """The driver refuses it as well; here it is seen before."""
    waits = [
        f"{file.name}:{node.lineno}"
        for file in WINDOW.glob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Yield)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, int | float)
        and node.value.value > 1
    ]
    assert waits == []
