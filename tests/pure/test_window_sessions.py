"""Rules for window sessions that can be checked without a window."""

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
    assert set(re.findall(r'hairloom_module\("([^"]*)"\)', texts)) == set(table)


#: Functions that wait for ticks on purpose, to show that nothing happens meanwhile.
STILL = {"session_soft_shadows.py": {"nothing_more_is_drawn"}}


def waits_for_ticks(tree: ast.AST) -> list[int]:
    """The lines where a session waits for several ticks, in one yield or in a loop."""
    return [
        node.lineno
        for node in ast.walk(tree)
        if (isinstance(node, ast.Yield) and (_constant(node) or 0.0) > 1)
        or (
            isinstance(node, ast.For)
            and ast.unparse(node.iter).startswith("range(")
            and all(_constant(each) is not None for each in map(_yielded, node.body))
        )
    ]


def _yielded(statement: ast.stmt) -> ast.Yield | None:
    value = statement.value if isinstance(statement, ast.Expr) else None
    return value if isinstance(value, ast.Yield) else None


def _constant(given: ast.Yield | None) -> float | None:
    """The number of ticks of a yield, 1 for a bare one; None if it is no constant."""
    if given is None:
        return None
    if given.value is None:
        return 1.0
    value = given.value.value if isinstance(given.value, ast.Constant) else None
    return float(value) if isinstance(value, int | float) else None


def without_still_ones(tree: ast.Module, name: str) -> ast.Module:
    allowed = STILL.get(name, set())
    found = [each for each in tree.body if getattr(each, "name", None) not in allowed]
    assert len(tree.body) - len(found) == len(allowed)
    return ast.Module(found, tree.type_ignores)


def test_no_session_waits_for_ticks() -> None:
    """The driver also refuses a yield of several ticks, but only at run time."""
    waits = [
        f"{file.name}:{line}"
        for file in WINDOW.glob("*.py")
        for line in waits_for_ticks(
            without_still_ones(ast.parse(file.read_text(encoding="utf-8")), file.name)
        )
    ]
    assert waits == []


def test_the_rule_sees_ticks_that_are_waited_for() -> None:
    loop = "def f():\n for _ in range(9):\n  "
    for source in ("def f():\n yield 2", loop + "yield", loop + "yield 1", loop + "yield 0.5"):
        assert len(waits_for_ticks(ast.parse(source))) == 1, source
    for source in ("def f():\n yield 1", loop + "press()\n  yield", loop + "yield from press()"):
        assert waits_for_ticks(ast.parse(source)) == [], source
