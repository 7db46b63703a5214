"""The words that the glossary retires are used nowhere."""

from __future__ import annotations

from pathlib import Path

import words

#: What is still used, by kind of text and term. A number may only fall: where fewer are
#: left, `.venv/bin/python tools/words.py counts` prints the table to put here. Empty is the aim;
#: after that this table goes away.
LEFT: dict[tuple[str, str], int] = {
    ("prose", "hangs on"): 30,
    ("prose", "hang on"): 11,
    ("prose", "hung on"): 1,
    ("prose", "anew"): 31,
    ("prose", "told"): 49,
    ("prose", "in the place of"): 8,
    ("prose", "stand-in"): 2,
    ("prose", "stands in for"): 5,
    ("prose", "mend"): 7,
    ("prose", "mends"): 3,
    ("prose", "mended"): 2,
    ("prose", "share of"): 163,
    ("prose", "shares of"): 15,
    ("prose", "fingerprint"): 4,
    ("prose", "fingerprints"): 1,
    ("prose", "hiders"): 4,
    ("prose", "aids"): 1,
    ("prose", "so many"): 50,
    ("prose", "Way"): 3,
    ("prose", "Most Pieces"): 3,
    ("prose", "Leave Out"): 4,
    ("prose", "Least Share"): 4,
    ("prose", "Wind Rise"): 3,
    ("prose", "Swing Damping"): 3,
    ("prose", "Push-out Speed"): 6,
    ("prose", "Computed On"): 6,
    ("prose", "Volume Shade"): 5,
    ("prose", "Rest Strength"): 2,
    ("prose", "On Body"): 4,
    ("prose", "Open Sky"): 2,
    ("prose", "Own Card"): 2,
    ("prose", "Show Slices"): 5,
    ("prose", "Several Hairs"): 1,
    ("code", "anew"): 4,
    ("code", "told"): 6,
    ("code", "retold"): 1,
    ("code", "late"): 3,
    ("code", "lacks"): 2,
    ("code", "awaited"): 1,
    ("code", "waits"): 2,
    ("code", "making"): 4,
    ("code", "trouble"): 3,
    ("code", "troubles"): 5,
    ("code", "mend"): 5,
    ("code", "aids"): 5,
    ("code", "hiders"): 5,
    ("code", "fingerprint"): 2,
    ("code", "wishes"): 3,
    ("code", "hair_out"): 1,
    ("code", "card_choices"): 2,
    ("code", "map_choices"): 1,
    ("code", "strand_choices"): 1,
    ("code", "sort_choices"): 1,
    ("code", "joint_choices"): 1,
    ("code", "motion_choices"): 2,
    ("code", "card_form"): 2,
    ("code", "opacity_form"): 1,
    ("code", "mesh_form"): 1,
    ("code", "cv_between"): 1,
    ("code", "hair_between"): 4,
    ("code", "other_hair"): 2,
    ("code", "even_alpha"): 2,
    ("code", "darts"): 4,
    ("code", "locks"): 4,
    ("code", "way"): 21,
    ("code", "ways"): 9,
    ("code", "bow"): 7,
    ("code", "share"): 33,
    ("code", "shares"): 13,
    ("code", "groom_moment"): 1,
    ("code", "most_"): 43,
    ("code", "at_most"): 3,
    ("code", "least_"): 47,
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
