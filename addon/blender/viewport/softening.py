"""Soft shadows in views at rest: one view after the other gets a sample with each redraw.

When a view was drawn and then stays unchanged, a timer redraws it to add a sample, and each sample
starts the timer for the next. So the window stays responsive, and drawing stops once all samples
are there. On the GPU all views share one SoftPicture, and each groom has separate opacity maps for
samples, so that those of the view's own lights stay. Both are freed after the last sample.
"""

from __future__ import annotations

import time
from collections.abc import Hashable, Sequence

import bpy
import numpy as np

from ...arrays import Floats
from ...render import gpu_memory
from ...render.light_samples import lights_at
from ...render.soft_picture import SoftPicture
from ...render.strand_layers import is_software
from ...render.strand_pass import StrandPass
from ...shading.lights import Light
from ..base.redraw import debounce, redraw_view
from .views import View, known_views

#: time [s] without a change before a view gets samples; and the longest time between draws of a
#: view that moves slowly, which is at rest after twice the last interval
_REST_SECONDS, _SLOW_SECONDS = 0.3, 1.0
#: from this many samples on, their mean is shown; in fewer, single samples of lights are visible
_MIN_SHOWN_SAMPLES = 8


class _Softening:
    """The state of sampling.

    view: the view that gets samples. is_due: a timer has requested one. passes: those that draw it.
    """

    def __init__(self) -> None:
        self.picture = SoftPicture()
        self.view: View | None = None
        self.is_due = False
        self.passes: tuple[StrandPass, ...] = ()


_softening = _Softening()


def can_soften(lights: Sequence[Light], samples: int) -> bool:
    """Whether shadows can become soft: a light has a size, and the GPU is not software."""
    has_size = samples > 1 and lights_at(lights, 1, np.zeros(3)) != tuple(lights)
    return has_size and not is_software()


def schedule_samples(view: View) -> None:
    """Schedule samples for a view that was drawn, once it rests."""
    now = time.monotonic()
    pause, view.changed_at = now - view.changed_at, now
    view.wants_samples = True
    debounce(
        _request_sample, max(_REST_SECONDS, 2.0 * pause) if pause < _SLOW_SECONDS else _REST_SECONDS
    )


def discard_samples(view: View) -> None:
    """Discard the samples of a view whose picture is no longer valid."""
    view.wants_samples = view.is_soft = view.has_all_samples = view.may_be_outdated = False
    view.fragment_counts = ()
    if _softening.view is view:
        _stop()


def resume_timer(view: View) -> None:
    """After a view has shown its kept picture, start the timer if it waits for samples."""
    if view.wants_samples and not bpy.app.timers.is_registered(_request_sample):
        debounce(_request_sample, 0.0)


def stop() -> None:
    """Stop sampling, when views are no longer drawn."""
    _stop()
    if bpy.app.timers.is_registered(_request_sample):
        bpy.app.timers.unregister(_request_sample)


def takes_sample(view: View) -> bool:
    """Whether this redraw of a view takes a sample: one was requested, and memory suffices."""
    if not _softening.is_due or _softening.view is not view:
        return False
    _softening.is_due = False
    if gpu_memory.exceeds_budget(_softening.picture.missing_bytes()):
        view.wants_samples = False
        _stop()
        debounce(_request_sample, 0.0)
    return view.wants_samples


def sample_picture() -> SoftPicture:
    """The picture to which the sample of this redraw is added."""
    return _softening.picture


def sample_key(view: View) -> Hashable:
    """The name under which passes keep data of the view in the light of a sample."""
    return "sample", view.address


def lights_of_sample(lights: Sequence[Light], centers: Sequence[Floats]) -> tuple[Light, ...]:
    """The lights of the next sample.

    Args:
        centers: of all grooms in the view, (3,) world [m] each.
    """
    return lights_at(lights, _softening.picture.count, np.mean(centers, axis=0))


def is_next_shown(view: View, samples: int) -> bool:
    """Whether the view shows the mean once the next sample is added. A view that has shown all
    samples before keeps its picture until all new ones are added.
    """
    count = _softening.picture.count + 1
    return count >= samples or (count >= _MIN_SHOWN_SAMPLES and not view.has_all_samples)


def was_sampled(
    view: View, samples: int, passes: Sequence[StrandPass], fragments: tuple[int, ...]
) -> None:
    """Record a sample that was added, and request the next.

    Args:
        samples: number of samples in total. passes: those that have drawn it.
        fragments: number that each has drawn; if unchanged, a view with all samples stays as it is.
    """
    _softening.passes = tuple(passes)
    count = _softening.picture.count
    if count == 1:
        view.may_be_outdated = False
    is_as_shown = view.has_all_samples and count == 1 and view.fragment_counts == fragments
    view.fragment_counts = fragments
    if is_as_shown or count >= samples:
        view.wants_samples, view.has_all_samples = view.may_be_outdated, True
        _stop()
    debounce(_request_sample, 0.0)


def _stop() -> None:
    if _softening.view is not None:
        for each in _softening.passes:
            each.forget_view(sample_key(_softening.view))
    _softening.picture.release()
    _softening.view, _softening.is_due, _softening.passes = None, False, ()


def _request_sample() -> None:
    """A timer for Blender: request a sample for the current view, or else for one that waits. Views
    that must be drawn again first are skipped; they request samples afterwards.
    """
    view = _softening.view
    if view is not None and _softening.is_due:
        _give_up(view)  # the requested redraw did not come: something else draws the view now
    waiting = (each for each in known_views() if each.wants_samples and not each.needs_redraw)
    view = _softening.view or next(waiting, None)
    if view is None:
        return
    _softening.view, _softening.is_due = view, True
    if not redraw_view(view.address):
        _give_up(view)  # no window shows it
        debounce(_request_sample, 0.0)


def _give_up(view: View) -> None:
    """Stop sampling a view; it begins again when it is next drawn."""
    view.picture.forget()
    discard_samples(view)
