"""Grooms in and out of the open scene, as the artist's buttons ask for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy

from .. import pipeline
from ..exchange.tressfx import read_tfx, write_tfx
from ..groom.children_settings import ChildrenSettings
from ..groom.grow import grow, scalp_density
from ..groom.roots import bind_roots
from ..groom.settings import GrowSettings, GuideSettings
from ..pipeline import Rig
from ..strands import StrandSet
from .card_files import CardOutput, write_cards
from .card_images import chosen_pictures
from .card_making import CardChoices, order_line
from .choices import Choices
from .curves import write_curves
from .properties import settings_of
from .source import Source, read_source
from .surfaces import read_surface
from .vertex_weights import read_weights


@dataclass(frozen=True)
class Outcome:
    """What happened: one line of result, what was dropped, and what the artist should know."""

    result: str
    dropped: dict[str, int]
    warnings: tuple[str, ...] = ()


def import_tfx(
    path: Path,
    head: bpy.types.Object | None,
    collection: bpy.types.Collection,
    *,
    up: str,
    scale: float,
) -> tuple[bpy.types.Object, Outcome]:
    """Read a TressFX file into hair curves, on a head if there is one.

    Raises:
        HairloomError: the file cannot be read, or is of another scale than the head.
    """
    read = read_tfx(path, up=up, scale=scale)
    strands: StrandSet = read.strands
    warnings: tuple[str, ...] = ()
    if head is not None:
        strands, warnings = _on_head(strands, head, path.name)
    hair = write_curves(path.stem, strands, head, collection)
    result = f"{path.name}: {strands.strand_count:,} strands, TressFX {read.version:g}"
    return hair, Outcome(result, read.dropped, warnings)


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


def export_cards(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    path: Path,
    output: CardOutput | None = None,
    *,
    levels: int | None = None,
) -> Outcome:
    """Write the groom as hair cards: the mesh, its textures and its sidecar.

    Args:
        levels: of detail; None is what the groom's own settings say.

    Raises:
        HairloomError: no hair that can be used, or the files cannot be written.
    """
    source = read_source(hair, depsgraph)
    rig = rig_of(hair, source)
    choices, warnings = card_choices(hair)
    if levels is not None:
        choices = replace(choices, cards=replace(choices.cards, levels=levels))
    written = write_cards(path, rig, choices, output or CardOutput(name=hair.name))
    first, *beside = (file.name for file in written.files)
    result = (
        f"Wrote {written.mesh.card_count:,} cards in {len(written.levels)} levels of detail to "
        f"{first}, with {len(beside)} files beside it. {order_line(written.build.wrong_share)}"
    )
    told = (*source.warnings, *notes_of(hair, rig), *written.notes, *warnings)
    return Outcome(result, source.dropped, told)


def export_tfx(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, path: Path, *, up: str, scale: float
) -> Outcome:
    """Write all strands as TressFX: as Blender shows them, or guides and children if there are any.

    Raises:
        HairloomError: no strands, or the file cannot be written.
    """
    source = read_source(hair, depsgraph)
    strands, notes = source.strands, tuple[str, ...]()
    if hair.data.hairloom.children.way != "none":
        rig = rig_of(hair, source)
        strands, notes = rig.strands, notes_of(hair, rig)
    elif source.head is not None and strands.strand_count:
        strands = bind_roots(strands, source.head, place=hair.name).strands
    write_tfx(path, strands, up=up, scale=scale)
    result = f"Wrote {strands.strand_count:,} strands to {path.name}"
    return Outcome(result, source.dropped, (*source.warnings, *notes))


def card_choices(hair: bpy.types.Object) -> tuple[CardChoices, tuple[str, ...]]:
    """What the groom's own settings say of its cards, and warnings of pictures that are no use."""
    pictures, warnings = chosen_pictures(hair.data.hairloom.card_images)
    return Choices.of(hair).card_form.choices(pictures), warnings


def rig_of(hair: bpy.types.Object, source: Source) -> Rig:
    """The hair made ready by its own settings, at rest as it was read.

    Raises:
        HairloomError: no hair that can be used.
    """
    groom = hair.data.hairloom
    return pipeline.prepare(
        source.strands,
        source.head,
        settings_of(groom.guides, GuideSettings),
        place=hair.name,
        children=settings_of(groom.children, ChildrenSettings),
        density=source.density,
    )


def notes_of(hair: bpy.types.Object, rig: Rig) -> tuple[str, ...]:
    """What the artist should know of how the hair was made ready."""
    return tuple(f"{hair.name}: {note}" for note in rig.notes)


def dropped_phrase(dropped: dict[str, int]) -> str:
    """Such as "dropped 3 (fewer than two points), 1 (no length)"; empty where nothing was."""
    reasons: Iterable[str] = (f"{count:,} ({reason})" for reason, count in dropped.items())
    return "dropped " + ", ".join(reasons) if dropped else ""


def _on_head(
    strands: StrandSet, head: bpy.types.Object, place: str
) -> tuple[StrandSet, tuple[str, ...]]:
    """Strands with the head's UVs at their roots, which Blender's own hair tools go by."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    bound = bind_roots(replace(strands, root_uv=None), surface, place=place).strands
    if surface.corner_uv is not None:
        return bound, ()
    warning = (
        f"{head.name}: it has no UVs, so Blender's own hair tools cannot hold these strands. "
        "Unwrap it (Edit Mode, UV > Unwrap)."
    )
    return bound, (warning,)
