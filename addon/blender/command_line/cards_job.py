"""The verb `cards`: hair cards as a file for engines."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import bpy

from ...arrays import Floats
from ...cards.export_settings import OF_MOTION, CardExportSettings
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...errors import HairloomError
from ...exchange.cards.card_formats import FORMATS, format_of
from ...params import SettingsMap
from ...rig_flow import Rig
from ..bakes.guide_motion import GuideMotion
from ..base.file_names import file_paths
from ..cards.build import CardInputs, order_line
from ..cards.files import (
    CardOutput,
    WrittenCards,
    check_no_input,
    check_output,
    write_cards,
)
from ..cards.occluders import read_occluders
from ..cards.textures import chosen_pictures, named_pictures
from ..scene.bone_weights import head_bone_of
from .arguments import option_name
from .inputs import read_head_look
from .job_options import (
    add_bake_option,
    add_frames_option,
    add_parameter_options,
    add_texture_option,
    frames_of_option,
    section_from_options,
)
from .job_steps import (
    GroomFacts,
    Job,
    card_edits,
    finish,
    folder_for_several_error,
    read_baked_motion,
    read_rig,
    report_notes,
)
from .output_checks import check_not_an_input
from .verb import Verb


def cards(job: Job) -> None:
    """Turn hair into cards, sorted from inside to outside: GLB, FBX, USD or OBJ, and textures."""
    options = job.options
    own_textures = [Path(argument.partition("=")[2]) for argument in options.texture]
    named = named_pictures(options.texture)
    path, _ = format_of(job.output, options.format)
    paths = file_paths(path, job.names)
    for each in paths:
        check_not_an_input(each, options)
        check_no_input(each, own_textures)
    grooms = []
    facts = GroomFacts(job)
    for part, file in zip(job.parts, paths, strict=True):
        settings = section_from_options(options, part.settings[CardExportSettings])
        _check_idle_options(part, settings)
        rig, motion = _read_rig_and_motion(part, settings)
        facts.added(rig)
        look = read_head_look(part.sources, rig.head)
        output = CardOutput(options.format, settings=settings, head_look=look)
        check_output(file, output, motion)  # before any is written
        grooms.append((part, file, rig, output, motion))
    written: list[WrittenCards] = []
    for part, file, rig, output, motion in grooms:
        pictures = _pictures_of_hair(part) | named
        files_beside = [
            (other.settings, its_rig)
            for other, _, its_rig, *_ in grooms
            if other is not part and other.hair is None
        ]
        made = build_and_write_cards(part, file, rig, pictures, output, motion, files_beside)
        written.append(made)
        if job.others:
            print(f"Wrote {file}")
    if job.others:
        job.report.facts.update(_sums(written))
    else:
        finish(job, path)


def _sums(written: list[WrittenCards]) -> dict[str, Any]:
    """The report's facts on the cards of several grooms: sums, and the largest fraction."""
    levels = zip_longest(*([len(m.triangles) for m in w.levels] for w in written), fillvalue=0)
    return {
        "cards": sum(each.mesh.card_count for each in written),
        "card_shell_layers": sum(each.build.shell_layers for each in written),
        "card_triangles": sum(len(each.mesh.triangles) for each in written),
        "card_levels": [sum(each) for each in levels],
        "card_order_wrong": round(max(each.build.wrong_fraction for each in written), 4),
    }


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
    beside: Sequence[tuple[SettingsMap, Rig]] = (),
) -> WrittenCards:
    """Build and write the cards, and report them.

    Args:
        beside: settings and rigs of grooms of files, which occlude these cards, too.
    """
    levels = getattr(job.options, "levels", None)
    settings, report = job.settings, job.report
    if levels is not None:
        settings = settings.with_settings(replace(settings[CardSettings], levels=levels))
    hair = job.hair
    if output is not None and hair is not None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        output = replace(output, head_bone=head_bone_of(hair, depsgraph, rig.strands))
    occluders = read_occluders(settings[CardOcclusionSettings], hair)
    if settings[CardOcclusionSettings].others:
        occluders = occluders.with_rigs(beside)
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
    if job.others and options.bake:
        raise folder_for_several_error(job)
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
                place=option_name(name),
                remedy="Omit it, or add --page",
            )
    motion = settings.motion
    for name in sorted({name for names in OF_MOTION.values() for name in names}):
        if getattr(job.options, name) is not None and name not in OF_MOTION[motion]:
            users = [each for each, names in OF_MOTION.items() if name in names]
            raise HairloomError(
                f"it has no effect with --motion {motion}",
                place=option_name(name),
                remedy=f"Omit it, or add --motion {' or '.join(users)}",
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
    output="hair cards to write (.glb, .fbx, .usd, .usda, .usdc or .obj); several grooms get a file"
    " each, NAME_GROOM.glb",
    takes_several=True,
    operators=("export_cards",),
)
