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
from .comb_flow import write_children
from .dynamics.painted import PaintedGuides
from .groom.child_roots import ChildRoots, child_roots
from .groom.masks import NO_MASKS, Masks, Places, StrandMask
from .groom.painted_color import PaintedColor
from .groom.roots import RootFrames, root_frames
from .rig_flow import GrownChildren, Rig
from .shading.drawn_strands import look_color, natural_strands
from .shading.settings import ShadingSettings
from .shading.wet_and_dusty import wet_and_dusty_color
from .strands import StrandSet, Surface
from .strands.arc_length import length_fractions
from .strands.result_cache import find_rows

#: The lowest opacity that premultiplied paint is divided by.
_MIN_OPACITY = 1.0e-6


def painted_rig(rig: Rig, density: Floats | None, masks: Masks = NO_MASKS) -> Rig:
    """The rig with its children as a new density and new masks make them.

    Args:
        rig: with children that have grown.
        density: (vertex_count,), see `rig_flow.prepare`. masks: of the settings of children.

    Raises:
        HairloomError: as `child_roots`.
    """
    rig = _with_masks(rig, masks)
    grown, own, head = rig.grown_children, rig.own_count, rig.head
    assert grown is not None and own is not None and head is not None
    settings = grown.growth.settings
    roots = child_roots(grown.shapes, head, settings.strand_count, density, settings.seed)
    number, grown = _with_grown_roots(roots, head, grown)
    is_wanted = np.zeros(len(grown.growth.root), bool)
    is_wanted[number] = True
    removed = np.flatnonzero(~is_wanted[grown.rig_children])
    is_wanted[grown.rig_children] = False
    added = np.flatnonzero(is_wanted)
    if not len(removed):
        return rig
    # if fewer come than go, some are drawn twice until `prepare` has found how many there are
    added = np.sort(np.resize(added if len(added) else number, len(removed)))
    rig_children = grown.rig_children.copy()
    rig_children[removed] = added
    grown = replace(grown, rig_children=rig_children)
    return replace(
        _with_replaced_children(rig, roots, grown, own + removed, number, added),
        grown_children=grown,
    )


def with_painted_colors(rig: Rig, painted: PaintedColor | None, look: ShadingSettings) -> Rig:
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
        own = wet_and_dusty_color(own, look)
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
    return opacity * wet_and_dusty_color(painted[:, :3] / np.maximum(opacity, _MIN_OPACITY), look)


def _with_grown_roots(
    roots: ChildRoots, head: Surface, grown: GrownChildren
) -> tuple[Ints, GrownChildren]:
    """The index of each root's child in the growth, (n,), and the growth with new ones added."""
    growth = grown.growth
    number = find_rows(roots.point, growth.root)
    new = np.flatnonzero(number < 0)
    number[new] = len(growth.root) + np.arange(len(new))
    if not len(new):
        return number, grown
    more = growth.with_more(roots.take(new), head, grown.shapes, grown.rig_children)
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
    if rig.grown_children is not None:
        weights, kept = rig.grown_children.growth.weights, rig.grown_children.rig_children
        between = Places(None, None, weights.guide[kept], weights.weight[kept])
        of_children = mask.for_strands(rig.grown_children.parents).along(between, count)
        values = np.concatenate([values, of_children], axis=1)
    if count == 1:
        return values[0].astype(np.float32)
    strand = np.repeat(np.arange(strands.strand_count), strands.point_counts)
    place = length_fractions(strands.points, strands.offsets) * (count - 1)
    left = np.minimum(place.astype(np.int32), count - 2)
    low, high = values[left, strand], values[left + 1, strand]
    found: Floats = (low + (place - left) * (high - low)).astype(np.float32)
    return found


def _with_masks(rig: Rig, masks: Masks) -> Rig:
    """The rig with its children as these masks shape them."""
    grown, own, strands, head = rig.grown_children, rig.own_count, rig.strands, rig.head
    assert grown is not None and own is not None and head is not None
    growth, kept = grown.growth, grown.rig_children
    masks = masks.for_strands(grown.parents)
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
    write_children(points, strands.offsets, grown, touched, own)
    finer = np.append(np.ones(own, np.float32), growth.fineness[kept] / fineness)
    radius = strands.radius * np.repeat(finer, strands.point_counts)
    return replace(
        rig, strands=replace(strands, points=points, radius=radius), grown_children=grown
    )


def _with_replaced_children(
    rig: Rig,
    roots: ChildRoots,
    grown: GrownChildren,
    replaced: Ints,
    root_children: Ints,
    new_children: Ints,
) -> Rig:
    """The rig with some of its strands replaced by other children of the growth.

    Args:
        roots: of the children `root_children`, (n,), of the growth.
        replaced: (m,) the rig's strands that are replaced.
        new_children: (m,) ascending, the children of the growth that replace them.
    """
    strands, own, head = rig.strands, rig.own_count, rig.head
    assert own is not None and head is not None and rig.rest_frames is not None
    points = strands.points.copy()
    write_children(points, strands.offsets, grown, replaced - own, own)
    order = np.argsort(root_children)
    of_root = order[np.searchsorted(root_children[order], new_children)]
    triangle, barycentric = roots.triangle[of_root], roots.barycentric[of_root]
    frames = root_frames(head.positions, head.triangles, triangle, barycentric)
    assert rig.grown_children is not None
    before = rig.grown_children.growth.fineness[rig.grown_children.rig_children[replaced - own]]
    finer = np.ones(strands.strand_count, np.float32)
    finer[replaced] = grown.growth.fineness[new_children] / before
    moved = replace(
        strands,
        points=points,
        radius=strands.radius * np.repeat(finer, strands.point_counts),
        root_triangle=_with_rows(strands.root_triangle, replaced, triangle),
        root_barycentric=_with_rows(strands.root_barycentric, replaced, barycentric),
    )
    rest_frames = RootFrames(
        _with_rows(rig.rest_frames.origin, replaced, frames.origin),
        _with_rows(rig.rest_frames.rotation, replaced, frames.rotation),
    )
    return replace(rig, strands=moved, rest_frames=rest_frames)


def _with_rows[Rows: np.ndarray](rows: Rows | None, chosen: Ints, new_rows: Rows) -> Rows:
    """A copy of rows (n, ...) with the chosen ones replaced."""
    assert rows is not None
    found: Any = rows.copy()
    found[chosen] = new_rows
    whole: Rows = found
    return whole
