"""The loops of the extension that wait for something, and why each of them ends."""

from __future__ import annotations

import ast
from pathlib import Path

from extension_loader import REPOSITORY

ADDON = REPOSITORY / "addon"
#: A call of one of these in a `while` loop makes it wait.
BLOCKING_CALLS = {
    "wait",
    "sleep",
    "join",
    "result",
    "take_made",
    "attempt",
    "run_main_thread_steps",
}
#: function -> why it ends
KNOWN_WAITS = {
    "cards/order_pairs.py:pairs_by_view": "each turn takes one view",
    "exchange/files/file_moves.py:move_file": "after MAX_WAIT seconds",
    "blender/preview/previews.py:finish": "each turn takes one result; another scene is refused",
    "blender/sessions/session.py:finish": "each turn takes one result, of which none is begun here",
    "ui/long_work.py:threaded": "gives back at every turn, and Esc closes it",
    "ui/strand_export.py:_write_motion": "gives back at every turn, and Esc closes it",
}


def waits(folder: Path = ADDON) -> list[str]:
    """Functions with a `while` loop that waits, as FILE:FUNCTION."""
    functions = []
    for path in sorted(folder.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if "while" not in text:
            continue
        for function in ast.walk(ast.parse(text)):
            if isinstance(function, ast.FunctionDef) and any(map(_waits, _own_loops(function))):
                functions.append(f"{path.relative_to(folder).as_posix()}:{function.name}")
    return functions


def endless_waits() -> list[str]:
    """Waits without a reason in KNOWN_WAITS."""
    return [each for each in waits() if each not in KNOWN_WAITS]


def _own_loops(function: ast.FunctionDef) -> list[ast.While]:
    return [node for node in ast.walk(function) if isinstance(node, ast.While)]


def _waits(loop: ast.While) -> bool:
    calls = (node.func for node in ast.walk(loop) if isinstance(node, ast.Call))
    names = {
        call.attr if isinstance(call, ast.Attribute) else getattr(call, "id", "") for call in calls
    }
    return bool(names & BLOCKING_CALLS)
