"""Pictures of parts of the window: the used part of a region, a popup, several side by side."""

import subprocess

import bpy
import driver
import numpy as np
import screen
from artist import viewport

#: [pixels] space between columns; changed pixels in a row of a popup, at least; frame of an area
COLUMN_GAP, MIN_CHANGED_PIXELS, AREA_EDGE = 6, 100, 8
GREY, COLOUR_COUNT = "#303030", 200
#: a channel of content differs by more than this from the background
MIN_DIFFERENCE = 8
#: width of a picture of the whole window [pixels]
WINDOW_PICTURE_WIDTH = 800

#: names of saved pictures
saved_names: set[str] = set()


def crop(name, _area, window):
    """The content of a region, without the empty rest below."""
    whole = driver.screenshot(f"part_{name}")
    top = bpy.context.window.height - (window.y + window.height)
    part = whole[top : top + window.height, window.x : window.x + window.width]
    inner = part[:-4, 4:-4].astype(int)  # the border is of another colour
    rows = np.flatnonzero(np.abs(inner - inner[-1, 0]).max(axis=2).max(axis=1) > MIN_DIFFERENCE)
    assert len(rows), f"nothing is in the picture of {name}"
    assert rows[-1] < len(inner) - MIN_DIFFERENCE, f"{name} is cut off below"
    return part[: rows[-1] + MIN_DIFFERENCE]


def changed_box(before, now):
    """The rectangle of a popup in the view, as slices of rows and columns."""
    area = viewport()
    left, top = area.x + AREA_EDGE, bpy.context.window.height - (area.y + area.height) + AREA_EDGE
    right, bottom = left + area.width - 2 * AREA_EDGE, top + area.height - 2 * AREA_EDGE
    differs = np.abs(now.astype(int) - before).max(axis=2)[top:bottom, left:right] > MIN_DIFFERENCE
    rows, columns = (np.flatnonzero(differs.sum(axis=axis) > MIN_CHANGED_PIXELS) for axis in (1, 0))
    assert len(rows) > MIN_CHANGED_PIXELS, "no popup opens"
    return np.s_[top + rows[0] : top + rows[-1] + 1, left + columns[0] : left + columns[-1] + 1]


def save_pictures(name, pictures):
    """Save a picture of these side by side, with a small palette; one of the whole window is also
    scaled down."""
    files = [driver.screenshot_path(f"part_{name}-{number}") for number in range(len(pictures))]
    for file, each in zip(files, pictures, strict=True):
        file.write_bytes(screen.png(each))
    path = driver.screenshot_path(f"panel_{name}")
    beside = ["-background", GREY, "-gravity", "north", "+smush", str(COLUMN_GAP), "-strip"]
    narrower = ["-resize", f"{WINDOW_PICTURE_WIDTH}x"] if name == "window" else []
    few = ["+dither", "-colors", str(COLOUR_COUNT), f"png8:{path}"]
    subprocess.run(["convert", *map(str, files), *beside, *narrower, *few], check=True)
    saved_names.add(name)
