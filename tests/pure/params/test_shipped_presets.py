"""Every preset that ships is checked by the same reader that an artist's files pass."""

from __future__ import annotations

from pathlib import Path

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import read_any_preset

FOLDER = Path(__file__).parents[3] / "presets"
PRESETS = sorted(FOLDER.rglob("*.json"))


def test_presets_ship() -> None:
    assert {path.parent.name for path in PRESETS} >= {"looks", "dynamics"}


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.stem)
def test_a_shipped_preset_is_sound_and_says_where_it_comes_from(path: Path) -> None:
    preset = read_any_preset(path, ALL_SETTINGS)
    assert preset.title and preset.source


def test_titles_within_a_section_differ() -> None:
    shown = [
        (preset.settings.section, preset.title)
        for preset in (read_any_preset(path, ALL_SETTINGS) for path in PRESETS)
    ]
    assert len(set(shown)) == len(shown)


@pytest.mark.parametrize("text", ["[]", '{"section": 3}', '{"section": "paint", "values": {}}'])
def test_a_preset_of_no_known_kind_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "odd.json"
    path.write_text(text)
    with pytest.raises(HairloomError, match="no known kind") as caught:
        read_any_preset(path, ALL_SETTINGS)
    assert caught.value.place == str(path)
