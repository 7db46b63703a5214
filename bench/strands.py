"""How well all drawn strands keep their lengths and shapes, and stay out of the head.

Sintel, the TressFX ponytail, the built-in groom, and 8,000 coils of 20 turns, with default settings
and without children, which would hide the curves. Two seconds of the demo's shake at 24 frames a
second, and of a shake of 5 Hz and 3.1 m/s at 60. Each strand counts by its worst frame. Depths are
distances from the mesh's triangles, of points inside the mesh that are outside at rest, scaled as
if the hair's median length were 25 cm: grooms come in any unit. So are jumps: changes, from one
frame to the next, in the displacement that leading out adds to where strands ride. A jump is a flip
if it exceeds the same limit within one of 16 parts of the way between the two frames; otherwise the
motion is steady. It is a flip of leading out if the ridden strand does not jump in that part.

Cards of Sintel's hair that ride on the guides in the demo's shake: how deep vertices are that are
outside at rest, and how many cards have any deeper than a millimetre; how much deeper the others
are than at rest; by how much cards change their lengths, along their middles, and rows their
widths; how far rows fold; and how many cards jump by leading out, as for strands.

For the cost, with Sintel's hair, see `_strands_cost`.

Exit code 1: a limit is missed.

make bench NAME=strands
tools/bench.py strands sintel coil       some grooms
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from _report import report, start
from _sight_grooms import GROOMS, Pair, rig_of
from _strands_cost import cost_figures

from hairloom.addon import motion_flow
from hairloom.addon.arrays import Floats, Ints, piece_starts
from hairloom.addon.blender.colliders.fields import field_of
from hairloom.addon.blender.command_line.simulate_job import shake_matrix
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.card_flow import bound_cards, card_build_steps, cards_at
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.follow import CardBinding
from hairloom.addon.cards.sort import card_of_vertex
from hairloom.addon.cards.steps import result_of
from hairloom.addon.dynamics.colliders import Collider, PosedCollider
from hairloom.addon.dynamics.colliders.signed_distance import signed_distance
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.dynamics.measure import length_changes
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.motion_flow import Motion
from hairloom.addon.params import SettingsMap
from hairloom.addon.refine.lead_out import NO_LED_OUT, LedOut
from hairloom.addon.rig_flow import MotionStart, Pose, Rig, SimulatedSolids
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.arc_length import segment_lengths, strand_lengths
from hairloom.addon.strands.closest_point import ClosestPointSearch

REFERENCE = "strands at rest, and the triangles of the head"
SECONDS, FPS, FAST_FPS = 2.0, 24.0, 60.0
MEDIAN_LENGTH = 0.25  # [m]
JUMP = 0.025  # [m], visible change in a frame of what leading out adds
#: flips are looked for once in this many frames, in this many parts of the way to the next
FLIPS_EVERY, PARTS = 6, 16
GRAVITY = np.array([0.0, 0.0, -9.81])
#: number, turns, radius and length [m] of coils; points of each before preparation
COILS, TURNS, COIL_RADIUS, COIL_LENGTH, COIL_POINTS = 8000, 20, 0.004, 0.15, 400
#: figure -> upper limit, and lower limit
MAX_LIMITS = {
    "length_p99_percent": 0.2,
    "length_worst_percent": 1.0,
    "segments_worst_percent": 2.0,
    "depth_worst_mm": 0.5,
    "strands_inside_percent": 0.0,
    "depth_fast_worst_mm": 1.0,
    "card_deepest_mm": 0.5,
    "cards_deep_percent": 0.0,
    "card_deeper_than_at_rest_mm": 0.5,
    "card_length_p99_percent": 0.2,
    "card_length_worst_percent": 1.0,
    "card_cost_ratio": 3.0,
    "rigid_turn_error": 1.0e-5,
    "rest_error": 0.0,
    "coil_radius_error_percent": 2.0,
    "numpy_cost_ratio": 3.0,
    "compute_cost_ratio": 2.0,
}
MIN_LIMITS = {"coil_length_kept": 0.995}


def coils() -> Pair:
    """Coils that stand straight out of the built-in head's scalp."""
    strands, head = GROOMS["built_in"]()
    assert head is not None
    surface = built_in_head().surface
    roots = strands.roots[np.linspace(0, strands.strand_count - 1, COILS).astype(int)]
    outward = roots - surface.positions.mean(axis=0)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    across = np.cross(outward, [0.3, 0.2, 0.9])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    other = np.cross(outward, across)
    along = np.linspace(0.0, 1.0, COIL_POINTS)[None, :, None]
    angle = 2.0 * np.pi * TURNS * along
    wide = COIL_RADIUS * np.minimum(1.0, 20.0 * along)
    grid = roots[:, None] + COIL_LENGTH * along * outward[:, None]
    grid = grid + wide * (np.cos(angle) * across[:, None] + np.sin(angle) * other[:, None])
    count = COILS * COIL_POINTS
    offsets = np.arange(COILS + 1) * COIL_POINTS
    return StrandSet(grid.reshape(-1, 3), offsets, np.full(count, 4e-5), np.zeros(COILS)), head


def shake_at(time: float, centre: Floats) -> Floats:
    return shake_matrix(centre, time)


def fast_shake_at(time: float, _centre: Floats) -> Floats:
    matrix = np.eye(4)
    matrix[0, 3] = 0.1 * np.sin(np.pi * min(time, 0.5)) ** 2 * np.sin(10.0 * np.pi * time)
    return matrix


def played(
    rig: Rig, collider: Collider, shake: Any, fps: float
) -> Iterator[tuple[Motion, Floats, Floats, LedOut]]:
    """The motion in each frame, the head's matrix, all strands, and those that were led out."""
    assert rig.head is not None
    centre = rig.head.positions.mean(axis=0).astype(np.float64)
    motion = motion_flow.begin(rig, rig.rest_pose)
    earlier, before, led = None, np.eye(4), NO_LED_OUT
    for frame in range(1, round(SECONDS * fps) + 1):
        matrix = shake(frame / fps, centre)
        posed = (PosedCollider(collider, before, matrix, earlier),)
        motion = motion_flow.advance(
            rig,
            motion,
            motion_flow.FrameInput(
                pose_of(rig, matrix), posed, DynamicsSettings(), GRAVITY, 1.0 / fps
            ),
            led,
        )
        earlier, before = before, matrix
        points, led = motion_flow.strands_and_led(rig, motion)
        yield motion, matrix, points, led


def pose_of(rig: Rig, matrix: Floats) -> Pose:
    assert rig.head is not None
    head = rig.head.positions @ matrix[:3, :3].T + matrix[:3, 3]
    return Pose(head.astype(np.float32), matrix)


def shaken(rig: Rig, shake: Any, fps: float) -> dict[str, float]:
    """Figures of all strands, each by its worst frame."""
    assert rig.head is not None
    collider = field_of(rig.head, DynamicsSettings(), place="head")
    search = ClosestPointSearch(rig.head)
    offsets, rest = rig.strands.offsets, rig.strands.points
    were_inside = np.zeros(len(rest), bool)
    were_inside[_inside(rest, np.eye(4), collider, rig.head)[0]] = True
    segments, rest_lengths = segment_lengths(rest, offsets), strand_lengths(rest, offsets)
    change, depth, max_offset = (np.zeros(rig.strands.strand_count) for _ in range(3))
    scale = MEDIAN_LENGTH / np.median(rest_lengths)
    correction, jumped, flips = np.zeros_like(rest), [], np.zeros(3)
    motion_before, led_before = None, NO_LED_OUT
    for motion, matrix, points, led in played(rig, collider, shake, fps):
        assert np.isfinite(points).all()
        np.maximum(change, length_changes(points, offsets, rest_lengths), out=change)
        off = np.abs(segment_lengths(points, offsets) - segments) / np.maximum(segments, 1.0e-5)
        np.maximum(max_offset, np.maximum.reduceat(off, offsets[:-1]), out=max_offset)
        deep = np.zeros(len(points))
        index, local = _inside(points, matrix, collider, rig.head)
        if len(index):
            deep[index] = np.where(were_inside[index], 0.0, search.closest(local).distance)
        np.maximum(depth, np.maximum.reduceat(deep, offsets[:-1]), out=depth)
        before = correction
        correction = points - motion_flow.strands_at(rig, motion.pose, motion.guides)
        jumped.append(_farthest(correction - before, offsets) * scale)
        if motion_before is not None and len(jumped) % FLIPS_EVERY == 0:
            is_far = jumped[-1] > JUMP
            moments = motion_before, motion
            farthest = _farthest_in_parts(rig, collider, moments, led_before, before, JUMP / scale)
            flips += is_far.sum(), *((is_far & (way * scale > JUMP)).sum() for way in farthest)
        motion_before, led_before = motion, led
    depth *= scale
    return {
        "length_p99_percent": float(np.quantile(change, 0.99)) * 100.0,
        "length_worst_percent": float(change.max()) * 100.0,
        "segments_worst_percent": float(max_offset.max()) * 100.0,
        "depth_p99_mm": float(np.quantile(depth, 0.99)) * 1000.0,
        "depth_worst_mm": float(depth.max()) * 1000.0,
        "strands_inside_percent": 100.0 * float((depth > 0.001).mean()),
        "jump_worst_mm": 1000.0 * float(np.max(jumped)),
        "strands_jump_percent": 100.0 * float((np.array(jumped) > JUMP).mean()),
        "flips_of_jumps_percent": 100.0 * float(flips[1] / max(flips[0], 1.0)),
        "led_flips_of_jumps_percent": 100.0 * float(flips[2] / max(flips[0], 1.0)),
    }


def _farthest(displacement: Floats, offsets: Ints) -> Floats:
    """The largest displacement (point_count, 3) of a point of each strand, (strand_count,)."""
    return np.asarray(np.maximum.reduceat(np.linalg.norm(displacement, axis=1), offsets[:-1]))


def _farthest_in_parts(
    rig: Rig,
    collider: Collider,
    moments: tuple[Motion, Motion],
    led: LedOut,
    correction: Floats,
    jump: float,
) -> Floats:
    """The largest change of each strand's displacement by leading out, in one part of the way
    between two frames, on which guides and head move straight; and the same over the parts in which
    the strand does not jump where it rides, in the head's space, (2, strand_count).

    Args:
        led: of the frame before.
        correction: (point_count, 3), the displacement by leading out in the frame before.
        jump: least size of a jump [m].
    """
    (before, now), offsets = moments, rig.strands.offsets
    farthest = np.zeros((2, rig.strands.strand_count))
    ridden = _as_head(motion_flow.strands_at(rig, before.pose, before.guides), before.pose.matrix)
    for part in np.arange(1, PARTS + 1) / PARTS:
        matrix = before.pose.matrix + part * (now.pose.matrix - before.pose.matrix)
        guides = before.guides + np.float32(part) * (now.guides - before.guides)
        posed = (PosedCollider(collider, matrix, matrix),)
        next_rig = replace(
            now,
            pose=pose_of(rig, matrix),
            guides=guides,
            colliders=posed,
            duration=now.duration / PARTS,
            deflections=led.deflections,
        )
        last, ridden_before = correction, ridden
        correction, led = motion_flow.strands_and_led(rig, next_rig)
        rides = motion_flow.strands_at(rig, next_rig.pose, guides)
        correction -= rides
        ridden = _as_head(rides, matrix)
        distance = _farthest(correction - last, offsets)
        is_steady = _farthest(ridden - ridden_before, offsets) <= jump
        np.maximum(farthest, [distance, distance * is_steady], out=farthest)
    return farthest


def _as_head(points: Floats, matrix: Floats) -> Floats:
    """World points (n, 3) in the head's space."""
    seen: Floats = (points - matrix[:3, 3]) @ matrix[:3, :3]
    return seen


def _inside(
    points: Floats, matrix: Floats, collider: Collider, head: Surface
) -> tuple[Ints, Floats]:
    """Indices of the points inside the mesh, and their places with the head at rest. Candidates are
    the points inside its distance field, which misses the mesh by a twentieth of a cell at most; of
    these the mesh must wind around a point."""
    posed = (PosedCollider(collider, matrix, matrix),)
    index = np.flatnonzero(signed_distance(points, posed, 0.01)[0] < 0.0)
    local = ((points[index] - matrix[:3, 3]) @ matrix[:3, :3]).astype(np.float32)
    is_in = np.abs(winding_number(local, head)) > 0.5 if len(index) else np.zeros(0, bool)
    return index[is_in], local[is_in]


def still_and_turned(rig: Rig) -> dict[str, float]:
    """The error at rest [m], and that of a rigid turn of head and guides, over the median
    length."""
    rest = motion_flow.strands_at(rig, rig.rest_pose, rig.guide_grid)
    matrix = shake_matrix(np.zeros(3), 0.3)
    matrix[:3, 3] = 0.3, -0.2, 0.1
    assert rig.head is not None
    # in double precision, so that only errors of riding show
    turned = rig.head.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    guides = rig.guide_grid.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    now = motion_flow.strands_at(rig, Pose(turned, matrix), guides)
    expected = rig.strands.points @ matrix[:3, :3].T + matrix[:3, 3]
    length = strand_lengths(rig.strands.points, rig.strands.offsets)
    return {
        "rest_error": float(np.abs(rest - rig.strands.points).max()),
        "rigid_turn_error": float(np.abs(now - expected).max() / np.median(length)),
    }


def coil_figures(rig: Rig, made_of: StrandSet) -> dict[str, float]:
    """How much of their length coils keep, and how far their radius is off, after the shake."""
    assert rig.head is not None
    collider = field_of(rig.head, DynamicsSettings(), place="head")
    points, offsets = list(played(rig, collider, shake_at, FPS))[-1][2], rig.strands.offsets
    length_ratios = strand_lengths(points, offsets) / strand_lengths(
        made_of.points, made_of.offsets
    )
    grid = points.reshape(rig.strands.strand_count, -1, 3).astype(np.float64)
    a_turn = grid.shape[1] // TURNS
    middle = slice(4 * a_turn, -4 * a_turn)
    window = np.ones(a_turn) / a_turn
    axis = np.apply_along_axis(lambda row: np.convolve(row, window, "same"), 1, grid)
    radius = np.linalg.norm(grid - axis, axis=2)[:, middle].mean()
    at_rest = rig.strands.points.reshape(grid.shape).astype(np.float64)
    axis = np.apply_along_axis(lambda row: np.convolve(row, window, "same"), 1, at_rest)
    before = np.linalg.norm(at_rest - axis, axis=2)[:, middle].mean()
    return {
        "coil_length_kept": float(length_ratios.min()),
        "coil_radius_error_percent": abs(float(radius / before) - 1.0) * 100.0,
    }


def card_figures(rig: Rig) -> dict[str, float]:
    """Figures of cards in the shake, each vertex and each card by its worst frame."""
    assert rig.head is not None
    collider = field_of(rig.head, DynamicsSettings(), place="head")
    mesh = result_of(card_build_steps(rig, SettingsMap())).finest
    cards, search = bound_cards(rig, mesh), ClosestPointSearch(rig.head)
    depth, deeper = np.zeros((2, len(mesh.positions)))
    inside, local = _inside(mesh.positions, np.eye(4), collider, rig.head)
    at_rest = np.zeros(len(mesh.positions))
    at_rest[inside] = search.closest(local).distance
    lines, rows = _middle_lines(mesh, cards), _row_edges(mesh, cards)
    length, width = (
        strand_lengths(mesh.positions[lines], cards.offsets),
        _sizes(mesh.positions, rows),
    )
    longer, wider, folded = (np.zeros(len(each)) for each in (length, width, length))
    straight = _folds(mesh.positions, rows, lines)
    scale = MEDIAN_LENGTH / np.median(strand_lengths(rig.strands.points, rig.strands.offsets))
    owner, motion_start, costs, jumped = card_of_vertex(mesh), None, [], []
    correction = np.zeros_like(mesh.positions)
    for motion, matrix, _, _ in played(rig, collider, shake_at, FPS):
        if motion_start is None:
            assert motion.clearance is not None
            colliders = (PosedCollider(collider, np.eye(4), np.eye(4)),)
            motion_start = MotionStart(rig.rest_pose, colliders, motion.clearance.max_distance)
        pose = replace(motion.pose, solids=SimulatedSolids(motion_start, motion.colliders))
        (riding, now), cost = _timed(rig, cards, (motion.pose, pose), motion.guides)
        costs.append(cost)
        before, correction = correction, now - riding
        jumps = np.zeros(owner.max() + 1)
        np.maximum.at(jumps, owner, np.linalg.norm(correction - before, axis=1) * scale)
        jumped.append(jumps[np.unique(owner)])
        index, local = _inside(now, matrix, collider, rig.head)
        if len(index):
            found = search.closest(local).distance
            np.maximum.at(depth, index, found)
            np.maximum.at(deeper, index, found - at_rest[index])
        change = length_changes(now[lines], cards.offsets, length)
        np.maximum(longer, change, out=longer)
        np.maximum(wider, np.abs(_sizes(now, rows) / width - 1.0), out=wider)
        fold = _folds(now, rows, lines) - straight
        np.maximum(folded, np.maximum.reduceat(fold, cards.offsets[:-1]), out=folded)
    depth[inside] = 0.0
    depth, deeper = depth * scale, deeper * scale
    deepest = np.zeros(owner.max() + 1)
    np.maximum.at(deepest, owner, depth)
    alone, led = np.median(costs, axis=0)
    return {
        "card_deepest_mm": float(depth.max()) * 1000.0,
        "card_vertices_deep_percent": 100.0 * float((depth > 0.001).mean()),
        "cards_deep_percent": 100.0 * float((deepest[np.unique(owner)] > 0.001).mean()),
        "card_deeper_than_at_rest_mm": float(deeper.max()) * 1000.0,
        "card_vertices_deeper_percent": 100.0 * float((deeper > 0.0005).mean()),
        "card_length_p99_percent": 100.0 * float(np.quantile(longer, 0.99)),
        "card_length_worst_percent": 100.0 * float(longer.max()),
        "card_width_p99_percent": 100.0 * float(np.quantile(wider, 0.99)),
        "card_width_worst_percent": 100.0 * float(wider.max()),
        "card_fold_p99_degrees": float(np.quantile(folded, 0.99)),
        "card_fold_worst_degrees": float(folded.max()),
        "card_jump_worst_mm": 1000.0 * float(np.max(jumped)),
        "cards_jump_percent": 100.0 * float((np.array(jumped) > JUMP).mean()),
        "card_ride_ms": 1000.0 * float(alone),
        "card_ride_and_lead_ms": 1000.0 * float(led),
        "card_cost_ratio": float(led / alone),
    }


def _timed(
    rig: Rig, cards: CardBinding, poses: tuple[Pose, Pose], guides: Floats
) -> tuple[list[Floats], Floats]:
    """The vertices in both poses, and how long each takes [s], the better of two."""
    times, found = np.zeros((2, 2)), [cards.mesh.positions] * 2
    for turn in np.ndindex(2, 2):
        begin = perf_counter()
        found[turn[1]] = cards_at(rig, cards, poses[turn[1]], guides).positions
        times[turn] = perf_counter() - begin
    return found, times.min(axis=0)


def _middle_lines(mesh: CardMesh, cards: CardBinding) -> Ints:
    """The middle vertex of each row; Sintel's cards have three in a row."""
    order = np.lexsort((mesh.uv[:, 0], cards.row_of_vertex))
    count = np.bincount(cards.row_of_vertex)
    assert (count % 2 == 1).all()
    middles: Ints = order[piece_starts(count) + count // 2]
    return middles


def _row_edges(mesh: CardMesh, cards: CardBinding) -> Ints:
    """Edges of triangles within rows, (n, 2)."""
    pairs = np.concatenate([mesh.triangles[:, sides] for sides in ((0, 1), (1, 2), (2, 0))])
    within = pairs[cards.row_of_vertex[pairs[:, 0]] == cards.row_of_vertex[pairs[:, 1]]]
    return np.unique(np.sort(within, axis=1), axis=0)


def _folds(points: Floats, edges: Ints, lines: Ints) -> Floats:
    """The angle by which the halves of each row fold [degrees], (row_count,).

    Args:
        edges: see `_row_edges`; two per row. lines: see `_middle_lines`.
    """
    row = np.full(len(points), -1)
    row[lines] = np.arange(len(lines))
    other, middle = edges[:, 0], edges[:, 1]
    other, middle = np.where(row[other] >= 0, (middle, other), (other, middle))
    directions = (points[other] - points[middle]).astype(np.float64)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    pairs = directions[np.argsort(row[middle], kind="stable")].reshape(len(lines), 2, 3)
    cosine = -(pairs[:, 0] * pairs[:, 1]).sum(axis=1)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _sizes(points: Floats, edges: Ints) -> Floats:
    edge_vectors = (points[edges[:, 1]] - points[edges[:, 0]]).astype(np.float64)
    return np.linalg.norm(edge_vectors, axis=1)


def cost_of(rig: Rig) -> dict[str, float]:
    assert rig.head is not None
    collider = field_of(rig.head, DynamicsSettings(), place="head")
    return cost_figures(rig, [frame[0] for frame in played(rig, collider, shake_at, FPS)])


def main(names: list[str]) -> int:
    start()
    grooms = {**{name: GROOMS[name] for name in ("sintel", "ponytail", "built_in")}, "coil": coils}
    found: dict[str, Any] = {}
    for name in names or grooms:
        pair = grooms[name]()
        rig = rig_of(pair, name, "none")
        figures = shaken(rig, shake_at, FPS) | still_and_turned(rig)
        fast = shaken(rig, fast_shake_at, FAST_FPS)
        figures |= {"depth_fast_worst_mm": fast["depth_worst_mm"]}
        figures |= {"strands_fast_inside_percent": fast["strands_inside_percent"]}
        figures |= {"jump_fast_worst_mm": fast["jump_worst_mm"]}
        figures |= {"strands_fast_jump_percent": fast["strands_jump_percent"]}
        figures |= {"flips_of_fast_jumps_percent": fast["flips_of_jumps_percent"]}
        figures |= {"led_flips_of_fast_jumps_percent": fast["led_flips_of_jumps_percent"]}
        if name == "sintel":
            figures |= cost_of(rig) | card_figures(rig)
        if name == "coil":
            figures |= coil_figures(rig, pair[0])
        found |= {f"{name}_{key}": value for key, value in figures.items()}
        print(name, {key: round(value, 6) for key, value in figures.items()}, flush=True)
    max_figures = {
        key: max(value for name, value in found.items() if name.endswith(f"_{key}"))
        for key in MAX_LIMITS
        if any(name.endswith(f"_{key}") for name in found)
    }
    coil_figures_found = {key: found[f"coil_{key}"] for key in MIN_LIMITS if f"coil_{key}" in found}
    return report(
        {**found, **max_figures, **coil_figures_found},
        REFERENCE,
        max_limits=MAX_LIMITS,
        min_limits=MIN_LIMITS,
    )


sys.exit(main(sys.argv[1:]))
