"""The verbs `fins` and `spheres`: meshes that move as cloth, and what hair collides with."""

from __future__ import annotations

import argparse
from typing import Any

import bpy

from ...errors import HairloomError
from ..colliders import spheres as fitting
from ..colliders.spheres import SphereFitSettings
from ..scene.fin_modifier import add_modifier, fin_modifier, remove_modifier
from .job_options import add_object_option
from .job_steps import Job, tell_notes
from .object_settings import check_editable, named_objects, put_settings
from .verb import Verb


def fins(job: Job) -> None:
    """Let meshes of a scene move as cloth, pinned by a vertex group, or no longer."""
    options = job.options
    for obj in _meshes(options.object):
        if options.remove:
            if fin_modifier(obj) is None:
                raise HairloomError("it is no fin", place=obj.name, remedy="Leave it out")
            remove_modifier(obj)
            print(f"{obj.name} is a plain mesh again", flush=True)
            continue
        add_modifier(obj)
        put_settings(obj, options.preset, options.set)
        _pin(obj, options.pin_group, job)
    job.report.facts["removed" if options.remove else "fins"] = list(options.object)


def _pin(obj: bpy.types.Object, group: str | None, job: Job) -> None:
    """By the group that was named, else by the one it has, else by the active one."""
    fin, active = obj.hairloom.fin, obj.vertex_groups.active
    if group is not None and group not in obj.vertex_groups:
        raise HairloomError(
            f"it has no vertex group '{group}'", place=obj.name, remedy="Name one of its own"
        )
    fin.pin_group = group or fin.pin_group or (active.name if active else "")
    if not fin.pin_group:
        tell_notes(
            [f"{obj.name}: nothing is pinned, so it will fall. Give --pin-group"], job.report
        )
        return
    print(f"{obj.name} is a fin, pinned by the vertex group {fin.pin_group}", flush=True)


def spheres(job: Job) -> None:
    """Fit spheres to meshes of a scene, which hair collides with faster, or remove them."""
    done = []
    for mesh in _meshes(job.options.object):
        if job.options.remove:
            count = fitting.remove_spheres(mesh)
            print(f"{count} spheres removed; {mesh.name} collides by itself again", flush=True)
            done.append({"object": mesh.name, "removed": count})
        else:
            done.append(_fit(mesh, job))
    job.report.facts["spheres"] = done


def _fit(mesh: bpy.types.Object, job: Job) -> dict[str, Any]:
    with job.report.stage("fit spheres"):
        fitted = fitting.fit_spheres_to(mesh, bpy.context, job.set(SphereFitSettings))
    for hair in fitting.grown_on(mesh, bpy.context.view_layer):
        fitting.use_spheres(hair, fitted.collection)
    if not job.options.keep_mesh:
        mesh.hairloom.collider_shape = "none"
    if fitted.hanging and mesh.modifiers:
        note = f"{mesh.name}: {fitted.hanging} spheres follow it as an object but not its shape. "
        tell_notes([note + "Apply the modifiers that copy vertices, and fit again"], job.report)
    error, count = fitted.fit.error, len(fitted.fit.radii)
    print(f"{count} spheres fitted to {mesh.name}: {fitted.collection.name}", flush=True)
    return {
        "object": mesh.name,
        "collection": fitted.collection.name,
        "count": count,
        "gap_mean_mm": round(error.gap_mean * 1000.0, 3),
        "gap_max_mm": round(error.gap_max * 1000.0, 3),
        "outside_mean_mm": round(error.outside_mean * 1000.0, 3),
        "outside_max_mm": round(error.outside_max * 1000.0, 3),
    }


def _meshes(names: list[str]) -> list[bpy.types.Object]:
    meshes = named_objects(names, lambda obj: bool(obj.type == "MESH"), "a mesh")
    for mesh in meshes:
        check_editable(mesh)
    return meshes


def _add_fin_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what becomes a fin")
    add_object_option(what, "mesh; can be given again", needed=True)
    what.add_argument("--pin-group", metavar="NAME", help="vertex group that the animation carries")
    what.add_argument(
        "--remove", action="store_true", help="make fins plain meshes again, as they were"
    )


def _add_sphere_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what spheres are fitted to")
    add_object_option(what, "mesh; can be given again", needed=True)
    what.add_argument(
        "--keep-mesh", action="store_true", help="let the mesh itself collide as well"
    )
    what.add_argument("--remove", action="store_true", help="remove its spheres, in place of it")


FINS = Verb(
    "fins",
    fins,
    _add_fin_options,
    takes_hair=False,
    saves_scene=True,
    operators=("fin_add", "fin_remove"),
)
SPHERES = Verb(
    "spheres",
    spheres,
    _add_sphere_options,
    takes_hair=False,
    saves_scene=True,
    operators=("fit_spheres", "remove_spheres"),
)
