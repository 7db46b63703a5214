"""A groom made ready to be shown, from arrays alone, so that a thread may do it.

That takes a second, and with many children ten. In a window it goes on beside everything else: what
was shown before stays until the new hair is there, and before the first one Blender's own strands
do. In the background it is made at once.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ... import pipeline
from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...groom.settings import GuideSettings
from ...pipeline import Rig
from ...shading.ambient_settings import AmbientSettings
from ...strands import StrandSet, Surface
from ..bakes.baked_rig import used_vertices
from ..properties.groom_settings import GroomSettings
from ..scene.rigs import rig_from
from ..scene.source import Source
from .hiders import Hiders

#: Strands of the placeholder of a groom that is being made.
_FEW = 32
#: Roots farther from their surface than this part of its diagonal are not on it; those of grooms
#: that fit lie within half of it.
_LOOSE = 0.02
#: Heads of more triangles take longer to search than an artist waits.
_LARGE = 4000


@dataclass(frozen=True, eq=False)
class Order:
    """What a groom is to be made from.

    name: of the groom, in messages. rig: that of its bake; None: it is to be made.
    """

    name: str
    source: Source
    settings: GroomSettings
    rig: Rig | None = None

    def gives_rig_of(self, other: Order) -> bool:
        """Whether both give the same rig, as far as can be told without making it."""
        one, two = self.source, other.source
        return (
            self.settings.of_rig == other.settings.of_rig
            and one.strands is two.strands
            and one.head is two.head
            and np.array_equal(one.density, two.density)  # type: ignore[arg-type]
        )


@dataclass(frozen=True, eq=False)
class Made:
    """A groom made ready to be shown.

    used: the head's vertices that carry roots.
    occlusion: (strand_count, cv_count) in [0, 1], at rest.
    rank: (strand_count,), see `pipeline.strand_ranks`.
    hiders: what of the head hides hair.
    is_whole: whether this is all the hair, not its placeholder, which is not seen.
    Without what only drawing needs, the last three before are None.
    """

    order: Order
    rig: Rig
    used: Ints
    occlusion: Floats | None = None
    rank: Floats | None = None
    hiders: Hiders | None = None
    is_whole: bool = True

    @cached_property
    def loose_roots(self) -> int:
        """How many roots are too far from the surface to be on it."""
        rig = self.rig
        if rig.head is None or rig.rest_frames is None:
            return 0
        low, high = rig.head.bounds()
        reach = _LOOSE * float(np.linalg.norm(high - low))
        away = np.linalg.norm(rig.strands.roots - rig.rest_frames.origin, axis=1)
        return int((away > reach).sum())


def rig_of(order: Order) -> Rig:
    """The groom made ready to move.

    Raises:
        HairloomError: the groom is of another scale than the head.
    """
    if order.rig is not None:
        return order.rig
    return rig_from(order.source, order.settings.sections, place=order.name)


def make(
    order: Order,
    before: Made | None = None,
    *,
    is_drawn: bool,
    report: Callable[[str], None] = lambda stage: None,
) -> Made:
    """Make a groom; what nothing changes is taken from before.

    Args:
        is_drawn: False leaves out what only drawing needs.
        report: is called before each stage with its name; may end it all by an exception.

    Raises:
        HairloomError: as `rig_of`.
    """
    report("strands")
    is_same_rig = before is not None and before.is_whole and order.gives_rig_of(before.order)
    rig = before.rig if before is not None and is_same_rig else rig_of(order)
    used = used_vertices(rig)
    if not is_drawn:
        return Made(order, rig, used)
    report("ambient occlusion")
    # other guides on the same hair leave its shade and its head as they are
    known = before if before is not None and _same_hair(before.rig, rig) else None
    ambient = order.settings[AmbientSettings]
    is_lit_alike = known is not None and known.order.settings[AmbientSettings] == ambient
    if known is not None and known.occlusion is not None and is_lit_alike:
        occlusion = known.occlusion
    else:
        occlusion = pipeline.rest_occlusion(rig, ambient)
    report("what the head hides")
    if known is not None and known.hiders is not None:
        hiders: Hiders | None = known.hiders
    else:
        hiders = None if rig.head is None else Hiders(rig.head, rig.strands.roots)
    return Made(order, rig, used, occlusion, pipeline.strand_ranks(rig), hiders)


def placeholder(order: Order) -> Made:
    """What a session moves until its groom is made: a few of its strands.

    Raises:
        HairloomError: as `rig_of`.
    """
    rig = order.rig
    if rig is None:
        source, count = order.source, order.source.strands.strand_count
        few = source.strands.take(np.arange(0, count, max(count // _FEW, 1)))
        rig = _quickly_bound(few, source.head, order)
    return Made(order, rig, used_vertices(rig), is_whole=False)


def _quickly_bound(few: StrandSet, head: Surface | None, order: Order) -> Rig:
    """A few strands on a head of any size; of a large one the triangles near their roots will do.

    Raises:
        HairloomError: as `rig_of`.
    """
    if head is not None and len(head.triangles) > _LARGE:
        near = _triangles_near(few.roots, head)
        uv = None if head.corner_uv is None else head.corner_uv[near]
        part = replace(head, triangles=head.triangles[near], corner_uv=uv)
        # roots that seem far away may be near to the rest of the head
        with suppress(HairloomError):
            rig = pipeline.prepare(few, part, order.settings[GuideSettings], place=order.name)
            bound = replace(rig.strands, root_triangle=near[rig.strands.root_triangle])
            return replace(rig, strands=bound, head=head)
    return pipeline.prepare(few, head, order.settings[GuideSettings], place=order.name)


def _triangles_near(points: Floats, surface: Surface) -> Ints:
    """Those at the vertices that are nearest to any of these points."""
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
