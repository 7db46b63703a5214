"""The 3D views into which we draw: what is kept for each, and when strands must be drawn again.

A view in which nothing has changed shows its kept picture. But what hides strands may change
without an event, while an engine still compiles or samples. So, in views other than Solid and
Wireframe, a series of redraws is followed by one that draws strands again. If shadows are soft by
then, a single sample checks whether the picture is still right.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import bpy
import gpu

from ...render.cached_picture import CachedPicture, are_same_keys
from ...render.camera import Camera
from ...render.strand_pass import Statistics, StrandPass
from ..base.redraw import debounce, redraw_views

#: types of views whose picture changes only with the scene, the view and its settings
STEADY_VIEW_TYPES = ("SOLID", "WIREFRAME")
#: time [s] without a redraw until strands are drawn again, and until lagging shadows are
_REDRAW_PAUSE, _CATCH_UP_PAUSE = 0.5, 0.1
#: redraws that make a series; time [s] since the last draw of strands after which a single one does
_SERIES_LENGTH, _SERIES_SECONDS = 3, 5.0


@dataclass(eq=False)
class View:
    """What is kept for a 3D view.

    address: of its region's data. key: of what was last drawn into it, see CachedPicture.
    statistics_by_uid: counts of what its picture shows, by session number of the hair.
    is_outdated: whether its shadows lag behind its lights, or it was drawn without waiting for the
        GPU.
    drawn_at: when its strands were last drawn [s]. reshown_count: how often its picture was shown
        since then. needs_redraw: whether its strands must be drawn again for that reason.
    wants_samples: whether it waits for samples of soft shadows, see softening.py. is_soft: whether
        its picture shows their mean, with the shadow on heads. has_all_samples: whether of all.
    fragment_counts: number in the last sample of each groom; none before the first.
    may_be_outdated: whether something else may hide hair than when its samples began.
    changed_at: when new contents were drawn that are to become soft [s].
    """

    address: int
    picture: CachedPicture = field(default_factory=CachedPicture)
    key: tuple[Any, ...] = ()
    statistics_by_uid: dict[int, Statistics] = field(default_factory=dict)
    is_outdated: bool = False
    drawn_at: float = 0.0
    reshown_count: int = 0
    needs_redraw: bool = False
    seen_from: bytes = b""
    wants_samples: bool = False
    is_soft: bool = False
    has_all_samples: bool = False
    fragment_counts: tuple[int, ...] = ()
    may_be_outdated: bool = False
    changed_at: float = 0.0

    def has_new_camera(self, camera: Camera) -> bool:
        """Whether it was last drawn from another camera; stores this one."""
        before, self.seen_from = self.seen_from, camera.view.tobytes()
        return before not in (b"", self.seen_from)

    def has_new_key(self, key: tuple[Any, ...]) -> bool:
        """Whether something else was last drawn; stores this key."""
        before, self.key = self.key, key
        return not are_same_keys(before, key)


class _KnownViews:
    """views: by address. switches: names of settings, by type of their owner. changes: number of
    changes of any scene."""

    def __init__(self) -> None:
        self.views: dict[int, View] = {}
        self.switches: dict[str, tuple[str, ...]] = {}
        self.changes = 0


_known = _KnownViews()


def view_of(region_data: Any) -> View:
    """The kept data of the current view."""
    address = region_data.as_pointer()
    return _known.views.setdefault(address, View(address))


def known_views() -> tuple[View, ...]:
    """All views that were drawn and are not closed."""
    return tuple(_known.views.values())


def invalidate_pictures() -> None:
    """Invalidate all pictures, as what hides strands may have changed."""
    _known.changes += 1


def view_key(context: Any, camera: Camera) -> tuple[Any, ...]:
    """Everything that may change what is drawn of the scene into a view, and where."""
    space, region_data = context.space_data, context.region_data
    clipped = tuple(map(tuple, region_data.clip_planes)) if region_data.use_clip_planes else ()
    return (
        *(_known.changes, context.scene.session_uid, context.view_layer.name, context.mode),
        *(context.scene.render.engine, space.local_view is not None),
        *(camera.view.tobytes(), camera.projection.tobytes(), gpu.state.viewport_get()),
        *(clipped, _switches(space.shading), _switches(space.overlay)),
    )


def _switches(owner: Any) -> tuple[Any, ...]:
    """The present values of all its settings."""
    kind = owner.bl_rna.identifier
    if kind not in _known.switches:
        kinds = ("BOOLEAN", "INT", "FLOAT", "ENUM")
        found = (each.identifier for each in owner.bl_rna.properties if each.type in kinds)
        _known.switches[kind] = tuple(found)
    return tuple(_plain(getattr(owner, name)) for name in _known.switches[kind])


def _plain(value: Any) -> Any:
    is_one = isinstance(value, bool | int | float | str)
    return value if is_one else tuple(map(_plain, value))


def forget_views() -> None:
    """Forget all views, when they are no longer drawn."""
    _known.views.clear()
    for timer in (_redraw_strands, _catch_up):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


def forget_closed_views(passes: Iterable[StrandPass]) -> None:
    """Free what was kept for views that no window shows any more."""
    shown = frozenset(_addresses())
    if not shown >= _known.views.keys():
        _known.views = {at: view for at, view in _known.views.items() if at in shown}
        for each in passes:
            each.forget_views(shown)


def _addresses() -> Iterator[int]:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                regions = (each for each in area.regions if each.type == "WINDOW")
                yield from (each.data.as_pointer() for each in regions if each.data is not None)


def record_reshown(view: View, shading: Any) -> None:
    """Record that a view has shown its kept picture."""
    view.reshown_count += 1
    is_row = (
        view.reshown_count >= _SERIES_LENGTH or time.monotonic() - view.drawn_at > _SERIES_SECONDS
    )
    if shading.type not in STEADY_VIEW_TYPES and is_row:
        view.needs_redraw = True
        debounce(_redraw_strands, _REDRAW_PAUSE)


def record_drawn(view: View) -> None:
    """Record that the strands of a view were drawn."""
    view.needs_redraw, view.reshown_count, view.drawn_at = False, 0, time.monotonic()
    if view.is_outdated:
        debounce(_catch_up, _CATCH_UP_PAUSE)


def _redraw_strands() -> None:
    for view in _known.views.values():
        if view.needs_redraw and view.fragment_counts:
            record_drawn(view)
            view.may_be_outdated, view.wants_samples = True, True
        elif view.needs_redraw:
            view.picture.forget()
    redraw_views()


def _catch_up() -> None:
    redraw_views()
