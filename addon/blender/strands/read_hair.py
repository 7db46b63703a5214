"""Reads hair for export: the strands that Blender shows, with guides and all attributes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats, Ints, rows_of_pieces
from ...exchange.groom import Groom, with_guide_copies
from ...groom.children_settings import ChildrenSettings
from ...groom.painted_color import PaintedColor
from ...groom.roots import bind_roots
from ...groom.settings import GuideSettings
from ...groom.weights import guide_weights
from ...groom.width_settings import WidthSettings
from ...groom.widths import with_widths, with_widths_of
from ...paint_flow import with_colors
from ...rig_flow import Rig
from ...shading.drawn_strands import look_color, own_colors
from ...shading.settings import ShadingSettings
from ...strands import StrandSet
from ...strands.needed_points import with_needed_points
from ...strands.resample import resample
from ..bakes import playback
from ..bakes.cache import Cache
from ..base.outcome import notes_of
from ..base.parts import Part, Parts, run_parts
from ..colliders.rigs import CachedRig
from ..properties.groom_settings import GroomSettings
from ..scene.groom_attributes import group_names, stored_groom
from ..scene.painted_colors import read_colors
from ..scene.source import Source, read_source, usable_curves

_GUIDE_FIELDS = ("is_guide", "closest_guides", "guide_weights")


@dataclass(frozen=True)
class ExportRequest:
    """What a file needs.

    guides: curves for the guides beside the strands.
    color: the look's colour for strands without their own.
    roots: the place of each root on the head, for bones.
    """

    guides: bool = True
    color: bool = True
    roots: bool = False


@dataclass(frozen=True)
class ExportStrands:
    """Hair for a file.

    groom: the strands, followed by copies of guides if the file needs them.
    strands: the strands alone.
    copied_points: indices of the points of `strands` that the copies of guides repeat.
    dropped: reason -> number of curves left out.
    notes: for the artist.
    cached_rig: the rig, if one had to be made.
    has_children: whether some strands are not curves of the scene.
    """

    groom: Groom
    strands: StrandSet
    copied_points: Ints
    dropped: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    cached_rig: CachedRig | None = None
    has_children: bool = False

    def points(self, strands: Floats) -> Floats:
        """The points of `groom` for these points of `strands`, (point_count, 3)."""
        return (
            np.concatenate([strands, strands[self.copied_points]])
            if len(self.copied_points)
            else strands
        )


def read_still_hair(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    request: ExportRequest,
    cached_rigs: tuple[CachedRig, ...] = (),
) -> ExportStrands:
    """All strands after the modifiers, with their own points; or guides and children, if any.

    Guides that are marked in the hair are kept; otherwise copies of those that Hairloom chooses are
    added.

    Args:
        cached_rigs: rigs that were made before, maybe of the same hair.

    Raises:
        HairloomError: no usable hair, or it is of another scale than its head.
    """
    return run_parts(still_hair_parts(hair, depsgraph, request, cached_rigs))


def still_hair_parts(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    request: ExportRequest,
    cached_rigs: tuple[CachedRig, ...] = (),
) -> Parts[ExportStrands]:
    """`read_still_hair` in two steps: the scene is read, then a part makes the strands."""
    source, settings = read_source(hair, depsgraph), GroomSettings.of(hair)
    stored = stored_groom(hair, depsgraph, source.curve_indices)
    make = partial(_still_strands, hair.name, source, settings, stored, request, cached_rigs)
    export: ExportStrands = yield Part("Making strands", make)
    return export


def _still_strands(
    name: str,
    source: Source,
    settings: GroomSettings,
    stored: dict[str, Any],
    request: ExportRequest,
    cached_rigs: tuple[CachedRig, ...],
) -> ExportStrands:
    """The strands of hair that was read, from arrays alone.

    Args:
        stored: see `stored_groom`.
    """
    look = settings[ShadingSettings]
    has_children = settings[ChildrenSettings].method != "none"
    cached_rig = CachedRig.find(source, settings, cached_rigs, name) if has_children else None
    if cached_rig is not None and cached_rig.rig.own_count is not None:
        rig = cached_rig.rig
        strands = with_colors(rig.strands, source.colors, look)
        groom = Groom(strands, name, group_names=stored["group_names"])
        export = replace(
            _export_strands(groom, rig, request, look), cached_rig=cached_rig, has_children=True
        )
        return _with_notes(name, source, export, rig)
    attributes = _without_empty_marks(stored)
    strands = _as_wide_as_drawn(settings, source.strands)
    if request.guides and "is_guide" not in attributes:
        cached_rig = cached_rig or CachedRig.find(source, settings, cached_rigs, name)
        rig = cached_rig.rig
        strands = with_colors(_with_roots_of(strands, rig.strands), source.colors, look)
        groom = Groom(strands, name, **attributes)
        export = replace(_export_strands(groom, rig, request, look), cached_rig=cached_rig)
        return _with_notes(name, source, export, rig)
    needs_roots = request.roots or strands.root_uv is None or source.colors is not None
    if source.head is not None and needs_roots:
        strands = bind_roots(strands, source.head, place=name).strands
    strands = with_colors(strands, source.colors, look)
    groom = Groom(strands, name, **attributes)
    if request.guides and groom.closest_guides is None:
        groom = _with_guide_weights(groom, settings[GuideSettings].cv_count)
    return _with_notes(name, source, _export_strands(groom, None, request, look))


def read_baked_hair(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, cache: Cache, request: ExportRequest
) -> ExportStrands:
    """The strands of a bake at rest, with the hair's attributes if they are its curves.

    Raises:
        HairloomError: the bake is damaged.
    """
    rig = playback.rig_in(cache).rig
    read, attributes = usable_curves(hair, depsgraph), dict[str, Any]()
    is_plain = hair.data.hairloom.children.method in ("none", "auto")
    if is_plain and rig.strands.strand_count == read.strands.strand_count:
        attributes = _without_empty_marks(stored_groom(hair, depsgraph, read.curve_indices))
    notes: tuple[str, ...] = ()
    if rig.strands.root_uv is None and rig.head is not None:
        notes = (f"{hair.name}: its bake has no root UVs. Bake again to have them in the file.",)
    triangle_count = None if rig.head is None else len(rig.head.triangles)
    colors, problems = read_colors(hair, depsgraph, triangle_count)
    notes += problems
    strands = with_colors(rig.strands, colors, _look(hair))
    groom = Groom(strands, hair.name, **({"group_names": group_names(hair)} | attributes))
    has_marks = groom.is_guide is not None
    export = _export_strands(groom, None if has_marks else rig, request, _look(hair))
    return replace(export, notes=notes)


def export_strands_of_rig(
    rig: Rig,
    groom: Groom,
    request: ExportRequest,
    look: ShadingSettings,
    colors: PaintedColor | None = None,
) -> ExportStrands:
    """Hair of the command line, from a rig.

    Args:
        groom: the rig's strands, or the same with other points.
        colors: colours painted under them.
    """
    strands = with_colors(_with_roots_of(groom.strands, rig.strands), colors, look)
    bound = replace(groom, strands=strands)
    if groom.is_guide is not None and not groom.is_guide.any():
        bound = replace(bound, is_guide=None, closest_guides=None, guide_weights=None)
    return _export_strands(bound, rig if bound.is_guide is None else None, request, look)


def _look(hair: bpy.types.Object) -> ShadingSettings:
    return GroomSettings.of(hair)[ShadingSettings]


def _export_strands(
    groom: Groom, rig: Rig | None, request: ExportRequest, look: ShadingSettings
) -> ExportStrands:
    """Hair for a file in its drawn colours, with copies of the rig's guides if requested."""
    of_points = np.repeat(groom.strands.group, np.diff(groom.strands.offsets))
    color = own_colors(groom.color, of_points, look)
    if color is not None or request.color:
        shape = groom.strands.point_count, 3
        color = np.full(shape, np.nan) if color is None else color
        color = np.where(np.isnan(color), look_color(look), color)
    groom = replace(groom, strands=replace(groom.strands, color=color))
    if rig is None or not request.guides:
        return ExportStrands(groom, groom.strands, np.zeros(0, np.int64))
    whole = with_guide_copies(groom, rig.guides, rig.weights.guide, rig.weights.weight)
    return ExportStrands(whole, groom.strands, rows_of_pieces(rig.guides, groom.strands.offsets))


def _with_notes(
    name: str, source: Source, export: ExportStrands, rig: Rig | None = None
) -> ExportStrands:
    notes = () if rig is None else notes_of(name, rig)
    return replace(export, dropped=source.dropped, notes=(*source.warnings, *notes))


def _as_wide_as_drawn(settings: GroomSettings, strands: StrandSet) -> StrandSet:
    drawn = with_needed_points(strands, settings[GuideSettings].cv_count)
    drawn, widths = with_widths(drawn, settings[WidthSettings].method)
    return with_widths_of(strands, drawn) if widths.is_found else strands


def _with_roots_of(strands: StrandSet, bound: StrandSet) -> StrandSet:
    """These strands, with the roots bound as those of the same strands with other points."""
    return replace(
        strands,
        root_uv=bound.root_uv,
        root_triangle=bound.root_triangle,
        root_barycentric=bound.root_barycentric,
    )


def _without_empty_marks(attributes: dict[str, Any]) -> dict[str, Any]:
    """The attributes without marks of guides, if no curve is marked."""
    if "is_guide" in attributes and not attributes["is_guide"].any():
        return {name: value for name, value in attributes.items() if name not in _GUIDE_FIELDS}
    return attributes


def _with_guide_weights(groom: Groom, cv_count: int) -> Groom:
    """The groom with closest guides and weights from its marked guides; unchanged if a group has no
    guide, as strands follow guides of their own group."""
    assert groom.is_guide is not None
    guides = np.flatnonzero(groom.is_guide)
    group = groom.strands.group
    if not np.isin(group, group[guides]).all():
        return groom
    uniform = resample(groom.strands, cv_count)
    roots, grid = uniform.roots, uniform.grid
    weights = guide_weights(
        roots,
        group,
        roots[guides],
        group[guides],
        strand_grid=grid,
        guide_grid=grid[guides],
    )
    ids = np.arange(len(group)) if groom.strand_id is None else groom.strand_id
    return replace(
        groom,
        strand_id=ids,
        closest_guides=ids[guides][weights.guide],
        guide_weights=weights.weight,
    )
