"""Hair that follows Blender's timeline: simulated frame by frame, or shown from a bake.

    the frame is baked                     show it
    the first frame                        rest there
    one frame on                           advance by exactly that
    some frames on, while Blender plays    frames were dropped: advance by their time in one go
    the same frame again                   stay
    anywhere else (scrubbing)              rest in that pose

Where there is no bake a jump shows the style: how the hair would hang there hangs on all frames
before it, which nobody wants to wait for while dragging the playhead.

While Blender plays, no frame waits for what is being made: see `late`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ...errors import HairloomError
from ..bakes import playback
from ..bakes.bake_settings import folder_of
from ..bakes.baked_rig import BakedRig
from ..bakes.cache import Cache, Facts
from ..bakes.fingerprints import RIG_PARTS, frame_rate, groom_fingerprint
from ..bakes.simulated import Simulated, as_now, differences
from ..base.objects import Handle, head_of
from ..properties.groom_settings import GroomSettings
from ..sessions.session import Session
from . import late

#: More frames than those of this time [s] on are a jump, not frames that were dropped.
_LONGEST_DROP = 1.0


@dataclass(frozen=True)
class Baked:
    """The bake of a groom or fin, as it stands to the scene.

    is_shown: whether the hair is shown as it was baked.
    changed: what has changed since, in words; nothing: it is up to date.
    moment: hashes of the scene in the frame that is shown.
    """

    facts: Facts
    is_shown: bool = False
    changed: tuple[str, ...] = ()
    moment: str = ""


#: uid -> the scene frame up to which the timeline has brought it
_stands: dict[int, int] = {}
_baked: dict[int, Baked] = {}
_fingerprints: dict[int, str] = {}
_troubles: dict[int, str] = {}
_bake_troubles: dict[int, str] = {}


def first_frame(scene: bpy.types.Scene) -> int:
    """Where playback begins."""
    return int(scene.frame_preview_start if scene.use_preview_range else scene.frame_start)


def move(before: int | None, now: int, first: int, is_played: bool, longest: float) -> int | None:
    """Frames to advance by, 0 for none; None: rest.

    Args:
        before: the frame that the hair stands at, None for none.
        first: the frame at which it begins.
        longest: frames that may be dropped in playback.
    """
    if now == first or before is None:
        return None
    ahead = now - before
    if ahead in (0, 1) or (is_played and 0 < ahead <= longest):
        return ahead
    return None


def follow(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """The scene has gone to a frame.

    Raises:
        HairloomError: the groom cannot go on.
    """
    obj, scene, uid = _object_of(session), depsgraph.scene, session.uid
    frame, before = scene.frame_current, _stands.get(session.uid)
    if before is None and session.is_playing:
        before = frame - 1  # it was played freely until now
    _stands[uid] = frame
    late.forget(uid)
    if late.lacks_hair(session):
        attempt(session, depsgraph, lambda: late.go_without(session, depsgraph))
        return
    rate, first = frame_rate(scene), first_frame(scene)
    if frame == first:
        check(session, depsgraph)
    if _show_baked(session, obj, depsgraph):
        return
    frames = move(before, frame, first, playback.is_played(), rate * _LONGEST_DROP)
    if frame == first or (frames and not session.is_playing):
        attempt(session, depsgraph, lambda: late.begin(session, depsgraph))
    elif frames is None:
        attempt(session, depsgraph, lambda: session.rest(depsgraph))
    elif frames:
        attempt(session, depsgraph, lambda: session.advance(depsgraph, frames / rate))


def attempt(session: Simulated, depsgraph: bpy.types.Depsgraph, action: Callable[[], None]) -> None:
    """Begin, go on or rest; what cannot be simulated just now only follows its body, with a reason.

    Raises:
        HairloomError: it cannot even do that.
    """
    _troubles.pop(session.uid, None)
    try:
        action()
    except HairloomError as error:
        session.is_playing = False
        session.rest(depsgraph)
        _troubles[session.uid] = str(error)


def keep_or_rest(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    """Blender has evaluated the body again, within a frame; only if it moved, the hair rests.

    Raises:
        HairloomError: as `Simulated.rest`.
    """
    baked = _baked.get(session.uid)
    if baked is not None and baked.is_shown:
        if session.moment(depsgraph) == baked.moment:
            return
        _baked[session.uid] = Baked(baked.facts, changed=_changed(session, baked.facts, depsgraph))
    elif not session.has_moved(depsgraph):
        return
    attempt(session, depsgraph, lambda: session.rest(depsgraph))


def check(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Find out anew whether there is a bake, and whether it is up to date.

    Raises:
        HairloomError: the groom or what it grows from is gone.
    """
    obj = _object_of(session)
    _fingerprints[session.uid] = session.fingerprint(depsgraph)
    cache = _cache_of(session, obj)
    if cache is None:
        _baked.pop(session.uid, None)
        return
    known = _baked.get(session.uid)
    is_shown = known is not None and known.is_shown
    _baked[session.uid] = _state(session, cache.facts, depsgraph, is_shown)


def look_again(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """A setting was changed, which may make the bake out of date.

    Raises:
        HairloomError: as `check`.
    """
    known = _baked.get(session.uid)
    if known is not None:
        _baked[session.uid] = _state(session, known.facts, depsgraph, known.is_shown)


def show_frame(session: Simulated, depsgraph: bpy.types.Depsgraph) -> bool:
    """Show the scene's frame from the bake, if it is there; returns whether it is.

    Raises:
        HairloomError: the groom cannot go on.
    """
    return _show_baked(session, _object_of(session), depsgraph)


def rig_for(hair: bpy.types.Object, scene: bpy.types.Scene) -> BakedRig | None:
    """The rig of the groom's bake, if that was made from the curves and the head as they are."""
    try:
        cache = playback.cache_of(hair)
        if cache is None:
            return None
        now = groom_fingerprint(hair, head_of(hair), GroomSettings.of(hair), scene)
        changed = differences(cache.facts.fingerprint, now)
        return None if set(changed) & set(RIG_PARTS) else playback.rig_in(cache)
    except HairloomError:  # told when the bake is to be shown
        return None


def _show_baked(session: Simulated, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    """What is wrong with a bake is told in the panel; the hair is simulated then."""
    frame = depsgraph.scene.frame_current
    _bake_troubles.pop(session.uid, None)
    cache = _cache_of(session, obj) if obj.hairloom.bake.is_shown else None
    if cache is None or not cache.holds(frame):
        known = _baked.get(session.uid)
        if known is not None and known.is_shown:
            _baked[session.uid] = Baked(known.facts, changed=known.changed)
            session.is_playing = False  # a bake leaves no motion to go on from
        return False
    try:
        session.show_recorded(cache.frame(frame))
    except HairloomError as error:
        _bake_troubles[session.uid] = str(error)
        return False
    session.is_playing = False
    _troubles.pop(session.uid, None)
    if session.uid not in _fingerprints:
        _fingerprints[session.uid] = session.fingerprint(depsgraph)
    _baked[session.uid] = _state(session, cache.facts, depsgraph, is_shown=True)
    return True


def _state(
    session: Simulated, facts: Facts, depsgraph: bpy.types.Depsgraph, is_shown: bool
) -> Baked:
    moment = session.moment(depsgraph)
    return Baked(facts, is_shown, _changed(session, facts, depsgraph, moment), moment)


def _changed(
    session: Simulated, facts: Facts, depsgraph: bpy.types.Depsgraph, moment: str = ""
) -> tuple[str, ...]:
    baked = facts.fingerprint
    if isinstance(session, Session):
        baked = as_now(baked, facts.moments)
    changed = differences(baked, _fingerprints.get(session.uid, baked))
    frame = depsgraph.scene.frame_current
    if facts.first <= frame <= facts.last:
        recorded = facts.moments[frame - facts.first]
        changed += differences(recorded, moment or session.moment(depsgraph))
    return tuple(dict.fromkeys(changed))


def _cache_of(session: Simulated, obj: bpy.types.Object) -> Cache | None:
    try:
        cache = playback.cache_of(obj)
    except HairloomError as error:
        _bake_troubles[session.uid] = str(error)
        return None
    return cache


def _object_of(session: Simulated) -> bpy.types.Object:
    obj = Handle(session.uid, session.name).find()
    if obj is None:
        raise HairloomError("this object is gone", place=session.name, remedy="Press Preview again")
    return obj


def is_following(session: Simulated) -> bool:
    """Whether the timeline moves it, rather than Play."""
    return session.uid in _stands


def follows_playback(session: Simulated) -> bool:
    """Whether its artist wants it to.

    Raises:
        HairloomError: it is gone.
    """
    return bool(_object_of(session).hairloom.bake.follows)


def release(session: Simulated) -> None:
    """It is played freely, or no longer at all, until the timeline takes it up again."""
    _stands.pop(session.uid, None)
    late.forget(session.uid)


def forget(uid: int) -> None:
    """A groom or fin is previewed no longer."""
    for known in (_stands, _baked, _fingerprints, _troubles, _bake_troubles):
        known.pop(uid, None)
    late.forget(uid)


def baked(uid: int) -> Baked | None:
    """What is known of its bake."""
    return _baked.get(uid)


def trouble(uid: int) -> str:
    """Why it is not simulated, or its bake not shown; empty while all is well."""
    return " ".join(known[uid] for known in (_troubles, _bake_troubles) if uid in known)


def bake_removed(obj: bpy.types.Object) -> None:
    """The bake was deleted, or another one put in its place."""
    _baked.pop(obj.session_uid, None)
    _bake_troubles.pop(obj.session_uid, None)
    folder = folder_of(obj)
    if folder is not None:
        playback.drop(folder)
