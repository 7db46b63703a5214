"""No text or name uses a word that the glossary retires."""

from __future__ import annotations

from pathlib import Path

import words

GLOSSARY = """\
## Retired in prose
| Do not say | Say |
| --- | --- |
| `hangs on`, `anew` | depends on; again |
| `Leave Out` | Culling |

## Retired as identifiers
| Do not write | Write |
| --- | --- |
| `late`, `stand_in`, `most_` | `deferred`, `placeholder`, `max_` |
"""


def test_no_retired_word_is_used() -> None:
    used = [
        f"{term.scope}: `{term.term}`; say {term.replacement}: {', '.join(map(str, uses))}"
        for term, uses in words.uses().items()
        if uses
    ]
    assert used == []


def test_each_kind_of_use_is_seen(tmp_path: Path) -> None:
    """Retired words are found in each kind of text, and similar words are not."""
    files = {
        "docs/glossary.md": GLOSSARY,
        "docs/page.md": "# Page\n\nIt hangs\non this. `anew`\n\n```\nanew\n```\nOr leave out.\n",
        "addon/late.py": (
            '"""Made anew,\nand later."""\n'
            "# it hangs\n# on that\n"
            'KEYS = ["LateHair", "is Leave Out", "latest"]\n'
            "def is_late(stand_in, standing): ...\n"
        ),
        "gpu_shaders/lib_x.glsl": "// one\n// anew\nfloat late = 1.0; // anew\n",
        "presets/x.json": '{"late": "all anew", "most": 1, "MOST_ROWS": 2}',
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    uses = words.uses(tmp_path)
    found = {retired.term: [str(use) for use in places] for retired, places in uses.items()}
    assert found == {
        "hangs on": ["docs/page.md:3", "addon/late.py:3"],
        "anew": [
            "addon/late.py:1",
            "gpu_shaders/lib_x.glsl:2",
            "gpu_shaders/lib_x.glsl:3",
            "presets/x.json:1",
        ],
        "Leave Out": ["addon/late.py:5"],
        "late": [
            "addon/late.py:5 LateHair",
            "addon/late.py:6 is_late",
            "addon/late.py:1 late",
            "gpu_shaders/lib_x.glsl:3 late",
            "presets/x.json:1 late",
        ],
        "stand_in": ["addon/late.py:6 stand_in"],
        "most_": ["presets/x.json:1 MOST_ROWS"],
    }
    assert [words.count_uses(places) for places in uses.values()] == [2, 4, 1, 3, 1, 1]
