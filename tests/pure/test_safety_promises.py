"""A test holds each sentence in which pages or the changelog promise something about safety."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from extension_loader import REPOSITORY

TESTS = REPOSITORY / "tests"
PAGES = (
    REPOSITORY / "CHANGELOG.md",
    REPOSITORY / "docs" / "farm" / "README.md",
    *sorted(each for each in (REPOSITORY / "docs").glob("*.md") if each.name != "glossary.md"),
)
#: Words of sentences that promise something about files, Esc, kills or crashes.
SAFETY = re.compile(
    r"Esc cancels|Esc ends the reading|half-written|whole or not|was killed|crash|file was in use"
    r"|that is in use|one before as it was|stays as it was|partial (files|result)|own process"
    r"|never mix their|[Cc]ancelling with|is saved in that case|automatically while|never fills"
    r"|never write over|files of yours|that nothing can be written to|run no code|comes back into"
)
LONG_WORK = "window/session_long_work.py::from_a_dialog"
CRASHES = "pure/exchange/test_subprocess_reader.py::test_every_bad_end_is_a_message"
GPU = "blender/test_no_gpu.py::test_verbs_that_draw_report_a_missing_gpu_and_write_nothing"
CANCELLED_TURN = "blender/test_turntable.py::test_a_cancelled_turntable_leaves_no_files"
CANCELLED_CARDS = (
    "blender/test_card_object.py::test_cards_that_are_cancelled_leave_the_scene_as_it_was"
)
#: a part of a sentence -> the test that holds it
PROMISES = {
    "Alembic or USD file that crashes": CRASHES,
    "Esc ends the reading": "blender/test_strand_import_steps.py"
    "::test_esc_half_way_leaves_no_process_no_file_and_no_object",
    "Long operations show their progress, and Esc cancels them": LONG_WORK,
    "No half-written files": "pure/exchange/test_fuzz.py"
    "::test_a_killed_writer_leaves_the_old_file_or_the_new_one",
    "saves automatically while hair plays": "window/session_autosave.py::steps",
    "Two Blenders never mix frames": "blender/test_bake.py"
    "::test_two_writers_of_one_folder_never_mix_their_frames",
    "never fills a copy of the cards": "blender/test_card_object.py"
    "::test_a_copy_of_the_cards_is_left_alone",
    "A file that is in use keeps its content": "pure/exchange/test_windows_rules.py"
    "::test_a_file_that_is_open_stays_and_the_new_ones_are_kept",
    "Exports keep files of yours": "blender/test_card_files.py"
    "::test_files_of_an_artist_are_kept_and_own_ones_replaced",
    "Verbs never write over a file that they read": "blender/test_output_checks.py"
    "::test_outputs_that_would_overwrite_inputs_are_refused_before_any_work",
    "named before the work begins": "blender/test_output_checks.py"
    "::test_outputs_that_would_overwrite_inputs_are_refused_before_any_work",
    "Hair whose baked copy was deleted": "blender/test_baked_copy.py"
    "::test_a_file_is_never_left_without_hair_in_renders",
    "run no code of the current folder": "pure/exchange/test_subprocess_reader.py"
    "::test_no_code_of_the_current_folder_or_the_environment_is_run",
    "Foreign USD files are never opened": "pure/test_safety_promises.py"
    "::test_one_module_opens_usd_files",
    "on a full disk stays as it was": "blender/test_scene_files.py"
    "::test_a_full_disk_leaves_the_previous_scene",
    "Turntables are replaced as a whole": "blender/test_turntable.py"
    "::test_a_picture_that_another_program_holds_keeps_all_and_the_new_ones",
    "verbs that draw say so instead of crashing": GPU,
    "before Blender itself would crash": "blender/test_no_gpu.py"
    "::test_the_engine_reports_that_there_is_no_gpu",
    "Esc cancels and leaves everything unchanged": CANCELLED_CARDS,
    "Esc cancels it and leaves the hair as it was": "blender/test_settle.py"
    "::test_settling_changes_nothing_until_it_ends",
    "say what goes on, and Esc cancels it": "window/session_jobs.py::cloth_is_played",
    "Cancelling with Esc or Ctrl-C": "window/session_long_work.py::cards_in_motion",
    "Esc cancels a turntable": CANCELLED_TURN,
    "After an error or Ctrl-C no partial files": "blender/test_tasks.py"
    "::test_an_interrupted_task_leaves_nothing",
    "if the job was killed": "blender/test_tasks.py"
    "::test_the_report_of_a_task_that_is_killed_says_so",
    "It is there whole or not at all": "blender/test_bake.py"
    "::test_cancelling_keeps_the_previous_bake",
    "leaves the one before as it was": "blender/test_bake.py"
    "::test_a_bake_that_fails_says_in_which_frame_and_leaves_nothing",
    "never mix their frames": "blender/test_bake.py"
    "::test_two_writers_of_one_folder_never_mix_their_frames",
    "which can crash their library": CRASHES,
    "damaged ones can crash their libraries": CRASHES,
    "the status bar shows the progress, and Esc cancels": LONG_WORK,
    "nothing is saved in that case": "blender/test_import_job.py"
    "::test_one_bad_file_keeps_the_scene_from_being_written",
    "while you experiment; Esc cancels": CANCELLED_CARDS,
    "Esc cancels them and leaves everything unchanged": LONG_WORK,
    "It never leaves a partial result": "pure/exchange/test_fuzz.py"
    "::test_a_killed_writer_leaves_the_old_file_or_the_new_one",
}


def text_of(page: Path) -> str:
    return " ".join(page.read_text(encoding="utf-8").split())


def unheld(text: str) -> list[str]:
    """Sentences of this text that promise something about safety that no test holds."""
    sentences = re.split(r"(?<=[.!?|]) ", text)
    return [
        sentence
        for sentence in sentences
        if SAFETY.search(sentence) and not any(part in sentence for part in PROMISES)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_promise_is_held(page: Path) -> None:
    assert unheld(text_of(page)) == [], "name the test that holds it"


def test_what_holds_a_promise_is_there() -> None:
    texts = " ".join(map(text_of, PAGES))
    assert [part for part in PROMISES if part not in texts] == [], "nobody promises that"
    for test in set(PROMISES.values()):
        file, _, name = test.partition("::")
        code = (TESTS / file).read_text(encoding="utf-8")
        assert re.search(rf"^def {name}\(", code, re.MULTILINE), test


def test_a_promise_that_nobody_holds_is_seen() -> None:
    assert unheld("All is fine. Files are there whole or not at all. Good.") == [
        "Files are there whole or not at all."
    ]


def test_one_module_opens_usd_files() -> None:
    """Only the reader that runs in another process opens foreign files. Writers make USD in memory,
    except for cards, which open the file that Blender's exporter has just written."""
    opens = re.compile(r"(Stage|Layer)\.(Open|FindOrOpen|OpenAsAnonymous)\w*\(")
    files = (REPOSITORY / "addon").rglob("*.py")
    found = sorted(each.name for each in files if opens.search(each.read_text(encoding="utf-8")))
    assert found == ["usd_levels.py", "usd_reader.py"]
