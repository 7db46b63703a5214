"""The verbs `make-cards` and `sort-cards`: cards as meshes of a scene."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any, get_args

import bpy

from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.steps import result_of, retold
from ...cards.uv_ways import Way
from ...errors import HairloomError
from ..cards.adopt import ORDERS, SortChoices, sort_steps
from ..cards.object import CardObjectJob
from .job_options import add_object_option
from .job_steps import Job, tell_notes
from .object_settings import check_editable, named_grooms, named_objects, put_settings
from .verb import Verb

#: between two looks at a thread [s]
_PAUSE = 0.01


def make_cards(job: Job) -> None:
    """Make hair cards of grooms of a scene, as meshes beside them, or make those anew."""
    made = []
    for hair in named_grooms(job.options.object):
        put_settings(hair, job.options.preset, job.options.set)
        with job.report.stage("make cards"):
            cards = _made(hair)
        tell_notes(list(cards.notes), job.report)
        finest = cards.objects[0]
        count, triangles = finest.hairloom.card_object.card_count, len(finest.data.polygons)
        facts = {"cards": count, "triangles": triangles, "levels": len(cards.objects)}
        made.append({"object": finest.name, **facts})
        print(f"{finest.name}: {count:,} cards, {triangles:,} triangles. {cards.order}", flush=True)
    job.report.facts["made"] = made


def _made(hair: bpy.types.Object) -> CardObjectJob:
    """The cards of one groom, in the scene."""
    cards = CardObjectJob(hair, bpy.context.evaluated_depsgraph_get())
    work = cards.making()
    try:
        while not work.run_main_thread_steps():
            time.sleep(_PAUSE)
        cards.write(work.result())
    finally:
        work.give_up()
    return cards


def sort_cards(job: Job) -> None:
    """Put the faces of card meshes into the order to draw them in, and store ambient occlusion."""
    choices, done = _choices(job), []
    for obj in named_objects(job.options.object, _is_mesh, "a mesh"):
        check_editable(obj)
        progress = job.report.progress(f"sorting {obj.name}", 100)
        steps = sort_steps(obj, bpy.context.evaluated_depsgraph_get(), choices)
        with job.report.stage("sort"):
            result = result_of(retold(steps, progress.show_share))
        tell_notes([f"{obj.name}: {note}" for note in result.notes], job.report)
        done.append({"object": obj.name, "cards": result.card_count, "moved": result.moved})
        moved = f"{result.moved:,} of {result.face_count:,} faces moved"
        print(f"Sorted {obj.name}: {result.card_count:,} cards, {moved}", flush=True)
    job.report.facts["sorted"] = done


def _choices(job: Job) -> SortChoices:
    options = job.options
    heads = named_objects([options.head] if options.head else [], _is_mesh, "a mesh")
    return SortChoices(
        head=heads[0] if heads else None,
        by=options.by,
        way=options.root_to_tip,
        dangling=options.dangling,
        occlusion=None if options.no_occlusion else job.set(CardOcclusionSettings),
        alpha=_picture(options.alpha),
    )


def _picture(name: str | None) -> bpy.types.Image | None:
    """An image of the scene, or a file."""
    if not name:
        return None
    image = bpy.data.images.get(name)
    if image is None and not Path(name).is_file():
        raise HairloomError(
            "this names neither an image of the open scene nor a file",
            place=name,
            remedy="Check the name",
        )
    return image or bpy.data.images.load(str(Path(name).resolve()), check_existing=True)


def _is_mesh(obj: bpy.types.Object) -> bool:
    return bool(obj.type == "MESH")


def _add_make_options(parser: argparse.ArgumentParser) -> None:
    add_object_option(parser, "hair curves; can be given again (default: all of the scene)")


def _add_sort_options(parser: argparse.ArgumentParser) -> None:
    what: Any = parser.add_argument_group("what to sort")
    add_object_option(what, "mesh of hair cards; can be given again", needed=True)
    what.add_argument(
        "--head", metavar="NAME", help="mesh that the hair grows from, which shades it as well"
    )
    what.add_argument(
        "--by",
        choices=[name for name, *_ in ORDERS],
        default="pieces",
        help="what is sorted (default: pieces)",
    )
    what.add_argument(
        "--dangling",
        default="",
        metavar="NAME",
        help="vertex group of cards that swing, such as a ponytail: drawn after all others",
    )
    what.add_argument(
        "--root-to-tip",
        choices=get_args(Way.__value__),
        default="auto",
        help="which way hair runs on the texture (default: found by the UVs and the head)",
    )
    what.add_argument("--no-occlusion", action="store_true", help="leave ambient occlusion alone")
    what.add_argument(
        "--alpha",
        metavar="PICTURE",
        help="where cards are clear: an image of the scene or a file (default: of their material)",
    )


MAKE_CARDS = Verb(
    "make-cards",
    make_cards,
    _add_make_options,
    takes_hair=False,
    saves_scene=True,
    operators=("make_cards",),
)
SORT_CARDS = Verb(
    "sort-cards",
    sort_cards,
    _add_sort_options,
    takes_hair=False,
    saves_scene=True,
    operators=("sort_cards",),
)
