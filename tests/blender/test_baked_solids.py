"""Moving cards are led out of the same solids in playback, from a bake and in exports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from swinging import shake_head
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon.blender.bakes import playback  # noqa: E402
from hairloom.addon.blender.bakes.baked_solids import (  # noqa: E402
    BakedSolids,
    interpolated_solids,
    solid_arrays,
    solid_constants,
)
from hairloom.addon.blender.bakes.guide_motion import BakedGuides  # noqa: E402
from hairloom.addon.blender.cards.motion import moved_cards  # noqa: E402
from hairloom.addon.blender.colliders.fields import field_of  # noqa: E402
from hairloom.addon.blender.engine.engine_hair import read_groom  # noqa: E402
from hairloom.addon.blender.preview import previews  # noqa: E402
from hairloom.addon.blender.preview.bake import Bake  # noqa: E402
from hairloom.addon.blender.scene.surfaces import read_surface  # noqa: E402
from hairloom.addon.card_flow import bound_cards, cards_at  # noqa: E402
from hairloom.addon.cards.steps import result_of  # noqa: E402
from hairloom.addon.dynamics.colliders import (  # noqa: E402
    CapsuleCollider,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
    signed_distance,
)
from hairloom.addon.dynamics.colliders.deformed_field import DeformedField  # noqa: E402
from hairloom.addon.dynamics.settings import DynamicsSettings  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402
from hairloom.addon.rig_flow import MotionStart, Pose  # noqa: E402
from hairloom.addon.strands import Surface  # noqa: E402

LAST, RADIUS = 9, 0.1
SETTINGS = DynamicsSettings(collider_resolution=16)


@pytest.fixture
def mesh(sphere, get_depsgraph) -> Surface:
    return read_surface(sphere, get_depsgraph(), need_uv=False, place="sphere")


def solids(mesh: Surface, bend: float) -> tuple[PosedCollider, ...]:
    """One collider of each kind, and the mesh's field at rest and bent."""
    matrix = np.eye(4)
    matrix[:3, 3] = 0.05, 0.02, 0.3
    field = field_of(mesh, SETTINGS, place="x")
    shape = mesh.positions + np.float32(bend) * mesh.positions[:, 2:] * [1.0, 0.0, 0.0]
    kinds = (
        SphereCollider(np.array([0.3, 0.0, 0.0]), 0.05),
        CapsuleCollider(np.array([0.0, 0.3, 0.0]), np.array([0.0, 0.4, 0.0]), 0.04),
        field,
        SphereSetCollider(np.array([[-0.3, 0.0, 0.0], [-0.35, 0.0, 0.0]]), np.array([0.05, 0.06])),
    )
    bent = DeformedField(field, mesh).at(shape.astype(np.float32))
    return (
        *(PosedCollider(kind, np.eye(4), np.eye(4)) for kind in kinds),
        PosedCollider(bent, matrix, matrix),
    )


def test_solids_are_read_back_as_written(mesh):
    posed, points = solids(mesh, 0.5), np.random.default_rng(2).normal(0.0, 0.3, (2000, 3))
    start = MotionStart(Pose(None, np.eye(4)), solids(mesh, 0.0), 0.001)
    constants = solid_constants(start, (mesh,), SETTINGS)
    baked = BakedSolids.of(constants)
    found = baked.at(solid_arrays(posed, (mesh,)), blocking=True)
    for one, other in ((posed, found.colliders), (start.colliders, found.motion_start.colliders)):
        expected, got = (signed_distance(points, each) for each in (one, other))
        np.testing.assert_allclose(got[0], expected[0], atol=1e-6)
        np.testing.assert_allclose(got[1], expected[1], atol=1e-4)
    assert found.motion_start.max_clearance == 0.001
    assert BakedSolids.of({}) is None, "a bake of a version that did not keep them"


def test_damaged_solids_are_reported(mesh):
    posed = solids(mesh, 0.5)
    start = MotionStart(Pose(None, np.eye(4)), posed, 0.001)
    baked = BakedSolids.of(solid_constants(start, (mesh,), SETTINGS))
    arrays = solid_arrays(posed, (mesh,))
    arrays["solid_shapes"] = arrays["solid_shapes"][:5]
    with pytest.raises(HairloomError, match="colliders are damaged"):
        _ = baked.at(arrays, blocking=True).colliders


def test_solids_are_interpolated_linearly_between_frames(mesh):
    one, other = (solid_arrays(solids(mesh, bend), (mesh,)) for bend in (0.4, 0.6))
    other["solid_matrices"] = other["solid_matrices"] + 0.1
    half = interpolated_solids(one, other, 0.5)
    for name in ("solid_matrices", "solid_shapes", "solid_balls"):
        np.testing.assert_allclose(half[name], 0.5 * (one[name] + other[name]), atol=1e-6)
    gone = {**other, "solids": other["solids"][1:]}
    assert interpolated_solids(one, gone, 0.5) is one


@pytest.fixture(params=few_in_commits(["sphere", "mesh"]))
def swinging(request, new_hair, sphere, tmp_path):
    """Hair that falls over the sphere, drawn as cards. Mesh faces lie up to 1.7 mm inside it."""
    hair, head = shake_head(new_hair(sphere), sphere, LAST, tmp_path / "bake")
    head.hairloom.collider_shape = request.param
    hair.hairloom.dynamics.collider_resolution = 64
    hair.hairloom.dynamics.style_root = 0.0
    hair.data.hairloom.cards.source = "guides"
    hair.data.hairloom.card_occlusion.rays = 4
    hair.data.hairloom.cards.order_by = "distance"
    hair.data.hairloom.atlas.source = "made"
    hair.data.hairloom.card_drawing.shown_as = "cards"
    yield hair, head
    previews.stop_all()


def positions(hair) -> np.ndarray:
    return previews.session_of(hair).snapshot.cards.mesh.positions


@pytest.mark.draws(light=False)
def test_cards_of_a_bake_are_those_that_played(swinging, get_depsgraph):
    hair, head = swinging
    previews.start(hair, get_depsgraph())
    flat = 0.0 if head.hairloom.collider_shape == "sphere" else 0.0017
    played, depth = [], 0.0
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        played.append(positions(hair))
        away = np.linalg.norm(played[-1] - np.array(head.matrix_world)[:3, 3], axis=1)
        depth = max(depth, RADIUS - away.min())
    assert depth < flat + 0.0005
    session = previews.session_of(hair)
    session.measure()
    assert session.card_figures.cards_stretch_max_percent < 1.0
    assert session.card_figures.cards_penetration_max_mm < 0.5
    list(Bake.of([hair], bpy.context.scene).steps())
    cache = playback.cache_of(hair)
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(positions(hair), played[frame - 1], atol=2e-6)
    rendered = read_groom(hair, get_depsgraph()).cards.mesh.positions
    np.testing.assert_allclose(rendered, played[-1], atol=2e-6)
    solids = playback.solids_in(cache, 4, 0.5)
    np.testing.assert_allclose(solids.colliders[0].matrix_now[0, 3], _middle(cache, 4), atol=1e-6)


def _middle(cache, frame: int) -> float:
    places = [playback.pose_in(cache, each).matrix[0, 3] for each in (frame, frame + 1)]
    return float(np.mean(places))


@pytest.mark.draws(light=False)
def test_exported_cards_are_led_out_too(swinging, get_depsgraph):
    hair, head = swinging
    flat = 0.0 if head.hairloom.collider_shape == "sphere" else 0.0017
    previews.start(hair, get_depsgraph())
    mesh = previews.session_of(hair).snapshot.cards.mesh
    list(Bake.of([hair], bpy.context.scene).steps())
    motion = BakedGuides.of(hair)
    moved = result_of(moved_cards(motion, [mesh], space="world", with_directions=False))
    places = moved.tracks.moved_positions[0]
    middles = np.array([motion.at(frame)[0].matrix[:3, 3] for frame in motion.frames])
    depth = RADIUS - np.linalg.norm(places - middles, axis=2).min()
    assert depth < flat + 0.0005
    riding = [
        cards_at(motion.rig, bound_cards(motion.rig, mesh), replace(pose, solids=None), guides)
        for pose, guides in map(motion.at, motion.frames)
    ]
    depths = [
        RADIUS - np.linalg.norm(cards.positions - middle, axis=1).min()
        for cards, middle in zip(riding, middles, strict=True)
    ]
    assert max(depths) > flat + 0.003, "where they ride alone"
    assert moved.figures.cards_penetration_max_mm < 0.5
    assert moved.figures.cards_stretch_max_percent < 1.0
