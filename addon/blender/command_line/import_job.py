"""The verb `import`: the artist's File > Import of grooms."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import bpy

from ...errors import HairloomError
from ...exchange.strand_formats import SUFFIXES
from ..base.outcome import dropped_phrase
from ..scene.mesh_files import import_mesh_file, scale_object
from ..strands.import_groom import (
    GUIDE_TREATMENTS,
    ImportSurface,
    StrandImport,
    import_strands,
    read_import_surface,
)
from .job_options import add_head_scale_option
from .job_steps import Job, report_notes
from .object_settings import change_settings, check_sections, named_objects
from .verb import Verb


def import_grooms(job: Job) -> None:
    """Import grooms from files into a scene: hair curves, bound to a head if one is named."""
    options, report = job.options, job.report
    import_options = StrandImport(options.groom_up, options.groom_scale, options.guides)
    surface, notes = _read_surface(options.head, options.head_scale)
    report_notes([*notes, *(surface.notes if surface else ())], report)
    objects: list[dict[str, Any]] = []
    for path in options.files:
        with report.stage("import"):
            hair, outcome = import_strands(path, surface, bpy.context.collection, import_options)
        if outcome.dropped and options.strict:
            reasons = ", ".join(f"{n:,} with {reason}" for reason, n in outcome.dropped.items())
            raise HairloomError(
                f"strands would be dropped: {reasons}",
                place=str(path),
                remedy="Fix the groom, or omit --strict",
            )
        report_notes(list(outcome.warnings), report)
        print(
            "; ".join(filter(None, (outcome.result, dropped_phrase(outcome.dropped)))), flush=True
        )
        check_sections(hair, options.preset, options.set)
        for each in hair:
            change_settings(each, options.preset, options.set)
            count = len(each.data.curves)
            objects.append({"object": each.name, "file": path.name, "strands": count})
        for reason, count in outcome.dropped.items():
            report.facts["dropped"][reason] = report.facts["dropped"].get(reason, 0) + count
    report.facts.update(head=surface and surface.head.name, objects=objects)


def _read_surface(head: str | None, scale: float) -> tuple[ImportSurface | None, tuple[str, ...]]:
    """The mesh of the scene, or of a file, that hair is bound to, and notes on it."""
    notes: tuple[str, ...] = ()
    if head is None:
        if scale != 1.0:
            raise HairloomError(
                "there is no head to scale", place="--head-scale", remedy="Name it with --head"
            )
        return None, notes
    if head in bpy.context.view_layer.objects or not Path(head).suffix:
        (mesh,) = named_objects([head], lambda obj: bool(obj.type == "MESH"), "a mesh")
    else:
        mesh, notes = import_mesh_file(Path(head), scale)
        scale = 1.0
    if scale != 1.0:
        scale_object(mesh, scale)
    return read_import_surface(mesh, bpy.context.evaluated_depsgraph_get()), notes


def _add_options(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what to import")
    what.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="grooms: " + ", ".join(SUFFIXES)
    )
    what.add_argument(
        "--head",
        help="mesh to bind the hair to: an object of the scene, or a file such as head.obj, whose "
        "meshes are joined",
    )
    what.add_argument(
        "--groom-up",
        choices=("Y", "Z"),
        help="up axis of the files (default: as stored in each file)",
    )
    what.add_argument(
        "--groom-scale",
        type=float,
        default=1.0,
        metavar="FACTOR",
        help="factor on all lengths, in addition to the unit stored in each file",
    )
    add_head_scale_option(
        what, "factor on the size of the head, about the scene's origin (default: 1)"
    )
    what.add_argument(
        "--guides",
        choices=GUIDE_TREATMENTS,
        default=GUIDE_TREATMENTS[0],
        help="how to import guides: leave them out, apart as a separate hair object, or among the "
        "strands (default: leave)",
    )
    what.add_argument("--strict", action="store_true", help="fail if any strand has to be dropped")


IMPORT = Verb(
    "import",
    import_grooms,
    _add_options,
    takes_hair=False,
    saves_scene=True,
    operators=("import_strands",),
)
