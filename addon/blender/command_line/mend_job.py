"""The verb `mend`: hair of a scene made ready, as the buttons beside warnings do it."""

from __future__ import annotations

import argparse
import re

import bpy

from ...errors import HairloomError
from ..base.objects import objects_in
from ..preview.troubles import set_surface, surface_for
from ..scene.particle_hair import convert_particle_hair
from ..scene.source import mute_own_dynamics
from ..setup.starting import take_over
from .job_options import add_object_option
from .job_steps import Job
from .object_settings import check_editable, named_grooms, named_objects, put_settings
from .verb import Verb

#: what stands before the text of a report, and of a button that is grey
_BLENDERS_WORDS = re.compile(r"^(Error: |Operator bpy\.ops\.[\w.]+\(\) (failed, )?)")


def mend(job: Job) -> None:
    """Make hair of a scene ready: particle hair, surface, UVs, roots, scale, Hair Dynamics."""
    options, done = job.options, list[str]()
    meshes = named_objects(options.convert_particles, _is_mesh, "a mesh")
    made = [hair for mesh in meshes for hair in convert_particle_hair(bpy.context, mesh)]
    chosen = named_grooms(options.object) if options.object or not made else []
    for hair in (*made, *chosen):
        check_editable(hair)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        ready, steps = take_over(hair, depsgraph, ()) if options.use else (hair, ())
        put_settings(ready, options.preset, options.set)
        done += [f"{ready.name}: {step}" for step in (*steps, *_mended(ready, options))]
    for line in done:
        print(line, flush=True)
    job.report.facts["mended"] = done


def _mended(hair: bpy.types.Object, options: argparse.Namespace) -> list[str]:
    """All that is asked for, in the order in which one thing needs the other; what was done."""
    done = []
    if options.mute_hair_dynamics:
        done.append(f"turned off {mute_own_dynamics(hair)} Hair Dynamics modifiers")
    if options.surface is not None:
        set_surface(hair, _surface(hair, options.surface))
        done.append(f"grows from {hair.data.surface.name}")
    for name, is_wanted, what in (
        ("unwrap_surface", options.unwrap, "its surface is unwrapped"),
        ("snap_roots", options.snap_roots, "its roots lie on its surface"),
        ("apply_scale", options.apply_scale, "its scale is in its curves"),
    ):
        if is_wanted:
            _press(name, hair)
            done.append(what)
    return done


def _surface(hair: bpy.types.Object, name: str) -> bpy.types.Object:
    if name:
        return named_objects([name], _is_mesh, "a mesh")[0]
    candidates = objects_in(bpy.context.view_layer)
    return surface_for(hair, candidates, bpy.context.evaluated_depsgraph_get())


def _press(button: str, hair: bpy.types.Object) -> None:
    """One of our buttons that take Blender's own operators, and with them the selection."""
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    try:
        getattr(bpy.ops.hairloom, button)()
    except RuntimeError as error:  # what the button would tell, or why it is grey
        problem = _BLENDERS_WORDS.sub("", str(error).strip().splitlines()[0]).rstrip(".")
        raise HairloomError(
            problem, place=hair.name, remedy="Mend that first, or leave the option out"
        ) from error


def _is_mesh(obj: bpy.types.Object) -> bool:
    return bool(obj.type == "MESH")


def _add_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what is mended")
    add_object_option(what, "hair curves; can be given again (default: all hair)")
    what.add_argument(
        "--convert-particles",
        action="append",
        default=[],
        metavar="MESH",
        help="make hair curves of the particle hair of a mesh, and mend these; can be given again",
    )
    what.add_argument(
        "--use",
        action="store_true",
        help="make hair ready as the button Use Hairloom does: turn off Hair Dynamics, grow hair "
        "where there are no curves",
    )
    what.add_argument(
        "--mute-hair-dynamics",
        action="store_true",
        help="turn off Blender's own Hair Dynamics, so that only Hairloom moves the hair",
    )
    what.add_argument(
        "--surface",
        nargs="?",
        const="",
        metavar="MESH",
        help="let hair grow from this mesh (without a name: from the closest one)",
    )
    what.add_argument(
        "--unwrap", action="store_true", help="give a surface without UVs some, by Smart UV Project"
    )
    what.add_argument(
        "--snap-roots", action="store_true", help="move strands so that roots lie on the surface"
    )
    what.add_argument(
        "--apply-scale", action="store_true", help="put an uneven scale of the object into curves"
    )


MEND = Verb(
    "mend",
    mend,
    _add_options,
    takes_hair=False,
    saves_scene=True,
    operators=(
        "convert_particles",
        "use_groom",
        "mute_hair_dynamics",
        "set_surface",
        "unwrap_surface",
        "snap_roots",
        "apply_scale",
    ),
)
