"""The words that the glossary retires are used nowhere."""

from __future__ import annotations

from pathlib import Path

import words

#: What is still used, by kind of text and term. A number may only fall: where fewer are
#: left, `.venv/bin/python tools/words.py counts` prints the table to put here. Empty is the aim;
#: after that this table goes away.
LEFT: dict[tuple[str, str], int] = {
    ("code", "told"): 2,
    ("code", "wishes"): 3,
    ("code", "hair_out"): 1,
    ("code", "card_choices"): 1,
    ("code", "strand_choices"): 1,
    ("code", "ways"): 1,
    ("code", "share"): 1,
    ("code", "most_"): 1,
    ("code", "least_"): 1,
}

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
    grown = [
        f"{retired.scope}: `{retired.term}` {words.amount(found)}, not {allowed}; "
        f"say {retired.instead}: {', '.join(str(use) for use in found[:20])}"
        for retired, found in words.uses().items()
        if words.amount(found) > (allowed := LEFT.get((retired.scope, retired.term), 0))
    ]
    assert grown == []


def test_what_is_left_is_retired() -> None:
    known = {(retired.scope, retired.term) for retired in words.retired_terms()}
    assert set(LEFT) - known == set()


def test_each_kind_of_use_is_seen(tmp_path: Path) -> None:
    """The first test can fail, and does not where a word only looks like a retired one."""
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
    assert [words.amount(places) for places in uses.values()] == [2, 4, 1, 3, 1, 1]
