"""Turns all hair that Hairloom draws into ordinary hair curves of Blender, for other tools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import bpy
import numpy as np

from ...cards.drawing_settings import CardDrawingSettings
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import Masks, StrandMask, mask_names
from ...groom.rest_hair import carry_with_surface
from ...groom.width_settings import WidthSettings
from ...paint_flow import painted_strands, with_colors
from ...parameters import ALL_SETTINGS, sections_of
from ...rig_flow import Rig, strand_seeds
from ...shading.drawn_strands import drawn_radius, strand_colors
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.strand_noise import SEED_LIMIT
from ...strands import StrandSet
from ...strands.arc_length import length_fractions
from ..base.attributes import set_attribute
from ..base.objects import head_of
from ..base.outcome import Outcome, notes_of
from ..base.parts import Part, Parts
from ..colliders.rigs import rig_from
from ..properties.groom_settings import GroomSettings
from ..properties.presets import apply
from ..scene.curves import write_curves
from ..scene.groom_attributes import group_names, store_group_names
from ..scene.hair_material import set_look_material
from ..scene.masks import MaskReader
from ..scene.source import Source, read_source

#: properties of an object's group that refer to objects which act on its hair
_OBJECT_PROPERTIES = (
    "collider",
    "collider_collection",
    "field_collection",
    "collider_shape",
    "tie_collection",
    "tip_surface",
    "tip_group",
    "parting_collection",
)


class RealHair(NamedTuple):
    """New hair curves, and a report."""

    hair: bpy.types.Object
    outcome: Outcome


class _DrawnHair(NamedTuple):
    """The drawn strands of hair, as arrays alone. masks: of its motion."""

    source: Source
    settings: GroomSettings
    rig: Rig
    strands: StrandSet
    masks: Masks


def make_real(
    grooms: Sequence[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> Parts[tuple[RealHair, ...]]:
    """New hair curves with every drawn strand of these grooms as combed, with children, curls,
    widths and colours, and a material equal to the look.

    Drawn by Hairloom they look the same: they keep the settings, except those whose effects are in
    the curves themselves. The original hair is hidden, unless it is linked from another file.

    Raises:
        HairloomError: there is no usable hair, or some is of another scale than its head. Nothing
            is changed then.
    """
    drawn = []
    for hair in grooms:
        drawn.append((yield from _drawn_hair(hair, depsgraph)))
    return tuple(_add_real_hair(hair, each) for hair, each in zip(grooms, drawn, strict=True))


def _drawn_hair(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Parts[_DrawnHair]:
    name, settings = hair.name, GroomSettings.of(hair)
    source = read_source(hair, depsgraph)
    mask_reader = MaskReader(hair, head_of(hair), source.head, source.strands, source.curve_indices)
    masks, _ = mask_reader.masks(settings[DynamicsSettings], depsgraph)
    rig = yield Part(
        "Making strands",
        lambda: rig_from(source, settings.sections, place=name),
    )
    strands = yield Part(
        "Colouring strands", lambda: _in_rest_pose(_with_drawn_look(rig, source, settings), source)
    )
    return _DrawnHair(source, settings, rig, strands, masks)


def _in_rest_pose(strands: StrandSet, source: Source) -> StrandSet:
    """The strands in the pose in which the original hair is stored, the rest pose of its head."""
    if source.rest is None or source.head is None:
        return strands
    return carry_with_surface(strands, source.head, source.rest.surface)


def _with_drawn_look(rig: Rig, source: Source, settings: GroomSettings) -> StrandSet:
    """The strands of a rig with the widths, colours and noise that they are drawn with."""
    strands = with_colors(rig.strands, source.colors, settings[ShadingSettings])
    place, counts = length_fractions(strands.points, strands.offsets), strands.point_counts
    seed = strand_seeds(rig)
    color = strand_colors(
        np.repeat(seed, counts),
        place,
        settings[ShadingSettings],
        strands.color,
        np.repeat(strands.group, counts),
    )
    return replace(
        strands,
        radius=drawn_radius(strands.radius, settings[StrandSettings], place),
        color=np.clip(color, 0.0, 1.0),
        has_widths=True,
        seed=np.where(seed == 0, SEED_LIMIT, seed),  # 0 means none; SEED_LIMIT acts as 0
    )


def _add_real_hair(hair: bpy.types.Object, drawn: _DrawnHair) -> RealHair:
    source, settings, rig, strands, masks = drawn
    real = write_curves(f"{hair.name} Real", strands, head_of(hair), hair.users_collection[0])
    store_group_names(real.data, group_names(hair))
    _copy_settings(real, hair, settings)
    _copy_masks(real.data, rig, masks, settings[DynamicsSettings])
    _, notes = set_look_material(
        real.data, real_look(settings[ShadingSettings]), has_final_colors=True
    )
    result = f"Made {strands.strand_count:,} strands real: {real.name}"
    warnings = [
        *source.warnings,
        *notes_of(hair.name, rig),
        *(f"{real.name}: {each}" for each in notes),
    ]
    if hair.is_editable:
        _hide(hair)
        result += f". {hair.name} is hidden"
    else:
        warnings.append(
            f"{hair.name} is linked from another file, so it is still shown and rendered: exclude "
            "its collection, or hide it in that file"
        )
    return RealHair(real, Outcome(result, dict(source.dropped), tuple(warnings)))


def real_look(shading: ShadingSettings) -> ShadingSettings:
    """The look of strands whose own colours include its effects on colour."""
    return replace(
        shading,
        color_source="own",
        color_map="",
        brow_source="look",
        color_variation=0.0,
        grey_fraction=0.0,
        tip_tint=0.0,
        wetness=0.0,
        dust=0.0,
    )


def _copy_settings(real: bpy.types.Object, hair: bpy.types.Object, settings: GroomSettings) -> None:
    """Copy all settings, except those whose effects are in the real strands themselves."""
    copied = settings.with_settings(
        real_look(settings[ShadingSettings]),
        replace(settings[StrandSettings], fullness=1.0, tip_width=1.0),
        replace(settings[ChildrenSettings], method="none"),
        replace(settings[CardDrawingSettings], shown_as="strands"),
        WidthSettings(method="own"),
    )
    for name in (*sections_of("groom"), *sections_of("character")):
        apply(copied[ALL_SETTINGS[name]], real)
    for name in _OBJECT_PROPERTIES:
        setattr(real.hairloom, name, getattr(hair.hairloom, name))


def _copy_masks(
    curves: bpy.types.Curves, rig: Rig, masks: Masks, dynamics: DynamicsSettings
) -> None:
    """Copy masks that are painted on the original curves; those on the surface need no copy."""
    for parameter, name in mask_names(dynamics).items():
        mask = masks.masks.get(parameter)
        if isinstance(mask, StrandMask) and name not in curves.attributes:
            values = painted_strands(rig, mask)
            is_along = mask.grid.shape[1] > 1
            set_attribute(curves, name, "POINT" if is_along else "CURVE", values)


def _hide(hair: bpy.types.Object) -> None:
    """Hide hair in the viewport and in renders, with the copy that shows its bake."""
    bake = hair.hairloom.bake
    if bake.hides:
        bake.was_hidden = True
        if bake.copy is not None:
            bake.copy.hide_render = True
    hair.hide_render = hair.hide_viewport = True
