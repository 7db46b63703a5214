"""Values after --set on the command line."""

import math

import pytest

from hairloom.addon.blender.command_line.command_line import parser
from hairloom.addon.blender.command_line.job_options import settings_from_options
from hairloom.addon.blender.command_line.overrides import overrides
from hairloom.addon.blender.properties import presets
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.stage_settings import StageSettings


@pytest.mark.parametrize("text", ["[" * 200_000, "9" * 5000, '{"a":' * 50_000])
def test_a_value_of_the_command_line_that_json_refuses_is_a_text(text):
    assert overrides([f"guides.guide_count={text}"], "guides") == {"guide_count": text}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-148deg", math.radians(-148.0)),
        ("90°", 0.5 * math.pi),
        (".5", 0.5),
        ("1.", 1.0),
        ("+2e-1", 0.2),
        (".1,.2,1", [0.1, 0.2, 1.0]),
        ("deg", "deg"),
        ("1.2.3", "1.2.3"),
        ("nan", "nan"),
    ],
)
def test_a_number_is_read_as_people_write_it(text, value):
    (found,) = overrides([f"stage.rim_side={text}"], "stage").values()
    assert found == (value if isinstance(value, str) else pytest.approx(value))


def test_messages_about_angles_are_in_degrees_too():
    with pytest.raises(HairloomError, match="-180 to 180 degrees"):
        StageSettings.from_dict(overrides(["stage.rim_side=-148"], "stage"), "--set")


@pytest.mark.parametrize(
    ("kind", "setting", "why"),
    [
        (ShadingSettings, "shading.tip_color=0.5", "it must be 3 numbers, red, green and blue"),
        (ShadingSettings, "shading.tip_color=#ff8800", "it must be 3 numbers, red, green and blue"),
        (DynamicsSettings, "dynamics.style_along=1,2", "it must be 5 numbers, from root to tip"),
        (DynamicsSettings, "dynamics.damping=", "it must be a number"),
        (DynamicsSettings, "dynamics.damping=1,2", "it must be a number"),
        (GuideSettings, "guides.guide_count=many", "it must be a number"),
    ],
)
def test_messages_about_values_are_in_plain_words(kind, setting, why):
    with pytest.raises(HairloomError, match=why):
        kind.from_dict(overrides([setting], kind.section), "--set")


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("blond", "Did you mean looks/blond? "),
        ("looks/blond.json", "Did you mean looks/blond? "),
        ("mine", "Did you mean own/mine? "),
        ("", "Use a file"),
        ("what is not there", "Use a file"),
    ],
)
def test_an_unknown_preset_is_answered_with_similar_names(name, meant, tmp_path, monkeypatch):
    monkeypatch.setattr(presets, "own_folder", lambda: tmp_path)
    presets.save_own("Mine", ShadingSettings())
    with pytest.raises(HairloomError) as caught:
        presets.named_preset(name)
    assert caught.value.remedy.startswith(meant) and "own/mine" in caught.value.remedy
    assert caught.value.problem.startswith("there is no such" if name else "no preset is named")


def test_an_unknown_stage_is_answered_with_the_stages():
    whole = ["render", "--stage", "daylite", "--output", "a.png"]
    with pytest.raises(HairloomError) as caught:
        settings_from_options(parser().parse_args(whole))
    assert caught.value.remedy.startswith("Did you mean stage/daylight? ")
    assert "looks/" not in caught.value.remedy
