"""What people type after --set."""

import math

import pytest

from hairloom.addon.blender.command_line.overrides import overrides
from hairloom.addon.errors import HairloomError
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


def test_what_no_angle_may_be_is_said_in_degrees_too():
    with pytest.raises(HairloomError, match="-180 to 180 degrees"):
        StageSettings.from_dict(overrides(["stage.rim_side=-148"], "stage"), "--set")
