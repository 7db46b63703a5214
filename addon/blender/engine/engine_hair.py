"""The grooms of a render: as they were baked, or else as Blender has evaluated their curves.

Results that take time and seldom change, such as children and ambient occlusion, are kept from
frame to frame while curves, head and settings are the same. All views, view layers and renders
share them. For Rendered mode they are built in a thread; until then the picture shows the hair that
was drawn before, or none. Renders wait.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats, are_same
from ...cards.edits import CardEdits
from ...cards.follow import transformed_mesh
from ...cards.occlusion_settings import CardOcclusionSettings
from ...errors import HairloomError
from ...groom.painted_color import PaintedColor
from ...paint_flow import with_painted_colors
from ...render.snapshot import Snapshot
from ...rig_flow import Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.settings import ShadingSettings
from ...strands import StrandSet, Surface
from ...strands.affine import mean_scale, transform_points
from ..bakes import playback
from ..bakes.baked_rig import BakedRig
from ..bakes.cache import Cache
from ..base.latest_job import LatestJob
from ..base.objects import head_of
from ..base.redraw import redraw_views
from ..cards.build import BuiltCards, CardInputs, cards_key
from ..cards.edits import read_edits, same_edits
from ..cards.occluders import Occluders, read_occluders
from ..cards.show import as_shown
from ..cards.textures import chosen_pictures
from ..colliders.ties import holders_of
from ..properties.groom_settings import GroomSettings
from ..scene.painted_colors import read_colors
from ..scene.partings import partings_of
from ..sessions.groom_source import GroomSource
from ..sessions.prepared_groom import prepare_groom, requested_rig
from ..sessions.snapshots import snapshot_of, with_all_strands, with_settings


class HairNotMadeYetError(Exception):
    """There is no hair to show yet; try again once it is no longer pending."""


@dataclass(frozen=True, eq=False)
class _Made:
    """A groom at rest, and the values it was made from."""

    made_from: tuple[Any, ...]
    rig: Rig
    snapshot: Snapshot
    is_baked: bool
    _cards: list[tuple[Hashable, BuiltCards, Occluders, CardEdits | None]] = field(
        default_factory=list
    )
    _colored: list[Rig] = field(default_factory=list)

    def colored(self, colors: PaintedColor | None, look: ShadingSettings) -> Rig:
        """The rig with the colours of a colour map; the same object if they have not changed."""
        rig = with_painted_colors(self.rig, colors, look)
        for known in self._colored:
            if are_same(known.strands.color, rig.strands.color):
                return known
        self._colored[:] = [rig]
        return rig

    def cards(
        self,
        owner: bpy.types.Object,
        rig: Rig,
        settings: GroomSettings,
        others: Occluders,
        edits: CardEdits | None,
    ) -> BuiltCards:
        """The groom's cards; the last ones are returned while settings (colours too), edits and
        other hair are the same.

        Cards of baked hair are built at rest, so they are not built again in frames where other
        hair has only moved.
        """
        key = cards_key(settings), settings[ShadingSettings]
        for known, built, before, edits_before in self._cards:
            is_lit_alike = (
                others.uids == before.uids if self.is_baked else others.gives_same_occlusion(before)
            )
            is_cut_alike = same_edits(edits, edits_before)
            if known == key and built.rig is rig and is_lit_alike and is_cut_alike:
                return built
        pictures, _ = chosen_pictures(owner.data.hairloom.card_images)
        built = BuiltCards.build(CardInputs(rig, settings.sections, pictures, others, edits))
        self._cards[:] = [(key, built, others, edits)]
        return built


class _Kept:
    """The last result for one groom, and the job that builds another one for Rendered mode."""

    def __init__(self) -> None:
        self.made: _Made | None = None
        self._job = LatestJob[tuple[Any, ...], _Made](
            "hair in Rendered mode", self._take, is_same=_alike
        )
        self._error: Exception | None = None

    @property
    def is_pending(self) -> bool:
        """Whether other hair is being built."""
        return self._job.is_pending

    def is_of(self, made_from: tuple[Any, ...]) -> bool:
        return self.made is not None and _alike(self.made.made_from, made_from)

    def have(
        self, made_from: tuple[Any, ...], make: Callable[[], _Made], *, blocking: bool
    ) -> _Made | None:
        """The last result, None if there is none. If it is not of these values, it is built again:
        at once if blocking, else by a job.

        Raises:
            HairloomError: hair cannot be built from these values.
        """
        made = self.made
        if blocking:
            # in a render's thread; a job of the window for other hair goes on
            if made is None or not _alike(made.made_from, made_from):
                self.made = made = make()
        elif self.is_of(made_from):
            self.cancel()
        else:
            if not self._job.wants(made_from):
                self._error = None
                self._job.want(made_from, lambda: lambda _: make())
            if self._error is not None:
                raise _again(self._error) from self._error
        return made

    def cancel(self) -> None:
        """Cancel the job for other hair of this groom."""
        self._job.cancel()
        self._error = None

    def _take(self) -> None:
        """Take the job's result, and redraw views, which show it or report its error."""
        try:
            self.made = self._job.take() or self.made
        except Exception as error:
            self._error = error
        redraw_views()


def _again(error: Exception) -> Exception:
    """A copy of an error, to be raised again: each time that one error object is raised, its
    traceback grows and keeps more frames alive."""
    if isinstance(error, HairloomError):
        return HairloomError(error.problem, place=error.place, remedy=error.remedy)
    return type(error)(*error.args)


_kept: dict[int, _Kept] = {}


def owner_of(hair: bpy.types.Object) -> bpy.types.Object:
    """The groom that a copy for renders shows; for all other hair, itself.

    Args:
        hair: not the evaluated copy.
    """
    if not hair.data.hairloom.baked_in:
        return hair
    named = hair.hairloom.bake.stands_for  # not set in copies of older bakes
    return named or next((obj for obj in bpy.data.objects if obj.hairloom.bake.copy == hair), hair)


def read_groom(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True
) -> Snapshot:
    """One groom as a render shows it, in world space, without lights.

    Args:
        hair: hair curves, or the copy that shows a bake; not the evaluated object.
        blocking: False: it is built in a thread, and the last result is returned until then.

    Raises:
        HairNotMadeYetError: it is being built for the first time, and the call is not blocking.
        HairloomError: none of its curves can be used, or its bake is damaged.
    """
    owner = owner_of(hair)
    settings = GroomSettings.of(owner, depsgraph)
    cache, scene = playback.cache_of(owner), depsgraph.scene
    # Beyond the baked frames a copy stays as it is, and the artist's own curves are as evaluated.
    if cache is not None and (owner != hair or _shows_bake(owner, cache, scene.frame_current)):
        strands = playback.strands_in(cache, scene.frame_current, scene.frame_subframe)
        baked = playback.rig_in(cache)
        made = _of_bake(owner, baked, settings, blocking=blocking)
        head = baked.rig.head
        colors, _ = read_colors(owner, depsgraph, None if head is None else len(head.triangles))
        pose = playback.pose_in(cache, scene.frame_current, scene.frame_subframe)
        guides = playback.guides_in(cache, scene.frame_current, scene.frame_subframe)
    else:
        made, colors = _of_curves(owner, settings, depsgraph, blocking=blocking)
        strands, pose, guides = made.snapshot.points, made.rig.rest_pose, made.rig.guide_grid
    rig = made.colored(colors, settings[ShadingSettings])
    snapshot = replace(made.snapshot, points=strands, color=rig.strands.color)
    if settings.shows_cards:
        others = read_occluders(settings[CardOcclusionSettings], owner, depsgraph, pose.matrix)
        edits, _ = read_edits(owner, depsgraph, pose.matrix)
        built = made.cards(owner, rig, settings, others, edits)
        cards = built.at(pose, guides, settings.sections)
        snapshot = as_shown(replace(snapshot, cards=cards))
    return with_all_strands(with_settings(snapshot, settings))


def state_of(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[Any, ...]:
    """A key of everything that the look of hair depends on, except its curves and its head.

    Raises:
        HairloomError: its bake is damaged.
    """
    owner, scene = owner_of(hair), depsgraph.scene
    cache = playback.cache_of(owner)
    # hair with a bake moves from frame to frame
    frame = 0.0 if cache is None else scene.frame_current_final
    return GroomSettings.of(owner, depsgraph), cache, owner.hairloom.bake.is_shown, frame


def uids_of(hair: bpy.types.Object) -> set[int]:
    """Session numbers of all objects that a groom is made from, and of their data."""
    owner = owner_of(hair)
    objects = [owner, head_of(owner), *partings_of(owner), *holders_of(owner)]
    return {each.session_uid for obj in objects if obj is not None for each in (obj, obj.data)}


def placed(snapshot: Snapshot, motion: Floats) -> Snapshot:
    """The snapshot of an instance, moved by an affine (4, 4) matrix. Radii grow with the mean
    scale, and a mirror flips vectors across strands to the other side."""
    cards, center, scale = snapshot.cards, snapshot.volume_center, mean_scale(motion)
    is_mirrored = bool(np.linalg.det(motion[:3, :3]) < 0.0)
    if cards is not None:
        back, depth = cards.back_triangles, cards.depth
        cards = replace(
            cards,
            mesh=transformed_mesh(cards.mesh, motion),
            back_triangles=back[:, ::-1] if is_mirrored and back is not None else back,
            openness=_placed_light(cards.openness, is_mirrored),
            skin_seen=_placed_light(cards.skin_seen, is_mirrored),
            depth=None if depth is None else depth * np.float32(scale),
        )
    if center is not None:
        center = transform_points(center[None], motion)[0]
    return replace(
        snapshot,
        points=transform_points(snapshot.points, motion),
        radius=snapshot.radius * np.float32(scale),
        spacing=snapshot.spacing * scale,
        openness=_placed_light(snapshot.openness, is_mirrored),
        skin_seen=_placed_light(snapshot.skin_seen, is_mirrored),
        cards=cards,
        volume_center=center,
    )


def _placed_light(light: Floats | None, is_mirrored: bool) -> Floats | None:
    """Openness (n, 4) or visible skin (n, 8) of an instance. The third axis of their vectors is the
    cross product of the others, so a mirror flips its sign."""
    if light is None or not is_mirrored:
        return light
    sign = np.ones(light.shape[1], np.float32)
    sign[3::3] = -1.0
    return light * sign


def is_pending(uid: int) -> bool:
    """Whether new hair of a groom, given by session number, is being built."""
    return uid in _kept and _kept[uid].is_pending


def forget() -> None:
    """Drop all grooms, and cancel all jobs."""
    _keep_only(set())


def forget_gone() -> None:
    """Drop grooms whose objects are gone."""
    _keep_only({obj.session_uid for obj in bpy.data.objects})


def _keep_only(uids: set[int]) -> None:
    for uid in set(_kept) - uids:
        _kept.pop(uid).cancel()


def _shows_bake(hair: bpy.types.Object, cache: Cache, frame: int) -> bool:
    return bool(hair.hairloom.bake.is_shown and cache.has_frame(frame))


def _of_bake(
    owner: bpy.types.Object, baked: BakedRig, settings: GroomSettings, *, blocking: bool
) -> _Made:
    made_from = baked, settings[AmbientSettings]
    return _made(owner, made_from, settings, lambda: baked.rig, is_baked=True, blocking=blocking)


def _of_curves(
    hair: bpy.types.Object,
    settings: GroomSettings,
    depsgraph: bpy.types.Depsgraph,
    *,
    blocking: bool,
) -> tuple[_Made, PaintedColor | None]:
    request = GroomSource(hair, depsgraph).request
    source = request.source
    made_from = (
        *_values(source.strands),
        *(() if source.head is None else _values(source.head)),
        source.density,
        source.masks,
        source.partings,
        source.holders,
        settings.rig_settings,
        settings[AmbientSettings],
    )
    made = _made(
        hair, made_from, settings, lambda: requested_rig(request), is_baked=False, blocking=blocking
    )
    return made, source.colors


def _made(
    owner: bpy.types.Object,
    made_from: tuple[Any, ...],
    settings: GroomSettings,
    rig: Callable[[], Rig],
    *,
    is_baked: bool,
    blocking: bool,
) -> _Made:
    def make() -> _Made:
        # a render leaves no strands out, so it needs no occluder spheres
        groom = prepare_groom(rig(), settings[AmbientSettings], with_occluders=False)
        return _Made(made_from, groom.rig, snapshot_of(groom), is_baked)

    kept = _kept.setdefault(owner.session_uid, _Kept())
    made = kept.have(made_from, make, blocking=blocking)
    # a bake's strands fit its own rig only, so an earlier result cannot be shown
    if made is None or (is_baked and not kept.is_of(made_from)):
        raise HairNotMadeYetError
    return made


def _values(made: StrandSet | Surface) -> tuple[Any, ...]:
    """The values of all fields."""
    return tuple(getattr(made, each.name) for each in fields(made))


def _alike(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether two lists of values, arrays among them, are the same."""
    return len(one) == len(other) and all(
        np.array_equal(a, b, equal_nan=True)
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray)
        else not isinstance(a, np.ndarray) and not isinstance(b, np.ndarray) and a == b
        for a, b in zip(one, other, strict=True)
    )
