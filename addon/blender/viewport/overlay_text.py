"""Counts of what is drawn, as text in a corner of a 3D view, with a graph of frame times above."""

from __future__ import annotations

from typing import Any

import blf
import gpu
import numpy as np

from ...arrays import Floats
from ...render import gpu_objects
from ...render.strand_pass import Statistics
from ..sessions.measures import PARTS, FrameTimes

#: Distance from the edges [pixels at UI scale 1], and line spacing as a factor of the font size.
_MARGIN, _LINE = 12.0, 1.5
_OF_CARDS = ("cards", "triangles", "vertices")
_FONT = 0  # Blender's own
#: A graph: width and height [pixels at UI scale 1], its smallest range [ms], and the colours of the
#: parts of a frame and of the line at 1/24 s.
_WIDTH, _HEIGHT, _FULL = 180.0, 40.0, 50.0
_COLORS = {"simulation": (0.3, 0.7, 1.0, 0.95), "drawing": (1.0, 0.65, 0.2, 0.95)}
_RULE = (1.0, 1.0, 1.0, 0.25)


def counts_line(name: str, guide_count: int, strand_count: int, drawn: Statistics) -> str:
    """A line such as "Hairloom Hair   guides 762   strands 4,095 of 4,857   pieces 61,425
    vertices 131,040"."""
    counts = (
        f"guides {guide_count:,}",
        f"strands {drawn.strands:,} of {strand_count:,}",
        f"pieces {drawn.pieces:,}",
        f"vertices {drawn.vertices:,}",
    )
    return "   ".join((f"Hairloom {name}", *counts))


def card_counts_line(name: str, guide_count: int, drawn: tuple[int, ...]) -> str:
    """A line such as "Hairloom Hair   guides 762   cards 800   triangles 9,600   vertices 13,200".

    Args:
        drawn: cards, triangles and vertices.
    """
    counts = (f"{kind} {n:,}" for kind, n in zip(_OF_CARDS, drawn, strict=True))
    return "   ".join((f"Hairloom {name}", f"guides {guide_count:,}", *counts))


def write_lines(context: Any, lines: list[str]) -> None:
    """Write into the view's lower left corner, which Blender leaves free."""
    size, left, bottom = _corner(context)
    blf.size(_FONT, size)
    blf.color(_FONT, *context.preferences.themes[0].view_3d.space.text_hi, 1.0)
    blf.enable(_FONT, blf.SHADOW)
    try:
        blf.shadow(_FONT, 5, 0.0, 0.0, 0.0, 0.8)
        blf.shadow_offset(_FONT, 1, -1)
        for index, line in enumerate(reversed(lines)):
            blf.position(_FONT, left, bottom + index * _LINE * size, 0.0)
            blf.draw(_FONT, line)
    finally:
        blf.disable(_FONT, blf.SHADOW)


def _corner(context: Any) -> tuple[float, float, float]:
    """Font size, and left and bottom edge of the text [pixels]."""
    system = context.preferences.system
    size = context.preferences.ui_styles[0].widget.points * system.ui_scale
    left, bottom = free_corner(context.area, context.region)
    margin = _MARGIN * system.ui_scale
    return size, left + margin, bottom + margin


def draw_graphs(context: Any, times: list[FrameTimes], line_count: int) -> None:
    """The milliseconds of the last frames of each groom, side by side above the lines."""
    size, left, bottom = _corner(context)
    scale = context.preferences.system.ui_scale
    bottom += line_count * _LINE * size
    for each in times:
        histories = {part: each.history(part) for part in PARTS}
        if max(map(len, histories.values())) < 2:
            continue
        full = max(_FULL, *(max(history, default=0.0) for history in histories.values()))
        place = np.array([left, bottom]), np.array([_WIDTH, _HEIGHT]) * scale
        _draw(_RULE, graph_lines([1000.0 / 24.0] * 2, full, *place))
        for part, history in histories.items():
            _draw(_COLORS[part], graph_lines(history, full, *place))
        left += (_WIDTH + _MARGIN) * scale


def graph_lines(history: list[float], full: float, corner: Floats, extent: Floats) -> Floats:
    """Values from left to right as lines, (2n, 2) [pixels]; the value `full` is at the top."""
    if len(history) < 2:
        return np.zeros((0, 2))
    along = np.linspace(0.0, 1.0, len(history))
    points = corner + np.stack([along, np.array(history) / full], axis=1) * extent
    return np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 2)


def _draw(color: tuple[float, float, float, float], points: Floats) -> None:
    if not len(points):
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    vertices = gpu_objects.vertex_buffer({"pos": points})
    blend = gpu.state.blend_get()
    gpu.state.blend_set("ALPHA")
    try:
        shader.bind()
        shader.uniform_float("color", color)
        gpu_objects.batch("LINES", vertices).draw(shader)
    finally:
        gpu.state.blend_set(blend)


def free_corner(area: Any, region: Any) -> tuple[int, int]:
    """The lower left corner (x, y) [pixels of the region] of the area that toolbars, shelves and
    the panel of the last operation leave free where they overlap the view."""
    left = bottom = 0
    for other in area.regions:
        if other.type == "WINDOW" or min(other.width, other.height) <= 1:
            continue
        right, top = other.x + other.width - region.x, other.y + other.height - region.y
        if right <= 0 or top <= 0 or other.x >= region.x + region.width:
            continue  # beside the view
        if other.alignment == "LEFT":
            left = max(left, right)
        elif other.alignment == "BOTTOM" or other.type == "HUD":
            bottom = max(bottom, top)
    return left, bottom
