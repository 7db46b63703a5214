"""The verb `grow`: the artist's button Grow Hair."""

from __future__ import annotations

import argparse

import bpy

from ...groom.settings import GrowSettings
from ..base.parts import run_parts
from ..scene.masks import read_map
from ..setup.starting import new_groom
from .job_options import add_density_options
from .job_steps import Job
from .object_settings import change_settings, check_sections, named_objects
from .verb import Verb


def grow(job: Job) -> None:
    """Grow hair curves on a mesh of a scene, with the given settings."""
    options, report = job.options, job.report
    (head,) = named_objects([options.head], lambda obj: bool(obj.type == "MESH"), "a mesh")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    if options.children_density:
        read_map(head, depsgraph, options.children_density)  # an unusable one is refused
    with report.stage("grow"):
        hair = run_parts(
            new_groom(
                head,
                depsgraph,
                bpy.context.collection,
                job.settings[GrowSettings],
                presets=(),
                fits=options.fit,
                density_group=options.density_group,
                length_group=options.length_group,
            )
        )
    hair.name = options.name or hair.name
    check_sections([hair], options.preset, options.set)
    # settings of growth have been used already, to grow and fit the hair
    others = [each for each in options.set if not each.startswith("grow.")]
    change_settings(hair, options.preset, others)
    if options.children_density:
        hair.hairloom.children_density = options.children_density
    count = len(hair.data.curves)
    report.facts.update(object=hair.name, strands=count)
    print(f"Grew {count:,} strands on {head.name}: {hair.name}", flush=True)


def _add_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what to grow")
    what.add_argument("--head", required=True, metavar="NAME", help="mesh that the hair grows from")
    what.add_argument("--name", help="name of the new object (default: named after the mesh)")
    what.add_argument(
        "--fit",
        action="store_true",
        help="scale lengths and motion to the mesh, unless it has the size of a head or body; "
        "presets and --set override this",
    )
    add_density_options(what)


GROW = Verb(
    "grow", grow, _add_options, takes_hair=False, saves_scene=True, operators=("add_groom", "grow")
)
