"""Every panel of Hairloom is in a picture of the user guide."""

import re
import sys
from pathlib import Path

import bpy
import pytest

from hairloom.addon import registration

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tests" / "window"))
import panel_texts  # noqa: E402
from guide_panels import OTHER_PICTURES, PICTURES, is_pictured  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")


def panels():
    return [each.__name__ for each in registration.CLASSES if issubclass(each, bpy.types.Panel)]


def test_every_panel_is_in_a_picture():
    assert [name for name in panels() if not is_pictured(name)] == []


def test_no_picture_is_of_a_panel_that_is_gone():
    named = {f"HAIRLOOM_PT_{each}" for columns in PICTURES.values() for c in columns for each in c}
    assert named - set(panels()) == set()


def test_the_user_guide_shows_all_of_these_pictures():
    guide = (REPOSITORY / "docs" / "user_guide.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"!\[[^\]]+\]\(images/panel_(\w+)\.png\)", guide))
    assert shown == {*PICTURES, *OTHER_PICTURES}


@pytest.mark.slow
def test_the_pictures_show_the_current_texts_of_panels():
    kept, now = panel_texts.stored_texts(), panel_texts.texts()
    stale = [name for name in now if now[name] != kept.get(name)]
    assert stale == [], "make test-ui SESSIONS=session_guide_pictures; tools/guide_pictures.py"


def test_stored_panel_texts_have_labels_defaults_buttons_and_keyframes():
    """Shows that the test above can fail."""
    now = panel_texts.texts()
    assert {"Guides: 762, no keyframes", "Add Modifier", "Detail: adaptive"} <= set(now["strands"])
    assert "Look: Brown" in now["preferences"]
    assert set(now) == {*PICTURES, "preferences"}


def test_a_panel_without_a_picture_is_found():
    assert not is_pictured("HAIRLOOM_PT_data_braids") and is_pictured("HAIRLOOM_PT_sidebar_look")
