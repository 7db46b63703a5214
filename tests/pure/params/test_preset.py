"""Presets: they are read as saved, and errors name file, value and remedy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.params import preset
from hairloom.addon.params.preset import PRESET_VERSION, Preset, preset_as_dict, read_any_preset

pytestmark = pytest.mark.portable

KINDS = {GrowSettings.section: GrowSettings}
GOOD: dict[str, Any] = {
    "hairloom": PRESET_VERSION,
    "section": "grow",
    "title": "Short",
    "source": "Hairloom",
    "values": {"length": 0.05, "strand_count": 10_000},
}


def written(folder: Path, data: object) -> Path:
    path = folder / "short.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return path


def test_a_preset_comes_back_as_saved(tmp_path: Path) -> None:
    saved = Preset("Short", "Hairloom", GrowSettings(length=0.05, strand_count=10_000))
    again = read_any_preset(written(tmp_path, preset_as_dict(saved)), KINDS)
    assert again == saved
    assert read_any_preset(written(tmp_path, GOOD), KINDS) == saved


@pytest.mark.parametrize(
    ("change", "problem", "remedy"),
    [
        ({"values": {"length": -1.0}}, "'length' is -1.0, but it must lie from", "Use a value"),
        ({"values": {"length": "long"}}, "'length' is 'long'", "Use a value"),
        ({"values": {"lenght": 0.1}}, "unknown grow parameter 'lenght'", "Did you mean length"),
        ({"values": [1, 2]}, "not a Hairloom preset", "Choose a preset"),
        (
            {"section": "guides"},
            "an unknown kind ('guides')",
            "Choose a preset of grow",
        ),
        ({"hairloom": PRESET_VERSION + 1}, f"{PRESET_VERSION + 1}", ""),
        ({"hairloom": "one"}, "'one'", ""),
        ({"hairloom": None}, "None", ""),
    ],
)
def test_a_bad_preset_names_file_value_and_remedy(
    tmp_path: Path, change: dict[str, Any], problem: str, remedy: str
) -> None:
    path = written(tmp_path, GOOD | change)
    with pytest.raises(HairloomError) as caught:
        read_any_preset(path, KINDS)
    assert caught.value.place == str(path)
    assert problem in caught.value.problem
    assert caught.value.remedy.startswith(remedy)
    assert caught.value.remedy


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "import os", "\x00\x01", '{"values": 3}'])
def test_garbage_is_refused_with_the_file_named(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(HairloomError) as caught:
        read_any_preset(path, KINDS)
    assert caught.value.place == str(path)


def test_bytes_that_are_no_text_and_a_missing_file_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "binary.json"
    path.write_bytes(b"\xff\xfe\xfa{}")
    for broken in (path, tmp_path / "missing.json", tmp_path):
        with pytest.raises(HairloomError, match=broken.name):
            read_any_preset(broken, KINDS)


def test_older_versions_go_up_one_step_at_a_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Version n - 2 names the length "size", version n - 1 stores it in centimetres."""

    def renamed(data: dict[str, Any]) -> dict[str, Any]:
        return data | {"values": {"length_cm": data["values"]["size"]}}

    def in_metres(data: dict[str, Any]) -> dict[str, Any]:
        return data | {"values": {"length": data["values"]["length_cm"] / 100.0}}

    now = PRESET_VERSION + 2
    monkeypatch.setattr(preset, "PRESET_VERSION", now)
    monkeypatch.setattr(preset, "MIGRATIONS", {now - 2: renamed, now - 1: in_metres})
    old = written(tmp_path, GOOD | {"hairloom": now - 2, "values": {"size": 25.0}})
    assert read_any_preset(old, KINDS).settings.length == 0.25
