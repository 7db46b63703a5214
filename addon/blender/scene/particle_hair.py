"""Converting particle hair to hair curves that are attached to their surface.

Blender's own conversion copies positions only: no surface, no parent, no root UVs.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import partial

import bpy

from ...errors import HairloomError
from ...groom.roots import bind_roots
from ...strands import Surface
from ...strands.clean import Cleaned
from ..base.objects import remove_hair
from ..base.parts import Part, Parts
from .curves import read_curves, write_curves
from .surfaces import read_surface


def hair_systems(mesh: bpy.types.Object) -> list[bpy.types.ParticleSystem]:
    """The hair particle systems of a mesh, except those hidden in both viewport and renders."""
    shown = [
        each.particle_system
        for each in mesh.modifiers
        if each.type == "PARTICLE_SYSTEM" and (each.show_viewport or each.show_render)
    ]
    return [system for system in shown if system.settings.type == "HAIR"]


def convert_particle_hair(
    context: bpy.types.Context, mesh: bpy.types.Object
) -> Parts[tuple[list[bpy.types.Object], dict[str, int]]]:
    """Hair curves that replace a mesh's particle hair, which is hidden, not deleted; and reason ->
    number of hairs that were dropped.

    Raises:
        HairloomError: it has no particle hair, or none that Blender can convert.
    """
    read, dropped = [], Counter[str]()
    for name in [system.name for system in hair_systems(mesh)]:
        found = _read(context, mesh, name)
        if found is not None:
            cleaned, surface, collection = found
            strands = cleaned.strands
            place = f"{mesh.name} {name}"
            work = partial(bind_roots, strands, surface, place=place)
            bound = yield Part(f"Converting {strands.strand_count:,} strands", work)
            read.append((name, place, bound.strands, collection))
            dropped.update(cleaned.dropped)
    hairs = []
    for name, place, strands, collection in read:
        system = mesh.particle_systems[name]
        hairs.append(write_curves(place, strands, mesh, collection))
        slot = system.settings.material - 1  # counted from 1, even where the mesh has none
        if slot < len(mesh.material_slots):
            hairs[-1].data.materials.append(mesh.material_slots[slot].material)
        modifier = next(m for m in mesh.modifiers if getattr(m, "particle_system", None) == system)
        modifier.show_viewport = modifier.show_render = False
    if not hairs:
        raise HairloomError(
            "it has no particle hair that can be converted",
            place=mesh.name,
            remedy="Show it in the viewport (Particle System in Modifiers), or press Add Hair to "
            "grow some",
        )
    return hairs, dict(dropped)


def _read(
    context: bpy.types.Context, mesh: bpy.types.Object, name: str
) -> tuple[Cleaned, Surface, bpy.types.Collection] | None:
    """The hair of a particle system as Blender converts it, its surface, and the collection where
    Blender puts it; Blender's object is removed. None without hair, as of hidden particles."""
    mesh.particle_systems.active_index = mesh.particle_systems.find(name)
    was_selected = mesh.select_get()
    with context.temp_override(object=mesh, active_object=mesh):
        bpy.ops.curves.convert_from_particle_system()
    converted = context.view_layer.objects.active
    if converted is mesh or converted is None or converted.type != "CURVES":
        return None
    depsgraph = context.evaluated_depsgraph_get()
    cleaned = read_curves(converted, depsgraph)
    cleaned = replace(cleaned, strands=replace(cleaned.strands, root_uv=None))
    surface = read_surface(mesh, depsgraph, need_uv=False, place=mesh.name)
    collection = converted.users_collection[0]
    remove_hair(converted)
    context.view_layer.objects.active = mesh
    mesh.select_set(was_selected)
    return (cleaned, surface, collection) if cleaned.strands.strand_count else None
