"""Options that several verbs of the command line share, and checks of their values."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ...cards.settings import CardSettings
from ...errors import HairloomError
from ...exchange.strand_formats import SUFFIXES
from ...exchange.strand_reading import SCALE_LIMITS
from ...parameters import ALL_SETTINGS
from ...params import Settings, SettingsMap
from ...params.preset import Preset
from ..bakes.bake_settings import frame_range
from ..base.report import STYLES
from ..properties.presets import named_preset, shipped_presets
from ..scene.bust_skin import TONES
from ..scene.principled import look_from_named
from ..setup.hairstyles import shipped_hairstyles as hairstyles
from .arguments import option_name
from .object_settings import find_hair, is_groom, named_objects, settings_of_object
from .overrides import overrides


def add_hair_options(parser: argparse.ArgumentParser, *, takes_several: bool = False) -> None:
    """Add options for the hair that a verb works on, see inputs.Sources.

    Args:
        takes_several: whether --groom can be repeated; `name_grooms` then makes one list of all.
    """
    sources = parser.add_argument_group("what to work on (files, or objects of the scene)")
    files = ", ".join(SUFFIXES)
    groom_help = (
        f"hair curves of the scene, or a groom file ({files}; default: hair grown on the head)"
    )
    if takes_several:
        sources.add_argument(
            "--groom", action="append", default=[], dest="grooms", metavar="GROOM", help=groom_help
        )
        parser.add_argument_group("several grooms").add_argument(
            "--object",
            action="append",
            default=[],
            dest="hair_objects",
            metavar="NAME",
            help="hair curves of the scene; can be repeated, as --groom can, to have several "
            "together (default: all hair of the scene)",
        )
        parser.set_defaults(groom=None)
    else:
        sources.add_argument("--groom", help=groom_help)
    sources.add_argument(
        "--style",
        choices=[entry.name for entry in hairstyles()],
        metavar="NAME",
        help="hairstyle with its settings, on the built-in head or on --head: "
        + ", ".join(entry.name for entry in hairstyles()),
    )
    sources.add_argument(
        "--head", help="mesh that the hair grows from (default: the built-in head)"
    )
    sources.add_argument(
        "--collider", help="closed mesh that the hair collides with (default: the head)"
    )
    sources.add_argument(
        "--groom-scale",
        type=float,
        default=1.0,
        metavar="FACTOR",
        help="scale of a groom file (default: 1)",
    )
    sources.add_argument(
        "--groom-up",
        choices=("Y", "Z"),
        help="up axis of a groom file (default: as stored in the file)",
    )
    add_head_scale_option(sources, "scale of the files of head and collider (default: 1)")
    add_density_options(sources)
    sources.add_argument(
        "--skin",
        choices=tuple(TONES),
        default="light",
        help="skin tone of the built-in head (default: light)",
    )
    sources.add_argument(
        "--strict", action="store_true", help="fail if any strand has to be dropped"
    )


def name_grooms(options: argparse.Namespace) -> None:
    """Let `options.grooms` be all hair that a verb for several names, each once, and
    `options.groom` the first of it, or None; call it when the scene is open.

    Raises:
        HairloomError: --object names no hair curves of the scene.
    """
    if hasattr(options, "grooms"):
        objects = named_objects(options.hair_objects, is_groom, "hair curves")
        names = [*options.grooms, *(obj.name for obj in objects)]
        options.grooms = list(dict.fromkeys(names))
        options.groom = options.grooms[0] if options.grooms else None


def add_density_options(parser: Any) -> None:
    """Add options for maps of the head: where hair grows, how long, and where its children grow."""
    map_kinds = "vertex group, attribute or image of the head"
    for name, what in (
        ("--density-group", "with the density of the hair"),
        ("--length-group", "with the length of the hair, as a fraction of grow.length"),
        (
            "--children-density",
            "with the density of the children (with --set children.method=multi)",
        ),
    ):
        parser.add_argument(name, default="", metavar="NAME", help=f"{map_kinds} {what}")


def add_head_scale_option(parser: Any, help_text: str) -> None:
    parser.add_argument("--head-scale", type=float, default=1.0, metavar="FACTOR", help=help_text)


def add_scene_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--scene", metavar="FILE.blend", help="scene file to open first (default: the open scene)"
    )


def add_output_option(
    parser: argparse.ArgumentParser, help_text: str, default: Path | None, *, needed: bool
) -> None:
    parser.add_argument(
        "--output", type=Path, required=needed, default=default, metavar="PATH", help=help_text
    )


def add_save_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--save", action="store_true", help="overwrite the scene file, instead of giving --output"
    )


def add_object_option(parser: Any, help_text: str) -> None:
    """Add --object, which can be given once for each object."""
    parser.add_argument("--object", action="append", default=[], metavar="NAME", help=help_text)


def add_frames_option(parser: Any, help_text: str) -> None:
    parser.add_argument("--frames", nargs=2, type=int, metavar=("FIRST", "LAST"), help=help_text)


def add_max_frames_option(parser: Any) -> None:
    parser.add_argument(
        "--max-frames",
        type=int,
        metavar="COUNT",
        help="write at most this many frames, from FIRST on, as for a task of a render farm",
    )


def frames_of_option(given: list[int] | None, max_frames: int | None = None) -> range | None:
    """The frames of --frames, including the last one, cut to --max-frames; None without --frames.

    Raises:
        HairloomError: the last frame comes before the first, or --max-frames cannot be used.
    """
    if max_frames is not None and (max_frames < 1 or given is None):
        raise HairloomError(
            f"{max_frames} frames cannot be used" if given else "it needs --frames",
            place="--max-frames",
            remedy="Give --frames FIRST LAST, and a count of 1 or more",
        )
    if given is None:
        return None
    first, last = given
    frames = frame_range(first, last, "--frames")
    return frames if max_frames is None else frames[:max_frames]


def add_bake_option(parser: Any) -> None:
    """Add --bake, alone or with a folder; see job_steps.read_baked_motion."""
    parser.add_argument(
        "--bake",
        nargs="?",
        const="",
        metavar="FOLDER",
        help="use the motion of a bake: a folder written by 'simulate' or 'bake' (without FOLDER: "
        "the bake of the hair object --groom)",
    )


def add_bake_frame_options(parser: argparse.ArgumentParser, help_suffix: str = "") -> None:
    """Add options for a frame of a bake, see job_steps.posed_hair.

    Args:
        help_suffix: text for the help on other hair that --frame applies to.
    """
    moment = parser.add_argument_group("when")
    add_bake_option(moment)
    moment.add_argument(
        "--frame",
        type=int,
        metavar="NUMBER",
        help=f"frame of the bake (default: its first){help_suffix}",
    )


def add_picture_options(parser: argparse.ArgumentParser, width: int, height: int) -> None:
    """Add options for the size of a picture [pixels], its samples and its stage."""
    picture = parser.add_argument_group("the picture")
    samples = "samples per pixel along each side, each lit from different points of the lights"
    for name, default, what in (
        ("--width", width, "width in pixels"),
        ("--height", height, "height in pixels"),
        ("--samples", 2, samples),
    ):
        help_text = f"{what} (default: {default})"
        picture.add_argument(name, type=int, default=default, metavar="COUNT", help=help_text)
    picture.add_argument(
        "--stage",
        metavar="NAME",
        help=f"lights, backdrop and film, overriding presets: {', '.join(_stages())}, or a preset "
        "file; --set stage.key=6 changes a single setting (default: studio)",
    )


def _stages() -> list[str]:
    """The short names of the shipped stages."""
    return [entry.path.stem for entry in shipped_presets("stage")]


def add_motion_options(parser: argparse.ArgumentParser) -> None:
    """Add options for what moves the hair: a shake, or the scene."""
    motion = parser.add_argument_group("the motion")
    motion.add_argument(
        "--seconds",
        type=float,
        default=2.0,
        metavar="COUNT",
        help="duration of the head shake (default: 2)",
    )
    motion.add_argument(
        "--frame-rate",
        type=float,
        default=60.0,
        metavar="COUNT",
        help="frames per second (default: 60)",
    )
    motion.add_argument(
        "--animated",
        action="store_true",
        help="follow the scene's animation over its frame range, instead of the head shake",
    )


def add_texture_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--texture",
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="picture to use instead of a generated texture of the cards: base, alpha, shift, "
        "noise or tangent; can be repeated",
    )


def add_settings_options(parser: argparse.ArgumentParser) -> None:
    """Add options for presets and single parameters."""
    settings = parser.add_argument_group("settings")
    settings.add_argument(
        "--preset",
        action="append",
        default=[],
        metavar="NAME",
        help="preset such as looks/blond or dynamics/soft, or a preset file; can be repeated",
    )
    settings.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.NAME=VALUE",
        help="set a parameter, such as dynamics.damping=2 (see docs/parameters.md); can be "
        "repeated, and overrides presets",
    )


def add_parameter_options(parser: Any, kind: type[Settings]) -> None:
    """Add an option for each parameter of a section, which overrides --set; see
    `section_from_options`."""
    for parameter in kind.parameters():
        name = option_name(parameter.name)
        help_text = parameter.description.replace("%", "%%")
        if parameter.kind == "toggle":
            action = argparse.BooleanOptionalAction if parameter.default else "store_true"
            parser.add_argument(name, action=action, default=None, help=help_text)
            continue
        choices = [identifier for identifier, *_ in parameter.choices] or None
        parser.add_argument(
            name,
            type=str if choices else float if parameter.kind == "number" else int,
            choices=choices,
            metavar=None if choices else {"percent": "PERCENT"}.get(parameter.unit, "N"),
            help=f"{help_text} (default: {parameter.default})",
        )


def section_from_options[S: Settings](options: argparse.Namespace, settings: S) -> S:
    """A section changed by its own options, see `add_parameter_options`."""
    given = {
        parameter.name: value
        for parameter in settings.parameters()
        if (value := getattr(options, parameter.name, None)) is not None
    }
    return type(settings).from_dict(settings.as_dict() | given, "the command line")


def add_farm_options(parser: argparse.ArgumentParser, *, can_skip: bool) -> None:
    """Add options for reports, and for what a second run does again."""
    job = parser.add_argument_group("the job")
    job.add_argument(
        "--report",
        metavar="FILE.json",
        help="write a JSON report to this file: what was done, or why the job failed",
    )
    job.add_argument(
        "--progress",
        choices=STYLES,
        default="lines",
        help="format of progress lines: for people (default), or for farms that run Open Job "
        "Descriptions",
    )
    if can_skip:
        job.add_argument(
            "--skip-existing",
            action="store_true",
            help="do nothing if the output exists, complete and made from the same inputs and "
            "options; keeps OUTPUT.done.json beside it",
        )


def check_numbers(options: argparse.Namespace) -> None:
    """Refuse numbers out of range, such as sizes that cannot be drawn, before any work is done.

    Raises:
        HairloomError: naming the option and its limits.
    """
    for name, minimum, maximum in _LIMITS:
        value = getattr(options, name, None)
        if value is not None and not minimum <= value <= maximum:
            raise HairloomError(
                f"{value} cannot be used",
                place=option_name(name),
                remedy=f"Use a number from {minimum:g} to {maximum:g}",
            )


def _range_of(kind: type[Settings], name: str) -> tuple[float, float]:
    (parameter,) = (each for each in kind.parameters() if each.name == name)
    assert parameter.hard_range is not None, "it is a number with limits"
    return parameter.hard_range


_LIMITS = (
    ("width", 1, 4096),
    ("height", 1, 4096),
    ("samples", 1, 16),
    ("seconds", 0.0, 3600.0),
    ("frame_rate", 1.0, 1000.0),
    ("groom_scale", *SCALE_LIMITS),
    ("head_scale", *SCALE_LIMITS),
    ("levels", *_range_of(CardSettings, "levels")),
)


def _presets(options: argparse.Namespace) -> list[Preset[Any]]:
    """The presets of --preset, and that of --stage last, which overrides them."""
    presets, stage = (
        [named_preset(name) for name in options.preset],
        getattr(options, "stage", None),
    )
    if stage is not None:
        presets.append(_stage_preset(stage))
    return presets


def _stage_preset(stage: str) -> Preset[Any]:
    preset = named_preset(f"stage/{stage}" if stage in _stages() else stage, ["stage"])
    if "stage" not in (settings.section for settings in preset.all):
        raise HairloomError(
            "this preset has no settings of the stage",
            place=f"--stage {stage}",
            remedy=f"Use {' or '.join(_stages())}; pass a look with --preset",
        )
    return preset


def settings_from_options(options: argparse.Namespace, groom: str | None = None) -> SettingsMap:
    """All settings; later sources override earlier ones: defaults, the hair object --groom,
    --preset, the material, --set.

    Args:
        groom: the one of several grooms; None: the only one.
    """
    chosen: dict[str, Settings] = {section: made() for section, made in ALL_SETTINGS.items()}
    name = groom or getattr(options, "groom", None)
    hair = find_hair(name)
    if hair is not None:
        chosen |= settings_of_object(hair)
    for preset in _presets(options):
        chosen |= {settings.section: settings for settings in preset.all}
    if hasattr(options, "groom") and getattr(options, "look_from_material", False):
        chosen["shading"], notes = look_from_named(name, chosen["shading"])
        for note in notes:
            print(f"hairloom: {name}: {note}", file=sys.stderr)
    return SettingsMap(
        *(
            type(values).from_dict(values.as_dict() | overrides(options.set, section), "--set")
            for section, values in chosen.items()
        )
    )
