"""Checks, before any work, of the paths that a job writes: none is read by it, none is used twice,
all can be written, and suffixes fit."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from ...errors import HairloomError
from ...exchange.files.atomic import check_folder_writable, check_writable
from .arguments import option_name
from .verb import Verb

#: options for files to write beside --output, and their suffix
_EXTRA_OUTPUTS = {
    "save_as": ".blend",
    "slices": ".png",
    "skin_shadow": ".png",
    "sheet": ".png",
    "report": ".json",
}
_OUTPUTS = ("output", *_EXTRA_OUTPUTS)


def check_report(options: argparse.Namespace) -> None:
    """Check the path of the report, which is written before all else.

    Raises:
        HairloomError: it would replace another kind of file, or one that the job reads.
    """
    if options.report is not None:
        _check_file(Path(options.report), "report", _EXTRA_OUTPUTS["report"], options)


def check_outputs(verb: Verb, options: argparse.Namespace) -> None:
    """Refuse paths that the job could not or should not write.

    Raises:
        HairloomError: naming the option or the file, and what to do.
    """
    if getattr(options, "preflight", None):
        return  # nothing is written
    for name, suffix in _EXTRA_OUTPUTS.items():
        path = getattr(options, name, None)
        if path is not None:
            _check_file(Path(path), name, suffix, options)
    output = getattr(options, "output", None)
    if output is None:
        return
    if verb.writes_folder:
        check_folder_writable(output)
        check_not_an_input(output, options)
    else:
        _check_file(output, "output", verb.suffix, options)


def check_not_an_input(path: Path, options: argparse.Namespace) -> None:
    """Refuse to write over an input of the job; a scene may be saved over itself.

    Raises:
        HairloomError: the job reads this file or folder.
    """
    is_scene = path.suffix == ".blend" and _is_same_file(path, getattr(options, "scene", None))
    if not is_scene and any(_is_same_file(path, each) for each in input_paths(options)):
        raise HairloomError(
            "the job reads this file and would overwrite it",
            place=str(path),
            remedy="Give the result another name, or another folder",
        )


def input_paths(options: argparse.Namespace) -> set[str]:
    """Existing files that options name, also as NAME=FILE, and the folder of --bake; without
    outputs."""
    words = []
    for name, value in vars(options).items():
        if name not in ("verb", *_OUTPUTS):
            words += [str(one) for one in (value if isinstance(value, list) else [value])]
    words += [word.partition("=")[2] for word in words]
    found = [word for word in words if os.path.isfile(word)]
    # objects may have the names of folders
    bake = getattr(options, "bake", None)
    return {os.path.abspath(word) for word in (*found, *([bake] if bake else []))}


def _check_file(path: Path, name: str, suffix: str, options: argparse.Namespace) -> None:
    option = option_name(name)
    if suffix and path.suffix.lower() != suffix:
        raise HairloomError(
            f"{option} writes a {suffix} file",
            place=str(path),
            remedy=f"Choose a name that ends in {suffix}",
        )
    check_writable(path)
    check_not_an_input(path, options)
    others = [each for each in _OUTPUTS if each != name and getattr(options, each, None)]
    if any(_is_same_file(path, getattr(options, each)) for each in others):
        raise HairloomError(
            "two results would be written to this file", place=str(path), remedy=f"Change {option}"
        )


def _is_same_file(path: Path, other: str | Path | None) -> bool:
    """Whether both paths are one file, also through a link or in another case."""
    if other is None:
        return False
    if os.path.exists(path) and os.path.exists(other):
        return os.path.samefile(path, other)
    return os.path.realpath(path) == os.path.realpath(other)
