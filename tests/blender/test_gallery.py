"""The gallery shows every look, stage and kind of cards, by commands that are valid."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import gallery
import pytest

pytest.importorskip("bpy", reason="the command line runs inside Blender")

from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.command_line.job_options import settings_from_options

ALL = [picture for section in gallery.SECTIONS for picture in section.pictures]
#: size limits of a picture and of all pictures, so that the page loads fast
MOST_BYTES, MOST_BYTES_IN_ALL = 250_000, 4_000_000


def test_the_page_is_current() -> None:
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(), "run make docs"


def test_the_page_shows_each_picture_that_is_there_and_small() -> None:
    shown = re.findall(r"!\[[^\]]+\]\(images/gallery/([^)]+)\)", gallery.page())
    sizes = {path.name: path.stat().st_size for path in gallery.PICTURES.iterdir()}
    assert sorted(shown) == sorted(sizes), "run make gallery"
    assert max(sizes.values()) < MOST_BYTES
    assert sum(sizes.values()) < MOST_BYTES_IN_ALL


@pytest.mark.parametrize("picture", ALL, ids=lambda picture: picture.name)
def test_a_command_is_valid(picture: gallery.Picture) -> None:
    """Its options, presets, parameters and values are all known."""
    tool, *arguments = shlex.split(picture.command)
    options = command_line.parser().parse_args(arguments)
    assert tool == gallery.HEADLESS
    assert Path(options.output).stem == picture.name
    settings_from_options(options)


def test_every_preset_that_gives_a_look_is_shown() -> None:
    commands = "\n".join(picture.command for picture in ALL)
    folders = {"looks": "--preset looks/", "stage": "--stage ", "cards": "--preset cards/"}
    shown = {
        folder: set(re.findall(rf"{option}(\w+)", commands)) for folder, option in folders.items()
    }
    shipped = {
        folder: {path.stem for path in (gallery.PRESETS / folder).glob("*.json")}
        for folder in folders
    }
    assert shown == shipped


def test_every_hairstyle_of_a_head_is_shown() -> None:
    shown = {name for picture in ALL for name in re.findall(r"--style (\w+)", picture.options)}
    assert shown == {path.stem for path in gallery.STYLES.glob("*.npz")}
