"""Pictures of parts of the window: a region as far as it is used, a popup, some side by side."""

import os
import subprocess
from pathlib import Path

import bpy
import driver
import numpy as np
from artist import viewport

#: [pixels] space between columns; more than that of a row have changed where a popup has come; the
#: frame of an area
GAP, SOLID, EDGE = 6, 100, 8
GREY, COLOURS = "#303030", 200
#: a channel differs by more than this where there is something
SEEN = 8
#: how wide a picture of the whole window is drawn [pixels]
WIDTH = 800

#: names of the pictures that are kept
made: set[str] = set()


def crop(name, _area, window):
    """What a region shows, without the empty rest below."""
    screen = driver.screenshot(f"part_{name}")
    top = bpy.context.window.height - (window.y + window.height)
    pixels = pixels_of(screen)[top : top + window.height, window.x : window.x + window.width]
    inner = pixels[:-4, 4:-4]  # the border is of another colour
    rows = np.flatnonzero(np.abs(inner - inner[-1, 0]).max(axis=2).max(axis=1) > SEEN)
    assert len(rows), f"nothing is in the picture of {name}"
    assert rows[-1] < len(inner) - SEEN, f"{name} is cut off below"
    return cut(screen, window.x, top, window.width, rows[-1] + SEEN)


def changed_box(before, now):
    """Left, top, width and height of a popup in the view."""
    area = viewport()
    left, top = area.x + EDGE, bpy.context.window.height - (area.y + area.height) + EDGE
    right, bottom = left + area.width - 2 * EDGE, top + area.height - 2 * EDGE
    differs = np.abs(now - before).max(axis=2)[top:bottom, left:right] > SEEN
    rows, columns = (np.flatnonzero(differs.sum(axis=axis) > SOLID) for axis in (1, 0))
    assert len(rows) > SOLID, "no popup opens"
    return left + columns[0], top + rows[0], np.ptp(columns) + 1, np.ptp(rows) + 1


def pixels_of(screen):
    """(height, width, 3), 0 to 255, top row first; the window fills the screen."""
    window = bpy.context.window
    pixels = np.frombuffer(raw(screen), np.uint8).reshape(window.height, window.width, 3)
    return pixels.astype(int)


def raw(file):
    command = ["convert", str(file), "-depth", "8", "rgb:-"]
    return subprocess.run(command, check=True, capture_output=True).stdout


def cut(screen, left, top, width, height):
    part = screen.with_name(f"{screen.stem}-cut.png")
    box = f"{width}x{height}+{left}+{top}"
    subprocess.run(["convert", str(screen), "-crop", box, "+repage", str(part)], check=True)
    return part


def keep(name, files):
    """A picture of these beside each other, in as few colours as panels have; one of the whole
    window is narrower instead."""
    folder, session = os.environ["HAIRLOOM_SCREENSHOTS"], os.environ["HAIRLOOM_SESSION"]
    path = Path(folder) / f"{session}-panel_{name}.png"
    beside = ["-background", GREY, "-gravity", "north", "+smush", str(GAP), "-strip"]
    few = ["+dither", "-colors", str(COLOURS), f"png8:{path}"]
    if name == "window":
        few = ["-resize", f"{WIDTH}x", "-define", "png:compression-level=9", f"png24:{path}"]
    subprocess.run(["convert", *map(str, files), *beside, *few], check=True)
    made.add(name)
