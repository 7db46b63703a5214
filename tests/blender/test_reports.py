"""Reports of operators can be read again later."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon.blender.base.outcome import collected_reports, past_reports  # noqa: E402


@pytest.fixture(autouse=True)
def none_yet(extension):
    past_reports.clear()
    yield
    past_reports.clear()


def test_there_is_nothing_to_read_before_anything_is_reported():
    assert not bpy.ops.hairloom.show_reports.poll() and not bpy.ops.hairloom.copy_reports.poll()


def test_a_report_names_its_operator_and_its_kind(new_hair):
    hair = new_hair()
    bpy.ops.hairloom.look_to_material()
    (found,) = past_reports
    assert (found.source, found.kind) == ("Look to Material", "INFO")
    assert hair.name in found.text and len(found.time) == len("12:34:56")
    with pytest.raises(RuntimeError):
        bpy.ops.hairloom.apply_preset(name="looks/plaid")
    assert past_reports[-1].kind == "ERROR" and "plaid" in past_reports[-1].text


def test_reports_collected_by_a_job_belong_to_it(new_hair):
    new_hair()
    with collected_reports() as reports:
        bpy.ops.hairloom.look_to_material()
    assert reports.messages and not past_reports


def test_old_reports_are_dropped(new_hair):
    new_hair()
    for _ in range(past_reports.maxlen + 5):
        bpy.ops.hairloom.look_to_material()
    assert len(past_reports) == past_reports.maxlen
