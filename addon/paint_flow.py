"""The flow of painted hair: children come and go at once under a brush that paints their density or
masks, and strands take painted colours.

Children that the new density removes make room for those that it adds. The new ones take over the
point counts of the old and get the shapes of all children, in the clumps of their neighbours. So
nothing else changes, and results for the whole groom stay in use, as in `comb_flow`. Left to
`rig_flow.prepare`, which has to follow: the number of children, occlusion where new ones are, where
children scatter from, guides in motion, and all that `comb_flow` leaves to it. Children whose masks
have changed are shaped again, as combed ones are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .arrays import Floats, Ints
from .comb_flow import put_children
from .dynamics.painted import PaintedGuides
from .groom.child_roots import ChildRoots, child_roots
from .groom.masks import NO_MASKS, Masks, Places, StrandMask
from .groom.painted_color import PaintedColor
from .groom.roots import RootFrames, root_frames
from .rig_flow import Grown, Rig
from .shading.coat import coated_color
from .shading.drawn_strands import look_color, natural_strands
from .shading.settings import ShadingSettings
from .strands import StrandSet, Surface
from .strands.arc_length import along
from .strands.kept import same_rows

#: The lowest opacity that premultiplied paint is divided by.
_FAINTEST = 1.0e-6


def painted(rig: Rig, density: Floats | None, masks: Masks = NO_MASKS) -> Rig:
    """The rig with its children as a new density and new masks make them.

    Args:
        rig: with children that have grown.
        density: (vertex_count,), see `rig_flow.prepare`. masks: of the settings of children.

    Raises:
        HairloomError: as `child_roots`.
    """
    rig = _masked(rig, masks)
    grown, own, head = rig.grown, rig.own_count, rig.head
    assert grown is not None and own is not None and head is not None
    settings = grown.growth.settings
    roots = child_roots(grown.shapes, head, settings.strand_count, density, settings.seed)
    number, grown = _grown(roots, head, grown)
    is_wanted = np.zeros(len(grown.growth.root), bool)
    is_wanted[number] = True
    gone = np.flatnonzero(~is_wanted[grown.kept])
    is_wanted[grown.kept] = False
    come = np.flatnonzero(is_wanted)
    if not len(gone):
        return rig
    # if fewer come than go, some are drawn twice until `prepare` has found how many there are
    come = np.sort(np.resize(come if len(come) else number, len(gone)))
    kept = grown.kept.copy()
    kept[gone] = come
    grown = replace(grown, kept=kept)
    return replace(_moved(rig, roots, grown, own + gone, number, come), grown=grown)


def colored(rig: Rig, painted: PaintedColor | None, look: ShadingSettings) -> Rig:
    """The rig with painted colours, see `with_colors`."""
    strands = with_colors(rig.strands, painted, look)
    return rig if strands is rig.strands else replace(rig, strands=strands)


def with_colors(
    strands: StrandSet, painted: PaintedColor | None, look: ShadingSettings
) -> StrandSet:
    """Strands in the colour that is painted at their root, over their own colour or the look's.

    Args:
        strands: bound to the surface, unless the hair has none.
        painted: None: no usable paint.
    """
    own = strands.color if look.color_source == "own" else None
    if own is not None:
        own = coated_color(own, look)
    if not look.color_map:
        is_as_it_is = own is None or own is strands.color
        return strands if is_as_it_is else replace(strands, color=own)
    triangle, barycentric = strands.root_triangle, strands.root_barycentric
    if painted is None or triangle is None or not painted.triangle_count > triangle.max(initial=-1):
        return strands if own is strands.color else replace(strands, color=own)
    assert barycentric is not None, "bound strands have both"
    found = painted.at(triangle, barycentric).astype(np.float32)
    found[:, :3] = _coated(found, look)
    found[natural_strands(strands.group, look)] = 0.0
    if own is None and not found[:, 3].any():
        return replace(strands, color=None)
    under = np.full((len(found), 3), np.float32(np.nan)) if own is None else own
    if own is not None:  # which may differ along strands
        found = np.repeat(found, strands.point_counts, axis=0)
    opacity = found[:, 3:]
    under = np.where(np.isnan(under) & (opacity > 0.0), look_color(look).astype(np.float32), under)
    color = found[:, :3] + (np.float32(1.0) - opacity) * under
    if own is None:
        color = np.repeat(color, strands.point_counts, axis=0)
    return replace(strands, color=color)


def _coated(painted: Floats, look: ShadingSettings) -> Floats:
    """Premultiplied colours (n, 4) as the look's water and dust change them, (n, 3)."""
    opacity = painted[:, 3:]
    return opacity * coated_color(painted[:, :3] / np.maximum(opacity, _FAINTEST), look)


def _grown(roots: ChildRoots, head: Surface, grown: Grown) -> tuple[Ints, Grown]:
    """The index of each root's child in the growth, (n,), and the growth with new ones added."""
    growth = grown.growth
    number = same_rows(roots.point, growth.root)
    new = np.flatnonzero(number < 0)
    number[new] = len(growth.root) + np.arange(len(new))
    if not len(new):
        return number, grown
    more = growth.with_more(roots.take(new), head, grown.shapes, grown.kept)
    return number, replace(grown, growth=more)


def painted_guides(rig: Rig, masks: Masks) -> PaintedGuides | None:
    """The factors of settings at each guide; None where the masks belong to other strands or
    another head, whose rig is still being built.

    Args:
        masks: of the settings of the motion.
    """
    own = rig.strands.strand_count if rig.own_count is None else rig.own_count
    triangles = None if rig.head is None else len(rig.head.triangles)
    if not all(each.fits(own, triangles) for each in masks.masks.values()):
        return None
    places, cv_count = Places.of_strands(rig.strands, rig.guides), rig.guide_grid.shape[1]
    return PaintedGuides({of: each.along(places, cv_count) for of, each in masks.masks.items()})


def painted_strands(rig: Rig, mask: StrandMask) -> Floats:
    """A mask of the artist's own strands at all strands of a rig, where children mix the values of
    their guides: (strand_count,), or (point_count,) if it varies along strands."""
    strands, count = rig.strands, mask.grid.shape[1]
    own = strands.strand_count if rig.own_count is None else rig.own_count
    values = mask.along(Places.of_strands(strands, np.arange(own)), count)
    if rig.grown is not None:
        weights, kept = rig.grown.growth.weights, rig.grown.kept
        between = Places(None, None, weights.guide[kept], weights.weight[kept])
        of_children = mask.of(rig.grown.parents).along(between, count)
        values = np.concatenate([values, of_children], axis=1)
    if count == 1:
        return values[0].astype(np.float32)
    strand = np.repeat(np.arange(strands.strand_count), strands.point_counts)
    place = along(strands.points, strands.offsets) * (count - 1)
    left = np.minimum(place.astype(np.int32), count - 2)
    low, high = values[left, strand], values[left + 1, strand]
    found: Floats = (low + (place - left) * (high - low)).astype(np.float32)
    return found


def _masked(rig: Rig, masks: Masks) -> Rig:
    """The rig with its children as these masks shape them."""
    grown, own, strands, head = rig.grown, rig.own_count, rig.strands, rig.head
    assert grown is not None and own is not None and head is not None
    growth, kept = grown.growth, grown.kept
    masks = masks.of(grown.parents)
    if masks == growth.masks:
        return rig
    assert strands.root_triangle is not None and strands.root_barycentric is not None
    triangle, barycentric = strands.root_triangle[own:], strands.root_barycentric[own:]
    weights = growth.weights
    factors = masks.at(Places(triangle, barycentric, weights.guide[kept], weights.weight[kept]))
    was, fineness = growth.factors.take(kept), growth.fineness[kept]
    is_other = np.zeros(len(growth.root), bool)
    for name in masks.masks.keys() | growth.masks.masks.keys():
        is_other[kept[factors[name] != was[name]]] = True
    others = growth.factors.with_others(kept, factors)
    growth = replace(growth, masks=masks, factors=others)
    grown = replace(grown, growth=growth)
    touched = np.flatnonzero(growth.clumps.with_members(is_other)[kept])
    points = strands.points.copy()
    put_children(points, strands.offsets, grown, touched, own)
    finer = np.append(np.ones(own, np.float32), growth.fineness[kept] / fineness)
    radius = strands.radius * np.repeat(finer, strands.point_counts)
    return replace(rig, strands=replace(strands, points=points, radius=radius), grown=grown)


def _moved(
    rig: Rig, roots: ChildRoots, grown: Grown, strand: Ints, number: Ints, come: Ints
) -> Rig:
    """The rig with some of its strands replaced by other children of the growth.

    Args:
        roots: of the children `number`, (n,), of the growth.
        strand: (m,) the rig's strands that are replaced.
        come: (m,) ascending, the children of the growth that replace them.
    """
    strands, own, head = rig.strands, rig.own_count, rig.head
    assert own is not None and head is not None and rig.rest_frames is not None
    points = strands.points.copy()
    put_children(points, strands.offsets, grown, strand - own, own)
    order = np.argsort(number)
    of_root = order[np.searchsorted(number[order], come)]
    triangle, barycentric = roots.triangle[of_root], roots.barycentric[of_root]
    frames = root_frames(head.positions, head.triangles, triangle, barycentric)
    assert rig.grown is not None
    before = rig.grown.growth.fineness[rig.grown.kept[strand - own]]
    finer = np.ones(strands.strand_count, np.float32)
    finer[strand] = grown.growth.fineness[come] / before
    moved = replace(
        strands,
        points=points,
        radius=strands.radius * np.repeat(finer, strands.point_counts),
        root_triangle=_with(strands.root_triangle, strand, triangle),
        root_barycentric=_with(strands.root_barycentric, strand, barycentric),
    )
    rest_frames = RootFrames(
        _with(rig.rest_frames.origin, strand, frames.origin),
        _with(rig.rest_frames.rotation, strand, frames.rotation),
    )
    return replace(rig, strands=moved, rest_frames=rest_frames)


def _with[Rows: np.ndarray](rows: Rows | None, chosen: Ints, others: Rows) -> Rows:
    """A copy of rows (n, ...) with the chosen ones replaced."""
    assert rows is not None
    found: Any = rows.copy()
    found[chosen] = others
    whole: Rows = found
    return whole
