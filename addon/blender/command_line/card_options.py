"""What an artist may choose where cards are written, as options of the command line."""

from __future__ import annotations

from typing import Any

from ...cards.joints import JointChoices
from ...exchange.cards.card_formats import FORMATS
from ..cards.card_choices import (
    DEPTH_ITEMS,
    MOTION_ITEMS,
    PACKING_ITEMS,
    SPACE_ITEMS,
    TEXTURE_ITEMS,
)
from .job_options import add_bake_option, add_frames_option


def add_card_options(job: Any) -> None:
    """The same on the command line: for the group of options of the verb."""
    job.add_argument(
        "--format",
        choices=[each.name for each in FORMATS],
        help="of the file (default: by its suffix)",
    )
    job.add_argument(
        "--levels", type=int, metavar="N", help="levels of detail (default: those of cards.levels)"
    )
    job.add_argument(
        "--index-buffer",
        action="store_true",
        help="write the sorted indices as NAME.indices.bin too",
    )
    job.add_argument(
        "--packing",
        choices=[name for name, *_ in PACKING_ITEMS],
        default="hairloom",
        help="what the channels of the textures hold (default: a file for each map)",
    )
    job.add_argument(
        "--textures",
        choices=[name for name, *_ in TEXTURE_ITEMS],
        default="png",
        help="format of the textures",
    )
    attributes = job.add_mutually_exclusive_group()
    attributes.add_argument(
        "--portable",
        action="store_true",
        default=True,
        help="ambient occlusion in a UV map alone, which every engine reads (default)",
    )
    attributes.add_argument(
        "--attributes",
        action="store_false",
        dest="portable",
        help="ambient occlusion as the attribute _AO too, which some engines refuse",
    )
    _add_motion_options(job)


def _add_motion_options(job: Any) -> None:
    job.add_argument(
        "--motion",
        choices=[name for name, *_ in MOTION_ITEMS],
        default="none",
        help="of --bake, or of the bake of the object --groom, as joints with keys (GLB) or as "
        "vertex animation textures",
    )
    add_bake_option(job)
    add_frames_option(job, "of the motion (default: all)")
    job.add_argument(
        "--motion-space",
        choices=[name for name, *_ in SPACE_ITEMS],
        default="head",
        help="head: without the head's own motion, to be attached to it (default)",
    )
    job.add_argument(
        "--motion-depth",
        choices=[name for name, *_ in DEPTH_ITEMS],
        default="half",
        help="of vertex animation textures",
    )
    defaults = JointChoices()
    job.add_argument(
        "--chains", type=int, default=defaults.chains, metavar="N", help="of joints, at most"
    )
    job.add_argument(
        "--joints",
        type=int,
        default=defaults.joints,
        metavar="N",
        help="in a chain, at most, 2 to 16; as few as stay under the error",
    )
    job.add_argument(
        "--joint-error",
        type=float,
        default=100.0 * defaults.error,
        metavar="PERCENT",
        help="root mean square distance from the simulation, of the mean length of the hair",
    )
