"""The words that the glossary retires are used nowhere."""

from __future__ import annotations

from pathlib import Path

import words

#: What is still used, by kind of text and term. A number may only fall: where fewer are
#: left, `.venv/bin/python tools/words.py counts` prints the table to put here. Empty is the aim;
#: after that this table goes away.
LEFT: dict[tuple[str, str], int] = {
    ("prose", "hangs on"): 16,
    ("prose", "hang on"): 3,
    ("prose", "hung on"): 1,
    ("prose", "anew"): 20,
    ("prose", "told"): 31,
    ("prose", "in the place of"): 3,
    ("prose", "stands in for"): 1,
    ("prose", "mend"): 2,
    ("prose", "mends"): 1,
    ("prose", "share of"): 32,
    ("prose", "shares of"): 2,
    ("prose", "fingerprint"): 4,
    ("prose", "fingerprints"): 1,
    ("prose", "hiders"): 3,
    ("prose", "so many"): 26,
    ("code", "anew"): 3,
    ("code", "told"): 6,
    ("code", "retold"): 1,
    ("code", "lacks"): 1,
    ("code", "awaited"): 1,
    ("code", "waits"): 1,
    ("code", "making"): 1,
    ("code", "trouble"): 1,
    ("code", "troubles"): 1,
    ("code", "mend"): 2,
    ("code", "aids"): 2,
    ("code", "hiders"): 3,
    ("code", "fingerprint"): 2,
    ("code", "wishes"): 3,
    ("code", "hair_out"): 1,
    ("code", "card_choices"): 1,
    ("code", "strand_choices"): 1,
    ("code", "sort_choices"): 1,
    ("code", "cv_between"): 1,
    ("code", "hair_between"): 3,
    ("code", "darts"): 4,
    ("code", "locks"): 4,
    ("code", "way"): 21,
    ("code", "ways"): 9,
    ("code", "bow"): 7,
    ("code", "share"): 17,
    ("code", "shares"): 7,
    ("code", "groom_moment"): 1,
    ("code", "most_"): 22,
    ("code", "at_most"): 2,
    ("code", "least_"): 17,
    ("code", "at_least"): 1,
    ("code", "pace"): 3,
    ("code", "read_apart"): 1,
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
