"""The main job without a window: `blender -b --command hairloom VERB ...`.

Exit codes: 0 done, 1 bad input (one line on stderr says what, where and what to do),
2 wrong usage. Every file is written whole or not at all.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ..errors import HairloomError
from ..parameters import ALL_SETTINGS
from ..params import Settings
from .bake_job import bake
from .card_choices import add_card_options
from .inputs import Sources
from .job_steps import Job
from .jobs import cards, demo, export, render, sheet, simulate, turntable
from .overrides import overrides
from .presets import named_preset
from .principled import look_from_named
from .turntable import LIGHTS

VERBS = {
    "simulate": simulate,
    "bake": bake,
    "render": render,
    "turntable": turntable,
    "sheet": sheet,
    "cards": cards,
    "export": export,
    "demo": demo,
}


def run(arguments: list[str]) -> int:
    """Blender calls this with what follows `--command hairloom`."""
    try:
        options = parser().parse_args(arguments)
    except SystemExit as stop:  # argparse has printed its message or the help
        return int(stop.code or 0)
    try:
        VERBS[options.verb](_job(options))
    except HairloomError as error:
        print(f"hairloom: {error}", file=sys.stderr)
        return 1
    return 0


def parser() -> argparse.ArgumentParser:
    """The verbs and their options."""
    top = argparse.ArgumentParser(
        prog="hairloom", description="Simulate, render and export real-time hair."
    )
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, flow in VERBS.items():
        about = (flow.__doc__ or "").strip().splitlines()[0]
        verb = verbs.add_parser(name, help=about, description=about)
        if name == "bake":
            _add_bake_options(verb)
        else:
            _add_source_options(verb)
        _add_job_options(verb, name)
    return top


def _add_bake_options(verb: argparse.ArgumentParser) -> None:
    what = verb.add_argument_group("what to bake")
    what.add_argument("--scene", metavar="FILE.blend", help="scene (default: the open one)")
    what.add_argument(
        "--object",
        action="append",
        default=[],
        metavar="NAME",
        help="hair curves or a fin; can be given again (default: all that are to be simulated)",
    )
    what.add_argument(
        "--frames",
        nargs=2,
        type=int,
        metavar=("FIRST", "LAST"),
        help="(default: those of the objects, else of the scene)",
    )
    what.add_argument(
        "--save", action="store_true", help="save the scene, so that it plays what was baked"
    )


def _add_source_options(verb: argparse.ArgumentParser) -> None:
    sources = verb.add_argument_group("what to work on (files, or objects of the open scene)")
    sources.add_argument("--groom", help="hair curves object or .tfx file (default: grown here)")
    sources.add_argument("--head", help="mesh that the hair grows from (default: built in)")
    sources.add_argument("--collider", help="closed mesh that hair stays out of (default: head)")
    sources.add_argument("--groom-scale", type=float, default=1.0, help="scale a groom file")
    sources.add_argument(
        "--density-group",
        default="",
        metavar="NAME",
        help="vertex group or attribute of the head: how densely hair grows",
    )
    sources.add_argument(
        "--length-group",
        default="",
        metavar="NAME",
        help="the same for how long hair grows, as a share of grow.length",
    )
    sources.add_argument(
        "--children-density",
        default="",
        metavar="NAME",
        help="the same for how densely children grow (--set children.way=multi)",
    )
    sources.add_argument("--groom-up", choices=("Y", "Z"), default="Y", help="up in a groom file")
    sources.add_argument("--no-uv", action="store_true", help="accept a head without UVs")
    sources.add_argument(
        "--strict", action="store_true", help="fail when a single strand must be dropped"
    )


def _add_job_options(verb: argparse.ArgumentParser, name: str) -> None:
    job = verb.add_argument_group("the job")
    optional = {"demo": Path("out"), "bake": None}
    job.add_argument(
        "--output",
        required=name not in optional,
        type=Path,
        default=optional.get(name),
        help=_OUTPUTS[name],
    )
    job.add_argument("--report", help="write a JSON report to this file")
    job.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.NAME=VALUE",
        help="change a parameter, such as dynamics.damping=2 (docs/parameters.md lists them)",
    )
    job.add_argument(
        "--preset",
        action="append",
        default=[],
        metavar="NAME",
        help="a preset such as looks/blond or dynamics/soft, or a preset file",
    )
    if name in ("cards", "demo"):
        job.add_argument(
            "--texture",
            action="append",
            default=[],
            metavar="NAME=FILE",
            help="a picture in place of a generated texture of the cards: base, alpha, shift, "
            "noise or tangent; can be given again",
        )
    if name == "cards":
        add_card_options(job)
    if name in ("simulate", "demo"):
        job.add_argument("--seconds", type=float, default=2.0, help="length of the head's shake")
        job.add_argument("--frame-rate", type=float, default=60.0, help="frames a second")
        job.add_argument(
            "--scene", action="store_true", help="use the scene's animation and frame range"
        )
    if name in ("render", "export", "turntable", "sheet"):
        job.add_argument("--take", help="a take written by 'hairloom simulate'")
        job.add_argument("--frame", type=int, default=0, help="frame of the take, from 0")
    if name in _PICTURES:
        width, height = _PICTURES[name]
        job.add_argument("--width", type=int, default=width, help="pixels across")
        job.add_argument("--height", type=int, default=height, help="pixels down")
        job.add_argument("--samples", type=int, default=3, help="sub-pixels along each side")
    if name == "turntable":
        _add_turntable_options(job)
    if name == "sheet":
        job.add_argument(
            "--looks", action="store_true", help="in all looks that ship, in place of all sides"
        )
    if name == "render":
        job.add_argument(
            "--look-from-material",
            action="store_true",
            help="start from the Principled Hair of the material of --groom, a hair object",
        )
        job.add_argument(
            "--slices",
            metavar="FILE.png",
            help="write the layers of the lights' shadow maps side by side too",
        )
        job.add_argument(
            "--skin-shadow",
            metavar="FILE.png",
            help="write the soft shadow on the head too, laid out as the head's UV map",
        )
        job.add_argument("--sheet", help="write a contact sheet of the take to this .png too")


def _add_turntable_options(job: Any) -> None:
    job.add_argument("--frames", type=int, default=48, help="pictures in a whole turn")
    job.add_argument("--frame-rate", type=float, default=24.0, help="of the video, frames a second")
    job.add_argument(
        "--lights",
        choices=[name for name, _, _ in LIGHTS],
        default="camera",
        help="whether lights turn with the camera (default) or stay on the groom",
    )
    job.add_argument("--transparent", action="store_true", help="without a backdrop")
    job.add_argument("--no-video", action="store_true", help="pictures only")


#: verb -> default size of a picture [pixels]
_PICTURES = {
    "render": (960, 720),
    "demo": (960, 720),
    "turntable": (720, 720),
    "sheet": (480, 480),
}
_OUTPUTS = {
    "simulate": "take to write (.npz)",
    "bake": "folder for the bake, of several objects one below it each (default: their own)",
    "render": "picture to write (.png)",
    "turntable": "folder for the pictures and the video",
    "sheet": "picture to write (.png); --width and --height are of each picture in it",
    "cards": "hair cards to write (.glb, .fbx, .usd, .usda, .usdc or .obj)",
    "export": "strands to write (.tfx)",
    "demo": "folder to write into (default: out)",
}


def _job(options: argparse.Namespace) -> Job:
    _check_numbers(options)
    return Job(
        verb=options.verb,
        sources=Sources() if options.verb == "bake" else _sources(options),
        settings=_settings(options),
        output=Path() if options.output is None else options.output,
        options=options,
    )


def _sources(options: argparse.Namespace) -> Sources:
    return Sources(
        groom=options.groom,
        head=options.head,
        collider=options.collider,
        groom_scale=options.groom_scale,
        groom_up=options.groom_up,
        need_head=options.verb in ("simulate", "demo"),
        need_uv=not options.no_uv,
        density_group=options.density_group,
        length_group=options.length_group,
        children_density=options.children_density,
    )


def _check_numbers(options: argparse.Namespace) -> None:
    """Refuse sizes that nobody can draw before any work is done."""
    for name, least, most in _LIMITS:
        value = getattr(options, name, least)
        if not least <= value <= most:
            raise HairloomError(
                f"{value} cannot be used",
                place="--" + name.replace("_", "-"),
                remedy=f"Use a number from {least:g} to {most:g}",
            )


_LIMITS = (
    ("width", 1, 4096),
    ("height", 1, 4096),
    ("samples", 1, 4),  # times 4096 pixels is the largest texture that every GPU has
    ("seconds", 0.0, 3600.0),
    ("frame_rate", 1.0, 1000.0),
    ("groom_scale", 1e-6, 1e6),
)


def _settings(options: argparse.Namespace) -> dict[str, Settings]:
    """All parameter sets: the defaults, changed by --preset or a material, changed by --set."""
    chosen = {section: made() for section, made in ALL_SETTINGS.items()}
    for name in options.preset:
        chosen |= {settings.section: settings for settings in named_preset(name).all}
    if getattr(options, "look_from_material", False):
        chosen["shading"], notes = look_from_named(options.groom, chosen["shading"])
        for note in notes:
            print(f"hairloom: {options.groom}: {note}", file=sys.stderr)
    return {
        section: type(values).from_dict(values.as_dict() | overrides(options.set, section), "--set")
        for section, values in chosen.items()
    }
