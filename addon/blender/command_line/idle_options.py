"""Options without effect in combination with others. They are refused, since a user who gives one
expects an effect."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ...errors import HairloomError
from .arguments import option_name
from .verb import Verb


@dataclass(frozen=True)
class _IdleOptions:
    """Options, when they have no effect, and the message then."""

    names: tuple[str, ...]
    has_no_effect: Callable[[argparse.Namespace], bool]
    why: str
    remedy: str


def has_scene(options: argparse.Namespace) -> bool:
    """Whether a scene is named, by --scene or as the file that Blender was started with."""
    return bool(options.scene or bpy.data.filepath)


def exports_scene_hair(options: argparse.Namespace) -> bool:
    """Whether an export writes hair objects of the scene, with their own settings, head and bake:
    those of --object, or all of the scene if no other source of strands is named.
    """
    if not hasattr(options, "object") or not hasattr(options, "groom"):
        return False
    has_other_source = options.groom or options.head or options.style or options.bake is not None
    return bool(options.object or (has_scene(options) and not has_other_source))


def _is_in_file(options: argparse.Namespace) -> bool:
    """Whether --groom names a file instead of an object of the scene."""
    names = getattr(options, "grooms", None) or filter(None, [options.groom])
    return any(bpy.data.objects.get(name) is None for name in names)


def _is_grown(options: argparse.Namespace) -> bool:
    return not (options.groom or options.style or getattr(options, "bake", None) is not None)


_GROOM_FILE_OPTIONS = ("groom_scale", "groom_up")
_GROWTH_OPTIONS = ("density_group", "length_group")
#: verbs that simulate hair of their own
_SIMULATING_VERBS = ("simulate", "demo")
_ONE_GROOM_OPTIONS = ("groom", "style", "head", "head_scale", "collider", "skin", "bake")

_IDLE_OPTIONS = (
    _IdleOptions(
        (*_ONE_GROOM_OPTIONS, *_GROOM_FILE_OPTIONS, *_GROWTH_OPTIONS),
        exports_scene_hair,
        "hair of the scene has its own groom, head and bake",
        "Omit it, or name one hair object with --groom instead of --object",
    ),
    _IdleOptions(
        ("collider",),
        lambda options: options.verb not in _SIMULATING_VERBS,
        "only simulated hair collides",
        f"Omit it, or use it with {' or '.join(_SIMULATING_VERBS)}",
    ),
    _IdleOptions(
        ("skip_existing",),
        lambda options: bool(getattr(options, "preflight", None)),
        "--preflight writes no output",
        "Omit one of the two options",
    ),
    _IdleOptions(
        ("frame",),
        lambda options: getattr(options, "frames", None) is not None and hasattr(options, "object"),
        "--frames already says what is written",
        "Omit one of the two options",
    ),
    _IdleOptions(
        ("frame",),
        lambda options: options.bake is None and not exports_scene_hair(options),
        "it selects a frame of a bake, and no bake is given",
        "Add --bake, or omit it",
    ),
    _IdleOptions(
        ("use_bake",),
        lambda options: (
            not exports_scene_hair(options) or (options.frames is options.frame is None)
        ),
        "it applies to hair of the scene over several frames",
        "Omit it, or name the hair with --object and give --frames",
    ),
    _IdleOptions(
        _GROOM_FILE_OPTIONS,
        lambda options: hasattr(options, "style") and not _is_in_file(options),
        "it applies only to a groom read from a file",
        "Omit it, or name the file with --groom",
    ),
    _IdleOptions(
        _GROWTH_OPTIONS,
        lambda options: hasattr(options, "style") and not _is_grown(options),
        "it applies only to hair that is grown by this job",
        "Omit it, or omit --groom, --style and --bake",
    ),
    _IdleOptions(
        ("seconds", "frame_rate"),
        lambda options: getattr(options, "animated", False),
        "--animated uses the frames and frame rate of the scene",
        "Omit one of the two options",
    ),
    _IdleOptions(
        ("frame_rate",),
        lambda options: getattr(options, "no_video", False),
        "it applies to the video, and --no-video makes none",
        "Omit one of the two options",
    ),
    _IdleOptions(
        ("frames", "output", "preset", "set"),
        lambda options: getattr(options, "delete", False),
        "--delete does not use it",
        "Omit one of the two options",
    ),
)


def check_idle_options(verb: Verb, options: argparse.Namespace) -> None:
    """Refuse options without effect; called when the scene is open.

    Raises:
        HairloomError: naming the first option without effect, and why.
    """
    defaults = argparse.ArgumentParser(add_help=False)
    verb.add_all_options(defaults)
    for idle in _IDLE_OPTIONS:
        for name in idle.names:
            value = getattr(options, name, None)
            if (
                value is not None
                and value != defaults.get_default(name)
                and idle.has_no_effect(options)
            ):
                raise HairloomError(
                    f"it has no effect here: {idle.why}",
                    place=option_name(name),
                    remedy=idle.remedy,
                )
