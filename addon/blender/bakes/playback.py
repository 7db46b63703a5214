"""Playback of bakes: frames for the live grooms, and for the curves that renders show instead.

Renders evaluate and simulate nothing: strands come from the bake alone.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...rig_flow import Pose, Solids
from ..scene.curves import set_points
from ..scene.fin_modifier import clear, fin_modifier, has_fins, show
from .bake_settings import folder_of, shown_folder_of
from .baked_rig import BakedRig, baked_rig_of
from .baked_solids import BakedSolids, interpolated_solids
from .cache import FACTS, Cache
from .simulation import Arrays


class _LoadedBakes:
    """Bakes that are kept in memory, by folder.

    caches: time and inode of cache.json, and the bake. rigs: the bake, and its rig. solids: the
    bake, and its colliders.
    problems: why a bake cannot be shown in renders; reported once.
    unshown: session numbers of fins that are being baked.
    lock: renders read bakes in their own thread.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.caches: dict[Path, tuple[tuple[int, int], Cache]] = {}
        self.rigs: dict[Path, tuple[Cache, BakedRig]] = {}
        self.solids: dict[Path, tuple[Cache, BakedSolids | None]] = {}
        self.problems: dict[Path, str] = {}
        self.unshown: set[int] = set()
        self.is_rendering = False


_loaded = _LoadedBakes()


def cache_in(folder: Path) -> Cache | None:
    """The bake in a folder as it is now; None where there is none.

    Raises:
        HairloomError: it is damaged.
    """
    with _loaded.lock:
        try:
            facts = (folder / FACTS).stat()
        except OSError:
            _loaded.caches.pop(folder, None)
            _loaded.rigs.pop(folder, None)
            _loaded.solids.pop(folder, None)
            return None
        written = facts.st_mtime_ns, facts.st_ino
        if folder not in _loaded.caches or _loaded.caches[folder][0] != written:
            _loaded.caches[folder] = written, Cache(folder)
            _loaded.problems.pop(folder, None)
        return _loaded.caches[folder][1]


def cache_of(obj: bpy.types.Object) -> Cache | None:
    """The bake of a groom or fin; None where there is none.

    Raises:
        HairloomError: it is damaged.
    """
    folder = folder_of(obj)
    return None if folder is None else cache_in(folder)


def cache_if_baked(obj: bpy.types.Object) -> Cache | None:
    """As `cache_of`, for writing files and pictures: None only where the object was never baked.
    If a bake is gone, or out of this machine's reach, other motion would be written without notice.

    Raises:
        HairloomError: it was baked and its bake is not there, or is damaged.
    """
    cache, folder = cache_of(obj), folder_of(obj)
    if cache is None and folder is not None and obj.hairloom.bake.owner:
        raise HairloomError(
            f"it was baked, but its bake is not in {folder}",
            place=obj.name,
            remedy="Restore that folder, bake again, or export strands without Use Bake "
            "(--no-use-bake)",
        )
    return cache


def rig_in(cache: Cache) -> BakedRig:
    """The rig of a groom's bake.

    Raises:
        HairloomError: it is damaged.
    """
    with _loaded.lock:
        known = _loaded.rigs.get(cache.folder)
        if known is None or known[0] is not cache:
            known = _loaded.rigs[cache.folder] = (
                cache,
                baked_rig_of(cache.constants(), str(cache.folder)),
            )
        return known[1]


def solids_in(
    cache: Cache, frame: int, subframe: float = 0.0, *, blocking: bool = True
) -> Solids | None:
    """The colliders that the hair of a groom stayed out of, between frames as `strands_in`; None
    where its bake holds none.

    Args:
        blocking: see `BakedSolids.at`.

    Raises:
        HairloomError: the bake is damaged.
    """
    with _loaded.lock:
        known = _loaded.solids.get(cache.folder)
        if known is None or known[0] is not cache:
            known = _loaded.solids[cache.folder] = cache, BakedSolids.of(cache.constants())
    if known[1] is None:
        return None
    here, there = _surrounding_frames(cache, frame, subframe)
    arrays = cache.frame(here)
    if here != there:
        arrays = interpolated_solids(arrays, cache.frame(there), subframe)
    return known[1].at(arrays, blocking=blocking)


def strands_in(cache: Cache, frame: int, subframe: float = 0.0) -> Floats:
    """All strands of a groom, (point_count, 3) world [m].

    Before the first frame and after the last one they stay as in that frame. Between two frames,
    where motion blur samples, they are interpolated linearly.

    Raises:
        HairloomError: the bake is damaged.
    """
    return _interpolated(cache, frame, subframe, rig_in(cache).strands)


def guides_in(cache: Cache, frame: int, subframe: float = 0.0) -> Floats:
    """The guides of a groom, (guide_count, cv_count, 3) world [m]; between frames as `strands_in`.

    Raises:
        HairloomError: the bake is damaged.
    """
    return _interpolated(cache, frame, subframe, lambda arrays: arrays["guides"])


def _interpolated(
    cache: Cache, frame: int, subframe: float, points_of: Callable[[Arrays], Floats]
) -> Floats:
    first, last = _surrounding_frames(cache, frame, subframe)
    here = points_of(cache.frame(first))
    if first == last:
        return here
    between: Floats = here + (points_of(cache.frame(last)) - here) * np.float32(subframe)
    return between


def _surrounding_frames(cache: Cache, frame: int, subframe: float) -> tuple[int, int]:
    """The baked frames before and after a time; twice the same frame where it is exactly in one."""
    facts = cache.facts
    here = min(max(frame, facts.first), facts.last)
    return here, here + bool(subframe and facts.first <= frame < facts.last)


def pose_in(cache: Cache, frame: int, subframe: float = 0.0) -> Pose:
    """The pose of a groom, with its colliders; between frames as `strands_in`.

    Raises:
        HairloomError: the bake is damaged.
    """
    rig, (first, last) = rig_in(cache), _surrounding_frames(cache, frame, subframe)
    here, solids = rig.pose(cache.frame(first)), solids_in(cache, frame, subframe)
    if first == last:
        return replace(here, solids=solids)
    there = rig.pose(cache.frame(last))
    matrix = here.matrix + (there.matrix - here.matrix) * subframe
    anchors = here.anchors
    if anchors is not None and there.anchors is not None:
        anchors = anchors + (there.anchors - anchors) * np.float32(subframe)
    if here.head_positions is None or there.head_positions is None:
        return Pose(None, matrix, anchors, solids)
    displacement = there.head_positions - here.head_positions
    head = here.head_positions + displacement * np.float32(subframe)
    return Pose(head, matrix, anchors, solids)


def show_fins(scene: bpy.types.Scene) -> None:
    """Write the scene's new frame into all meshes of baked fins, previewed or not.

    Beyond the baked frames, a fin only follows the animation.
    """
    for obj in bpy.data.objects if has_fins() else ():
        is_shown = is_baked_fin(obj) and obj.session_uid not in _loaded.unshown
        folder = folder_of(obj) if is_shown else None
        if folder is not None:
            _report_errors(folder, partial(_show_fin, obj, folder, scene.frame_current))


@contextmanager
def fins_not_shown(objects: Sequence[bpy.types.Object]) -> Iterator[None]:
    """Do not show the bakes of these fins inside the block, where they are baked again."""
    _loaded.unshown = {obj.session_uid for obj in objects}
    try:
        yield
    finally:
        _loaded.unshown = set()


def is_baked_fin(obj: bpy.types.Object) -> bool:
    """Whether an object is a fin whose bake, if there is one, is to be shown."""
    return bool(
        obj.type == "MESH"
        and obj.hairloom.bake.folder
        and obj.hairloom.bake.is_shown
        and fin_modifier(obj) is not None
    )


def _show_fin(obj: bpy.types.Object, folder: Path, frame: int) -> None:
    cache = cache_in(folder)
    if cache is not None and cache.has_frame(frame):
        show(obj.data, cache.frame(frame)["position"])
    else:
        clear(obj.data)


def show_in_copies(scene: bpy.types.Scene) -> None:
    """Write the scene's new frame into all curves that show a bake in renders."""
    for curves in bpy.data.hair_curves:
        folder = shown_folder_of(curves)
        if folder is not None:
            _report_errors(folder, partial(_write_copy, curves, folder, scene))


def _write_copy(curves: bpy.types.Curves, folder: Path, scene: bpy.types.Scene) -> None:
    cache = cache_in(folder)
    if cache is None:
        raise HairloomError("there is no bake here", place=str(folder), remedy="Bake again")
    points = strands_in(cache, scene.frame_current, scene.frame_subframe)
    is_same = curves.hairloom.baked_rig in ("", cache.facts.rig_hash)
    if len(curves.position_data) != len(points) or not is_same:
        raise HairloomError(
            "these curves do not match the bake", place=curves.name, remedy="Bake again"
        )
    set_points(curves, points)


def _report_errors(folder: Path, show: Callable[[], object]) -> None:
    """Show a bake, which may come from anywhere and be broken in any way; report an error once.

    If it went up to Blender, Blender would print it at every frame, and the bakes after this one
    would be skipped.
    """
    try:
        show()
    except HairloomError as error:
        _report(folder, str(error))
    except Exception as error:
        _report(folder, f"{folder}: this bake is damaged ({type(error).__name__}: {error})")


def _report(folder: Path, problem: str) -> None:
    if _loaded.problems.get(folder) != problem:
        _loaded.problems[folder] = problem
        print(f"Hairloom: {problem}")


def is_animation_playing() -> bool:
    """Whether Blender plays its animation in a window, or its playhead is being dragged."""
    screens = [window.screen for window in bpy.context.window_manager.windows]
    return any(screen.is_animation_playing for screen in screens)


def is_playhead_dragged() -> bool:
    """Whether the playhead is being dragged."""
    screens = [window.screen for window in bpy.context.window_manager.windows]
    return any(screen.is_scrubbing for screen in screens)


def set_rendering(begins: bool) -> None:
    """A render begins or has ended."""
    _loaded.is_rendering = begins


def must_update_copies() -> bool:
    """Whether to update the copies that renders and exporters read. Not while an animation plays
    or the playhead is dragged in the viewport, which hides them."""
    return (
        _loaded.is_rendering
        or bpy.app.background
        or not (is_animation_playing() or is_playhead_dragged())
    )


def forget_bake(folder: Path) -> None:
    """Forget a folder whose bake is gone or was replaced."""
    with _loaded.lock:
        for known in (_loaded.caches, _loaded.rigs, _loaded.solids, _loaded.problems):
            known.pop(folder, None)


def forget() -> None:
    """Keep no bake in memory."""
    with _loaded.lock:
        for known in (_loaded.caches, _loaded.rigs, _loaded.solids, _loaded.problems):
            known.clear()
    _loaded.is_rendering = False


def check_frames(name: str, frames: range, cache: Cache) -> None:
    """Refuse frames that were not baked.

    Raises:
        HairloomError: naming those that are missing.
    """
    first, last = cache.facts.first, cache.facts.last
    missing = [frame for frame in (frames[0], frames[-1]) if not cache.has_frame(frame)]
    if missing:
        wanted = f"all of {frames[0]} to {frames[-1]}" if len(frames) > 1 else str(frames[0])
        raise HairloomError(
            f"its bake holds frames {first} to {last}, not {wanted}",
            place=name,
            remedy=f"Bake those too, or choose frames from {first} to {last}",
        )
