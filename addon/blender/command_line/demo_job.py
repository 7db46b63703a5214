"""The verb `demo`: everything once, into one folder."""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from ...arrays import Floats
from ...exchange.tressfx import write_tfx
from ...rig_flow import Rig
from ..base.images import contact_sheet
from ..cards.build import BuiltCards, MappedCards
from ..cards.files import WrittenCards
from ..cards.textures import named_pictures
from ..pictures.studio import Studio
from .cards_job import build_and_write_cards
from .job_options import add_motion_options, add_picture_options, add_texture_option
from .job_steps import Job, PosedHair, open_studio, read_rig, report_notes
from .render_job import write_sheet, write_still
from .simulate_job import scene_at_first_frame, simulate_hair
from .verb import Verb


def demo(job: Job) -> None:
    """Run everything: simulation, stills, contact sheet, hair cards, strands and report.json."""
    report, folder = job.report, job.output
    pictures = named_pictures(job.options.texture)
    with TemporaryDirectory() as bake:
        with scene_at_first_frame(job):
            rig, inputs = read_rig(job)
            motion = simulate_hair(job, inputs, Path(bake) / "bake")
        studio = open_studio(job, rig)
        still = write_still(job, folder / "still.png", studio, PosedHair.of_rest(rig))
        _write_close_up(job, folder / "close_up.png", studio, rig)
        write_sheet(job, folder / "motion.png", studio, [motion])
    report_notes(list(studio.notes), report)
    written = build_and_write_cards(job, folder / "cards.glb", rig, pictures)
    _write_card_still(job, folder / "cards.png", studio, rig, written, still)
    with report.stage("write strands"):
        write_tfx(folder / "strands.tfx", rig.strands)
    report.add_output(folder / "strands.tfx")
    report.finish("done")
    report.write(folder / "report.json")
    print(f"Wrote {', '.join(report.facts['outputs'])} and report.json into {folder}")


def _write_close_up(job: Job, path: Path, studio: Studio, rig: Rig) -> None:
    """Write a picture of the hair close by, lit as in the still: attached to a camera that looks
    down, the light from behind would graze the crown, where roots mirror it."""
    options = job.options
    camera = studio.close_up(options.width / options.height)
    with job.report.stage("draw close-up"):
        picture = studio.picture(
            rig.rest_pose,
            rig.strands.points,
            options.width,
            options.height,
            options.samples,
            camera,
            lights=studio.lights(),
        )
    studio.write(path, picture)
    job.report.add_output(path)


def _write_card_still(
    job: Job, path: Path, studio: Studio, rig: Rig, written: WrittenCards, still: Floats
) -> None:
    """Write a picture of the still and the cards side by side."""
    options = job.options
    built = BuiltCards.of(rig, MappedCards(written.build, written.maps))
    shown = built.with_drawing_settings(built.rest, job.settings)
    with job.report.stage("draw cards"):
        picture = studio.card_picture(shown, options.width, options.height, options.samples)
    studio.write(path, contact_sheet([still, picture], 2))
    job.report.add_output(path)


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_motion_options(parser)
    add_picture_options(parser, 960, 720)
    add_texture_option(parser)


DEMO = Verb(
    "demo",
    demo,
    _add_options,
    output="folder to write into (default: out)",
    writes_folder=True,
    default_output=Path("out"),
    needs_head=True,
)
