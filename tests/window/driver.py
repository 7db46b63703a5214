"""How a window session drives Blender: one step a timer tick, so that events and redraws happen.

A session is a script session_NAME.py that ends with `driver.play(steps())`, where `steps` is a
generator: what stands before a `yield` runs in one tick, Blender redraws, the next tick goes on.
`yield 5` lets five ticks pass. A failed assert or any exception fails the session.
"""

import faulthandler
import os
import subprocess
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import addon_utils
import bpy

TICK_S = 0.1
EXTENSION = "bl_ext.user_default.hairloom"


def play(steps: Iterator[int | None]) -> None:
    """Plays the session, says how it ended and quits Blender."""

    def tick() -> float | None:
        try:
            return TICK_S * (next(steps) or 1)
        except StopIteration:
            print("SESSION PASSED", flush=True)
            bpy.ops.wm.quit_blender()
        except BaseException:
            # An exception in a timer neither ends Blender nor changes its exit code: the missing
            # closing line is what tells the runner.
            traceback.print_exc()
            try:
                screenshot("failed")
            finally:
                bpy.ops.wm.quit_blender()
        return None

    faulthandler.enable()  # of a crash the log tells the lines of Python as well
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)


def enable_extension() -> None:
    """Enables the installed extension; Blender itself only prints when that goes wrong."""
    assert addon_utils.enable(EXTENSION, default_set=True) is not None, f"{EXTENSION} fails"
    assert all(addon_utils.check(EXTENSION)), f"{EXTENSION} is not enabled"


def of_hairloom(module: str) -> Any:
    """A module of the enabled extension, such as "blender.preview.live"."""
    return sys.modules[f"{EXTENSION}.addon.{module}"]


def screenshot(label: str) -> Path:
    """A picture of the whole screen, taken now: let some ticks pass after a change before it."""
    folder, session = os.environ["HAIRLOOM_SCREENSHOTS"], os.environ["HAIRLOOM_SESSION"]
    path = Path(folder) / f"{session}-{label}.png"
    subprocess.run(["import", "-window", "root", str(path)], check=True)
    return path
