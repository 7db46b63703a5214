"""Every shipped preset is checked with the reader for artists' files."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import preset_as_dict, read_any_preset
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.shafts_settings import ShaftSettings

pytestmark = pytest.mark.portable

FOLDER = Path(__file__).parents[3] / "presets"
PRESETS = sorted(FOLDER.rglob("*.json"))


def test_presets_ship() -> None:
    assert {path.parent.name for path in PRESETS} >= {"looks", "dynamics"}


def test_the_quick_start_shows_each_preset_above_its_name() -> None:
    """Except looks and stages, which have their own sheets."""
    page = (FOLDER.parent / "docs" / "quick_start.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("|")]
    named: dict[str, str] = {}
    for above, below in pairwise(row for row in rows if "---" not in row):
        named |= {
            link: name.strip(" *")
            for picture, name in zip(above, below, strict=False)
            for link in re.findall(r"\(\.\./presets/(\w+/\w+)\.png\)", picture)
        }
    assert named == {
        f"{path.parent.name}/{path.stem}": json.loads(path.read_text(encoding="utf-8"))["title"]
        for path in PRESETS
        if path.parent.name not in ("looks", "stage")
    }


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
    with pytest.raises(HairloomError, match="unknown kind") as caught:
        read_any_preset(path, ALL_SETTINGS)
    assert caught.value.place == str(path)


def test_a_preset_may_bring_along_other_sections(tmp_path: Path) -> None:
    path = tmp_path / "wet.json"
    data = {"hairloom": 1, "section": "shading", "title": "x", "values": {}}
    path.write_text(json.dumps(data | {"also": {"shafts": {"use_shafts": True, "length": 0.7}}}))
    preset = read_any_preset(path, ALL_SETTINGS)
    assert [settings.section for settings in preset.all] == ["shading", "shafts"]
    assert preset.also == (ShaftSettings(use_shafts=True, length=0.7),)
    path.write_text(json.dumps(preset_as_dict(preset)))
    assert read_any_preset(path, ALL_SETTINGS) == preset


@pytest.mark.parametrize("also", [["shafts"], {"paint": {}}, {"shafts": 3}, "shafts", None])
def test_what_a_preset_brings_along_is_checked(tmp_path: Path, also: object) -> None:
    path = tmp_path / "odd.json"
    data = {"hairloom": 1, "section": "shading", "title": "x", "values": {}, "also": also}
    path.write_text(json.dumps(data))
    with pytest.raises(HairloomError, match="unknown kind"):
        read_any_preset(path, ALL_SETTINGS)


def test_the_strengths_and_widths_of_the_looks_are_those_of_their_page() -> None:
    """docs/shading.md lists all strengths other than 1, for single looks or for all natural
    ones."""
    page = (FOLDER.parent / "docs" / "shading.md").read_text(encoding="utf-8")
    documented: dict[str, dict[str, float]] = {}
    rows = re.findall(r"^\| ([a-z ]+) \| ((?:R|TRT) [^|]+)\|", page, flags=re.M)
    for look, values in rows:
        for part in values.split(", "):
            found = re.match(r"(?:([a-z]+) |(R|TRT) )([\d.]+)", part)
            if found:
                lobe = found.group(2) or "TRT"
                documented.setdefault(found.group(1) or look, {})[lobe] = float(found.group(3))
    everywhere = documented.pop("all natural looks")
    for path in PRESETS:
        settings = read_any_preset(path, ALL_SETTINGS).settings
        if not isinstance(settings, ShadingSettings) or settings.model != "marschner":
            continue
        of_look = documented.get(path.stem, {})
        is_water = path.stem == "under_water"
        strengths = {"R": 1.0, "TRT": 1.0, **({} if is_water else everywhere), **of_look}
        assert {"R": settings.strength_r, "TRT": settings.strength_trt} == strengths, path
        assert settings.ambient == settings.strength_tt == settings.strength_higher == 1.0, path
        assert (1.45 < settings.width_trt / settings.width_r < 2.05) is not is_water, path


def test_only_the_look_under_water_has_shafts_of_light() -> None:
    presets = {path: read_any_preset(path, ALL_SETTINGS) for path in PRESETS}
    shafts = {
        path.stem: settings
        for path, preset in presets.items()
        for settings in preset.also
        if isinstance(settings, ShaftSettings)
    }
    assert set(shafts) == {"under_water"} and shafts["under_water"].use_shafts
    assert not ShaftSettings().use_shafts
