"""The grooms of a render: as they were baked, or else as Blender has evaluated their curves.

What costs time and seldom changes, such as children and ambient occlusion, is kept from frame to
frame as long as curves, head and settings are the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import bpy

from ... import pipeline
from ...arrays import Floats
from ...cards.follow import moved_mesh
from ...pipeline import Rig
from ...render.snapshot import Snapshot
from ...strands.affine import moved
from ..bakes import playback
from ..bakes.baked_rig import BakedRig
from ..bakes.cache import Cache
from ..base.objects import head_of
from ..cards.card_builds import BuiltCards, built_cards
from ..cards.card_images import chosen_pictures
from ..cards.occluders import OtherHair, read_other_hair
from ..cards.shown_cards import as_shown
from ..properties.card_form import CardForm
from ..properties.choices import Choices
from ..sessions.reading import Reading
from ..sessions.shown import snapshot_of, with_all_strands, with_choices
from . import engine_making
from .engine_making import HairNotMadeYetError


@dataclass(frozen=True, eq=False)
class _Kept:
    """A groom at rest, and the values it was made from."""

    made_from: tuple[Any, ...]
    rig: Rig
    snapshot: Snapshot
    is_baked: bool
    _cards: list[tuple[BuiltCards, OtherHair]] = field(default_factory=list)

    def cards(self, owner: bpy.types.Object, form: CardForm, others: OtherHair) -> BuiltCards:
        """Its cards; those of the last form and other hair are kept, to the last colour.

        Baked hair stays at rest, whatever other hair does in the frames: its cards are not built
        anew for each of them.
        """
        for built, before in self._cards:
            is_same = built.form == form and built.form.shading == form.shading
            is_lit_alike = others.uids == before.uids if self.is_baked else others.is_like(before)
            if is_same and is_lit_alike:
                return built
        pictures, _ = chosen_pictures(owner.data.hairloom.card_images)
        built = built_cards(self.rig, form, pictures, others)
        self._cards[:] = [(built, others)]
        return built


_kept: dict[int, _Kept] = {}


def owner_of(hair: bpy.types.Object) -> bpy.types.Object:
    """The groom that a copy for renders stands for; of all other hair, itself.

    Args:
        hair: not the evaluated copy.
    """
    if not hair.data.hairloom.baked_in:
        return hair
    named = hair.hairloom.bake.stands_for  # copies of older bakes name nothing
    return named or next((obj for obj in bpy.data.objects if obj.hairloom.bake.copy == hair), hair)


def read_groom(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, waits: bool = True
) -> Snapshot:
    """One groom as a render shows it, in world space, without light.

    Args:
        hair: not the evaluated copy; hair curves, or the copy of a bake.
        waits: False: it is made in a thread, and what was made last is shown until then.

    Raises:
        HairNotMadeYetError: it is being made for the first time, and nobody waits.
        HairloomError: none of its curves can be used, or its bake is damaged.
    """
    owner = owner_of(hair)
    choices = Choices.of(owner, depsgraph)
    cache, scene = playback.cache_of(owner), depsgraph.scene
    # A copy stays as it is beyond the baked frames; curves of the artist's go on by themselves.
    if cache is not None and (owner != hair or _shows_bake(owner, cache, scene.frame_current)):
        strands = playback.strands_in(cache, scene.frame_current, scene.frame_subframe)
        kept = _of_bake(owner, playback.rig_in(cache), choices, waits=waits)
        pose = playback.pose_in(cache, scene.frame_current, scene.frame_subframe)
    else:
        kept = _of_curves(owner, choices, depsgraph, waits=waits)
        strands, pose = kept.snapshot.strands, kept.rig.rest_pose
    snapshot = replace(kept.snapshot, strands=strands)
    if choices.shows_cards:
        form = choices.card_form
        others = read_other_hair(form.occlusion, owner, depsgraph, pose.matrix)
        built = kept.cards(owner, form, others)
        cards = built.at(pose, strands[kept.rig.guides], choices.cards_drawn)
        snapshot = as_shown(replace(snapshot, cards=cards))
    return with_all_strands(with_choices(snapshot, choices))


def state_of(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[Any, ...]:
    """What decides how hair looks, but for its curves and its head.

    Raises:
        HairloomError: its bake is damaged.
    """
    owner, scene = owner_of(hair), depsgraph.scene
    cache = playback.cache_of(owner)
    # where a bake is shown, it moves from frame to frame
    frame = 0.0 if cache is None else scene.frame_current_final
    return Choices.of(owner, depsgraph), cache, owner.hairloom.bake.is_shown, frame


def uids_of(hair: bpy.types.Object) -> set[int]:
    """Session numbers of hair and head, and of their data."""
    objects = [owner_of(hair), head_of(owner_of(hair))]
    return {each.session_uid for obj in objects if obj is not None for each in (obj, obj.data)}


def placed(snapshot: Snapshot, motion: Floats) -> Snapshot:
    """The same, moved by an affine (4, 4) matrix, as an instance is."""
    strands = moved(snapshot.strands.reshape(-1, 3), motion).reshape(snapshot.strands.shape)
    cards, center = snapshot.cards, snapshot.volume_center
    if cards is not None:
        cards = replace(cards, mesh=moved_mesh(cards.mesh, motion))
    if center is not None:
        center = moved(center[None], motion)[0]
    return replace(snapshot, strands=strands, cards=cards, volume_center=center)


def forget() -> None:
    """Keep no groom in memory."""
    _kept.clear()
    engine_making.forget()


def forget_but(uids: set[int]) -> None:
    """Keep these alone, by session number of their objects."""
    for uid in set(_kept) - uids:
        del _kept[uid]
    engine_making.forget_but(uids)


def _shows_bake(hair: bpy.types.Object, cache: Cache, frame: int) -> bool:
    return bool(hair.hairloom.bake.is_shown and cache.holds(frame))


def _of_bake(owner: bpy.types.Object, baked: BakedRig, choices: Choices, *, waits: bool) -> _Kept:
    made_from = baked.rig.strands.points, choices.ambient
    return _made(owner, made_from, choices, lambda: baked.rig, is_baked=True, waits=waits)


def _of_curves(
    hair: bpy.types.Object, choices: Choices, depsgraph: bpy.types.Depsgraph, *, waits: bool
) -> _Kept:
    reading = Reading(hair, depsgraph)
    source = reading.source
    made_from = (
        source.strands.points,
        source.strands.offsets,
        source.strands.radius,
        source.strands.group,
        None if source.head is None else source.head.positions,
        source.density,
        choices.of_rig,
        choices.ambient,
    )
    return _made(hair, made_from, choices, reading.rig, is_baked=False, waits=waits)


def _made(
    owner: bpy.types.Object,
    made_from: tuple[Any, ...],
    choices: Choices,
    rig: Any,
    *,
    is_baked: bool,
    waits: bool,
) -> _Kept:
    def make() -> _Kept:
        made = rig()
        occlusion = pipeline.rest_occlusion(made, choices.ambient)
        snapshot = snapshot_of(made, occlusion, pipeline.strand_ranks(made))
        return _Kept(made_from, made, snapshot, is_baked)

    uid = owner.session_uid
    kept = _kept.get(uid)
    if kept is not None and engine_making.alike(kept.made_from, made_from):
        if not waits:
            engine_making.drop(uid)
        return kept
    found = make() if waits else engine_making.made(uid, made_from, make)
    if found is not None:
        kept = _kept[uid] = found
    # of a bake no other hair is shown, as the strands of each frame belong to its own
    if kept is None or (is_baked and not engine_making.alike(kept.made_from, made_from)):
        raise HairNotMadeYetError
    return kept
