"""The table of docs/hairstyles.md, of the hairstyles that ship."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

_REPOSITORY = Path(__file__).resolve().parents[1]
PAGE = _REPOSITORY / "docs" / "hairstyles.md"
STYLES = _REPOSITORY / "hairstyles"
_HEADING = ("Name", "Hairstyle", "Blender's hair nodes", "Children")
_TABLE = re.compile(rf"^\| {' [|] '.join(_HEADING)} \|\n(?:\|.*\n)*", re.MULTILINE)


def with_table(text: str) -> str:
    """The page with the table of the present hairstyles."""
    return _TABLE.sub(lambda _: table(), text, count=1)


def table() -> str:
    styles = {
        path.stem: json.loads(path.read_text(encoding="utf-8")) for path in STYLES.glob("*.json")
    }
    rows = [_HEADING, ("---",) * len(_HEADING)]
    for name in sorted(styles, key=lambda name: (styles[name]["order"], name)):
        style = styles[name]
        nodes = ", ".join(each["nodes"] for each in style["modifiers"]) or "none"
        rows.append((f"`{name}`", style["title"], nodes, _children(style["settings"])))
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _children(settings: dict[str, dict[str, Any]]) -> str:
    children = settings.get("children", {})
    is_grown = children.get("method", "none") != "none"
    return f"{children['strand_count']:,}" if is_grown else "none"
