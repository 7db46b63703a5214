"""Verbs of the command line: their functions, options and outputs."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .job_options import (
    add_farm_options,
    add_hair_options,
    add_output_option,
    add_save_option,
    add_scene_option,
    add_settings_options,
)
from .job_steps import Job

SCENE_OUTPUT = "scene to write (.blend)"


def no_options(_: argparse.ArgumentParser) -> None:
    """The options of a verb that has none of its own."""


@dataclass(frozen=True)
class Verb:
    """A verb; it is defined at the end of the file with its function.

    run: does the work; the first line of its docstring is the help.
    add_options: adds the options that only this verb has.
    output: the help of --output; "" for a verb without one.
    suffix: of the file of --output; "" if the verb checks it.
    writes_folder: whether --output is a folder.
    default_output: where it writes without --output.
    needs_output: whether --output must be given.
    takes_hair: whether it works on hair of --groom, --head and --collider.
    takes_several: whether --groom can be repeated, and all hair of a scene is used by default.
    needs_head: whether it refuses hair without a head.
    takes_settings: whether it has --set and --preset.
    opens_scene: whether it has --scene.
    saves_scene: whether it changes the scene, which is saved as --output or, with --save, over its
        own file.
    operators: names of the operators whose work it does.
    """

    name: str
    run: Callable[[Job], None]
    add_options: Callable[[argparse.ArgumentParser], None] = no_options
    output: str = ""
    suffix: str = ""
    writes_folder: bool = False
    default_output: Path | None = None
    needs_output: bool = True
    takes_hair: bool = True
    takes_several: bool = False
    needs_head: bool = False
    takes_settings: bool = True
    opens_scene: bool = True
    saves_scene: bool = False
    operators: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        return (self.run.__doc__ or "").strip().splitlines()[0]

    def add_all_options(self, parser: argparse.ArgumentParser) -> None:
        """Add all options in the order of --help: inputs, output, its own, settings, farms."""
        if self.opens_scene:
            add_scene_option(parser)
        output, is_needed = self.output, self.needs_output and self.default_output is None
        if self.saves_scene:
            add_save_option(parser)
            output, is_needed = SCENE_OUTPUT, False
        if output:
            add_output_option(parser, output, self.default_output, needed=is_needed)
        if self.takes_hair:
            add_hair_options(parser, takes_several=self.takes_several)
        self.add_options(parser)
        if self.takes_settings:
            add_settings_options(parser)
        add_farm_options(parser, can_skip=bool(output))
