"""Presets, shipped and own ones, applied by the menu and by the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy", reason="presets are applied inside Blender")

import bpy

from hairloom.addon.blender.command_line import command_line, job_options
from hairloom.addon.blender.properties import presets
from hairloom.addon.blender.properties.properties import settings_of
from hairloom.addon.blender.setup.starting import apply_presets
from hairloom.addon.errors import HairloomError
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import PRESET_VERSION
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.shafts_settings import ShaftSettings
from hairloom.addon.ui import preset_chooser


@pytest.fixture
def hair(new_hair: Callable[..., bpy.types.Object]) -> bpy.types.Object:
    return new_hair()


@pytest.mark.parametrize("name", [entry.name for entry in presets.shipped_presets("volume")])
def test_shadows_keep_key_fill_and_rim_light(name: str) -> None:
    """Lights without a map use occlusion instead of shadows, which is 30 % darker on blond hair."""
    assert presets.named_preset(name).settings.max_lights >= 3


@pytest.mark.parametrize("name", [entry.name for entry in presets.shipped_presets("shading")])
def test_a_look_goes_onto_the_selected_hair(hair: bpy.types.Object, name: str) -> None:
    assert bpy.ops.hairloom.apply_preset(name=name) == {"FINISHED"}
    applied = settings_of(hair.data.hairloom.shading, ShadingSettings).as_dict()
    for parameter, expected in presets.named_preset(name).settings.as_dict().items():
        is_word = isinstance(expected, str)
        assert applied[parameter] == (expected if is_word else pytest.approx(expected, rel=1e-6))


@pytest.mark.parametrize("section", list(preset_chooser.KINDS))
def test_the_panel_knows_which_preset_the_hair_has(hair: bpy.types.Object, section: str) -> None:
    """Values are stored with seven digits; each preset is still recognised by them."""
    choices = bpy.context.window_manager.hairloom_presets
    for entry in presets.shipped_presets(section):
        setattr(choices, section, entry.name)
        assert presets.matching_preset(hair, presets.shipped_presets(section)) == entry
        assert getattr(choices, section) == entry.name


def test_hair_with_a_setting_of_its_own_has_no_preset(hair: bpy.types.Object) -> None:
    choices = bpy.context.window_manager.hairloom_presets
    choices.shading = "looks/blond"
    hair.data.hairloom.shading.width_r *= 1.1
    assert choices.shading == "CUSTOM"
    choices.shading = "CUSTOM"  # changes nothing
    assert presets.matching_preset(hair, presets.shipped_presets("shading")) is None
    choices.shading = "looks/blond"
    assert choices.shading == "looks/blond"


def test_a_new_groom_has_the_look_that_it_was_given(hair: bpy.types.Object) -> None:
    """Its colour source is "own", which only counts once its curves have colours."""
    choices = bpy.context.window_manager.hairloom_presets
    apply_presets(hair, ("looks/brown",))
    assert hair.data.hairloom.shading.color_source == "own"
    assert choices.shading == "looks/brown"
    hair.data.attributes.new("color", "FLOAT_COLOR", "CURVE")
    assert choices.shading == "CUSTOM"


def test_a_preset_of_two_sections_needs_both(hair: bpy.types.Object) -> None:
    (crowd,) = (each for each in presets.shipped_presets("cards") if each.name == "cards/crowd")
    bpy.ops.hairloom.apply_preset(name=crowd.name)
    hair.data.hairloom.atlas.columns += 1
    assert presets.matching_preset(hair, (crowd,)) is None


def test_choosing_goes_to_all_selected_hair(
    hair: bpy.types.Object, new_hair: Callable[..., bpy.types.Object]
) -> None:
    other = new_hair()
    for each in (hair, other):
        each.select_set(True)
    bpy.context.window_manager.hairloom_presets.shading = "looks/red"
    for each in (hair, other):
        found = presets.matching_preset(each, presets.shipped_presets("shading"))
        assert found is not None and found.name == "looks/red"


def test_dynamics_go_onto_the_object(hair: bpy.types.Object) -> None:
    bpy.ops.hairloom.apply_preset(name="dynamics/soft")
    expected = presets.named_preset("dynamics/soft").settings.as_dict()["style_tip"]
    assert hair.hairloom.dynamics.style_tip == pytest.approx(expected)


def test_settings_that_a_groom_does_not_keep_are_refused(hair: bpy.types.Object) -> None:
    """The message names all settings that it does keep."""
    with pytest.raises(HairloomError, match="no 'settle' settings") as error:
        presets.apply(ALL_SETTINGS["settle"](), hair)
    assert "shading, " in str(error.value) and "volume" in str(error.value)
    assert "dynamics" in str(error.value) and " settle," not in str(error.value)


def test_an_unknown_name_is_reported_with_those_that_are_known(hair: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="looks/blond"):
        bpy.ops.hairloom.apply_preset(name="looks/plaid")


def test_a_name_cannot_leave_the_preset_folder() -> None:
    with pytest.raises(HairloomError, match="no such preset"):
        presets.named_preset("../package")


def test_the_command_line_takes_presets_and_single_values_over_them(tmp_path: Path) -> None:
    options = command_line.parser().parse_args(
        ["cards", "--output", "x.glb", "--preset", "looks/blond"]
        + ["--set", "shading.primary_strength=3"]
    )
    shading = job_options.settings_from_options(options)[ShadingSettings].as_dict()
    assert shading["primary_strength"] == 3.0
    blond = presets.named_preset("looks/blond").settings.as_dict()
    assert shading["base_color"] == blond["base_color"]


def test_a_preset_file_is_applied_and_kept(
    hair: bpy.types.Object, own_folder: Path, tmp_path: Path
) -> None:
    """Dropped into the viewport; another preset of the same title is added beside it."""
    file = tmp_path / "theirs.json"
    data = json.loads((presets.PRESET_FOLDER / "looks" / "red.json").read_text())
    file.write_text(json.dumps(data | {"title": "Theirs"}))
    for titles in (["Theirs"], ["Theirs", "Theirs 2"]):
        assert bpy.ops.hairloom.add_preset(filepath=str(file)) == {"FINISHED"}
        entries, warnings = presets.own_presets("shading")
        assert [entry.title for entry in entries] == titles and not warnings
    assert presets.matching_preset(hair, entries) == entries[0]


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("{", "cannot be read"),
        ('{"hairloom": 1, "section": "shading", "values": {"model": "plaid"}}', "plaid"),
        ((presets.PRESET_FOLDER / "stage" / "plain.json").read_text(), "has no 'stage'"),
    ],
)
def test_files_that_are_no_presets_are_refused_and_not_stored(
    hair: bpy.types.Object, own_folder: Path, tmp_path: Path, content: str, why: str
) -> None:
    (tmp_path / "theirs.json").write_text(content)
    with pytest.raises(RuntimeError, match=why):
        bpy.ops.hairloom.add_preset(filepath=str(tmp_path / "theirs.json"))
    assert not own_folder.exists()


@pytest.fixture
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder for the artist's own presets that does not exist yet."""
    folder = tmp_path / "presets"
    monkeypatch.setattr(presets, "own_folder", lambda: folder)
    return folder


def titles() -> list[str]:
    return [entry.title for entry in presets.own_presets("shading")[0]]


def test_a_look_is_saved_listed_applied_and_deleted(
    hair: bpy.types.Object, own_folder: Path
) -> None:
    shading = hair.data.hairloom.shading
    assert presets.own_presets("shading") == ((), ())
    shading.model, shading.width_r = "marschner", 0.123
    assert bpy.ops.hairloom.save_preset(title="  My Red, no. 2 ") == {"FINISHED"}
    assert [path.name for path in own_folder.iterdir()] == ["my_red_no_2.json"]
    ((entry,), warnings) = presets.own_presets("shading")
    assert (entry.name, entry.title, warnings) == ("own/my_red_no_2", "My Red, no. 2", ())
    assert entry.is_own and entry.icon == 0
    assert presets.own_presets("dynamics") == ((), ())
    shading.model, shading.width_r = "kajiya_kay", 0.2
    assert bpy.ops.hairloom.apply_preset(name=entry.name) == {"FINISHED"}
    assert shading.model == "marschner" and shading.width_r == pytest.approx(0.123)
    with pytest.raises(RuntimeError, match=r"no preset is named\. Name one of own/my_red_no_2"):
        bpy.ops.hairloom.delete_preset()
    assert bpy.ops.hairloom.delete_preset(name=entry.name) == {"FINISHED"}
    assert list(own_folder.iterdir()) == [] and titles() == []


def test_files_are_named_by_titles_of_all_scripts_and_take_no_others_place(
    hair: bpy.types.Object, own_folder: Path
) -> None:
    for title in ("前髪", "後髪", "Straße!", "Strasse", "con", "?!", "!?"):
        assert bpy.ops.hairloom.save_preset(title=title) == {"FINISHED"}
    names = {"前髪", "後髪", "straße", "strasse_2", "_con", "preset", "preset_2"}
    assert {path.stem for path in own_folder.iterdir()} == names
    assert bpy.ops.hairloom.apply_preset(name="own/前髪") == {"FINISHED"}


def test_the_name_that_is_offered_for_hair_of_a_long_name_is_free(
    hair: bpy.types.Object, own_folder: Path
) -> None:
    offered = []
    for _ in range(12):
        offered.append(
            presets.free_title("Aurelia of the Long Name  Head Hair, left side", "shading")
        )
        assert bpy.ops.hairloom.save_preset(title=offered[-1]) == {"FINISHED"}
    assert sorted(titles()) == sorted(set(offered)) and max(map(len, offered)) == 40
    assert offered[0].startswith("Aurelia") and offered[11].endswith(" 12")


def test_presets_of_all_kinds_are_saved_and_cards_bring_their_atlas(
    hair: bpy.types.Object, own_folder: Path
) -> None:
    groom = hair.data.hairloom
    groom.cards.card_count, groom.atlas.size, hair.hairloom.dynamics.drag = 77, "512", 0.5
    for section in ("cards", "dynamics", "volume"):
        assert bpy.ops.hairloom.save_preset(title="Mine", section=section) == {"FINISHED"}
        ((entry,), _) = presets.own_presets(section)
        assert entry.title == "Mine"
    assert presets.own_presets("shading") == ((), ())
    groom.cards.card_count, groom.atlas.size, hair.hairloom.dynamics.drag = 100, "1024", 0.0
    for section in ("cards", "dynamics"):
        bpy.ops.hairloom.apply_preset(name=presets.own_presets(section)[0][0].name)
    assert (groom.cards.card_count, groom.atlas.size) == (77, "512")
    assert hair.hairloom.dynamics.drag == 0.5


@pytest.mark.parametrize("section", ["shading", "dynamics", "volume", "cards"])
def test_every_preset_that_ships_goes_onto_a_groom_and_has_a_picture(
    hair: bpy.types.Object, section: str
) -> None:
    entries = presets.shipped_presets(section)
    assert len(entries) >= 3
    for entry in entries:
        assert bpy.ops.hairloom.apply_preset(name=entry.name) == {"FINISHED"}
        picture = entry.path.with_suffix(".png")
        assert picture.is_file() and picture.stat().st_size < 60_000, "run make pictures"


def test_only_a_preset_of_the_same_title_is_replaced(
    hair: bpy.types.Object, own_folder: Path
) -> None:
    shading = hair.data.hairloom.shading
    for title, width in (
        ("Fur", 0.1),
        ("fur!", 0.2),
        ("Fur", 0.3),
        ("\u0448\u0435\u0440\u0441\u0442\u044c", 0.4),
    ):
        shading.width_r = width
        bpy.ops.hairloom.save_preset(title=title)
    assert sorted(titles()) == sorted(["Fur", "fur!", "\u0448\u0435\u0440\u0441\u0442\u044c"])
    assert presets.named_preset("own/fur").settings.width_r == pytest.approx(0.3)
    assert presets.named_preset("own/fur_2").settings.width_r == pytest.approx(0.2)


def test_a_preset_without_a_name_is_refused(hair: bpy.types.Object, own_folder: Path) -> None:
    with pytest.raises(RuntimeError, match="needs a name"):
        bpy.ops.hairloom.save_preset(title="   ")
    assert not own_folder.exists()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff\xfe\x00garbage",
        b"[1, 2]",
        b"{}",
        b"[" * 100_000,
        b"{" + b" " * 2_000_000 + b"}",
        b'{"hairloom": 99, "section": "shading", "title": "x", "values": {}}',
        b'{"hairloom": 1, "section": "shading", "title": "x", "values": {"width_r": "wide"}}',
        b'{"hairloom": 1, "section": ["shading"], "title": "x", "values": {}}',
        b'__import__("os").abort()',
    ],
    ids=range(10),
)
def test_garbage_in_the_preset_folder_is_reported_and_harmless(
    hair: bpy.types.Object, own_folder: Path, content: bytes
) -> None:
    bpy.ops.hairloom.save_preset(title="Good")
    (own_folder / "bad.json").write_bytes(content)
    (own_folder / "folder.json").mkdir()
    (own_folder / "note.txt").write_text("not looked at")
    entries, warnings = presets.own_presets("shading")
    assert [entry.title for entry in entries] == ["Good"]
    assert [warning.split(" ")[0] for warning in warnings] == ["bad.json", "folder.json"]
    with pytest.raises(HairloomError):
        presets.named_preset("own/folder")


def test_a_title_that_is_too_long_or_of_many_lines_fits_a_menu(own_folder: Path) -> None:
    own_folder.mkdir()
    data = {"hairloom": PRESET_VERSION, "section": "shading", "title": "a\nb" * 99, "values": {}}
    (own_folder / "long.json").write_text(json.dumps(data))
    (title,) = titles()
    assert len(title) <= 40 and "\n" not in title


@pytest.mark.parametrize("name", ["own/../../secret", "own/missing", "looks/blond", "/etc/passwd"])
def test_only_own_presets_can_be_deleted(own_folder: Path, tmp_path: Path, name: str) -> None:
    secret = tmp_path.parent / "secret.json"
    secret.write_text("{}")
    with pytest.raises(HairloomError, match="you have no preset of this name"):
        presets.delete_own(name)
    assert secret.is_file()


def test_without_an_installed_extension_presets_go_to_blenders_settings() -> None:
    """Blender itself provides the folder of an installed extension; see
    tests/window/session_look.py."""
    folder = presets.own_folder()
    assert folder.is_absolute() and folder.parts[-2:] == ("hairloom", "presets")


def test_a_picture_beside_a_preset_goes_with_it(extension: Any, own_folder: Path) -> None:
    """tests/window/session_look.py tests its display; without a window Blender has no icons."""
    own_folder.mkdir()
    data = {"hairloom": PRESET_VERSION, "section": "shading", "title": "Seen", "values": {}}
    (own_folder / "seen.json").write_text(json.dumps(data))
    (own_folder / "seen.png").write_bytes(b"no picture")
    (entry,), _ = presets.own_presets("shading")
    assert entry.icon == entry.icon
    presets.delete_own(entry.name)
    assert list(own_folder.iterdir()) == []


def test_the_look_under_water_brings_its_shafts_of_light_with_it(hair: bpy.types.Object) -> None:
    shafts = hair.data.hairloom.shafts
    assert not shafts.use_shafts
    assert bpy.ops.hairloom.apply_preset(name="looks/under_water") == {"FINISHED"}
    assert shafts.use_shafts
    expected = presets.named_preset("looks/under_water").also
    assert (settings_of(shafts, ShaftSettings),) == expected
    options = command_line.parser().parse_args(
        ["render", "--output", "x.png", "--preset", "looks/under_water"]
    )
    assert job_options.settings_from_options(options)[ShaftSettings] == expected[0]


def test_a_title_stands_for_one_preset(hair: bpy.types.Object, own_folder: Path) -> None:
    """An artist may give an own look the title of a shipped one."""
    assert presets.names_by_title("dynamics")["Soft and long"] == "dynamics/soft"
    for title in ("Brown", "Mine"):
        bpy.ops.hairloom.save_preset(title=title)
    found = presets.names_by_title("shading")
    assert found["Brown"] == "looks/brown" and found["own/brown"] == "own/brown"
    assert found["Mine"] == "own/mine"


def test_a_title_in_capitals_is_the_same_title(hair: bpy.types.Object, own_folder: Path) -> None:
    """As the dialog states, and as file names behave on Windows and macOS."""
    for title, width in (("Bob", 0.1), ("BOB", 0.2)):
        hair.data.hairloom.shading.width_r = width
        bpy.ops.hairloom.save_preset(title=title)
    assert titles() == ["BOB"]
    (file,) = own_folder.glob("*.json")
    file.rename(own_folder / "Fur.json")
    bpy.ops.hairloom.save_preset(title="Fur")
    names = [path.stem.casefold() for path in own_folder.glob("*.json")]
    assert len(set(names)) == len(names) == 2
