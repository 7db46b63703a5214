"""Diagnostics of a groom: issues that one button fixes, and some of the fixes."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import bpy
import numpy as np

from ...errors import HairloomError
from ..bakes.baked_copy import render_problem
from ..bakes.simulation import phrase_of
from ..base.objects import head_of, objects_in
from ..scene.curves import attach_to_surface, read_curves
from ..scene.source import dynamics_warnings, hair_dynamics_modifiers
from ..scene.surfaces import read_positions
from ..sessions.session import Session
from . import previews
from .passive_grooms import nearby_grooms

#: Scales whose ratio is smaller differ by rounding alone.
_MAX_SCALE_RATIO = 1.01
#: Number of roots, evenly chosen, that decide which mesh they are on.
_MAX_TESTED_ROOTS = 100
#: Number of instances in a scene that are searched for those of a groom, 1 us each.
_MAX_INSTANCES = 10_000


@dataclass(frozen=True)
class Issue:
    """One thing that is wrong.

    operator: name of the operator that fixes it. button: its text.
    instead_of: the warning that reports the same without a button.
    """

    text: str
    operator: str
    button: str
    instead_of: str = ""


def issues_of(hair: bpy.types.Object, session: Session | None) -> tuple[Issue, ...]:
    """What is wrong with this groom, worst first; fast enough for every redraw.

    Args:
        session: its preview; without one, loose roots are not found.
    """
    head = head_of(hair)
    warning = "" if session is None else session.source.head_warning
    found = []
    if hair_dynamics_modifiers(hair):
        found.append(
            Issue(
                "Blender's Hair Dynamics moves this hair as well",
                "hairloom.mute_hair_dynamics",
                "Mute Hair Dynamics",
                next(iter(dynamics_warnings(hair)), ""),
            )
        )
    if head is None:
        text = "No surface: it follows its own object only, and collides with nothing"
        found.append(Issue(text, "hairloom.set_surface", "Set Surface", warning))
    elif head.data.uv_layers.active is None:
        text = f"{head.name} has no UVs: exported strands will have no root UVs"
        found.append(Issue(text, "hairloom.unwrap_surface", "Unwrap", warning))
    if (
        head is not None
        and session is not None
        and session.is_made
        and (loose := session.groom.loose_roots)
    ):
        count = f"{loose:,} roots are" if loose > 1 else "1 root is"
        text = f"{count} not on {head.name}, and would float"
        found.append(Issue(text, "hairloom.snap_roots", "Snap to Surface"))
    if is_unevenly_scaled(hair):
        text = "Its object is scaled unevenly, so strand widths use the mean of the scales"
        found.append(Issue(text, "hairloom.apply_scale", "Apply Scale"))
    if text := render_problem(hair):
        found.append(Issue(text, "hairloom.show_in_renders", "Show in Renders"))
    baked = previews.bake_of(hair)
    if baked is not None and baked.changed_inputs:
        text = f"Changed since its bake: {phrase_of(baked.changed_inputs)}. Bake again"
        found.append(Issue(text, "hairloom.bake", "Bake"))
    return tuple(found)


def instances_note(hair: bpy.types.Object) -> str:
    """A note that the preview does not draw instances of this hair, such as those of a collection
    or of geometry nodes; "" if there are none. Fast enough for every redraw."""
    layer = bpy.context.view_layer
    if not any(_may_instance(obj) for obj in objects_in(layer) if obj != hair):
        return ""
    searched = itertools.islice(layer.depsgraph.object_instances, _MAX_INSTANCES)
    if any(each.is_instance and each.object.original == hair for each in searched):
        return "Instances of it have hair in renders, but not in the preview"
    return ""


def unfelt_note(session: Session) -> str:
    """A note on hair that is not previewed, but that a bake would feel; "" if there is none. Fast
    enough for every redraw."""
    near = nearby_grooms([session], bpy.context.view_layer.depsgraph)
    names = [obj.name for obj in near if previews.session_of(obj) is None]
    if not names:
        return ""
    return f"{', '.join(names)}: near, but not previewed; Play ignores it, bakes do not"


def size_note(session: Session) -> str:
    """A note on moving hair whose object or surface has another size now, as by keyframes; "" if
    there is none. Fast enough for every redraw."""
    try:
        is_resized = session.is_resized(bpy.context.view_layer.depsgraph)
    except HairloomError:  # one of them is gone, which the preview reports
        return ""
    if not (is_resized and (session.is_playing or session.is_recorded)):
        return ""
    return (
        "Hair or surface is scaled, maybe by keyframes, and moving hair keeps its size. Stop to "
        "have it in this size; bake again for the size of the first frame"
    )


def _may_instance(obj: bpy.types.Object) -> bool:
    return obj.is_instancer or any(each.type == "NODES" for each in obj.modifiers)


def is_unevenly_scaled(obj: bpy.types.Object) -> bool:
    """Whether its axes are scaled by different factors."""
    scales = [abs(scale) for scale in obj.matrix_world.to_scale()]
    return max(scales) > _MAX_SCALE_RATIO * min(scales)


def nearest_surface(
    hair: bpy.types.Object, candidates: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> bpy.types.Object:
    """The mesh whose vertices are closest to the roots of the hair, to grow it from. Cards do not
    count, as their roots are where those of their hair are.

    Raises:
        HairloomError: there is no mesh with faces, or no hair.
    """
    roots = read_curves(hair, depsgraph).strands.roots
    roots = roots[:: max(len(roots) // _MAX_TESTED_ROOTS, 1)]
    meshes = [
        mesh
        for mesh in candidates
        if mesh.type == "MESH"
        and len(mesh.data.polygons)
        and mesh.hairloom.card_object.groom is None
    ]
    if not meshes or not len(roots):
        raise HairloomError(
            "there is no mesh that it could grow from",
            place=hair.name,
            remedy="Add the mesh, and select it together with the hair",
        )

    def distance(mesh: bpy.types.Object) -> float:
        positions = read_positions(mesh, depsgraph, place=mesh.name)
        offsets = roots[:, None] - positions[None, :: max(len(positions) // 2000, 1)]
        return float(np.median((offsets**2).sum(axis=2).min(axis=1)))

    return min(meshes, key=distance)


def set_surface(hair: bpy.types.Object, mesh: bpy.types.Object) -> None:
    """Attach hair to a mesh as Blender's own tools do; the hair stays where it is."""
    place = hair.matrix_world.copy()
    attach_to_surface(hair, mesh)
    hair.matrix_world = place
