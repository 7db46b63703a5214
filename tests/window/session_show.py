"""Pictures of a groom for others: a turntable in the window, one that Esc ends, a sheet."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
from artist import look_from_front, new_head, open_our_sidebar, press
from driver import hairloom_module, wait_until

STRANDS, FRAMES = 300, 5
FOLDER = Path(bpy.app.tempdir) / "shown"
SMALL = {"size": 64, "samples": 1}


def running_label():
    return hairloom_module("long_work").running_label()


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    new_head(keeps_light=True)
    assert bpy.ops.hairloom.grow(strand_count=STRANDS, length=0.12) == {"FINISHED"}
    bpy.context.object.name = "Hair"
    look_from_front(0.9)
    yield from open_our_sidebar()
    yield from a_whole_turn()
    yield from a_cancelled_one()
    yield from a_sheet()


def turntable(**options):
    started = bpy.ops.hairloom.turntable(
        "INVOKE_DEFAULT", directory=str(FOLDER), **SMALL, **options
    )
    assert started == {"RUNNING_MODAL"}
    assert not bpy.ops.hairloom.turntable.poll()


def a_whole_turn():
    """Pictures and a video, while the window stays responsive."""
    turntable(frames=FRAMES)
    yield from wait_until(lambda: not running_label(), "the turntable does not end")
    names = sorted(path.name for path in FOLDER.iterdir())
    assert names == ["Hair.mp4", *(f"Hair_000{n}.png" for n in range(1, FRAMES + 1))], names
    clip = bpy.data.movieclips.load(str(FOLDER / "Hair.mp4"))
    assert clip.frame_duration == FRAMES
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]
    driver.screenshot("turned")


def a_cancelled_one():
    """Esc ends it between two pictures; those of the turntable before stay as they are."""
    before = {path.name: path.stat().st_mtime_ns for path in FOLDER.iterdir()}
    turntable(frames=2000)
    third = ".Hair_0001.hl-*/*_0003.png"  # the folder until the last one is there
    yield from wait_until(lambda: any(FOLDER.glob(third)), "no picture is drawn")
    assert running_label() == "Turntable"
    driver.screenshot("turning")
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel the turntable")
    assert {path.name: path.stat().st_mtime_ns for path in FOLDER.iterdir()} == before
    assert bpy.ops.hairloom.turntable.poll()


def a_sheet():
    path = FOLDER / "sheet.png"
    assert bpy.ops.hairloom.contact_sheet(filepath=str(path), **SMALL) == {"FINISHED"}
    assert path.is_file()
    yield 1


driver.play_session(steps())
