"""Hair that plays lags behind its head, falls, and stays out of colliders."""

import bpy
import numpy as np
import pytest
from grids import strand_grid
from swinging import play_frames

from hairloom.addon.blender.preview import previews


def test_playing_hair_lags_behind_and_returns_when_stopped(preview, get_depsgraph):
    _, head, session = preview
    at_rest = strand_grid(session)
    assert previews.play(get_depsgraph()) == []

    def push(frame):
        head.location.x = 0.02 * (frame + 1)

    play_frames(get_depsgraph, 6, push)
    carried = at_rest + np.array([head.location.x, 0.0, 0.0])
    offset = strand_grid(session) - carried
    assert np.abs(offset[:, 0]).max() < 1e-5, "roots go with the head"
    assert offset[:, -1, 0].mean() < -0.005, "tips stay behind"
    previews.rest(get_depsgraph(), keep_playing=False)
    assert not previews.is_playing()
    assert strand_grid(session) == pytest.approx(carried, abs=2e-6)


def test_a_head_that_stands_still_is_the_same_one_in_the_next_frame(preview, get_depsgraph):
    """Otherwise it would be processed and uploaded again."""
    _, head, session = preview
    previews.play(get_depsgraph())
    heads = []
    for place in (0.0, 0.0, 0.1):
        head.location.x = place
        play_frames(get_depsgraph, 1)
        heads += session.snapshot.casters
    assert heads[0] is heads[1] and heads[1] is not heads[2]
    moved = heads[2].positions - heads[1].positions
    np.testing.assert_allclose(moved - [0.1, 0.0, 0.0], 0.0, atol=1e-6)


def test_without_motion_gravity_alone_pulls_unheld_hair_down(preview, get_depsgraph):
    hair, _, session = preview
    at_rest = strand_grid(session)
    hair.hairloom.dynamics.sag_compensation = 0.0
    previews.play(get_depsgraph())
    play_frames(get_depsgraph, 12)
    assert (strand_grid(session) - at_rest)[:, -1, 2].mean() < -0.001
    previews.rest(get_depsgraph(), keep_playing=False)
    bpy.context.scene.use_gravity = False
    previews.play(get_depsgraph())
    play_frames(get_depsgraph, 12)
    assert np.abs(strand_grid(session) - at_rest).max() < 1e-3


def test_hair_stays_out_of_the_head_that_moves_into_it(preview, get_depsgraph):
    _, head, session = preview
    previews.play(get_depsgraph())
    play_frames(get_depsgraph, 10, lambda frame: setattr(head.location, "z", 0.01 * (frame + 1)))
    distance = np.linalg.norm(strand_grid(session) - np.array(head.location), axis=2)
    assert distance[:, 2:].min() > 0.098


def test_a_chosen_collider_is_used_in_place_of_the_head(preview, get_depsgraph):
    hair, _, session = preview
    bpy.ops.mesh.primitive_cube_add(size=0.05, location=(0.0, 0.0, 1.0))
    cube = bpy.context.object
    hair.hairloom.collider = cube
    assert previews.play(get_depsgraph()) == []
    (part,) = session.scene_colliders.parts
    assert part.carrier.body.handle.name == cube.name
    play_frames(get_depsgraph, 2, lambda frame: setattr(cube.location, "x", 0.1 * frame))
    assert part.track.before[:3, 3] == pytest.approx([0.1, 0.0, 0.0], abs=1e-6)


def field_of(session):
    (part,) = session.scene_colliders.parts
    return part.distance


def test_a_collider_is_made_once_and_again_only_when_it_differs(preview, get_depsgraph):
    hair, head, session = preview
    hair.hairloom.dynamics.collider_resolution = 8
    previews.play(get_depsgraph())
    field = field_of(session)
    head.location.x = 1.0
    previews.play(get_depsgraph())
    assert field_of(session) is field
    hair.hairloom.dynamics.collider_resolution = 9
    previews.play(get_depsgraph())
    assert field_of(session) is not field

    bpy.ops.mesh.primitive_cube_add(size=0.05, location=(0.0, 0.0, 1.0))
    cube = hair.hairloom.collider = bpy.context.object
    previews.play(get_depsgraph())
    field = field_of(session)
    cube.rotation_euler.x = 1.0
    previews.play(get_depsgraph())
    assert field_of(session) is field
    cube.data.vertices[0].co.x += 0.1
    previews.play(get_depsgraph())
    assert field_of(session) is not field


def test_a_collider_that_cannot_be_used_is_a_warning_and_play_goes_on(preview, get_depsgraph):
    hair, _, session = preview
    points = bpy.data.objects.new("Points", bpy.data.meshes.new("Points"))
    bpy.context.collection.objects.link(points)
    hair.hairloom.collider = points
    assert previews.play(get_depsgraph()) == []
    (warning,) = session.warnings
    assert "Points" in warning
    assert previews.is_playing()
    play_frames(get_depsgraph, 2)
    assert previews.session_of(hair) is session


def test_hair_that_blender_simulates_is_not_simulated_twice(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    modifier = hair.modifiers.new("Swing", "NODES")
    modifier.node_group = bpy.data.node_groups.new("Hair Dynamics", "GeometryNodeTree")
    modifier.show_viewport = False
    assert previews.start(hair, get_depsgraph()).warnings == ()
    modifier.show_viewport = True
    tree = modifier.node_group
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    source, result = (tree.nodes.new(f"NodeGroup{kind}") for kind in ("Input", "Output"))
    tree.links.new(source.outputs[0], result.inputs[0])
    session = previews.start(hair, get_depsgraph())
    (warning,) = session.warnings
    assert "Swing" in warning and "Mute" in warning
    (refusal,) = previews.play(get_depsgraph())
    assert "Swing" in refusal and not previews.is_playing()
    bpy.context.scene.frame_set(1)
    bpy.context.scene.frame_set(2)
    assert not session.is_playing and "Swing" in previews.previews[session.uid].problems

    assert bpy.ops.hairloom.mute_hair_dynamics() == {"FINISHED"}
    assert not modifier.show_viewport and not modifier.show_render
    assert not bpy.ops.hairloom.mute_hair_dynamics.poll()
    assert session.warnings == ()
    assert previews.play(get_depsgraph()) == [] and previews.is_playing()
