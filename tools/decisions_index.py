"""The index of docs/dev/decisions.md, by the topic that each entry's second line names."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "docs" / "dev" / "decisions.md"
#: topic -> what it is about, in the order of the index
TOPICS = {
    "Rooms": "Rooms, settings, packages",
    "Strands": "Strands, children, hairstyles",
    "Dynamics": "Dynamics, colliders, bakes",
    "Shading": "Shading, shadows, GPU",
    "Cards": "Cards",
    "Files": "Files",
    "Blender": "Window, engine, farm",
}
_ENTRY = re.compile(r"^## (\d+)\. (.+)\n\n\d{4}-\d\d-\d\d · [^·\n]+ · (\w+)\n", re.MULTILINE)
_INDEX = re.compile(r"^\| About .*?(?=^## )", re.MULTILINE | re.DOTALL)


def with_index(text: str) -> str:
    """The page with the index of its entries."""
    return _INDEX.sub(lambda _: index(text) + "\n", text, count=1)


def index(text: str) -> str:
    lines = ["| About | Entries |", "| --- | --- |"]
    found = _ENTRY.findall(text)
    for topic, about in TOPICS.items():
        links = (
            f"[{number}](#{number}-{_anchor(title)})"
            for number, title, own in found
            if own == topic
        )
        lines.append(f"| {about} | {', '.join(links)} |")
    return "\n".join(lines) + "\n"


def _anchor(title: str) -> str:
    """The anchor that GitHub makes for a heading."""
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
