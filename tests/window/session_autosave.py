"""Blender saves automatically while hair plays, and Esc stops hair wherever the mouse is."""

import sys
import time
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    click,
    look_from_front,
    new_head,
    open_our_sidebar,
    press,
    sidebar_button,
    wait_for_hair,
)
from driver import hairloom_module, wait_until

FOLDER = Path(bpy.app.tempdir)


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    files = bpy.context.preferences.filepaths
    files.use_auto_save_temporary_files, files.auto_save_time = True, 1  # minute, the shortest
    new_head(keeps_light=True)
    bpy.ops.hairloom.grow(strand_count=200, length=0.12)
    look_from_front(0.9)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(hairloom_module("previews").is_playing, "the Play button did nothing")
    bpy.ops.ed.undo_push(message="An edit")  # an unchanged file is not saved
    begun = time.time()
    yield from wait_until(lambda: autosaves(begun), "nothing is saved while hair plays")
    assert hairloom_module("previews").is_playing()
    print(f"autosaves while playing: {len(autosaves(begun))} in {time.time() - begun:.0f} s")
    yield from press("ESC")
    yield from wait_until(
        lambda: not hairloom_module("previews").is_playing(), "Esc does not stop it"
    )
    yield from wait_until(
        lambda: not hairloom_module("latest_job").is_scheduled("play"), "it ticks on"
    )


def autosaves(since):
    """Autosave files that Blender has written since then."""
    folders = {FOLDER, FOLDER.parent, Path(bpy.context.preferences.filepaths.temporary_directory)}
    found = (path for folder in folders for path in folder.glob("*autosave*.blend"))
    return [path for path in found if path.stat().st_mtime > since]


driver.play_session(steps())
