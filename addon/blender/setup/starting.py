"""The first groom, on any mesh or from empty hair: sized to its mesh, with a look and motion."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...groom.settings import GrowSettings
from ...shading.settings import ShadingSettings
from ...shading.wet_and_dusty import wet_and_dusty_look
from ..base.objects import head_of, link_into, remove_hair
from ..base.parts import Part, Parts
from ..properties.presets import apply, named_preset
from ..properties.properties import settings_of
from ..scene.curves import read_curves
from ..scene.hair_material import set_look_material
from ..scene.principled import has_principled_hair, look_from_material
from ..scene.source import mute_hair_dynamics
from ..scene.surfaces import read_positions
from ..strands.growing import grow_on

#: Smallest extent [m] of a human head, for which default lengths are declared.
_HEAD_SIZE = 0.19
#: Meshes within this factor of that size are heads or bodies of real size: hair is not scaled.
REAL_SIZE_FACTOR = 2.5
#: lengths that belong to the whole head, not to single hairs
_LENGTHS = ("length", "wave", "wave_length", "frizz", "clearance", "volume")
#: settings of dynamics -> the power of the size that they scale with; frequencies do not scale
_MOTION_POWERS = {
    "gravity": 1,
    "wind_speed": 1,
    "gust_size": 1,
    "drag": -1,
}


def fitting_factor(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> float:
    """The size of a mesh relative to a human head; 1 if it may be a head or a body.

    The smallest extent is compared: a body of 2 m is thin in one direction, a cube of 2 m is not.
    """
    positions = read_positions(head, depsgraph, place=head.name)
    if not len(positions):
        return 1.0
    min_extent = float(np.ptp(positions, axis=0).min())
    factor = min_extent / _HEAD_SIZE
    return factor if factor > REAL_SIZE_FACTOR or 0.0 < factor < 1.0 / REAL_SIZE_FACTOR else 1.0


def scaled_settings(settings: GrowSettings, factor: float) -> GrowSettings:
    """Settings for the same hair on a head that is larger by a factor, within their limits."""
    if factor == 1.0:
        return settings
    longer = settings.multiplied(**dict.fromkeys(_LENGTHS, factor))
    # droop is a turn per 2 cm of hair, on heads of any size
    return longer.clipped(droop=1.0 - (1.0 - settings.droop) ** (1.0 / factor))


def fit_motion(hair: bpy.types.Object, factor: float) -> None:
    """Let hair swing on a larger head by the same angles in the same time as on a human one.

    Otherwise a breeze of two metres per second would not move hair of two metres.
    """
    if factor == 1.0:
        return
    group = hair.hairloom.dynamics
    factors = {name: factor**power for name, power in _MOTION_POWERS.items()}
    fitted_motion = settings_of(group, DynamicsSettings).multiplied(**factors)
    for name in factors:
        setattr(group, name, getattr(fitted_motion, name))


def new_groom(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    values: Any,
    *,
    presets: tuple[str, ...],
    fits: bool,
    density_group: str = "",
    length_group: str = "",
) -> Parts[bpy.types.Object]:
    """Hair grown on a mesh, with these presets.

    Args:
        values: an operator, group or settings with the values of GrowSettings.
        presets: names as in `named_preset`.
        fits: whether lengths and motion follow the mesh's size if it is not a head's.

    Raises:
        HairloomError: see `growing.grow_on`; or there is no such preset.
    """
    check_presets(presets)
    settings = settings_of(values, GrowSettings)
    factor = fitting_factor(head, depsgraph) if fits else 1.0
    settings = scaled_settings(settings, factor)
    hair = yield from grow_on(
        head,
        depsgraph,
        collection,
        settings,
        density_group=density_group,
        length_group=length_group,
    )
    apply_presets(hair, presets)
    fit_motion(hair, factor)
    set_look_material(
        hair.data, wet_and_dusty_look(settings_of(hair.data.hairloom.shading, ShadingSettings))
    )
    return hair


def check_presets(presets: tuple[str, ...]) -> None:
    """Refuse names of no preset, before hair is made that they are for.

    Raises:
        HairloomError: there is no such preset.
    """
    for name in presets:
        named_preset(name)


def apply_presets(hair: bpy.types.Object, presets: tuple[str, ...]) -> None:
    """Apply presets to a groom, by name.

    Raises:
        HairloomError: there is no such preset.
    """
    for name in presets:
        for settings in named_preset(name).all:
            apply(settings, hair)
    if presets:  # not chosen for this hair, so it keeps colours of its own
        hair.data.hairloom.shading.color_source = "own"


def prepare_existing_hair(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, presets: tuple[str, ...]
) -> Parts[tuple[bpy.types.Object, tuple[str, ...]]]:
    """Prepare Blender's hair curves for Hairloom; returns the groom, and what was done.

    Blender's Hair Dynamics is muted. Empty hair is replaced by a new groom. Linked hair stays as
    its file has it.

    Args:
        presets: for hair whose look has not been set.

    Raises:
        HairloomError: it has no curves, and no surface to grow some on; or there is no such preset.
    """
    done, factor = [], 1.0
    if not (hair.is_editable and hair.data.is_editable):
        yield Part("Reading the hair", lambda: None)
        return hair, ()
    if has_untouched_look(hair) or not len(hair.data.curves):
        check_presets(presets)
    if not len(hair.data.curves) and not read_curves(hair, depsgraph).strands.strand_count:
        hair, factor = yield from _replace_empty_hair(hair, depsgraph)
        done.append("grew hair, since there was none")
    else:
        yield Part("Reading the hair", lambda: None)  # nothing has changed if it is cancelled here
        if mute_hair_dynamics(hair):
            done.append("muted Blender's Hair Dynamics")
    if has_untouched_look(hair):
        apply_presets(hair, presets)
        fit_motion(hair, factor)
        done += _take_look_of_material(hair, depsgraph)
    return hair, tuple(done)


def _take_look_of_material(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Take the look from its material's Principled Hair BSDF, if any; returns what was done."""
    if not has_principled_hair(hair):
        return []
    settings, notes = look_from_material(hair, depsgraph)
    apply(settings, hair)
    return [f"took its look from the material '{hair.active_material.name}'", *notes]


def has_untouched_look(hair: bpy.types.Object) -> bool:
    """Whether its look has never been changed."""
    group = hair.data.hairloom.shading
    return not any(group.is_property_set(p.name) for p in group.settings.parameters())


def _replace_empty_hair(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> Parts[tuple[bpy.types.Object, float]]:
    """Replace empty hair by a groom with its name and collections; also returns the factor by which
    its head is larger than a human one.
    """
    head = head_of(hair)
    if head is None:
        raise HairloomError(
            "it has no curves, and no surface to grow them on",
            place=hair.name,
            remedy="Comb some in Sculpt Mode, or select a mesh and press Add Hair",
        )
    factor = fitting_factor(head, depsgraph)
    settings = scaled_settings(GrowSettings(), factor)
    name, collections = hair.name, list(hair.users_collection)
    grown = yield from grow_on(head, depsgraph, collections[0], settings)
    link_into(grown, collections, bpy.context.scene)
    remove_hair(hair)
    grown.name = name
    return grown, factor
