"""Mirror hair from one side of its surface to the other, with all attributes of its curves."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...arrays import Bools, Floats, Ints, rows_of_pieces
from ...errors import HairloomError
from ...groom.mirror import Mirrored, mirror_sides, mirror_strands, reflection
from ...groom.mirror_settings import MirrorSettings
from ...refine.lead_out_at_rest import lead_out_at_rest
from ...strands import Surface
from ...strands.affine import transform_points
from ...strands.nearest import nearest_points
from ..base.attributes import copy_elements, read_attribute, set_attribute
from ..base.objects import head_of, matrix_of
from ..base.outcome import Outcome
from ..base.parts import Part, Parts
from ..colliders.fields import head_field_of
from ..scene.curves import curve_offsets, curve_points, read_original_curves, set_points
from ..scene.groom_attributes import CLOSEST_GUIDES, GUIDE, STRAND_ID
from ..scene.shape_backup import SHAPE_BACKUPS
from .combing import surface_to_comb_on

#: point attributes that hold positions in object space, beside the position itself
_PLACES = (
    "handle_left",
    "handle_right",
    *(shape.attribute for shape in SHAPE_BACKUPS),
)


def mirror_hair(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, settings: MirrorSettings
) -> Parts[Outcome]:
    """Replace the curves of one side by mirrored ones of the other, before their modifiers. Curves
    in the middle stay.

    Raises:
        HairloomError: no surface, no hair on the side to mirror, or it is linked from another file.
    """
    surface = surface_to_comb_on(hair, depsgraph)
    head = head_of(hair)
    assert head is not None, "there is a surface"
    frame = matrix_of(head, depsgraph)
    own = read_original_curves(hair, depsgraph)
    side = mirror_sides(own.strands.roots, surface, frame, settings)
    if not (side > 0).any():
        raise HairloomError(
            f"it has no curves on the {settings.side} side of {settings.axis.upper()}",
            place=hair.name,
            remedy="Choose the other side, or another axis",
        )
    source = np.flatnonzero(side > 0)
    across = reflection(frame, settings.axis)
    made = yield Part(
        f"Mirroring {len(source):,} curves",
        lambda: _led_out(mirror_strands(own.strands.take(source), surface, across), surface),
    )
    replaced = own.curve_indices[side < 0]
    unchanged = [shape for shape in SHAPE_BACKUPS if shape.read_if_unchanged(hair) is not None]
    hair_frame = matrix_of(hair, depsgraph)
    to_own = np.linalg.inv(hair_frame)
    _replace(
        hair.data,
        own.curve_indices[source],
        replaced,
        made,
        to_own,
        to_own @ across @ hair_frame,
    )
    for shape in unchanged:  # kept shapes are mirrored too, so they can still be restored
        shape.mark_result(hair)
    middle = int((side == 0).sum())
    result = f"{hair.name}: {len(source):,} curves mirrored, {len(replaced):,} replaced"
    if middle:
        result += f", {middle:,} in the middle left unchanged"
    return Outcome(result, own.dropped)


def _led_out(made: Mirrored, surface: Surface) -> Mirrored:
    """Lead out curves that an asymmetric surface has swallowed."""
    shifted = np.flatnonzero(made.is_shifted)
    solid = head_field_of(surface) if len(shifted) else None
    if solid is None:
        return made
    strands = made.strands
    led, _ = lead_out_at_rest(strands.take(shifted), solid, float(np.median(strands.lengths())))
    points = strands.points.copy()
    points[np.repeat(made.is_shifted, strands.point_counts)] = led.points
    return Mirrored(strands.with_points(points), made.shift)


def _replace(
    curves: bpy.types.Curves,
    source: Ints,
    replaced: Ints,
    made: Mirrored,
    to_own: Floats,
    across: Floats,
) -> None:
    """Remove curves, and add mirrored ones with all other attributes of their sources.

    Args:
        source, replaced: numbers of curves.
        to_own: (4, 4), from world to object space. across: (4, 4), the mirror in object space.
    """
    count = len(curves.curves)
    stays = np.ones(count, bool)
    stays[replaced] = False
    gone = _RemovedCurves.of(curves, replaced)
    if len(replaced):
        curves.remove_curves(indices=replaced.tolist())
    source = (np.cumsum(stays) - 1)[source]
    offsets = curve_offsets(curves)
    counts = np.diff(offsets)[source]
    curves.add_curves(counts.tolist())
    old = rows_of_pieces(source, offsets)
    new = offsets[-1] + np.arange(len(old))
    new_curves = stays.sum() + np.arange(len(source))
    for attribute in curves.attributes.values():
        pair = (old, new) if attribute.domain == "POINT" else (source, new_curves)
        copy_elements(attribute, *pair)
    points = curve_points(curves)
    points[new] = transform_points(made.strands.points, to_own)
    shift = np.repeat(made.shift @ to_own[:3, :3].T.astype(np.float32), counts, axis=0)
    for name in _PLACES:
        places = read_attribute(curves, name, "POINT", 3)
        if places is not None:
            places[new] = transform_points(places[old], across) + shift
            set_attribute(curves, name, "POINT", places)
    if made.strands.root_uv is not None:
        uv = read_attribute(curves, "surface_uv_coordinate", "CURVE", 2)
        uv = np.zeros((len(curves.curves), 2), np.float32) if uv is None else uv
        uv[new_curves] = made.strands.root_uv
        set_attribute(curves, "surface_uv_coordinate", "CURVE", uv)
    set_points(curves, points)
    _assign_ids(curves, source, new_curves, gone)


@dataclass(frozen=True)
class _RemovedCurves:
    """Curves that mirrored ones replace. id: (n,), root: (n, 3) object space [m]."""

    id: Ints
    root: Floats

    @classmethod
    def of(cls, curves: bpy.types.Curves, replaced: Ints) -> _RemovedCurves:
        ids = read_attribute(curves, STRAND_ID, "CURVE")
        ids = np.zeros(len(curves.curves), np.int32) if ids is None else ids
        return cls(ids[replaced], curve_points(curves)[curve_offsets(curves)[replaced]])


def _assign_ids(curves: bpy.types.Curves, source: Ints, new: Ints, gone: _RemovedCurves) -> None:
    """Give mirrored curves new IDs, and mirrored guides as their closest guides; references to a
    guide that is gone are replaced by the mirrored guide whose root is nearest to its root."""
    ids = read_attribute(curves, STRAND_ID, "CURVE")
    if ids is None:
        return
    known, there = ids[source], np.arange(new[0])
    ids[new] = ids[there].max() + 1 + np.arange(len(new))
    is_guide = read_attribute(curves, GUIDE, "CURVE")
    guides = np.arange(len(new)) if is_guide is None else np.flatnonzero(is_guide[new])
    guides = guides if len(guides) else np.arange(len(new))
    is_gone = ~np.isin(gone.id, ids[there])
    roots = curve_points(curves)[curve_offsets(curves)[new[guides]]]
    instead = guides[nearest_points(gone.root[is_gone], roots, 1)[0][:, 0]]
    before = np.concatenate([known, gone.id[is_gone]])
    mirrored_ones = np.concatenate([ids[new], known[instead]])
    for name in CLOSEST_GUIDES:
        closest = read_attribute(curves, name, "CURVE")
        if closest is not None:
            closest[there] = _with_replaced_ids(closest[there], gone.id[is_gone], ids[new[instead]])
            closest[new] = _with_replaced_ids(closest[new], before, mirrored_ones)
            set_attribute(curves, name, "CURVE", closest)
    set_attribute(curves, STRAND_ID, "CURVE", ids)


def _with_replaced_ids(values: Ints, known: Ints, other: Ints) -> Ints:
    """The values, with each that is in `known` replaced by its counterpart in `other`."""
    if not len(known):
        return values
    order = np.argsort(known, kind="stable")
    known, other = known[order], other[order]
    place = np.minimum(np.searchsorted(known, values), len(known) - 1)
    is_known: Bools = known[place] == values
    return np.where(is_known, other[place], values)
