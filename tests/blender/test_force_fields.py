"""Force fields of the scene act as in Blender, and unsupported ones are reported."""

import math
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from collider_scene import depsgraph
from mathutils import noise

from hairloom.addon.blender.scene.forces import force_fields_of, permutation
from hairloom.addon.dynamics.force_fields import field_effect, perlin

sys.path.append(str(Path(__file__).parents[2] / "bench"))
from _field_particles import CASES, error_of


@pytest.fixture
def owner(extension):
    owner = bpy.data.objects.new("Owner", None)
    bpy.context.scene.collection.objects.link(owner)
    return owner


def add(kind, **values):
    if "shape" in values:  # for mesh shapes only
        bpy.ops.mesh.primitive_grid_add()
        bpy.ops.object.forcefield_toggle()
    else:
        bpy.ops.object.effector_add(type="FORCE")
    source = bpy.context.object
    source.field.type = kind
    for name, value in values.items():
        setattr(source.field, name, value)
    return source


def push_at(owner, place=(0.0, 0.0, 0.5)):
    fields, _ = force_fields_of(owner, depsgraph())
    point = np.array(place, np.float32)[:, None]
    return field_effect(fields, point, np.zeros_like(point)).push[:, 0]


@pytest.mark.parametrize("case", CASES)
def test_particles_of_blender_feel_the_same(owner, case):
    """At 40 moving places, the error relative to Blender's largest force is below 1/1000."""
    points = np.random.default_rng(2).uniform(-1.0, 1.0, (40, 3))
    assert error_of(*CASES[case], points) < 1e-3


def test_the_noise_is_that_of_blender(owner):
    points = np.random.default_rng(0).uniform(-300.0, 300.0, (3, 300)).astype(np.float32)
    theirs = [noise.noise(point, noise_basis="PERLIN_NEW") for point in points.T]
    np.testing.assert_allclose(perlin(permutation(), points), theirs, atol=1e-5)


def test_fields_that_are_hidden_or_elsewhere_do_not_act(owner):
    assert force_fields_of(owner, depsgraph())[0].fields == ()
    one, other = (add("WIND", strength=strength, flow=0.0) for strength in (3.0, 2.0))
    other.rotation_euler = (0.0, math.pi / 2, 0.0)
    other.scale = (5.0, 5.0, 5.0)
    np.testing.assert_allclose(push_at(owner), [2.0, 0.0, 3.0], atol=1e-6)
    one.hide_viewport = True
    np.testing.assert_allclose(push_at(owner), [2.0, 0.0, 0.0], atol=1e-6)
    one.hide_viewport = False
    other.field.apply_to_location = False
    np.testing.assert_allclose(push_at(owner), [0.0, 0.0, 3.0], atol=1e-6)
    other.field.apply_to_location = True
    chosen = bpy.data.collections.new("Chosen")
    chosen.objects.link(other)
    owner.hairloom.field_collection = chosen
    np.testing.assert_allclose(push_at(owner), [2.0, 0.0, 0.0], atol=1e-6)
    other.hide_set(True)
    assert force_fields_of(owner, depsgraph())[0].fields == ()


def test_an_object_ignores_its_own_force_field(owner):
    source = add("FORCE")
    assert len(force_fields_of(owner, depsgraph())[0].fields) == 1
    owner = source
    assert force_fields_of(owner, depsgraph())[0].fields == ()


def test_noise_changes_from_frame_to_frame_and_by_its_seed(owner):
    source = add("WIND", strength=1.0, noise=4.0, seed=3)
    seen = []
    for frame in range(1, 40):
        bpy.context.scene.frame_set(frame)
        seen.append(push_at(owner)[2])
    bpy.context.scene.frame_set(7)
    assert push_at(owner)[2] == seen[6], "a frame has its noise"
    assert len(set(seen)) > 30
    assert -3.0 <= min(seen) < 0.0 and 2.0 < max(seen) <= 5.0
    source.field.seed = 4
    assert push_at(owner)[2] != seen[6]


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        ("CHARGE", {}, "no charge"),
        ("LENNARDJ", {}, "particles with a size"),
        ("BOID", {}, "only boids"),
        ("GUIDE", {}, "along a curve"),
        ("TEXTURE", {}, "texture"),
        ("FLUID_FLOW", {}, "fluid"),
        ("FORCE", {"shape": "SURFACE"}, "Set Shape to Plane"),
        ("FORCE", {"shape": "POINTS"}, "1 to 64 points"),
        ("FORCE", {"strength": float("nan")}, "not finite"),
        ("WIND", {"flow": float("inf")}, "not finite"),
    ],
)
def test_fields_that_do_not_act_are_named(owner, kind, values, message):
    source = add(kind, **values)
    fields, notes = force_fields_of(owner, depsgraph())
    assert fields.fields == ()
    assert len(notes) == 1 and source.name in notes[0] and message in notes[0]


def test_strength_that_hair_cannot_follow_is_limited_and_named(owner):
    source = add("FORCE", strength=1e9, falloff_power=0.0)
    fields, notes = force_fields_of(owner, depsgraph())
    assert fields.fields[0].strength == 1e6
    assert len(notes) == 1 and source.name in notes[0] and "Lower Strength" in notes[0]


def test_the_preview_says_what_does_not_act_and_moves_the_hair(new_hair, sphere):
    from hairloom.addon.blender.sessions.session import Session

    hair = new_hair(sphere)
    charge = add("CHARGE")
    wind = add("WIND", strength=30.0)
    session = Session(hair, depsgraph())
    session.play(depsgraph())
    assert any(charge.name in warning for warning in session.warnings)
    before = session.frame_hash(depsgraph())
    at_rest = session.solver.guides().copy()
    for _ in range(3):
        session.advance(depsgraph(), 1.0 / 24.0)
    assert np.abs(session.solver.guides() - at_rest).max() > 1e-3
    wind.field.strength = 20.0
    wind.update_tag()
    assert session.frame_hash(depsgraph()) != before, "a bake is stale then"
