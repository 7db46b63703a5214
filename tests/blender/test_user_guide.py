"""Every panel of Hairloom stands in a picture of the user guide."""

import re
import sys
from pathlib import Path

import bpy
import pytest

from hairloom.addon import registration

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tests" / "window"))
from guide_panels import OTHERS, PICTURES, pictured  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")


def panels():
    return [each.__name__ for each in registration.CLASSES if issubclass(each, bpy.types.Panel)]


def test_every_panel_is_in_a_picture():
    assert [name for name in panels() if not pictured(name)] == []


def test_no_picture_is_of_a_panel_that_is_gone():
    named = {f"HAIRLOOM_PT_{each}" for columns in PICTURES.values() for c in columns for each in c}
    assert named - set(panels()) == set()


def test_the_user_guide_shows_all_of_these_pictures():
    guide = (REPOSITORY / "docs" / "user_guide.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"!\[[^\]]+\]\(images/panel_(\w+)\.png\)", guide))
    assert shown == {*PICTURES, *OTHERS}


def test_a_panel_that_is_in_none_is_found():
    assert not pictured("HAIRLOOM_PT_data_braids") and pictured("HAIRLOOM_PT_sidebar_look")
