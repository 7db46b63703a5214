"""The grooms of a render: as they were baked, or else as Blender has evaluated their curves.

Results that take time and seldom change, such as children and ambient occlusion, are cached while
curves, head and settings are the same. All views, view layers and renders share them. For Rendered
mode they are built in a thread; until then the picture shows the last hair, or none. Renders wait.
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


class HairNotReadyError(Exception):
    """No hair has been built yet; try again once none is pending."""


@dataclass(frozen=True, eq=False)
class _BuiltGroom:
    """A groom at rest, and the values it was built from."""

    inputs: tuple[Any, ...]
    rig: Rig
    snapshot: Snapshot
    is_baked: bool
    _last_cards: list[tuple[Hashable, BuiltCards, Occluders, CardEdits | None]] = field(
        default_factory=list
    )
    _last_colored: list[Rig] = field(default_factory=list)

    def colored(self, colors: PaintedColor | None, look: ShadingSettings) -> Rig:
        """The rig with the colours of a colour map; the same object if they have not changed."""
        rig = with_painted_colors(self.rig, colors, look)
        for last in self._last_colored:
            if are_same(last.strands.color, rig.strands.color):
                return last
        self._last_colored[:] = [rig]
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
        for last_key, built, others_before, edits_before in self._last_cards:
            has_same_occlusion = (
                others.uids == others_before.uids
                if self.is_baked
                else others.gives_same_occlusion(others_before)
            )
            has_same_edits = same_edits(edits, edits_before)
            if last_key == key and built.rig is rig and has_same_occlusion and has_same_edits:
                return built
        pictures, _ = chosen_pictures(owner.data.hairloom.card_images)
        built = BuiltCards.build(CardInputs(rig, settings.sections, pictures, others, edits))
        self._last_cards[:] = [(key, built, others, edits)]
        return built


class _CachedGroom:
    """The last result of one groom, and the job that builds the next one for Rendered mode."""

    def __init__(self) -> None:
        self.built: _BuiltGroom | None = None
        self._job = LatestJob[tuple[Any, ...], _BuiltGroom](
            "hair in Rendered mode", self._take, is_same=_are_same
        )
        self._error: Exception | None = None

    @property
    def is_pending(self) -> bool:
        """Whether new hair is being built."""
        return self._job.is_pending

    def was_built_from(self, inputs: tuple[Any, ...]) -> bool:
        return self.built is not None and _are_same(self.built.inputs, inputs)

    def get(
        self, inputs: tuple[Any, ...], make: Callable[[], _BuiltGroom], *, blocking: bool
    ) -> _BuiltGroom | None:
        """The last result, None if there is none. If its inputs differ, it is built again: at once
        if blocking, else by a job.

        Raises:
            HairloomError: hair cannot be built from these inputs.
        """
        built = self.built
        if blocking:
            # in a render's thread; a job of the window continues
            if built is None or not _are_same(built.inputs, inputs):
                self.built = built = make()
        elif self.was_built_from(inputs):
            self.cancel()
        else:
            if not self._job.is_latest(inputs):
                self._error = None
                self._job.request(inputs, lambda: lambda _: make())
            if self._error is not None:
                raise _copied_error(self._error) from self._error
        return built

    def cancel(self) -> None:
        """Cancel the job that builds this groom."""
        self._job.cancel()
        self._error = None

    def _take(self) -> None:
        """Take the job's result, and redraw views, which show it or report its error."""
        try:
            self.built = self._job.take() or self.built
        except Exception as error:
            self._error = error
        redraw_views()


def _copied_error(error: Exception) -> Exception:
    """A copy of an error, to be raised again: whenever the same error object is raised, its
    traceback grows and keeps more frames alive."""
    if isinstance(error, HairloomError):
        return error.at(error.place)
    return type(error)(*error.args)


_cache: dict[int, _CachedGroom] = {}


def owner_of(hair: bpy.types.Object) -> bpy.types.Object:
    """The groom that a copy for renders shows; for all other hair, itself.

    Args:
        hair: not the evaluated copy.
    """
    if not hair.data.hairloom.baked_in:
        return hair
    original = hair.hairloom.bake.shown_hair  # not set in copies of older bakes
    return original or next(
        (obj for obj in bpy.data.objects if obj.hairloom.bake.copy == hair), hair
    )


def read_groom(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True
) -> Snapshot:
    """One groom as a render shows it, in world space, without lights.

    Args:
        hair: hair curves, or the copy that shows a bake; not the evaluated object.
        blocking: False: it is built in a thread, and the last result is returned until then.

    Raises:
        HairNotReadyError: it is being built for the first time, and the call is not blocking.
        HairloomError: none of its curves can be used, or its bake is damaged.
    """
    owner = owner_of(hair)
    settings = GroomSettings.of(owner, depsgraph)
    cache, scene = playback.cache_of(owner), depsgraph.scene
    # Outside of the baked frames, a copy keeps its shape, and the artist's curves are as evaluated.
    if cache is not None and (owner != hair or _shows_bake(owner, cache, scene.frame_current)):
        strands = playback.strands_in(cache, scene.frame_current, scene.frame_subframe)
        baked = playback.rig_in(cache)
        built = _build_from_bake(owner, baked, settings, blocking=blocking)
        head = baked.rig.head
        colors, _ = read_colors(owner, depsgraph, None if head is None else len(head.triangles))
        pose = playback.pose_in(cache, scene.frame_current, scene.frame_subframe)
        guides = playback.guides_in(cache, scene.frame_current, scene.frame_subframe)
    else:
        built, colors = _build_from_curves(owner, settings, depsgraph, blocking=blocking)
        strands, pose, guides = built.snapshot.points, built.rig.rest_pose, built.rig.guide_grid
    rig = built.colored(colors, settings[ShadingSettings])
    snapshot = replace(built.snapshot, points=strands, color=rig.strands.color)
    if settings.shows_cards:
        others = read_occluders(settings[CardOcclusionSettings], owner, depsgraph, pose.matrix)
        edits, _ = read_edits(owner, depsgraph, pose.matrix)
        built_cards = built.cards(owner, rig, settings, others, edits)
        cards = built_cards.at(pose, guides, settings.sections)
        snapshot = as_shown(replace(snapshot, cards=cards))
    return with_all_strands(with_settings(snapshot, settings))


def state_key(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[Any, ...]:
    """A key of everything that the look of hair depends on, except its curves and its head.

    Raises:
        HairloomError: its bake is damaged.
    """
    owner, scene = owner_of(hair), depsgraph.scene
    cache = playback.cache_of(owner)
    # baked hair changes with the frame
    frame = 0.0 if cache is None else scene.frame_current_final
    return GroomSettings.of(owner, depsgraph), cache, owner.hairloom.bake.is_shown, frame


def uids_of(hair: bpy.types.Object) -> set[int]:
    """Session numbers of all objects that a groom is built from, and of their data."""
    owner = owner_of(hair)
    objects = [owner, head_of(owner), *partings_of(owner), *holders_of(owner)]
    return {each.session_uid for obj in objects if obj is not None for each in (obj, obj.data)}


def transformed(snapshot: Snapshot, motion: Floats) -> Snapshot:
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
            openness=_mirrored_light(cards.openness, is_mirrored),
            skin_seen=_mirrored_light(cards.skin_seen, is_mirrored),
            depth=None if depth is None else depth * np.float32(scale),
        )
    if center is not None:
        center = transform_points(center[None], motion)[0]
    return replace(
        snapshot,
        points=transform_points(snapshot.points, motion),
        radius=snapshot.radius * np.float32(scale),
        spacing=snapshot.spacing * scale,
        openness=_mirrored_light(snapshot.openness, is_mirrored),
        skin_seen=_mirrored_light(snapshot.skin_seen, is_mirrored),
        cards=cards,
        volume_center=center,
    )


def _mirrored_light(light: Floats | None, is_mirrored: bool) -> Floats | None:
    """Openness (n, 4) or visible skin (n, 8) of an instance. The third axis of their vectors is the
    cross product of the others, so a mirror flips its sign."""
    if light is None or not is_mirrored:
        return light
    sign = np.ones(light.shape[1], np.float32)
    sign[3::3] = -1.0
    return light * sign


def is_pending(uid: int) -> bool:
    """Whether new hair of a groom, given by session number, is being built."""
    return uid in _cache and _cache[uid].is_pending


def forget() -> None:
    """Drop all grooms, and cancel all jobs."""
    _drop_all_but(set())


def forget_deleted() -> None:
    """Drop grooms whose objects were deleted."""
    _drop_all_but({obj.session_uid for obj in bpy.data.objects})


def _drop_all_but(uids: set[int]) -> None:
    for uid in set(_cache) - uids:
        _cache.pop(uid).cancel()


def _shows_bake(hair: bpy.types.Object, cache: Cache, frame: int) -> bool:
    return bool(hair.hairloom.bake.is_shown and cache.has_frame(frame))


def _build_from_bake(
    owner: bpy.types.Object, baked: BakedRig, settings: GroomSettings, *, blocking: bool
) -> _BuiltGroom:
    inputs = baked, settings[AmbientSettings]
    return _build(owner, inputs, settings, lambda: baked.rig, is_baked=True, blocking=blocking)


def _build_from_curves(
    hair: bpy.types.Object,
    settings: GroomSettings,
    depsgraph: bpy.types.Depsgraph,
    *,
    blocking: bool,
) -> tuple[_BuiltGroom, PaintedColor | None]:
    request = GroomSource(hair, depsgraph).request
    source = request.source
    inputs = (
        *_field_values(source.strands),
        *(() if source.head is None else _field_values(source.head)),
        source.density,
        source.masks,
        source.partings,
        source.holders,
        settings.rig_settings,
        settings[AmbientSettings],
    )
    built = _build(
        hair, inputs, settings, lambda: requested_rig(request), is_baked=False, blocking=blocking
    )
    return built, source.colors


def _build(
    owner: bpy.types.Object,
    inputs: tuple[Any, ...],
    settings: GroomSettings,
    rig: Callable[[], Rig],
    *,
    is_baked: bool,
    blocking: bool,
) -> _BuiltGroom:
    def make() -> _BuiltGroom:
        # a render leaves no strands out, so it needs no occluder spheres
        groom = prepare_groom(rig(), settings[AmbientSettings], with_occluders=False)
        return _BuiltGroom(inputs, groom.rig, snapshot_of(groom), is_baked)

    cached = _cache.setdefault(owner.session_uid, _CachedGroom())
    built = cached.get(inputs, make, blocking=blocking)
    # baked strands fit only their own rig, so an earlier result cannot be shown
    if built is None or (is_baked and not cached.was_built_from(inputs)):
        raise HairNotReadyError
    return built


def _field_values(data: StrandSet | Surface) -> tuple[Any, ...]:
    """The values of all fields."""
    return tuple(getattr(data, each.name) for each in fields(data))


def _are_same(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether two lists of values, some of them arrays, are the same."""
    return len(one) == len(other) and all(
        np.array_equal(a, b, equal_nan=True)
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray)
        else not isinstance(a, np.ndarray) and not isinstance(b, np.ndarray) and a == b
        for a, b in zip(one, other, strict=True)
    )
