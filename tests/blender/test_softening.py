"""Scheduling of soft shadows: which view gets samples, and when."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from hairloom.addon.blender.viewport import softening, views
from hairloom.addon.render import gpu_memory, gpu_objects
from hairloom.addon.shading.lights import Light

SUN = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 1.0, 0.2)
NARROW = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 1.0)


class Sums:
    """Replaces the sums of samples, which need a GPU."""

    def __init__(self) -> None:
        self.count = 0

    def release(self) -> None:
        self.count = 0

    def missing_bytes(self) -> int:
        return 0 if self.count else 1 << 20


class Pass:
    """Replaces a strand pass; records the views that it should forget."""

    def __init__(self) -> None:
        self.forgotten: list[object] = []

    def forget_view(self, name: object) -> None:
        self.forgotten.append(name)


@pytest.fixture
def two_views(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[views.View, views.View]]:
    monkeypatch.setattr(softening._softening, "picture", Sums())
    monkeypatch.setattr(softening, "redraw_view", lambda address: address != 9)
    one, other = (views.view_of(SimpleNamespace(as_pointer=lambda at=at: at)) for at in (7, 8))
    yield one, other
    softening.forget()
    views.forget_views()


def sampled(view: views.View, samples: int, fragments: int = 100) -> Pass:
    """Simulate a redraw that takes a sample."""
    assert softening.takes_sample(view) and not softening.takes_sample(view)
    hair = Pass()
    is_shown = softening.is_next_shown(view, samples)
    softening.sums().count += 1
    view.is_soft |= is_shown
    softening.was_sampled(view, samples, [hair], (fragments,))
    return hair


def test_only_lights_with_a_size_are_worth_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(softening, "is_software", lambda: False)
    assert softening.is_worth_it((NARROW, SUN), 2)
    assert not softening.is_worth_it((NARROW, SUN), 1), "switched off"
    assert not softening.is_worth_it((NARROW, NARROW), 32) and not softening.is_worth_it((), 32)
    monkeypatch.setattr(softening, "is_software", lambda: True)
    assert not softening.is_worth_it((SUN,), 32)


def test_views_get_their_samples_in_turn_and_then_no_more(
    two_views: tuple[views.View, ...],
) -> None:
    for view in two_views:
        softening.soften(view)
    order = []
    for _ in range(30):
        softening._ask()
        due = [view for view in two_views if softening._softening.view is view]
        if not due:
            break
        order.append(two_views.index(due[0]))
        hair = sampled(due[0], 10)
        assert due[0].is_soft == (order.count(order[-1]) >= 8), "few samples are not shown"
    assert order == [0] * 10 + [1] * 10
    assert all(view.has_all and not view.wants_more for view in two_views)
    assert hair.forgotten == [softening.name_of(two_views[1])] and not softening.sums().count


def test_a_view_that_is_drawn_afresh_begins_again(two_views: tuple[views.View, ...]) -> None:
    view, _ = two_views
    softening.soften(view)
    for _ in range(3):
        softening._ask()
        hair = sampled(view, 10)
    softening._ask()
    softening.harden(view)
    assert not softening.takes_sample(view) and not softening.sums().count
    assert hair.forgotten == [softening.name_of(view)]
    softening.soften(view)
    softening._ask()
    sampled(view, 10)
    assert softening.sums().count == 1 and not view.is_soft


def test_a_view_that_must_be_redrawn_gets_no_sample_first(
    two_views: tuple[views.View, ...],
) -> None:
    view, other = two_views
    view.wants_more, view.is_again, other.wants_more = True, True, True
    softening._ask()
    assert not softening.takes_sample(view) and softening.takes_sample(other)


@pytest.mark.parametrize("fragments", [100, 99])
def test_a_sample_tells_whether_a_soft_view_is_still_right(
    two_views: tuple[views.View, ...], fragments: int
) -> None:
    """It is right if it shows as much hair as before. If not, all samples are taken again;
    meanwhile the view stays soft."""
    view, _ = two_views
    softening.soften(view)
    for _ in range(10):
        softening._ask()
        sampled(view, 10)
    view.picture.marks, view.is_again = ("kept",), True
    views._draw_afresh()
    assert view.picture.marks == ("kept",) and view.wants_more and not view.is_again
    softening.go_on(view)
    softening._ask()
    sampled(view, 10, fragments)
    assert view.is_soft and view.wants_more == (fragments != 100)
    for count in range(2, 11) if view.wants_more else ():
        assert softening.is_next_shown(view, 10) == (count == 10)
        softening._ask()
        sampled(view, 10, fragments)
    assert not view.wants_more


def test_a_view_shown_between_samples_is_checked_after_them(
    two_views: tuple[views.View, ...],
) -> None:
    """Slow series of samples do not start again with each redraw."""
    view, _ = two_views
    view.picture.marks = ("kept",)
    softening.soften(view)
    for count in range(10):
        softening._ask()
        sampled(view, 10)
        if count == 5:
            view.is_again = True
            views._draw_afresh()
    assert view.picture.marks and view.has_all and view.wants_more
    softening._ask()
    sampled(view, 10)
    assert not view.wants_more


def test_a_view_that_no_window_shows_waits_for_nothing(two_views: tuple[views.View, ...]) -> None:
    view = views.view_of(SimpleNamespace(as_pointer=lambda: 9))
    view.picture.marks = ("kept",)
    softening.soften(view)
    softening._ask()
    assert not view.wants_more and not softening.takes_sample(view) and not view.picture.marks


def test_without_memory_a_view_stays_hard(
    two_views: tuple[views.View, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gpu_memory, "budget", lambda: gpu_objects.bytes_in_use() + (1 << 19))
    view, _ = two_views
    softening.soften(view)
    softening._ask()
    assert not softening.takes_sample(view) and not view.wants_more
    softening._ask()
    assert not softening.takes_sample(view)


def test_a_view_that_others_draw_keeps_none_waiting(two_views: tuple[views.View, ...]) -> None:
    """Such as a view that got no sample after it requested one."""
    view, other = two_views
    view.wants_more = other.wants_more = True
    softening._ask()
    softening._ask()
    assert softening.takes_sample(other) and not view.wants_more


def test_slow_motion_is_not_at_rest_between_its_frames(
    two_views: tuple[views.View, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(softening, "soon", lambda _, pause: pauses.append(pause))
    for now in (100.0, 100.05, 100.1, 100.6, 101.1, 130.0):
        monkeypatch.setattr(softening.time, "monotonic", lambda now=now: now)
        softening.soften(two_views[0])
    assert pauses == pytest.approx([0.3, 0.3, 0.3, 1.0, 1.0, 0.3])


def test_one_point_of_a_lamp_lights_all_grooms(two_views: tuple[views.View, ...]) -> None:
    """The lamp's disk faces the middle of all grooms."""
    lamp = Light.point((0.0, 0.0, 2.0), (1.0, 1.0, 1.0), 1.0, 0.1)
    softening.sums().count = 3

    def lights(*x: float) -> tuple[Light, ...]:
        return softening.lights_of_sample((lamp,), [np.array([each, 0.0, 0.0]) for each in x])

    assert lights(-1.0, 1.0) == lights(0.0) != lights(1.0)
