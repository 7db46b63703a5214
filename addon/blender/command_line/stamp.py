"""Stamps, by which a farm can run all tasks again and only the unfinished ones do work.

A job with --skip-existing writes a stamp beside its output: its options, and digests of all files
that it has read and written. The job counts as done while all of these are the same; a changed
scene, another option, or a truncated or missing file makes it run again.

Paths are relative to the stamp, so that a job is still done after its folders were moved together,
or on another machine that mounts them elsewhere.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy

from ...errors import HairloomError
from ...exchange.files.atomic import check_writable, write_text_atomic
from ...exchange.referenced_files import referenced_files
from ...params.preset import preset_as_dict
from ..base.digests import digest
from ..base.report import Report, hairloom_version
from ..properties.presets import named_preset
from ..setup.hairstyles import files_of_hairstyle
from .output_checks import input_paths

SUFFIX = ".done.json"
#: options without effect on the result
_WITHOUT_EFFECT = frozenset(("report", "progress", "skip_existing"))
#: facts about the result, which reports of skipped runs repeat
_REPORTED = ("outputs", "dropped", "notes")


class Stamp:
    """The stamp of one job, beside its output.

    reported: facts of the report when the job was done; empty before `reason_to_run` is called.

    Raises:
        HairloomError: the job has no output, or saves over its own input; or the folder of the
            output cannot be written.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        output = getattr(options, "output", None)
        if output is None:
            raise HairloomError(
                "it needs an output to look for",
                place="--skip-existing",
                remedy="Name it with --output",
            )
        if getattr(options, "save", False):
            raise HairloomError(
                "overwriting the scene changes the job's own input",
                place="--skip-existing",
                remedy="Save another file: --save-as, or --output",
            )
        output = Path(os.path.abspath(output))  # so that "." has a name
        self.path = output.with_name(output.name + SUFFIX)
        check_writable(self.path)
        self.reported: dict[str, Any] = {}
        self._folder = self.path.parent
        self._option_values = _option_values(options, self._folder)
        self._start_time = time.time_ns()
        self._inputs = {path: file_digest(Path(path)) for path in _files_read(options)}

    def reason_to_run(self) -> str:
        """Why the job has to run; empty where it need not."""
        try:
            known = json.loads(self.path.read_text(encoding="utf-8"))
            values, inputs, outputs = known["options"], known["inputs"], known["outputs"]
            self.reported = dict(known["reported"])
            pairs = _all_items(inputs, outputs)
            changed = [
                path
                for path, digest_before in pairs
                if file_digest(self._folder / path) != digest_before
            ]
        except FileNotFoundError:
            return "it was never done"
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return f"{self.path.name} cannot be read"
        if values != self._option_values:
            return "the options have changed"
        return f"{changed[0]} has changed" if changed else ""

    def write(self, report: Report) -> None:
        """Write the stamp after the job, with all files that were read and written.

        Raises:
            HairloomError: the stamp cannot be written.
        """
        outputs = [os.path.abspath(path) for path in report.outputs]
        read = [
            *report.inputs,
            *(file for path in self._inputs for file in referenced_files(Path(path))),
        ]
        found = [os.path.abspath(path) for path in read] + _files_of_scene()
        inputs = {path: self._digest_as_read(Path(path)) for path in found} | self._inputs
        content = {
            "options": self._option_values,
            "reported": {name: report.facts[name] for name in _REPORTED if name in report.facts},
            "inputs": {
                _relative_path(self._folder, path): digest_before
                for path, digest_before in inputs.items()
                if path not in outputs
            },
            "outputs": {
                _relative_path(self._folder, path): file_digest(Path(path)) for path in outputs
            },
        }
        write_text_atomic(self.path, json.dumps(content, indent=2) + "\n")

    def _digest_as_read(self, path: Path) -> str:
        """The digest of an input; "" if it has changed since the job began: it will run again."""
        files = path.rglob("*") if os.path.isdir(path) else (path,) if os.path.exists(path) else ()
        is_newer = any(file.stat().st_mtime_ns > self._start_time for file in files)
        return "" if is_newer else file_digest(path)


def file_digest(path: Path) -> str:
    """The digest of a file, or of all files in a folder with their names; "" for neither."""
    if os.path.isdir(path):
        lines = [
            f"{file.relative_to(path).as_posix()} {file_digest(file)}\n"
            for file in sorted(path.rglob("*"))
            if file.is_file()
        ]
        return digest("".join(lines).encode())
    if not os.path.isfile(path):
        return ""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()


def _all_items(*tables: dict[str, str]) -> Iterable[tuple[str, str]]:
    return (pair for table in tables for pair in table.items())


def _relative_path(folder: Path, path: str) -> str:
    """An absolute path made relative to a folder; unchanged if it is on another drive."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return path


def _option_values(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """All options as JSON values, with absolute paths made relative to a folder; the content of
    presets and of the hairstyle; and the versions of Hairloom and Blender."""
    values = {
        name: _with_relative_paths(folder, value)
        for name, value in vars(options).items()
        if name not in _WITHOUT_EFFECT
    }
    presets = [preset_as_dict(named_preset(name)) for name in getattr(options, "preset", ())]
    values |= {"presets": presets, "made_by": [hairloom_version(), bpy.app.version_string]}
    if getattr(options, "style", None):
        values["style_files"] = [file_digest(path) for path in files_of_hairstyle(options.style)]
    plain: dict[str, Any] = json.loads(json.dumps(values, default=str))
    return plain


def _with_relative_paths(folder: Path, value: Any) -> Any:
    """An option's value with absolute paths, also in NAME=FILE, made relative to the folder."""
    if isinstance(value, list):
        return [_with_relative_paths(folder, each) for each in value]
    if isinstance(value, Path):
        return _relative_path(folder, os.path.abspath(value))
    if not isinstance(value, str):
        return value
    name, sign, path = value.rpartition("=")
    return f"{name}{sign}{_relative_path(folder, path)}" if os.path.isabs(path) else value


def _files_read(options: argparse.Namespace) -> set[str]:
    """The files that options name; and the file of the open scene without --scene."""
    paths = input_paths(options)
    if not getattr(options, "scene", None) and bpy.data.filepath:
        paths.add(os.path.abspath(bpy.data.filepath))
    return {path for path in paths if os.path.isfile(path)}


def _files_of_scene() -> list[str]:
    """The files that the open scene refers to: libraries, pictures, caches; without Blender's own,
    whose paths differ between machines."""
    paths: list[str] = bpy.utils.blend_paths(absolute=True, packed=False, local=False)
    folders = [bpy.utils.resource_path(kind) for kind in ("LOCAL", "SYSTEM")]
    of_blender = tuple(os.path.join(os.path.abspath(each), "") for each in folders if each)
    # missing files count, as they may appear later
    found = [os.path.abspath(path) for path in paths if not Path(path).is_dir()]
    return [path for path in found if not path.startswith(of_blender)]
