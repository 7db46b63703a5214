"""The driver of window sessions in Blender: one step per timer tick, with events and redraws.

A session is a script session_NAME.py that ends with `driver.play_session(steps())`, where `steps`
is a generator. The code up to a `yield` runs in one tick. A plain `yield` returns once the window
shows all changes: none of our work is deferred any more, every 3D view has been redrawn since, and
that redraw is on the screen. `yield 1` lets one tick pass, to look at something in progress; wait
for anything else with `wait_until`. A failed assert or any exception fails the session.
"""

import faulthandler
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import addon_utils
import bpy
import numpy as np
import screen
from view_mark import ViewMark

TICK_S = 0.05
#: Sleep of an idle Blender, which does not sleep by itself while events are simulated.
IDLE_SLEEP_S = 0.005
#: So long that slow machines pass; only an event that does not come fails.
TIMEOUT_S = 180.0
EXTENSION = "bl_ext.user_default.hairloom"
#: In commits, sessions skip cases that are like others.
IS_COMMIT = os.environ.get("HAIRLOOM_TIER") == "commit"

#: Modules of the extension that sessions use. Their paths are only here.
MODULES = {
    "card_object": "blender.cards.object",
    "child_process": "exchange.files.child_process",
    "curves": "blender.scene.curves",
    "diagnostics": "blender.preview.diagnostics",
    "engine": "blender.engine.engine",
    "export_check": "ui.operators_export_check",
    "fin_modifier": "blender.scene.fin_modifier",
    "gizmos": "ui.gizmos",
    "gpu_objects": "render.gpu_objects",
    "groom_file": "exchange.groom",
    "growing": "blender.strands.growing",
    "hair_file": "exchange.hair_file",
    "hair_scene": "blender.engine.hair_scene",
    "import_groom": "blender.strands.import_groom",
    "cached_picture": "render.cached_picture",
    "latest_job": "blender.base.latest_job",
    "long_work": "ui.long_work",
    "motion_flow": "motion_flow",
    "overlay": "blender.viewport.overlay",
    "playback": "blender.bakes.playback",
    "preferences": "ui.preferences",
    "presets": "blender.properties.presets",
    "previews": "blender.preview.previews",
    "registration": "registration",
    "self_test": "blender.setup.self_test",
    "softening": "blender.viewport.softening",
    "strand_pass": "render.strand_pass",
    "strands": "strands",
    "suspension": "blender.base.suspension",
    "tables": "shading.marschner.tables",
    "tressfx": "exchange.tressfx",
    "view_transform": "blender.viewport.view_transform",
    "views": "blender.viewport.views",
}


class Timers:
    """Blender's timers that call Hairloom, for all its deferred work. Blender has no list of
    them."""

    def __init__(self) -> None:
        self._seen: dict[Any, None] = {}
        self._register = bpy.app.timers.register
        bpy.app.timers.register = self._remember_and_register

    def _remember_and_register(self, function: Any, **settings: Any) -> None:
        self._seen[function] = None
        self._register(function, **settings)

    def pending(self) -> list[str]:
        """Timers that are still registered, except for the ticks of playing hair, and the draw of
        resting views, which waits for the end of those ticks.
        """
        return [
            f"{each.__module__}.{each.__qualname__}"
            for each in self._seen
            if getattr(each, "__module__", "").startswith(EXTENSION)
            and bpy.app.timers.is_registered(each)
            and not self._is_repeating(each)
        ]

    @staticmethod
    def _is_repeating(timer: Any) -> bool:
        jobs, is_played = hairloom_module("latest_job"), _is_animation_playing()
        if timer is hairloom_module("views")._catch_up:
            return is_played or "play" in jobs._steps
        return timer is jobs.run_steps and set(jobs._steps) == {"play"}


def _is_animation_playing() -> bool:
    """Whether Blender plays its animation in any window."""
    windows = bpy.context.window_manager.windows
    return any(each.screen.is_animation_playing for each in windows)


timers = Timers()
_view_mark = ViewMark()


def play_session(steps: Iterator[float | None], *, anti_aliasing: bool = False) -> None:
    """Play the session, print how it ended and quit Blender.

    Args:
        anti_aliasing: leave Blender's anti-aliasing on.
    """
    ticks = _ticks(steps)

    def tick() -> float | None:
        try:
            return TICK_S * next(ticks)
        except StopIteration:
            print("SESSION PASSED", flush=True)
            bpy.ops.wm.quit_blender()
        except BaseException:
            # An exception in a timer neither ends Blender nor changes its exit code: the runner
            # notices the missing closing line.
            traceback.print_exc()
            try:
                screenshot("failed")
            finally:
                bpy.ops.wm.quit_blender()
        return None

    # Otherwise Blender draws each view eight times; only first_light tests hair with it.
    bpy.context.preferences.system.viewport_aa = "8" if anti_aliasing else "OFF"
    faulthandler.enable()  # logs the lines of Python in a crash
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
    bpy.app.timers.register(_sleep, persistent=True)


def _sleep() -> float:
    """Sleep in each iteration of Blender's loop, which otherwise keeps a processor busy."""
    time.sleep(IDLE_SLEEP_S)
    return 0.0


def _ticks(steps: Iterator[float | None]) -> Iterator[float]:
    for wait in steps:
        if wait is None:
            yield from _wait_for_redraws()
        else:
            assert wait <= 1, "wait for what is asked by `yield` or `wait_until`, not for ticks"
            yield wait


def _wait_for_redraws() -> Iterator[float]:
    """Wait until the window shows all changes."""
    yield 1  # events first, and Blender's evaluation after them
    while True:
        yield from wait_until(lambda: not timers.pending(), lambda: f"deferred: {timers.pending()}")
        yield from wait_until(lambda: bpy.context.window is not None, "there is no window")
        _view_mark.draw_again()
        yield from wait_until(_view_mark.is_shown, "the 3D views are not drawn")
        if not timers.pending():
            return


def wait_until(condition: Callable[[], Any], message: str | Callable[[], str]) -> Iterator[float]:
    """Wait, tick by tick, until a condition holds."""
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(message if isinstance(message, str) else message())
        yield 1


def enable_extension() -> None:
    """Enable the installed extension, or fail; Blender itself only prints a failure."""
    assert addon_utils.enable(EXTENSION, default_set=True) is not None, f"{EXTENSION} fails"
    assert all(addon_utils.check(EXTENSION)), f"{EXTENSION} is not enabled"


def hairloom_module(name: str) -> Any:
    """A module of the enabled extension, by its name in MODULES."""
    return sys.modules[f"{EXTENSION}.addon.{MODULES[name]}"]


def screenshot_path(label: str) -> Path:
    folder, session = os.environ["HAIRLOOM_SCREENSHOTS"], os.environ["HAIRLOOM_SESSION"]
    return Path(folder) / f"{session}-{label}.png"


def screenshot(label: str) -> np.ndarray:
    """The current screen, also saved as a file: (height, width, 3), uint8, top row first.

    After a change, `yield` before the call.
    """
    pixels = _view_mark.without_marks(screen.pixels())
    screenshot_path(label).write_bytes(screen.png(pixels))
    return pixels
