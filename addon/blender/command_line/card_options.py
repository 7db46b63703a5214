"""What an artist may choose where cards are written, as options of the command line."""

from __future__ import annotations

from typing import Any

from ...cards.export_settings import CardExportSettings
from ...exchange.cards.card_formats import FORMATS
from .job_options import add_bake_option, add_frames_option, add_parameter_options


def add_card_options(job: Any) -> None:
    """For the group of options of the verb."""
    job.add_argument(
        "--format",
        choices=[each.name for each in FORMATS],
        help="of the file (default: by its suffix)",
    )
    job.add_argument(
        "--levels", type=int, metavar="N", help="levels of detail (default: those of cards.levels)"
    )
    add_parameter_options(job, CardExportSettings)
    add_bake_option(job)
    add_frames_option(job, "of the motion (default: all)")
