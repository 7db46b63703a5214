"""The budget of GPU memory: in the preferences, in the panel, and for pictures kept by views."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from hairloom.addon.blender.base import gpu_preferences
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.render import gpu_memory, gpu_objects
from hairloom.addon.ui import preferences
from hairloom.addon.ui.state import problems_of

pytestmark = pytest.mark.usefixtures("gpu_context", "extension")
MEGABYTE = 1 << 20


@pytest.fixture(autouse=True)
def automatic(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.delenv(gpu_memory.MEMORY_VARIABLE, raising=False)
    yield
    gpu_preferences.apply()


def chosen(megabytes: int) -> None:
    page = SimpleNamespace(image_atomics="automatic", gpu_memory=megabytes)
    preferences._apply_gpu_preferences(page, bpy.context)


def test_the_preference_is_the_budget_and_is_never_too_little_to_draw() -> None:
    assert gpu_memory.budget() == gpu_preferences.DEFAULT_MEMORY * MEGABYTE
    chosen(4096)
    assert gpu_memory.budget() == 4096 * MEGABYTE
    page = bpy.types.AddonPreferences.bl_rna_get_subclass_py("HAIRLOOM_AP_preferences").bl_rna
    setting = page.properties["gpu_memory"]
    assert (setting.hard_min, setting.default) == (
        gpu_preferences.MIN_MEMORY,
        gpu_preferences.DEFAULT_MEMORY,
    )


def test_the_panel_says_what_to_do_when_the_budget_is_exceeded(
    new_hair: Callable[..., Any], sphere: Any, get_depsgraph: Callable[[], Any]
) -> None:
    hair = new_hair(sphere)
    session = previews.start(hair, get_depsgraph())

    def warnings() -> list[str]:
        return [one.text for one in problems_of(hair, session) if "GPU" in one.text]

    gpu_objects.free_unused()
    before = gpu_objects.bytes_in_use()  # other tests of this process hold some memory
    budget = 128 + round(before / MEGABYTE)
    chosen(budget)
    assert not warnings()
    side = 4096  # 256 MB
    large = gpu_objects.texture((side, side), format="RGBA32F")
    (text,) = warnings()
    taken = before / MEGABYTE + 256
    assert (
        f"takes {taken:,.0f} MB" in text
        and f"may take {budget:,} MB" in text
        and "preferences" in text
    )
    del large
    gpu_objects.free_unused()
    assert not warnings()


@pytest.mark.parametrize("is_short", [False, True])
def test_a_view_keeps_no_picture_where_memory_is_short(
    monkeypatch: pytest.MonkeyPatch, is_short: bool
) -> None:
    calls: list[str] = []
    picture = SimpleNamespace(
        begin=lambda: calls.append("begin"), release=lambda: calls.append("release"), key=()
    )
    view = SimpleNamespace(picture=picture, has_new_key=lambda _: False, address=0)
    monkeypatch.setattr(gpu_memory, "exceeds_budget", lambda: is_short)
    overlay._draw_hair(view, None, [], ("drawn",))  # type: ignore[arg-type]
    assert calls == (["release"] if is_short else ["begin"])
    assert picture.key == (() if is_short else ("drawn",))
