"""Grooms in and out of the open scene, as the artist's buttons ask for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy

from ...groom.grow import grow, scalp_density
from ...groom.settings import GrowSettings
from ...pipeline import Rig
from ..cards.card_images import chosen_pictures
from ..cards.card_making import CardChoices
from ..cards.other_cards import read_other_hair
from ..properties.choices import Choices
from ..properties.properties import settings_of
from ..scene.curves import write_curves
from ..scene.surfaces import read_surface
from ..scene.vertex_weights import read_weights


@dataclass(frozen=True)
class Outcome:
    """What happened: one line of result, what was dropped, and what the artist should know."""

    result: str
    dropped: dict[str, int]
    warnings: tuple[str, ...] = ()


def grow_on(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    values: Any,
    *,
    density_group: str = "",
    length_group: str = "",
) -> bpy.types.Object:
    """Hair curves grown on a mesh.

    Args:
        values: an operator or group with the properties of GrowSettings.
        density_group, length_group: vertex groups or float attributes on points, by name. Without
            a density combed hair grows on the scalp of an upright head, hair along the normals
            everywhere; without a length all is as long as the settings say.

    Raises:
        HairloomError: it has no faces to grow on, there is no group of this name, or all is 0.
    """
    settings = settings_of(values, GrowSettings)
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    density = read_weights(head, depsgraph, density_group) if density_group else None
    length = read_weights(head, depsgraph, length_group) if length_group else None
    if density is None and settings.way == "combed":
        density = scalp_density(surface)
    strands = grow(surface, settings, density, length)
    return write_curves(f"{head.name} Hair", strands, head, collection)


def card_choices(hair: bpy.types.Object) -> tuple[CardChoices, tuple[str, ...]]:
    """What the groom's own settings say of its cards, and warnings of pictures that are no use."""
    pictures, warnings = chosen_pictures(hair.data.hairloom.card_images)
    form = Choices.of(hair).card_form
    return form.choices(pictures, read_other_hair(form.occlusion, hair)), warnings


def notes_of(hair: bpy.types.Object, rig: Rig) -> tuple[str, ...]:
    """What the artist should know of how the hair was made ready."""
    return tuple(f"{hair.name}: {note}" for note in rig.notes)


def dropped_phrase(dropped: dict[str, int]) -> str:
    """Such as "dropped 3 (fewer than two points), 1 (no length)"; empty where nothing was."""
    reasons: Iterable[str] = (f"{count:,} ({reason})" for reason, count in dropped.items())
    return "dropped " + ", ".join(reasons) if dropped else ""
