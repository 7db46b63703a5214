"""Force fields: three implementations that agree, textbook formulas, and hair that stays finite.

tests/blender/test_force_fields.py compares each field with Blender's.
"""

from dataclasses import replace

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics.cloth.reference import advance_cloth_reference
from hairloom.addon.dynamics.cloth.settings import FinSettings
from hairloom.addon.dynamics.cloth.state import start_cloth
from hairloom.addon.dynamics.cloth.step import advance_cloth
from hairloom.addon.dynamics.force_fields import (
    KINDS,
    MAX_DISPLACEMENT,
    SHAPES,
    Falloff,
    ForceField,
    ForceFields,
    apply_force_fields,
    field_effect,
    strand_directions,
)
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.measure import max_stretch
from hairloom.addon.dynamics.reference.force_fields import acceleration, previous_after_fields
from hairloom.addon.dynamics.reference.step import advance_reference
from hairloom.addon.dynamics.settings import DynamicsSettings

PERMUTATION = np.random.default_rng(3).permutation(256)
AXIS = (0.48, 0.6, 0.64)
DT = 1.0 / 180.0


def variants():
    """Fields of every kind in every shape, with random other values."""
    random = np.random.default_rng(7)
    for kind in KINDS:
        for shape in SHAPES:
            for falloff in ("sphere", "tube", "cone"):
                is_point = shape == "points"
                wide = (15.0, 120.0) if falloff == "cone" else (0.1, 0.9)
                yield ForceField(
                    kind,
                    center=tuple(random.normal(0.0, 0.2, 3).tolist()),
                    axis=AXIS,
                    strength=float(random.uniform(-5.0, 5.0)),
                    shape=shape,
                    place=(0.1, -0.2, 0.3) if is_point else None,
                    normal=(0.0, 0.6, 0.8) if is_point else None,
                    damping=float(random.uniform(0.0, 2.0)),
                    size=float(random.choice([0.0, 0.3])),
                    flow=float(random.choice([0.0, 1.0, -0.5])),
                    across_fraction=float(random.choice([0.0, 0.3, 1.0])),
                    falloff=falloff,
                    side=int(random.integers(-1, 2)),
                    distance=Falloff(float(random.choice([0.0, 2.0, 1.37])), 0.2, 1.2),
                    radial=Falloff(float(random.choice([0.0, 0.5])), *wide),
                    is_inverse_square=bool(random.integers(2)),
                    is_global=bool(random.integers(2)),
                )


def smooth(kind=None):
    """One field of each kind, or of `kind` alone, without discontinuities, where rounding would
    decide."""
    return tuple(
        replace(one, strength=one.strength * 3.0, side=0, distance=Falloff(1.37), flow=0.5)
        for one in variants()
        if one.falloff == "tube" and one.shape == "plane" and kind in (None, one.kind)
    )


def points_and_speeds(count=20):
    random = np.random.default_rng(5)
    return (random.uniform(-0.8, 0.8, (3, count)).astype(np.float32) for _ in range(2))


def test_the_slow_form_agrees_at_any_point():
    points, speeds = points_and_speeds()
    for one in variants():
        fields = ForceFields((one,), PERMUTATION, 0.7)
        ours = field_effect(fields, points, speeds).acceleration(speeds)
        theirs = [
            acceleration(*(vector.astype(np.float64) for vector in pair), fields)
            for pair in zip(points.T, speeds.T, strict=True)
        ]
        np.testing.assert_allclose(ours.T, theirs, rtol=2e-4, atol=2e-4, err_msg=str(one))


def test_the_slow_form_agrees_on_strands(kit):
    position = np.ascontiguousarray(kit.curly(3, 9).transpose(2, 1, 0))
    random = np.random.default_rng(1)
    previous = position - random.normal(0.0, 0.003, position.shape).astype(np.float32)
    for one in variants():
        fields = ForceFields((one,), PERMUTATION, 1.3)
        fast = previous.copy()
        apply_force_fields(
            position.reshape(3, -1),
            fast.reshape(3, -1),
            fields,
            DT,
            0.2,
            strand_directions(position).reshape(3, -1),
        )
        for guide in range(3):
            x, before = (rows[:, :, guide].T.astype(np.float64) for rows in (position, previous))
            slow = previous_after_fields(x, before, fields, DT, 0.2)
            np.testing.assert_allclose(fast[:, :, guide].T, slow, atol=2e-6, err_msg=str(one))


@pytest.mark.parametrize("kind", few_in_commits([None, *KINDS], 2))
def test_the_slow_step_agrees(kit, shake, kind):
    """All fields at once and each alone, strong enough to have a visible effect."""
    fields = smooth(kind)
    scene = kit.Scene(
        kit.curly(4, 10),
        DynamicsSettings(length_tolerance=0.0001),
        shake,
        force_fields=ForceFields(fields, PERMUTATION),
    )
    plain = kit.Scene(kit.curly(4, 10), DynamicsSettings(length_tolerance=0.0001), shake)
    slow = kit.Scene(**scene.__dict__ | {"advance": advance_reference})
    states = [one.play(0.2, 50.0)[-1].position for one in (scene, slow, plain)]
    np.testing.assert_allclose(states[0], states[1], atol=2e-4)
    assert np.abs(states[0] - states[2]).max() > 1e-4, "they act"


def test_the_slow_cloth_agrees():
    points = np.array([[x, y, 0.0] for x in range(4) for y in range(4)]) * 0.1
    corners = [(i, i + 1, i + 5) for i in range(11)] + [(i, i + 5, i + 4) for i in range(11)]
    state = start_cloth(points.astype(np.float32), np.array(corners), np.eye(16)[0])
    fields = ForceFields(smooth(), PERMUTATION)
    drive = Drive(points, points, (), np.zeros(3), force_fields=fields)
    ends = [
        form(state, drive, FinSettings(), 0.04).position
        for form in (advance_cloth, advance_cloth_reference)
    ]
    np.testing.assert_allclose(*ends, atol=2e-5)
    assert np.abs(ends[0] - state.position).max() > 1e-3


def test_no_field_changes_nothing(kit, shake):
    """Bit for bit: without fields, and with fields that are turned off."""
    fields = ForceFields(tuple(variants()), PERMUTATION)
    plain = kit.Scene(kit.curly(6, 10), DynamicsSettings(), shake)
    off = kit.Scene(
        kit.curly(6, 10), DynamicsSettings(force_fields=0.0), shake, force_fields=fields
    )
    none = kit.Scene(kit.curly(6, 10), DynamicsSettings(), shake, force_fields=ForceFields())
    expected = plain.play(0.3)[-1]
    for scene in (off, none):
        state = scene.play(0.3)[-1]
        np.testing.assert_array_equal(state.position, expected.position)
        np.testing.assert_array_equal(state.previous, expected.previous)


def test_free_hair_in_even_wind_goes_as_fast_as_it_blows(kit):
    """v' = s - f v: without other forces, the speed approaches strength over flow."""
    grid = kit.straight(1, 8)
    previous = np.ascontiguousarray(grid.transpose(2, 1, 0)).reshape(3, -1)
    wind = ForceFields((ForceField("wind", axis=(1.0, 0.0, 0.0), strength=3.0, flow=2.0),))
    position, steps = previous.copy(), 90
    for _ in range(steps):
        apply_force_fields(position, previous, wind, DT, 0.2)
        position, previous = 2.0 * position - previous, position
    speed = (position - previous)[0] / DT
    expected = 1.5 * (1.0 - np.exp(-2.0 * steps * DT))
    np.testing.assert_allclose(speed, expected, rtol=0.01)


def test_a_magnet_turns_speed_and_adds_none():
    """It may remove some, since damping terms are solved implicitly."""
    position, previous = np.zeros((3, 1), np.float32), np.zeros((3, 1), np.float32)
    previous[0] = -0.01
    magnet = ForceFields((ForceField("magnet", shape="plane", strength=5.0),))
    turned = 0.0
    for _ in range(40):
        before = position - previous
        apply_force_fields(position, previous, magnet, DT, 10.0)
        after = position - previous
        lengths = [float(np.linalg.norm(one)) for one in (before, after)]
        assert 0.999 * lengths[0] < lengths[1] <= lengths[0]
        cosine = float((before * after).sum()) / lengths[0] / lengths[1]
        turned += float(np.arccos(min(cosine, 1.0)))
        position, previous = position + after, position
    assert turned == pytest.approx(5.0 * 40 * DT, rel=0.01)


@pytest.mark.parametrize("strength", [1e6, -1e6])
@pytest.mark.parametrize("kind", KINDS)
def test_hair_stays_whole_in_any_field(kit, kind, strength):
    """Fields of the greatest strength that the scene passes on, amid the hair, without falloff."""
    fields = tuple(
        ForceField(
            kind,
            center=(0.0, 0.0, 0.15),
            strength=strength,
            damping=1e6,
            shape=shape,
            flow=-1e6 if shape == "line" else 1e6,
            distance=Falloff(10.0, 0.0, 0.0 if shape == "plane" else 1.0),
            is_inverse_square=True,
        )
        for shape in ("point", "line", "plane")
    )
    scene = kit.Scene(
        kit.curly(8, 12), DynamicsSettings(), force_fields=ForceFields(fields, PERMUTATION)
    )
    for state in scene.play(0.5, 24.0):
        assert np.isfinite(state.position).all() and np.isfinite(state.previous).all()
        assert max_stretch(state) < 0.02


def test_a_field_moves_no_cv_farther_than_a_part_of_its_hair():
    position = np.zeros((3, 5), np.float32)
    previous = position.copy()
    apply_force_fields(
        position, previous, ForceFields((ForceField("wind", strength=1e6),)), DT, 0.3
    )
    np.testing.assert_allclose(position[2] - previous[2], MAX_DISPLACEMENT * 0.3, rtol=1e-5)


def test_the_frame_rate_does_not_matter(kit):
    fields = ForceFields(smooth(), PERMUTATION)
    scene = kit.Scene(kit.curly(6, 12), DynamicsSettings(), force_fields=fields)
    expected = scene.play(0.5, 60.0)[-1].grid
    np.testing.assert_allclose(scene.play(0.5, 30.0)[-1].grid, expected, atol=2e-4)
