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
    softening.stop()
    views.forget_views()


def sampled(view: views.View, samples: int, fragments: int = 100) -> Pass:
    """Simulate a redraw that takes a sample."""
    assert softening.takes_sample(view) and not softening.takes_sample(view)
    hair = Pass()
    is_shown = softening.is_next_shown(view, samples)
    softening.sample_picture().count += 1
    view.is_soft |= is_shown
    softening.was_sampled(view, samples, [hair], (fragments,))
    return hair


def test_only_lights_with_a_size_are_worth_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(softening, "is_software", lambda: False)
    assert softening.can_soften((NARROW, SUN), 2)
    assert not softening.can_soften((NARROW, SUN), 1), "switched off"
    assert not softening.can_soften((NARROW, NARROW), 32) and not softening.can_soften((), 32)
    monkeypatch.setattr(softening, "is_software", lambda: True)
    assert not softening.can_soften((SUN,), 32)


def test_views_get_their_samples_in_turn_and_then_no_more(
    two_views: tuple[views.View, ...],
) -> None:
    for view in two_views:
        softening.schedule_samples(view)
    order = []
    for _ in range(30):
        softening._request_sample()
        due = [view for view in two_views if softening._softening.view is view]
        if not due:
            break
        order.append(two_views.index(due[0]))
        hair = sampled(due[0], 10)
        assert due[0].is_soft == (order.count(order[-1]) >= 8), "few samples are not shown"
    assert order == [0] * 10 + [1] * 10
    assert all(view.has_all_samples and not view.wants_samples for view in two_views)
    assert (
        hair.forgotten == [softening.sample_key(two_views[1])]
        and not softening.sample_picture().count
    )


def test_a_view_that_is_drawn_afresh_begins_again(two_views: tuple[views.View, ...]) -> None:
    view, _ = two_views
    softening.schedule_samples(view)
    for _ in range(3):
        softening._request_sample()
        hair = sampled(view, 10)
    softening._request_sample()
    softening.discard_samples(view)
    assert not softening.takes_sample(view) and not softening.sample_picture().count
    assert hair.forgotten == [softening.sample_key(view)]
    softening.schedule_samples(view)
    softening._request_sample()
    sampled(view, 10)
    assert softening.sample_picture().count == 1 and not view.is_soft


def test_a_view_that_must_be_redrawn_gets_no_sample_first(
    two_views: tuple[views.View, ...],
) -> None:
    view, other = two_views
    view.wants_samples, view.needs_redraw, other.wants_samples = True, True, True
    softening._request_sample()
    assert not softening.takes_sample(view) and softening.takes_sample(other)


@pytest.mark.parametrize("fragments", [100, 99])
def test_a_sample_tells_whether_a_soft_view_is_still_right(
    two_views: tuple[views.View, ...], fragments: int
) -> None:
    """It is right if it shows as much hair as before. If not, all samples are taken again;
    meanwhile the view stays soft."""
    view, _ = two_views
    softening.schedule_samples(view)
    for _ in range(10):
        softening._request_sample()
        sampled(view, 10)
    view.picture.key, view.needs_redraw = ("kept",), True
    views._redraw_strands()
    assert view.picture.key == ("kept",) and view.wants_samples and not view.needs_redraw
    softening.resume_timer(view)
    softening._request_sample()
    sampled(view, 10, fragments)
    assert view.is_soft and view.wants_samples == (fragments != 100)
    for count in range(2, 11) if view.wants_samples else ():
        assert softening.is_next_shown(view, 10) == (count == 10)
        softening._request_sample()
        sampled(view, 10, fragments)
    assert not view.wants_samples


def test_a_view_shown_between_samples_is_checked_after_them(
    two_views: tuple[views.View, ...],
) -> None:
    """Slow series of samples do not start again with each redraw."""
    view, _ = two_views
    view.picture.key = ("kept",)
    softening.schedule_samples(view)
    for count in range(10):
        softening._request_sample()
        sampled(view, 10)
        if count == 5:
            view.needs_redraw = True
            views._redraw_strands()
    assert view.picture.key and view.has_all_samples and view.wants_samples
    softening._request_sample()
    sampled(view, 10)
    assert not view.wants_samples


def test_a_view_that_no_window_shows_waits_for_nothing(two_views: tuple[views.View, ...]) -> None:
    view = views.view_of(SimpleNamespace(as_pointer=lambda: 9))
    view.picture.key = ("kept",)
    softening.schedule_samples(view)
    softening._request_sample()
    assert not view.wants_samples and not softening.takes_sample(view) and not view.picture.key


def test_without_memory_a_view_stays_hard(
    two_views: tuple[views.View, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gpu_memory, "budget", lambda: gpu_objects.bytes_in_use() + (1 << 19))
    view, _ = two_views
    softening.schedule_samples(view)
    softening._request_sample()
    assert not softening.takes_sample(view) and not view.wants_samples
    softening._request_sample()
    assert not softening.takes_sample(view)


def test_a_view_that_others_draw_keeps_none_waiting(two_views: tuple[views.View, ...]) -> None:
    """Such as a view that got no sample after it requested one."""
    view, other = two_views
    view.wants_samples = other.wants_samples = True
    softening._request_sample()
    softening._request_sample()
    assert softening.takes_sample(other) and not view.wants_samples


def test_slow_motion_is_not_at_rest_between_its_frames(
    two_views: tuple[views.View, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(softening, "debounce", lambda _, pause: pauses.append(pause))
    for now in (100.0, 100.05, 100.1, 100.6, 101.1, 130.0):
        monkeypatch.setattr(softening.time, "monotonic", lambda now=now: now)
        softening.schedule_samples(two_views[0])
    assert pauses == pytest.approx([0.3, 0.3, 0.3, 1.0, 1.0, 0.3])


def test_one_point_of_a_lamp_lights_all_grooms(two_views: tuple[views.View, ...]) -> None:
    """The lamp's disk faces the middle of all grooms."""
    lamp = Light.point((0.0, 0.0, 2.0), (1.0, 1.0, 1.0), 1.0, 0.1)
    softening.sample_picture().count = 3

    def lights(*x: float) -> tuple[Light, ...]:
        return softening.lights_of_sample((lamp,), [np.array([each, 0.0, 0.0]) for each in x])

    assert lights(-1.0, 1.0) == lights(0.0) != lights(1.0)
