"""The words that the glossary retires are used nowhere."""

from __future__ import annotations

from pathlib import Path

import words

#: Uses that are still there, by kind of text and term. A number may only fall: where fewer are
#: left, `.venv/bin/python tools/words.py counts` prints the table to put here. Empty is the aim;
#: after that this table goes away.
LEFT: dict[tuple[str, str], int] = {
    ("prose", "hangs on"): 41,
    ("prose", "hang on"): 22,
    ("prose", "hung on"): 2,
    ("prose", "anew"): 48,
    ("prose", "told"): 67,
    ("prose", "in the place of"): 14,
    ("prose", "stand-in"): 2,
    ("prose", "stands in for"): 9,
    ("prose", "stand in for"): 3,
    ("prose", "mend"): 8,
    ("prose", "mends"): 5,
    ("prose", "mended"): 4,
    ("prose", "share of"): 173,
    ("prose", "shares of"): 16,
    ("prose", "fingerprint"): 4,
    ("prose", "fingerprints"): 1,
    ("prose", "hiders"): 4,
    ("prose", "aids"): 1,
    ("prose", "so many"): 51,
    ("prose", "Way"): 2,
    ("prose", "Most Pieces"): 3,
    ("prose", "Leave Out"): 4,
    ("prose", "Least Share"): 3,
    ("prose", "Wind Rise"): 3,
    ("prose", "Swing Damping"): 3,
    ("prose", "Push-out Speed"): 6,
    ("prose", "Computed On"): 7,
    ("prose", "Volume Shade"): 5,
    ("prose", "Rest Strength"): 2,
    ("prose", "On Body"): 5,
    ("prose", "Open Sky"): 2,
    ("prose", "Own Card"): 2,
    ("prose", "Show Slices"): 5,
    ("prose", "Several Hairs"): 1,
    ("code", "anew"): 26,
    ("code", "told"): 53,
    ("code", "retold"): 14,
    ("code", "late"): 16,
    ("code", "lacks"): 4,
    ("code", "awaited"): 16,
    ("code", "waits"): 89,
    ("code", "asks"): 6,
    ("code", "serve"): 7,
    ("code", "stand_in"): 3,
    ("code", "making"): 85,
    ("code", "makings"): 13,
    ("code", "trouble"): 27,
    ("code", "troubles"): 32,
    ("code", "mend"): 16,
    ("code", "aids"): 17,
    ("code", "hiders"): 45,
    ("code", "fingerprint"): 27,
    ("code", "wishes"): 65,
    ("code", "hair_out"): 21,
    ("code", "card_choices"): 22,
    ("code", "map_choices"): 2,
    ("code", "strand_choices"): 5,
    ("code", "sort_choices"): 10,
    ("code", "joint_choices"): 8,
    ("code", "motion_choices"): 16,
    ("code", "card_form"): 37,
    ("code", "opacity_form"): 17,
    ("code", "mesh_form"): 3,
    ("code", "cv_between"): 6,
    ("code", "hair_between"): 15,
    ("code", "other_hair"): 31,
    ("code", "even_alpha"): 13,
    ("code", "darts"): 60,
    ("code", "locks"): 12,
    ("code", "way"): 548,
    ("code", "ways"): 114,
    ("code", "bow"): 49,
    ("code", "share"): 512,
    ("code", "shares"): 98,
    ("code", "groom_moment"): 5,
    ("code", "most"): 258,
    ("code", "least"): 261,
    ("code", "pace"): 24,
    ("code", "run_apart"): 5,
    ("code", "read_apart"): 2,
    ("code", "leftovers"): 11,
    ("code", "disk_room"): 2,
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
| `late`, `stand_in` | `deferred`, `placeholder` |
"""


def test_no_retired_word_is_used() -> None:
    grown = [
        f"{retired.scope}: `{retired.term}` {len(places)} times, not {allowed}; "
        f"say {retired.instead}: {', '.join(places[:20])}"
        for retired, places in words.uses().items()
        if len(places) > (allowed := LEFT.get((retired.scope, retired.term), 0))
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
        "presets/x.json": '{"late": "all anew"}',
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    found = {retired.term: places for retired, places in words.uses(tmp_path).items()}
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
            "addon/late.py:5",
            "addon/late.py:6",
            "addon/late.py:1",
            "gpu_shaders/lib_x.glsl:3",
            "presets/x.json:1",
        ],
        "stand_in": ["addon/late.py:6"],
    }
