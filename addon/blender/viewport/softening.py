"""Views at rest whose shadows become soft: one after the other, a sample with each redraw.

A view that was drawn afresh and then stays as it is gets its samples by a timer: it asks for a
redraw of that view alone, and the sample of this redraw asks for the next. So the window stays
usable, and nothing is drawn once all samples are there. On the GPU all views have one SoftPicture,
and each groom maps of its own for samples, so that those of the view's lights stay. Both are let go
of with the last sample.
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
from ..base.redraw import redraw_view, soon
from .views import View, known_views

#: [s] for which a view stays as it is before it gets samples; and how far apart draws of one that
#: moves slowly may be: it is at rest after twice as long
_REST, _SLOW = 0.3, 1.0
#: so few samples show one by one where lights are
_FEW = 8


class _Softening:
    """What is under way.

    view: that gets samples. is_due: a timer has asked for one. passes: what draws them.
    """

    def __init__(self) -> None:
        self.picture = SoftPicture()
        self.view: View | None = None
        self.is_due = False
        self.passes: tuple[StrandPass, ...] = ()


_softening = _Softening()


def is_worth_it(lights: Sequence[Light], samples: int) -> bool:
    """Whether shadows are to become soft: a light has a size, and a GPU draws."""
    has_size = samples > 1 and lights_at(lights, 1, np.zeros(3)) != tuple(lights)
    return has_size and not is_software()


def soften(view: View) -> None:
    """A view was drawn afresh, and is to become soft once it rests."""
    now = time.monotonic()
    pause, view.changed_at = now - view.changed_at, now
    view.wants_more = True
    soon(_ask, max(_REST, 2.0 * pause) if pause < _SLOW else _REST)


def harden(view: View) -> None:
    """What a view shows is gone: it is not soft, and samples of it count no more."""
    view.wants_more = view.is_soft = view.has_all = view.is_doubted = False
    view.fragments = ()
    if _softening.view is view:
        _stop()


def go_on(view: View) -> None:
    """A view has shown its kept picture: if it waits for samples, a timer runs."""
    if view.wants_more and not bpy.app.timers.is_registered(_ask):
        soon(_ask, 0.0)


def forget() -> None:
    """No view of ours is drawn any more."""
    _stop()
    if bpy.app.timers.is_registered(_ask):
        bpy.app.timers.unregister(_ask)


def takes_sample(view: View) -> bool:
    """Whether this redraw of a view does: it was asked to, and there is memory."""
    if not _softening.is_due or _softening.view is not view:
        return False
    _softening.is_due = False
    if gpu_memory.is_short(_softening.picture.missing_bytes()):
        view.wants_more = False
        _stop()
        soon(_ask, 0.0)
    return view.wants_more


def sums() -> SoftPicture:
    """To which the sample of this redraw is added."""
    return _softening.picture


def name_of(view: View) -> Hashable:
    """By which passes know the view in the light of a sample."""
    return "sample", view.address


def lights_of_sample(lights: Sequence[Light], centers: Sequence[Floats]) -> tuple[Light, ...]:
    """Those of the next sample.

    Args:
        centers: of all grooms in the view.
    """
    return lights_at(lights, _softening.picture.count, np.mean(centers, axis=0))


def is_next_shown(view: View, samples: int) -> bool:
    """Whether the view shows the mean once the next sample is added. One that is soft already keeps
    its picture until all are.
    """
    count = _softening.picture.count + 1
    return count >= samples or (count >= _FEW and not view.has_all)


def was_sampled(
    view: View, samples: int, passes: Sequence[StrandPass], fragments: tuple[int, ...]
) -> None:
    """A sample was added.

    Args:
        samples: how many there are to be. passes: what has drawn it.
        fragments: how many each has drawn; if that has not changed, a soft view may stay as it is.
    """
    _softening.passes = tuple(passes)
    count = _softening.picture.count
    if count == 1:
        view.is_doubted = False
    is_as_shown = view.has_all and count == 1 and view.fragments == fragments
    view.fragments = fragments
    if is_as_shown or count >= samples:
        view.wants_more, view.has_all = view.is_doubted, True
        _stop()
    soon(_ask, 0.0)


def _stop() -> None:
    if _softening.view is not None:
        for each in _softening.passes:
            each.forget_view(name_of(_softening.view))
    _softening.picture.release()
    _softening.view, _softening.is_due, _softening.passes = None, False, ()


def _ask() -> None:
    """The view that has samples goes on, or else one that waits begins. What is to be drawn afresh
    is so first, and asks then.
    """
    view = _softening.view
    if view is not None and _softening.is_due:
        _leave(view)  # it was asked, and is drawn by others now
    waiting = (each for each in known_views() if each.wants_more and not each.is_again)
    view = _softening.view or next(waiting, None)
    if view is None:
        return
    _softening.view, _softening.is_due = view, True
    if not redraw_view(view.address):
        _leave(view)  # no window shows it
        soon(_ask, 0.0)


def _leave(view: View) -> None:
    """It begins again when it is drawn again."""
    view.picture.forget()
    harden(view)
