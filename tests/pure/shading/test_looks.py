"""The shipped looks: complete, and each with its own picture."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.field import NAME_KINDS
from hairloom.addon.params.preset import read_any_preset
from hairloom.addon.shading.settings import ShadingSettings

FOLDER = Path(__file__).parents[3] / "presets" / "looks"
LOOKS = sorted(FOLDER.glob("*.json"))
ASKED_FOR = ["black", "brown", "blond", "red", "grey", "dyed", "wet", "under_water", "stylised"]
#: pictures by `make pictures`: side [pixels] and largest size [bytes]
SIDE, LARGEST = 192, 45_000

every_look = pytest.mark.parametrize("path", LOOKS, ids=lambda path: path.stem)


def test_all_that_were_asked_for_are_there() -> None:
    assert {path.stem for path in LOOKS} >= set(ASKED_FOR)


@every_look
def test_a_look_names_every_value(path: Path) -> None:
    """So a look gives the same result after any other settings, also when defaults change. It has
    no names of painted attributes, which it leaves alone.
    """
    named = set(json.loads(path.read_text(encoding="utf-8"))["values"])
    assert named == {
        each.name for each in ShadingSettings.parameters() if each.kind not in NAME_KINDS
    }


@every_look
def test_a_look_has_a_small_square_picture(path: Path) -> None:
    picture = path.with_suffix(".png").read_bytes()
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", picture[16:24]) == (SIDE, SIDE)
    assert len(picture) < LARGEST


def test_looks_differ_in_both_models() -> None:
    """A look sets the values of both models, so that it keeps its character when the model
    changes."""
    settings = [read_any_preset(path, ALL_SETTINGS).settings for path in LOOKS]
    for asked in (("primary_strength",), ("strength_r", "width_r")):
        names = ("base_color", "wetness", *asked)
        different = {tuple(getattr(look, name) for name in names) for look in settings}
        assert len(different) == len(LOOKS)


def test_no_picture_lies_there_without_a_look() -> None:
    assert {path.stem for path in FOLDER.glob("*.png")} == {path.stem for path in LOOKS}
