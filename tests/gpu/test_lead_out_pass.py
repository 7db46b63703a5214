"""Strands led out of colliders: the GPU against numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereSetCollider,
    signed_distance,
)
from hairloom.addon.refine.lead_out import Clearance, LedOut, clearance_at, lead_out
from hairloom.addon.strands.arc_length import segment_lengths

pytestmark = pytest.mark.usefixtures("gpu_context")

CLEARANCE, MOVED = 0.001, 2.0e-4  # [m]


def posed(*, moved: float) -> tuple[PosedCollider, ...]:
    """A box, a capsule and two balls, slightly turned and scaled."""
    axis = np.linspace(-0.2, 0.2, 24)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    beside = np.abs(nodes) - 0.06
    box = np.linalg.norm(np.maximum(beside, 0.0), axis=-1) - 0.02
    box += np.minimum(beside.max(axis=-1), 0.0)
    solids: tuple[Collider, ...] = (
        DistanceField(box, nodes[0, 0, 0], axis[1] - axis[0]),
        CapsuleCollider(np.array([0.1, 0.1, -0.1]), np.array([0.1, 0.1, 0.2]), 0.03),
        SphereSetCollider(np.array([[-0.1, 0.0, 0.1], [-0.1, 0.1, 0.0]]), np.array([0.03, 0.05])),
    )
    matrix = np.eye(4)
    matrix[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    matrix[:3, :3] *= 1.1
    matrix[:3, 3] = moved, 0.0, 0.01
    return tuple(PosedCollider(solid, matrix, matrix) for solid in solids)


def strands(count: int, min_points: int, max_points: int) -> tuple[np.ndarray, np.ndarray]:
    """Wavy strands from all sides through the solids."""
    random = np.random.default_rng(2)
    counts = random.integers(min_points, max_points + 1, count)
    points = []
    for number in counts:
        begin, direction = random.normal(size=3), random.normal(size=3)
        begin *= 0.2 / np.linalg.norm(begin)
        direction = direction - 12.0 * begin
        along = np.linspace(0.0, 0.35, number)[:, None]
        wave = 0.004 * np.sin(40.0 * along) * random.normal(size=3)
        points.append(begin + along * direction / np.linalg.norm(direction) + wave)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return np.concatenate(points).astype(np.float32), offsets


def with_held(clearance: Clearance, offsets: np.ndarray) -> Clearance:
    """A clearance in which every fourth strand is fixed to its root up to a point in its first
    half."""
    random, counts = np.random.default_rng(7), np.diff(offsets)
    held = np.where(np.arange(len(counts)) % 4, 0, counts * random.uniform(0.0, 0.5, len(counts)))
    held = held.astype(np.int32)
    number = np.arange(len(clearance.points)) - np.repeat(offsets[:-1], counts)
    is_held = number <= np.repeat(held, counts)
    return Clearance(clearance.max_distance, np.where(is_held, -np.inf, clearance.points), held)


@pytest.mark.parametrize(
    ("min_points", "max_points", "can_read_own_writes"),
    [(9, 9, True), (9, 9, False), (2, 60, True)],
    ids=["at once", "as on Metal", "in parts"],
)
def test_equals_numpy(
    monkeypatch: pytest.MonkeyPatch, min_points: int, max_points: int, can_read_own_writes: bool
) -> None:
    from hairloom.addon.render import lead_out_pass
    from hairloom.addon.render.collider_textures import UploadedColliders
    from hairloom.addon.render.lead_out_pass import LeadOutPass
    from hairloom.addon.render.ride_pass import matrix_motion
    from hairloom.addon.render.strand_layout import StrandLayout
    from hairloom.addon.render.textures import texture_from, texture_to_array

    monkeypatch.setattr(lead_out_pass, "can_read_own_writes", lambda: can_read_own_writes)
    points, offsets = strands(600, min_points, max_points)
    layout = StrandLayout(offsets)
    texels = layout.pixels(np.column_stack([points, np.full(len(points), 1e-4)]))
    now = texture_from(texels, "RGBA32F")
    matrix = np.eye(4)
    matrix[:3, 3] = 0.0, MOVED, 0.0
    carried = points + np.float32([0.0, MOVED, 0.0])
    carry_textures = {
        "rest_points": texture_from(texels, "RGBA32F"),
        "root_motions": texture_from(matrix_motion(matrix), "RGBA32F"),
    }

    def found() -> np.ndarray:
        return layout.values(texture_to_array(now))

    leading = LeadOutPass(layout, UploadedColliders())

    def lead(texture: Any, colliders: tuple[PosedCollider, ...]) -> None:
        inputs = leading.begin_frame(
            colliders, 1 << 20
        )  # the limit lets the pass take all steps itself
        if inputs is not None:
            assert not inputs.finds_near_while_riding
            leading.lead(texture, inputs, carry_textures, 1)

    lead(now, posed(moved=0.0))
    np.testing.assert_array_equal(found()[:, :3], points, "no motion has begun")

    clearance = with_held(clearance_at(points, offsets, posed(moved=-0.05), CLEARANCE), offsets)
    leading.set_clearance(clearance)
    expected = points.copy()
    led, _ = lead_out(
        expected, lambda index, _: carried[index], offsets, posed(moved=0.0), clearance
    )
    lead(now, posed(moved=0.0))
    assert 100 < len(led) < 550
    assert len(np.setxor1d(led, leading.led_strands())) <= 2, "rounding decides few"
    off = np.maximum.reduceat(np.abs(found()[:, :3] - expected).max(axis=1), offsets[:-1])
    assert np.median(off[led]) < 2e-6
    assert (off > 1e-4).mean() < 0.08, "where two solids are as near, rounding decides"
    np.testing.assert_array_equal(found()[:, 3], np.float32(1e-4), "radii stay")

    away = np.linalg.norm(points - carried, axis=1)
    required = np.minimum(clearance.points + away, np.float32(CLEARANCE))

    def stuck(places: np.ndarray) -> float:
        shortfall = required - signed_distance(places, posed(moved=0.0), CLEARANCE)[0]
        return float((np.maximum.reduceat(shortfall, offsets[:-1]) > 0.1 * CLEARANCE).mean())

    assert abs(stuck(found()[:, :3]) - stuck(expected)) < 0.01
    assert stuck(points) > 0.2
    np.testing.assert_allclose(
        segment_lengths(found()[:, :3], offsets), segment_lengths(points, offsets), atol=2e-6
    )

    # it continues after a release
    before, led_before, again = found(), leading.led_strands(), texture_from(texels, "RGBA32F")
    leading.release()
    lead(again, posed(moved=0.0))
    np.testing.assert_array_equal(layout.values(texture_to_array(again)), before)
    np.testing.assert_array_equal(leading.led_strands(), led_before)
    lead(again, ())
    assert not len(leading.led_strands())


def test_points_that_were_led_out_earlier_are_stored() -> None:
    from hairloom.addon.render.collider_textures import UploadedColliders
    from hairloom.addon.render.lead_out_pass import LeadOutPass
    from hairloom.addon.render.strand_layout import StrandLayout
    from hairloom.addon.render.textures import texture_from, texture_to_array

    for min_points, max_points in ((16, 16), (2, 60)):
        points, offsets = strands(600, min_points, max_points)
        layout = StrandLayout(offsets)
        now = texture_from(layout.pixels(np.pad(points, ((0, 0), (0, 1)))), "RGBA32F")
        led = LedOut.of(np.array([0, 7, 599]), points + np.float32(0.5), offsets)
        LeadOutPass(layout, UploadedColliders()).put(now, led)
        led.put(points, offsets)
        np.testing.assert_array_equal(layout.values(texture_to_array(now))[:, :3], points)
