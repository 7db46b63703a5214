"""The steps of docs/hairstyles.md: its blocks of Python, which pictures and a test walk."""

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "docs" / "hairstyles.md"


def steps() -> dict[str, list[str]]:
    """Name of a hairstyle -> the code of each of its steps, which begin with their number."""
    text = PAGE.read_text(encoding="utf-8")
    found = re.findall(r"^```python ([a-z]+)\n(.*?)^```$", text, flags=re.M | re.S)
    return {name: re.split(r"^# \d\n", code, flags=re.M)[1:] for name, code in found}
