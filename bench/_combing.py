"""A style of 20,000 children on the built-in head, combed as a brush does, and painted.

Times run, as in the window but without its drawing, from Blender's evaluation of the curves until
the snapshot for the next redraw has all strands, and until these have their own light. In the
window, a pause precedes the work of a thread, and its result is polled for; both delays are added.
"""

from __future__ import annotations

import time
from typing import Any
from unittest.mock import patch

import bpy
import numpy as np

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.base.latest_job import POLL_INTERVAL
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.scene.curves import curve_offsets, curve_points, set_points
from hairloom.addon.blender.sessions.session import Session

STRANDS, STROKES = 20_000, 7
#: how far the brush reaches [m], and how far it turns hair [rad]
RADIUS, TURN = 0.03, 0.2


def styled(style: str) -> Any:
    """A groom of this hairstyle, previewed with STRANDS children."""
    bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
    hair = bpy.context.object
    hair.data.hairloom.children.strand_count = STRANDS
    session = previews.session_of(hair)
    assert session is not None
    _catch_up(session)
    return hair


def combed(hair: Any) -> dict[str, float]:
    """Medians [ms] for a stroke: its first update, all strands, their light, and its undo."""
    first, rest, undo, light = [], [], [], []
    session, count = previews.session_of(hair), len(hair.data.curves)
    assert session is not None
    for stroke in range(STROKES):
        before, strands = curve_points(hair.data), session.rig.strands.points
        set_points(hair.data, _turned(hair, stroke * count // STROKES))
        first.append(_update())
        assert session.rig.strands.points is not strands, "the strands do not follow"
        if stroke % 2:
            set_points(hair.data, before)
            undo.append(_update())
        hair_ms, light_ms = _catch_up(session)
        rest.append(hair_ms)
        light.append(light_ms)
    return {
        "comb_ms": float(np.median(first)),
        "comb_undo_ms": float(np.median(undo)),
        "comb_all_ms": float(np.median(rest[::2])),
        "comb_light_ms": float(np.median(light[::2])),
    }


def painted(hair: Any) -> dict[str, float]:
    """Medians [ms] for a dab on the density of children: its first update, all strands, their
    light."""
    head, first, rest, light = hair.parent, [], [], []
    group = head.vertex_groups[hair.hairloom.children_density]
    session = previews.session_of(hair)
    assert session is not None
    positions = np.empty(3 * len(head.data.vertices), np.float32)
    head.data.vertices.foreach_get("co", positions)
    roots = session.source.strands.roots
    for dab in range(3):
        away = np.linalg.norm(positions.reshape(-1, 3) - roots[dab * 50], axis=1)
        strands = session.rig.strands.points
        group.add(np.flatnonzero(away < RADIUS).tolist(), 0.5, "REPLACE")
        head.data.update_tag()
        first.append(_update())
        assert session.rig.strands.points is not strands, "the children do not follow"
        hair_ms, light_ms = _catch_up(session)
        rest.append(hair_ms)
        light.append(light_ms)
    return {
        "paint_ms": float(np.median(first)),
        "paint_all_ms": float(np.median(rest)),
        "paint_light_ms": float(np.median(light)),
    }


def _update() -> float:
    began = time.perf_counter()
    bpy.context.view_layer.update()
    return 1000.0 * (time.perf_counter() - began)


def _catch_up(session: Session) -> tuple[float, float]:
    """Milliseconds until all strands are there, and until they have their own light."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    began = time.perf_counter()
    with patch.object(latest_job, "is_blocking", lambda: False):
        scene_events.catch_up(depsgraph)
    while session.is_pending and not session.is_lighting:
        session.take_made(depsgraph)
    hair = time.perf_counter() - began + scene_events.SETTLING_TIME + POLL_INTERVAL
    session.finish(depsgraph)
    light = time.perf_counter() - began + scene_events.SETTLING_TIME + 2.0 * POLL_INTERVAL
    return 1000.0 * hair, 1000.0 * light


def _turned(hair: Any, curve: int) -> np.ndarray:
    """Points of all curves, those around this one turned about Z, tips most; lengths are kept."""
    points, offsets = curve_points(hair.data), curve_offsets(hair.data)
    roots = points[offsets[:-1]]
    for near in np.flatnonzero(np.linalg.norm(roots - roots[curve], axis=1) < RADIUS):
        own = points[offsets[near] : offsets[near + 1]]
        step, angle = np.diff(own, axis=0), TURN * np.linspace(0.0, 1.0, len(own))[1:]
        x = step[:, 0] * np.cos(angle) - step[:, 1] * np.sin(angle)
        y = step[:, 0] * np.sin(angle) + step[:, 1] * np.cos(angle)
        own[1:] = own[0] + np.cumsum(np.stack([x, y, step[:, 2]], axis=1), axis=0)
    return points
