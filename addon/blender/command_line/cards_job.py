"""The verb `cards`: hair cards as a file for engines."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import bpy

from ...arrays import Floats
from ...cards.export_settings import OF_MOTION, CardExportSettings
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...errors import HairloomError
from ...exchange.cards.card_formats import FORMATS, format_of
from ...rig_flow import Rig
from ..bakes.guide_motion import GuideMotion
from ..cards.build import CardInputs, order_line
from ..cards.files import CardOutput, WrittenCards, check_no_input, write_cards
from ..cards.occluders import read_occluders
from ..cards.textures import chosen_pictures, named_pictures
from ..scene.bone_weights import head_bone_of
from .inputs import read_head_look
from .job_options import (
    add_bake_option,
    add_frames_option,
    add_parameter_options,
    add_texture_option,
    frames_of_option,
    section_from_options,
)
from .job_steps import Job, card_edits, finish, read_baked_motion, read_rig, report_notes
from .output_checks import check_not_an_input
from .verb import Verb


def cards(job: Job) -> None:
    """Turn hair into cards, sorted from inside to outside: GLB, FBX, USD or OBJ, and textures."""
    options = job.options
    pictures = _pictures_of_hair(job) | named_pictures(options.texture)
    path, _ = format_of(job.output, options.format)
    check_not_an_input(path, options)
    settings = section_from_options(options, job.settings[CardExportSettings])
    check_no_input(path, [Path(argument.partition("=")[2]) for argument in options.texture])
    rig, motion = _read_rig_and_motion(job, settings)
    look = read_head_look(job.sources, rig.head)
    output = CardOutput(options.format, settings=settings, head_look=look)
    build_and_write_cards(job, path, rig, pictures, output, motion)
    finish(job, path)


def _pictures_of_hair(job: Job) -> dict[str, Floats]:
    """The pictures that the artist has chosen for the hair object of --groom."""
    hair = job.hair
    if hair is None:
        return {}
    pictures, warnings = chosen_pictures(hair.data.hairloom.card_images)
    report_notes(list(warnings), job.report)
    return pictures


def build_and_write_cards(
    job: Job,
    path: Path,
    rig: Rig,
    pictures: Mapping[str, Floats],
    output: CardOutput | None = None,
    motion: GuideMotion | None = None,
) -> WrittenCards:
    """Build and write the cards, and report them."""
    levels = getattr(job.options, "levels", None)
    settings, report = job.settings, job.report
    if levels is not None:
        settings = settings.with_settings(replace(settings[CardSettings], levels=levels))
    hair = job.hair
    if output is not None and hair is not None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        output = replace(output, head_bone=head_bone_of(hair, depsgraph, rig.strands))
    occluders = read_occluders(settings[CardOcclusionSettings], hair)
    inputs = CardInputs(rig, settings, pictures, occluders, card_edits(job))
    on_step = report.steps("building hair cards")
    written = write_cards(path, inputs, output, report.stage, motion, on_step)
    report.facts.update(
        cards=written.mesh.card_count,
        card_shell_layers=written.build.shell_layers,
        card_triangles=len(written.mesh.triangles),
        card_levels=[len(level.triangles) for level in written.levels],
        card_order_wrong=round(written.build.wrong_fraction, 4),
    )
    edits = written.build.edits
    if edits:
        report.facts["card_edits"] = {
            "edited": edits.edited,
            "deleted": edits.deleted,
            "own": edits.added,
        }
        print(edits.report_line, flush=True)
    if written.motion:
        report.facts["card_motion"] = dict(written.motion)
    if written.figures is not None:
        report.facts.update(written.figures.as_dict())
    print(order_line(written.build.wrong_fraction), flush=True)
    report_notes(list(written.notes), report)
    for file in written.files:
        report.add_output(file)
    return written


def _read_rig_and_motion(job: Job, settings: CardExportSettings) -> tuple[Rig, GuideMotion | None]:
    """The hair, and its motion if requested: the bake in a folder or of an object."""
    options = job.options
    frames = frames_of_option(options.frames)
    _check_idle_options(job, settings)
    if settings.motion != "none":
        motion = read_baked_motion(job, frames)
        return motion.rig, motion
    if options.bake is not None or frames is not None:
        raise HairloomError(
            "a bake and frames are only used for cards in motion",
            place="--frames" if options.bake is None else "--bake",
            remedy="Add --motion joints, springs or texture",
        )
    return read_rig(job)[0], None


def _check_idle_options(job: Job, settings: CardExportSettings) -> None:
    """Refuse options of another kind of motion, and options of a page that is not written."""
    for name in () if settings.page else ("page_texture", "page_head"):
        if getattr(job.options, name) is not None:
            raise HairloomError(
                "it has no effect, because no web page is written",
                place="--" + name.replace("_", "-"),
                remedy="Leave it out, or add --page",
            )
    motion = settings.motion
    for name in sorted({name for names in OF_MOTION.values() for name in names}):
        if getattr(job.options, name) is not None and name not in OF_MOTION[motion]:
            users = [each for each, names in OF_MOTION.items() if name in names]
            raise HairloomError(
                f"it has no effect with --motion {motion}",
                place="--" + name.replace("_", "-"),
                remedy=f"Leave it out, or add --motion {' or '.join(users)}",
            )


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_texture_option(parser)
    files = parser.add_argument_group("the files")
    files.add_argument(
        "--format",
        choices=[each.name for each in FORMATS],
        help="file format (default: by the suffix of --output)",
    )
    files.add_argument(
        "--levels", type=int, metavar="N", help="number of levels of detail (default: cards.levels)"
    )
    files.add_argument(
        "--discard-edits",
        action="store_true",
        help="ignore edits made to the cards in the scene",
    )
    add_parameter_options(files, CardExportSettings)
    add_bake_option(files)
    add_frames_option(files, "frames of the motion (default: all)")


CARDS = Verb(
    "cards",
    cards,
    _add_options,
    output="hair cards to write (.glb, .fbx, .usd, .usda, .usdc or .obj)",
    operators=("export_cards",),
)
