"""Changes since hair was baked, for notes on files that are written with a stale bake's motion."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ..base.objects import Body, Handle, head_of
from ..properties.groom_settings import GroomSettings
from ..scene.poses import read_pose
from . import playback
from .cache import Cache
from .groom_hashes import groom_frame_hash, groom_rig_hash, settings_hash
from .simulation import differences, phrase_of


def changed_inputs(
    hair: bpy.types.Object, cache: Cache, depsgraph: bpy.types.Depsgraph
) -> tuple[str, ...]:
    """The names of the inputs that have changed since the bake; empty where it is up to date.

    The inputs of frames are compared in the scene's frame only, if that was baked.

    Raises:
        HairloomError: the bake is damaged.
    """
    facts, head, settings = cache.facts, head_of(hair), GroomSettings.of(hair)
    now = groom_rig_hash(hair, head, settings, depsgraph.scene)
    changed = differences(facts.rig_hash, now)
    scene = depsgraph.scene
    if cache.has_frame(scene.frame_current) and not scene.frame_subframe:
        changed += _changed_frame_inputs(hair, head, cache, depsgraph)
    elif not any(settings_hash(hair) in frame_hash.split() for frame_hash in facts.frame_hashes):
        changed += ("settings",)
    return tuple(dict.fromkeys(changed))


def stale_notes(
    hair: bpy.types.Object, cache: Cache, depsgraph: bpy.types.Depsgraph
) -> tuple[str, ...]:
    """A sentence for the artist; empty where the bake is up to date.

    Raises:
        HairloomError: the bake is damaged.
    """
    changed = changed_inputs(hair, cache, depsgraph)
    if not changed:
        return ()
    return (
        f"{hair.name}: its bake is out of date ({phrase_of(changed)}), and its motion is written "
        "as it was baked. Bake again to write the current motion.",
    )


def _changed_frame_inputs(
    hair: bpy.types.Object,
    head: bpy.types.Object | None,
    cache: Cache,
    depsgraph: bpy.types.Depsgraph,
) -> tuple[str, ...]:
    """The names of this frame's inputs that have changed since the bake."""
    baked = playback.rig_in(cache)
    carrier, count = None, None
    if head is not None and baked.rest_matrices.head is not None and baked.rig.head is not None:
        carrier = Body(Handle.of(head), baked.rest_matrices.head)
        count = len(baked.rig.head.positions)
    try:
        pose = read_pose(Body(Handle.of(hair), baked.rest_matrices.hair), carrier, count, depsgraph)
    except HairloomError:  # another vertex count now, or values that are not finite
        return ("pose",)
    now = groom_frame_hash(hair, head if carrier else None, pose, depsgraph)
    return differences(cache.frame_hash(depsgraph.scene.frame_current), now)
