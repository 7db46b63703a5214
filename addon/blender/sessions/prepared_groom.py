"""Prepares a groom to be shown, from arrays alone, so that a thread may do it.

That takes a second, or ten with many children. In a window it runs in a thread: until the new hair
is made, the hair before it is shown, or Blender's own strands before the first. In background mode
it is made at once.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from ... import light_flow, rig_flow
from ...arrays import Floats, Ints, all_equal
from ...errors import HairloomError
from ...groom.settings import GuideSettings
from ...light_flow import HairLight, quick_light, rest_light
from ...rig_flow import Rig
from ...shading.ambient_settings import AmbientSettings
from ...strands import StrandSet, Surface
from ...strands.result_cache import NO_CACHE, ResultCache
from ..colliders.rigs import rig_from
from ..colliders.ties import TrackedHolders
from ..properties.groom_settings import GroomSettings
from ..scene.source import Source
from .occluder_spheres import OccluderSpheres

type Report = Callable[[str], None]

#: Number of strands of a placeholder.
_PLACEHOLDER_STRANDS = 32
#: Roots farther from their surface than this fraction of its diagonal are loose; those of grooms
#: that fit are within half of it.
_LOOSE_ROOT_DISTANCE = 0.02
#: Heads with more triangles take too long to search for a placeholder.
_MAX_SEARCHED_TRIANGLES = 4000


@dataclass(frozen=True, eq=False)
class BuildRequest:
    """What a groom is made from.

    name: of the groom, in messages. rig: that of its bake; None: it must be made.
    holding: what holds the hair beside its roots; follows those objects.
    cache: results of the last build for the same session, which runs one build at a time.
    """

    name: str
    source: Source
    settings: GroomSettings
    rig: Rig | None = None
    holders: TrackedHolders = field(default_factory=TrackedHolders)
    cache: ResultCache = NO_CACHE

    def gives_same_rig_as(self, other: BuildRequest) -> bool:
        """Whether both surely give the same rig; does not build it."""
        one, two = self.source, other.source
        return (
            self.settings.rig_settings == other.settings.rig_settings
            and one.strands is two.strands
            and one.head is two.head
            and one.masks == two.masks
            and one.holders == two.holders
            and all_equal((one.density, one.partings), (two.density, two.partings))
        )


@dataclass(frozen=True, eq=False)
class PreparedGroom:
    """A groom prepared to be shown.

    ambient: settings that its light was made with.
    light: at rest; None: left out.
    rank: (strand_count,), see `rig_flow.strand_ranks`; None: left out.
    occluders: spheres in the head that hide hair; None: there are none, or they were left out.
    is_placeholder: whether it has only a few of the strands, which are not drawn.
    """

    rig: Rig
    ambient: AmbientSettings
    light: HairLight | None = None
    rank: Floats | None = None
    occluders: OccluderSpheres | None = None
    is_placeholder: bool = False

    @cached_property
    def head_occlusion(self) -> Floats | None:
        """(vertex_count,) in [0, 1], at rest; None without a head."""
        return light_flow.head_occlusion(self.rig, self.ambient)

    @cached_property
    def loose_roots(self) -> int:
        """Number of roots that are too far from the surface to be on it."""
        rig = self.rig
        if rig.head is None or rig.rest_frames is None:
            return 0
        low, high = rig.head.bounds()
        reach = _LOOSE_ROOT_DISTANCE * float(np.linalg.norm(high - low))
        away = np.linalg.norm(rig.strands.roots - rig.rest_frames.origin, axis=1)
        return int((away > reach).sum())


def requested_rig(request: BuildRequest) -> Rig:
    """The groom prepared to move.

    Raises:
        HairloomError: the groom is of another scale than the head.
    """
    if request.rig is not None:
        return request.rig
    settings, cache = request.settings.sections, request.cache
    return rig_from(request.source, settings, place=request.name, cache=cache)


def build_groom(
    request: BuildRequest,
    before: tuple[BuildRequest, PreparedGroom] | None = None,
    *,
    is_drawn: bool,
    is_quick: bool = False,
    report: Report = lambda stage: None,
) -> PreparedGroom:
    """Make a groom; parts that the request does not change are reused.

    Args:
        before: the last groom, and the request that it was made from.
        is_drawn: False leaves out what only drawing needs.
        is_quick: whether it may have approximate light, until `with_full_light` has found its own.
        report: see `prepare_groom`.

    Raises:
        HairloomError: as `requested_rig`.
    """
    report("strands")
    known = None if before is None or before[1].is_placeholder else before[1]
    is_same = before is not None and known is not None and request.gives_same_rig_as(before[0])
    rig = known.rig if known is not None and is_same else requested_rig(request)
    ambient = request.settings[AmbientSettings]
    if not is_drawn:
        return PreparedGroom(rig, ambient)
    return prepare_groom(rig, ambient, known, is_quick=is_quick, report=report)


def prepare_groom(
    rig: Rig,
    ambient: AmbientSettings,
    known: PreparedGroom | None = None,
    *,
    with_occluders: bool = True,
    is_quick: bool = False,
    report: Report = lambda stage: None,
) -> PreparedGroom:
    """Everything that drawing a rig needs, for previews, renders and pictures.

    Args:
        known: the groom before; light and occluders are reused if only guides differ.
        with_occluders: False leaves out the spheres, which need a search through the head.
        is_quick: see `build_groom`.
        report: called before each stage with its name; may cancel by raising an exception.
    """
    report("ambient occlusion")
    with ThreadPoolExecutor(1) as beside:
        # cached properties that the window's first frame needs; numpy lets both threads run at once
        moving = beside.submit(
            lambda: (rig.riders, rig.root_holds, rig.strands.uneven_length_fractions)
        )
        groom = _prepare_drawing(rig, ambient, known, with_occluders, is_quick, report)
        moving.result()
    return groom


def _prepare_drawing(
    rig: Rig,
    ambient: AmbientSettings,
    known: PreparedGroom | None,
    with_occluders: bool,
    is_quick: bool,
    report: Report,
) -> PreparedGroom:
    """As `prepare_groom`, without the cached data for motion."""
    light, relit = None if known is None else known.light, None
    if known is not None and light is not None and known.rig is rig and known.ambient != ambient:
        relit = light_flow.updated_light(rig, light, known.ambient, ambient)
    before = None if known is None or light is None else (known.rig, light)
    if known is not None and not _same_hair(known.rig, rig):
        known = None
    is_other = known is None or known.ambient != ambient
    if relit is not None:
        light = relit
    elif light is None or is_other or (light.is_quick and not is_quick):
        find = partial(quick_light, earlier=before) if is_quick else rest_light
        light = find(rig, ambient)
    report("what the head hides")
    occluders = None if known is None else known.occluders
    if occluders is None and rig.head is not None and with_occluders:
        roots = rig.strands.roots
        corners = np.stack([roots.min(axis=0), roots.max(axis=0)])
        occluders = rig.head.compute_if_changed(OccluderSpheres, corners)
    rank = rig_flow.strand_ranks(rig)
    return PreparedGroom(rig, ambient, light, rank, occluders)


def with_full_light(groom: PreparedGroom, report: Report = lambda stage: None) -> PreparedGroom:
    """The groom with its full light instead of quick light.

    Args:
        report: see `prepare_groom`.
    """
    report("light")
    light = rest_light(groom.rig, groom.ambient, lambda: report("light"))
    return replace(groom, light=light)


def placeholder_groom(request: BuildRequest) -> PreparedGroom:
    """The groom of a session until the real one is made: a few of its strands.

    Raises:
        HairloomError: as `requested_rig`.
    """
    rig = request.rig
    if rig is None:
        source, count = request.source, request.source.strands.strand_count
        few = source.strands.take(np.arange(0, count, max(count // _PLACEHOLDER_STRANDS, 1)))
        rig = _placeholder_rig(few, source.head, request)
    ambient = request.settings[AmbientSettings]
    return PreparedGroom(rig, ambient, is_placeholder=True)


def _placeholder_rig(few: StrandSet, head: Surface | None, request: BuildRequest) -> Rig:
    """A few strands on a head; a large head is reduced to the triangles near their roots.

    Raises:
        HairloomError: as `requested_rig`.
    """
    if head is not None and len(head.triangles) > _MAX_SEARCHED_TRIANGLES:
        near = _triangles_near(few.roots, head)
        uv = None if head.corner_uv is None else head.corner_uv[near]
        part = replace(head, triangles=head.triangles[near], corner_uv=uv)
        # fails if roots are far from these triangles; then the whole head is searched
        with suppress(HairloomError):
            rig = rig_flow.prepare(few, part, request.settings[GuideSettings], place=request.name)
            bound = replace(rig.strands, root_triangle=near[rig.strands.root_triangle])
            return replace(rig, strands=bound, head=head)
    return rig_flow.prepare(few, head, request.settings[GuideSettings], place=request.name)


def _triangles_near(points: Floats, surface: Surface) -> Ints:
    """The triangles at the vertices that are nearest to any of these points."""
    middle = surface.positions.mean(axis=0)
    vertices, asked = surface.positions - middle, points - middle
    away = (vertices**2).sum(axis=1)[:, None] - 2.0 * vertices @ asked.T
    is_near = np.zeros(len(vertices), bool)
    is_near[away.argmin(axis=0)] = True
    return np.flatnonzero(is_near[surface.triangles].any(axis=1))


def _same_hair(one: Rig, other: Rig) -> bool:
    """Whether two rigs have the same strands on the same head, whatever their guides."""
    return one.head is other.head and all(
        np.array_equal(getattr(one.strands, name), getattr(other.strands, name))
        for name in ("points", "offsets", "radius")
    )
