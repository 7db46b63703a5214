"""The flow of light to hair at rest: first the hair, then its light.

Points look up their light in fields, which are grids over the hair. Computing fields takes time, so
a window first shows hair in quick light: strands that were there before keep their light, as under
a brush, and others look theirs up in the fields of the earlier hair. The first hair gets coarse
fields, computed from few of its strands. Quick light is looked up at few points of each strand.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from .arrays import Floats, Ints
from .rig_flow import Rig
from .shading.ambient import (
    HairCells,
    occlusion_from_sky,
    openness_field,
    skin_occlusion,
    sky_field,
)
from .shading.ambient_settings import AmbientSettings
from .shading.density_grid import Field
from .shading.drawn_strands import drawn_radius
from .shading.settings import StrandSettings
from .shading.skin_seen import skin_field, skin_seen_from
from .strands import StrandSet
from .strands.arc_length import even_fractions
from .strands.frames import strand_tangents, tangents_at, volume_normal_rows
from .strands.result_cache import find_rows
from .strands.vectors import cross_rows, dot_rows

#: Points whose directions are computed at once, so that they stay in the cache.
POINTS_PER_CHUNK = 1 << 14
#: Three directions at each point, three times (point_count, 3), see `strand_axes`.
type Axes = tuple[Floats, Floats, Floats]
#: Number of strands that represent all where light off far skin is blocked.
SHADING_STRANDS = 6000
#: Coarse fields: cells along the longest side, cells in all, cells along the longest side of the
#: skin's field, and strands.
_COARSE_CELLS, _MAX_COARSE_CELLS, _COARSE_SKIN, _COARSE_STRANDS = 24, 8_000, 20, 2000
#: Settings that `ambient.sky_field` does not depend on.
_SKY_INDEPENDENT = ("strength", "ao_bias", "scalp_extinction")
#: Quick light is looked up at every fourth point of a strand, and at its last one.
_STRIDE = 4


@dataclass(frozen=True, eq=False)
class LightFields:
    """The fields of hair at rest: see `ambient.sky_field`, `ambient.openness_field` and
    `skin_seen.skin_field`; the last is None without a head."""

    sky: Field
    openness: Field
    skin: Field | None


@dataclass(frozen=True, eq=False)
class HairLight:
    """The light at each point of hair at rest.

    occlusion: (point_count,), 1 where nothing shades.
    openness: (point_count, 4), see `ambient.openness_field`: the mean, and a vector in the strand's
        axes. The vector turns with the strand, so in motion it stays as accurate as occlusion.
    skin_seen: (point_count, 8), see `skin_seen_along_axes`; None without a head.
    fields: the ones that light was looked up in; None without strands.
    is_quick: whether these fields are coarse, or those of earlier hair.
    """

    occlusion: Floats
    openness: Floats
    skin_seen: Floats | None
    fields: LightFields | None
    is_quick: bool = False


def rest_light(
    rig: Rig, settings: AmbientSettings, report: Callable[[], None] = lambda: None
) -> HairLight:
    """The light of a rig.

    Args:
        report: called from time to time; may raise an exception to cancel.
    """
    strands = rig.strands
    if not strands.strand_count:
        return _NO_LIGHT
    axes, points = strand_axes(strands), strands.points
    with ThreadPoolExecutor(1) as beside:
        skin_field = beside.submit(rest_skin_field, rig)
        skin = beside.submit(
            lambda: _skin_seen(axes, skin_field.result(), lambda field: field.at(points))
        )
        fields = LightFields(*_sky_fields(rig, settings, report), skin_field.result())
        return _light(rig, settings, fields, axes, lambda field: field.at(points), skin.result())


def rest_fields(rig: Rig, settings: AmbientSettings) -> LightFields:
    """The fields of a rig with strands."""
    return LightFields(*_sky_fields(rig, settings), rest_skin_field(rig))


def _sky_fields(
    rig: Rig, settings: AmbientSettings, report: Callable[[], None] = lambda: None
) -> tuple[Field, Field]:
    """The first two of `LightFields`."""
    cells = HairCells.of(rig.strands, rig.head, settings.cell_count)
    report()
    sky = sky_field(cells, ambient_of(rig, settings))
    report()
    openness = openness_field(cells, rig.widths.extinction)
    report()
    return sky, openness


def updated_light(
    rig: Rig, light: HairLight, before: AmbientSettings, settings: AmbientSettings
) -> HairLight | None:
    """The light of a rig after a change of settings, bit for bit as `rest_light`.

    Only occlusion is computed again, since openness and light off the skin depend on none of these
    settings but the cell count. None where that has changed, or where the light is quick.

    Args:
        light: of this rig, by the settings before.
    """
    fields = light.fields
    if light.is_quick or fields is None or before.cell_count != settings.cell_count:
        return None
    sky = fields.sky
    looks = {name: getattr(settings, name) for name in _SKY_INDEPENDENT}
    if replace(before, **looks) != settings:
        cells = HairCells.of(rig.strands, rig.head, settings.cell_count)
        sky = sky_field(cells, ambient_of(rig, settings))
    occlusion = occlusion_from_sky(sky.at(rig.strands.points)[0], ambient_of(rig, settings))
    return replace(light, occlusion=occlusion, fields=replace(fields, sky=sky))


def quick_light(
    rig: Rig, settings: AmbientSettings, earlier: tuple[Rig, HairLight] | None
) -> HairLight:
    """An approximation of `rest_light` in a fraction of the time.

    Args:
        earlier: earlier hair much like this, and its light; None: there is none.
    """
    strands = rig.strands
    if not strands.strand_count:
        return _NO_LIGHT
    before, light = (None, None) if earlier is None else earlier
    fields = None if light is None else light.fields
    if before is None or light is None or fields is None:
        fields = _coarse_fields(rig, settings)
        return _interpolated_light(rig, settings, fields, strands)
    if (fields.skin is None) != (rig.head is None):
        return rest_light(rig, settings)
    number = find_rows(strands.roots, before.strands.roots)
    number[before.strands.point_counts[number] != strands.point_counts] = -1
    others = np.flatnonzero(number < 0)
    there = before.strands.offsets[:-1][number] - strands.offsets[:-1]
    there = np.repeat(there, strands.point_counts) + np.arange(strands.point_count)
    there[np.repeat(number < 0, strands.point_counts)] = 0
    seen = light.skin_seen
    found = HairLight(
        light.occlusion[there],
        light.openness[there],
        None if seen is None else seen[there],
        fields,
        is_quick=True,
    )
    if len(others):
        _write_light(
            found, strands, others, _interpolated_light(rig, settings, fields, strands.take(others))
        )
    return found


def _write_light(
    light: HairLight, strands: StrandSet, chosen: Ints, light_of_chosen: HairLight
) -> None:
    """Write the light of some strands into that of all."""
    is_own = np.zeros(strands.strand_count, bool)
    is_own[chosen] = True
    points = np.flatnonzero(np.repeat(is_own, strands.point_counts))
    light.occlusion[points] = light_of_chosen.occlusion
    light.openness[points] = light_of_chosen.openness
    if light.skin_seen is not None and light_of_chosen.skin_seen is not None:
        light.skin_seen[points] = light_of_chosen.skin_seen


def _interpolated_light(
    rig: Rig, settings: AmbientSettings, fields: LightFields, strands: StrandSet
) -> HairLight:
    """Quick light of some of a rig's strands: looked up at few points, and interpolated linearly
    between these."""
    chosen, before, fraction = _lookup_points(strands)
    few, axes = strands.points[chosen], _axes_at(strands, chosen, rig.strands)

    def sample(field: Field) -> Floats:
        return field.at(few)

    light = _light(rig, settings, fields, axes, sample, _skin_seen(axes, fields.skin, sample))
    seen = light.skin_seen
    return HairLight(
        _interpolated(light.occlusion[:, None], before, fraction)[:, 0],
        _interpolated(light.openness, before, fraction),
        None if seen is None else _interpolated(seen, before, fraction),
        fields,
        is_quick=True,
    )


_NO_LIGHT = HairLight(np.ones(0, np.float32), np.ones((0, 4), np.float32), None, None)


def _light(
    rig: Rig,
    settings: AmbientSettings,
    fields: LightFields,
    axes: Axes,
    sample: Callable[[Field], Floats],
    skin_seen: Floats | None,
) -> HairLight:
    """Args:
    sample: returns the values of a field at all points, (k, point_count).
    """
    occlusion = occlusion_from_sky(sample(fields.sky)[0], ambient_of(rig, settings))
    openness = np.ascontiguousarray(sample(fields.openness).T)
    openness[:, 1:] = components_along(openness[:, 1:], axes)
    return HairLight(occlusion, openness, skin_seen, fields)


def _skin_seen(axes: Axes, field: Field | None, sample: Callable[[Field], Floats]) -> Floats | None:
    return None if field is None else skin_seen_along_axes(axes, sample(field))


def _coarse_fields(rig: Rig, settings: AmbientSettings) -> LightFields:
    few, step = subsampled_strands(rig.strands, _COARSE_STRANDS)
    cells = HairCells.of(few, rig.head, _COARSE_CELLS, _MAX_COARSE_CELLS)
    sky = sky_field(cells, ambient_of(rig, settings).multiplied(extinction=step))
    open_field = openness_field(cells, step * rig.widths.extinction)
    return LightFields(sky, open_field, rest_skin_field(rig, _COARSE_SKIN, _COARSE_STRANDS))


def _lookup_points(strands: StrandSet) -> tuple[Ints, Ints, Floats]:
    """The points to look up, (k,); for each point of the strands the index of the last of these at
    or before it, and how far it is from there to the next, 0 to 1."""
    offsets, number = strands.offsets, np.arange(strands.point_count)
    is_chosen = (number - np.repeat(offsets[:-1], strands.point_counts)) % _STRIDE == 0
    is_chosen[offsets[1:] - 1] = True
    before, chosen = np.cumsum(is_chosen) - 1, np.flatnonzero(is_chosen)
    gap = np.diff(chosen, append=strands.point_count).astype(np.float32)
    return chosen, before, (number - chosen[before]).astype(np.float32) / gap[before]


def _interpolated(values: Floats, before: Ints, fraction: Floats) -> Floats:
    """Values at all points, (n, k), interpolated from those at few points, (few, k)."""
    found = np.empty((len(before), values.shape[1]), np.float32)
    last = len(values) - 1
    for first in range(0, len(before), POINTS_PER_CHUNK):
        some = slice(first, first + POINTS_PER_CHUNK)
        low, high = before[some], np.minimum(before[some] + 1, last)
        one = values.take(low, axis=0)
        target = np.subtract(values.take(high, axis=0), one, out=found[some])
        target *= fraction[some, None]
        target += one
    return found


def _axes_at(strands: StrandSet, chosen: Ints, hair: StrandSet) -> Axes:
    """`strand_axes` at the chosen points, (k,), with normals in the volume of the hair `hair`."""
    tangent = tangents_at(strands.points, strands.offsets, chosen)
    away = np.ascontiguousarray(strands.points[chosen].T) - _mean_root(hair)
    normal = volume_normal_rows(away, tangent)
    return tangent.T, normal.T, cross_rows(tangent, normal).T


def strand_axes(strands: StrandSet) -> Axes:
    """Three directions at each point: the strand's tangent, its normal in the volume of the hair,
    and across both."""
    axes = np.empty((3, 3, strands.point_count), np.float32)
    count, center = max(strands.strand_count, 1), _mean_root(strands)
    step = max(POINTS_PER_CHUNK * count // max(strands.point_count, 1), 1)
    for first in range(0, strands.strand_count, step):
        offsets = strands.offsets[first : first + step + 1]
        some = slice(offsets[0], offsets[-1])
        points = np.ascontiguousarray(strands.points[some].T)
        tangent = strand_tangents(points, offsets - offsets[0])
        normal = volume_normal_rows(points - center, tangent)
        for axis, rows in zip(axes, (tangent, normal, cross_rows(tangent, normal)), strict=True):
            axis[:, some] = rows
    tangent, normal, across = axes
    return tangent.T, normal.T, across.T


def _mean_root(strands: StrandSet) -> Floats:
    """The mean of the roots, (3, 1) float32 [m]."""
    total = strands.roots.sum(axis=0, dtype=np.float64)[:, None]
    middle: Floats = (total / max(strands.strand_count, 1)).astype(np.float32)
    return middle


def directional_light(fields: LightFields, points: Floats) -> Floats:
    """Openness and skin seen at points (n, 3), as rows (n, k) in world axes.

    Rows may be averaged over points before `light_along_axes` turns them into light.
    """
    found = [field.at(points) for field in (fields.openness, fields.skin) if field is not None]
    return np.ascontiguousarray(np.concatenate(found).T)


def light_along_axes(axes: Axes, light: Floats) -> tuple[Floats, Floats | None]:
    """The openness (n, 4) and skin seen (n, 8) of `HairLight`, from rows of `directional_light`."""
    openness, skin = np.ascontiguousarray(light[:, :4]), np.ascontiguousarray(light[:, 4:].T)
    openness[:, 1:] = components_along(openness[:, 1:], axes)
    return openness, skin_seen_along_axes(axes, skin) if len(skin) else None


def rest_skin_field(
    rig: Rig, cell_count: int | None = None, max_strands: int = SHADING_STRANDS
) -> Field | None:
    """The field of the skin seen, see `skin_seen.skin_field`; None without a head."""
    if rig.head is None or not rig.strands.strand_count:
        return None
    # a part of the strands is enough: cells are coarser than the gaps between strands
    some, step = subsampled_strands(rig.strands, max_strands)
    radius = drawn_radius(some.radius, StrandSettings(), even_fractions(some.offsets))
    some = replace(some, radius=radius.astype(np.float32))
    return skin_field(some, rig.head, step * rig.widths.extinction, cell_count)


def subsampled_strands(strands: StrandSet, max_count: int) -> tuple[StrandSet, int]:
    """At most `max_count` of the strands, and how many strands each of these represents."""
    step = -(-strands.strand_count // max_count)
    return strands.take(np.arange(0, strands.strand_count, step)), step


def skin_seen_along_axes(axes: Axes, values: Floats) -> Floats:
    """`received`, `beneath` and `depth` of `skin_seen.SkinSeen`, (n, 8), with vectors in the axes
    at each point.

    Args:
        values: values of `rest_skin_field` at points, (k, n).
    """
    seen = skin_seen_from(values)
    received, beneath = (
        components_along(each, axes) for each in (seen.received[:, 1:], seen.beneath)
    )
    parts = seen.received[:, :1], received, beneath, seen.depth[:, None]
    return np.concatenate(parts, axis=1, dtype=np.float32)


def components_along(vectors: Floats, axes: Axes) -> Floats:
    """The components of vectors (n, 3) along the axes, (n, 3) float32."""
    found = np.empty((len(vectors), 3), np.float32)
    for first in range(0, len(vectors), POINTS_PER_CHUNK):
        some = slice(first, first + POINTS_PER_CHUNK)
        rows = np.ascontiguousarray(vectors[some].T)
        for column, axis in zip(found.T, axes, strict=True):
            column[some] = dot_rows(rows, axis[some].T)
    return found


def head_occlusion(rig: Rig, settings: AmbientSettings) -> Floats | None:
    """The light that the hair lets through to the head, (vertex_count,); None without a head."""
    if rig.head is None:
        return None
    return skin_occlusion(rig.strands, rig.head, ambient_of(rig, settings))


def ambient_of(rig: Rig, settings: AmbientSettings) -> AmbientSettings:
    """The settings with extinction scaled to the hairs that strands represent."""
    factor = rig.widths.extinction
    return settings.multiplied(extinction=factor, scalp_extinction=factor)
