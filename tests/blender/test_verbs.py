"""Whatever an artist can do in the window, a farm can do with verbs."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="the buttons are Blender's operators")

import bpy

from hairloom.addon import registration
from hairloom.addon.blender.command_line.command_line import VERBS, parser, run
from hairloom.addon.blender.command_line.verb_docs import page

DOCS = Path(__file__).parents[2] / "docs"

#: buttons that act only on a view or a session and change no data
WINDOW_ONLY = {
    "show_problems",
    "help",
    "show_reports",
    "copy_reports",
    "preview",
    "cancel_build",
    "play",
    "pause",
    "reset",
    "stop",
    "measure",
    "fin_preview",
    "fin_reset",
    "choose_hairstyle",
    "show_settings",
    "show_export_check",
    # act on the selection in Edit Mode
    "card_width",
    "card_twist",
    "card_tile",
}


def operators() -> set[str]:
    names = [
        each.bl_idname for each in registration.CLASSES if issubclass(each, bpy.types.Operator)
    ]
    return {name.removeprefix("hairloom.") for name in names}


def test_every_button_has_a_verb_or_needs_a_window() -> None:
    done = [name for verb in VERBS for name in verb.operators]
    assert len(done) == len(set(done)), "two verbs do the work of one button"
    assert operators() - WINDOW_ONLY - set(done) == set(), "buttons without a verb"
    assert set(done) | WINDOW_ONLY <= operators(), "verbs of buttons that are not there"
    assert not WINDOW_ONLY & set(done)


def options_of(verb: str) -> list[argparse.Action]:
    (verbs,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    actions: list[argparse.Action] = verbs.choices[verb]._actions
    return actions


@pytest.mark.parametrize("verb", [verb.name for verb in VERBS])
def test_the_help_of_a_verb_is_whole(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([verb, "--help"]) == 0
    text = capsys.readouterr().out
    for action in options_of(verb):
        assert action.help, f"{action.dest} has no help"
        for name in action.option_strings:
            assert name in text
    (about,) = (each.summary for each in VERBS if each.name == verb)
    assert about.endswith(".") and " ".join(text.split()).count(about) == 1


@pytest.mark.parametrize("verb", [verb.name for verb in VERBS])
def test_every_verb_reports(verb: str) -> None:
    names = {name for action in options_of(verb) for name in action.option_strings}
    assert {"--report", "--progress", "--help", "--scene"} <= names
    assert ("--skip-existing" in names) == ("--output" in names)


def test_the_page_of_verbs_is_current() -> None:
    assert (DOCS / "verbs.md").read_text(encoding="utf-8") == page(VERBS), "run make docs"


def test_every_option_is_on_the_page_of_verbs() -> None:
    text = page(VERBS)
    for verb in VERBS:
        assert f"## `{verb.name}`" in text
        for action in options_of(verb.name):
            for name in set(action.option_strings) - {"-h", "--help"}:
                assert f"`{name}" in text, f"{verb.name} {name}"


def test_the_guide_names_every_verb_and_only_existing_options() -> None:
    text = (DOCS / "command-line.md").read_text(encoding="utf-8")
    for verb in VERBS:
        assert f"| `{verb.name}` |" in text
    known = {n for verb in VERBS for action in options_of(verb.name) for n in action.option_strings}
    blenders_own = {"--command", "--help"}
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)) <= known | blenders_own


@pytest.mark.parametrize(
    ("option", "suffix"),
    [
        ("--scene", ".blend"),
        ("--groom", ".tfx"),
        ("--groom", ".abc"),
        ("--head", ".obj"),
        ("--preset", ".json"),
        ("--stage", ".json"),
        ("--bake", ""),
    ],
)
def test_a_name_that_no_file_can_have_is_named(
    option: str, suffix: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """pathlib raises an error for file names longer than 255 bytes."""
    name, picture = "a" * 300 + suffix, tmp_path / "still.png"
    assert run(["render", option, name, "--output", str(picture)]) == 1
    (message,) = [line for line in capfd.readouterr().err.splitlines() if "hairloom:" in line]
    assert name in message
    assert not picture.exists()


def test_a_misspelt_option_gets_the_usage_of_its_verb_and_a_suggestion(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["render", "--prest", "looks/blond", "--output", "still.png"]) == 2
    message = capsys.readouterr().err
    assert message.startswith("usage: hairloom render ")
    assert message.endswith("--prest looks/blond. Did you mean --preset?\n")
    assert run(["simulate", "--object", "Hair", "--output", "still.png"]) == 2
    assert capsys.readouterr().err.endswith("--object Hair\n"), "nothing else is meant"


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (["grow", "--head", "cube", "--output", "a.blend"], "Did you mean Cube? "),
        (["render", "--head", "Cubee", "--output", "a.png"], "Did you mean Cube? "),
        (["render", "--set", "dynamic.damping=2", "--output", "a.png"], "Did you mean dynamics"),
    ],
)
def test_a_misspelt_name_gets_a_suggestion(
    arguments: list[str], remedy: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert run(arguments) == 1
    assert remedy in capsys.readouterr().err


def test_a_look_is_no_stage(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "still.png"
    assert run(["render", "--stage", "looks/blond", "--output", str(picture)]) == 1
    assert "--stage looks/blond: this preset has no settings of the stage" in capfd.readouterr().err
    assert not picture.exists()
