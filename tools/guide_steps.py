"""The steps of docs/hairstyles.md and of the tutorials: their blocks of Python, which tools for
pictures and tests run.
"""

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE = DOCS / "hairstyles.md"
#: names of pages of docs/tutorials, in their order
TUTORIALS = (
    "first_hair",
    "comb_and_play",
    "cards_into_godot",
    "look_like_cycles",
    "eevee_shot",
)


def tutorial_page(name: str) -> Path:
    return DOCS / "tutorials" / f"{name}.md"


def tutorial(name: str) -> list[str]:
    """The code of each step of a tutorial; it may use `bpy`, a `folder` and a `last_frame`."""
    return steps(tutorial_page(name))["tutorial"]


def steps(page: Path = PAGE) -> dict[str, list[str]]:
    """Name of a hairstyle -> the code of each of its steps, which begin with their number."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"^```python ([a-z]+)\n(.*?)^```$", text, flags=re.M | re.S)
    return {name: re.split(r"^# \d\n", code, flags=re.M)[1:] for name, code in found}
