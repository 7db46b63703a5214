"""Particle hair to hair curves that are attached to their surface.

Blender's own conversion copies positions only: no surface, no parent, no root UVs.
"""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...errors import HairloomError
from ...groom.roots import bind_roots
from .curves import read_curves, write_curves
from .surfaces import read_surface


def hair_systems(mesh: bpy.types.Object) -> list[bpy.types.ParticleSystem]:
    """The hair of a mesh that is still particles."""
    return [system for system in mesh.particle_systems if system.settings.type == "HAIR"]


def convert_particle_hair(
    context: bpy.types.Context, mesh: bpy.types.Object
) -> list[bpy.types.Object]:
    """Hair curves that replace a mesh's particle hair, which is hidden, not deleted.

    Raises:
        HairloomError: it has no particle hair, or none that Blender can convert.
    """
    systems, made = hair_systems(mesh), []
    for system in systems:
        mesh.particle_systems.active_index = list(mesh.particle_systems).index(system)
        name = f"{mesh.name} {system.name}"
        with context.temp_override(object=mesh, active_object=mesh):
            bpy.ops.curves.convert_from_particle_system()
        converted = context.view_layer.objects.active
        if converted is mesh or converted is None or converted.type != "CURVES":
            continue
        made.append(_on_its_mesh(context, converted, mesh, name))
        slot = system.settings.material - 1  # counted from 1, even where the mesh has none
        if slot < len(mesh.material_slots):
            made[-1].data.materials.append(mesh.material_slots[slot].material)
        modifier = next(m for m in mesh.modifiers if getattr(m, "particle_system", None) == system)
        modifier.show_viewport = modifier.show_render = False
        context.view_layer.objects.active = mesh
    if not made:
        raise HairloomError(
            "it has no particle hair that can be converted",
            place=mesh.name,
            remedy="Press Add Hair to grow some",
        )
    return made


def _on_its_mesh(
    context: bpy.types.Context,
    converted: bpy.types.Object,
    mesh: bpy.types.Object,
    name: str,
) -> bpy.types.Object:
    """The same strands, attached to the mesh; the object that Blender made is removed."""
    depsgraph = context.evaluated_depsgraph_get()
    strands = read_curves(converted, depsgraph).strands
    surface = read_surface(mesh, depsgraph, need_uv=False, place=mesh.name)
    bound = bind_roots(replace(strands, root_uv=None), surface, place=name).strands
    collection, curves = converted.users_collection[0], converted.data
    bpy.data.objects.remove(converted)
    bpy.data.hair_curves.remove(curves)
    return write_curves(name, bound, mesh, collection)
