"""The verb `simulate` equals a bake of the scene, whose wind and gravity move the hair."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.command_line.simulate_job import mesh_object, shake
from hairloom.addon.blender.scene.curves import write_curves
from hairloom.addon.blender.scene.mesh_files import read_mesh_file
from hairloom.addon.exchange.tressfx import read_tfx

SMALL = ["--set", "guides.guide_count=20", "--set", "dynamics.collider_resolution=8"]


@pytest.fixture
def scene(new_hair, sphere):
    """Hair on a head in still air, for ten frames."""
    new_hair(sphere)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 10
    return scene


def simulated(path, *extra):
    arguments = ["simulate", "--groom", "Hair", "--animated", *SMALL, *extra, "--output", str(path)]
    assert command_line.run(arguments) == 0
    bake = Cache(path)
    frames = range(bake.facts.first, bake.facts.last + 1)
    return np.stack([bake.frame(frame)["guides"] for frame in frames])


def tips(guides):
    return (guides[-1] - guides[0])[:, -1].mean(axis=0)


@pytest.mark.slow
def test_a_wind_force_field_blows_the_hair(scene, tmp_path):
    still = simulated(tmp_path / "still")
    assert np.abs(tips(still)).max() < 1e-3
    bpy.ops.object.effector_add(type="WIND", rotation=(0.0, np.pi / 2.0, 0.0))
    bpy.context.object.field.strength = 10.0
    blown = tips(simulated(tmp_path / "blown", "--set", "dynamics.damping=10"))
    assert blown[0] > 0.005 and blown[0] > 3.0 * np.abs(blown[1:]).max()


def test_the_scenes_gravity_is_used(scene, tmp_path):
    limp = ["--set", "dynamics.sag_compensation=0", "--set", "dynamics.style_along=0,0,0,0,0"]
    scene.gravity = (0.0, 5.0, 0.0)
    sideways = tips(simulated(tmp_path / "sideways", *limp))
    assert sideways[1] > 0.001 and sideways[1] > 3.0 * np.abs(sideways[[0, 2]]).max()
    scene.use_gravity = False
    assert np.abs(tips(simulated(tmp_path / "none", *limp))).max() < 1e-3


def test_files_are_simulated_as_the_same_scene_is_baked(new_hair, sphere, tmp_path):
    """All arrays are equal bit for bit, with a collider that is not the head."""
    hair = new_hair(sphere)
    groom, head, ball = tmp_path / "hair.tfx", tmp_path / "head.obj", tmp_path / "ball.obj"
    bpy.ops.hairloom.export_tressfx(filepath=str(groom))
    for obj, path in ((sphere, head), (sphere, ball)):
        bpy.ops.object.select_all(action="DESELECT")
        obj.select_set(True)
        obj.location.x = 0.0 if path == head else 0.15
        bpy.ops.wm.obj_export(filepath=str(path), export_selected_objects=True)
    files = ["--groom", str(groom), "--head", str(head), "--collider", str(ball)]
    shaken = ["--seconds", "0.2", "--frame-rate", "30", "--output", str(tmp_path / "files")]
    limp = ["--set", "dynamics.sag_compensation=0", "--set", "guides.guide_count=12"]
    assert command_line.run(["simulate", *files, *limp, *shaken]) == 0
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)

    scene = bpy.context.scene
    surface = read_mesh_file(head, need_uv=True)[0]
    own = mesh_object("My head", surface, scene)
    hair = write_curves("My hair", read_tfx(groom).strands, own, scene.collection)
    other = mesh_object("My ball", read_mesh_file(ball, need_uv=False)[0], scene)
    other.parent = own
    hair.hairloom.collider = other
    hair.hairloom.dynamics.sag_compensation, hair.data.hairloom.guides.guide_count = 0.0, 12
    low, high = surface.bounds()
    shake(own, (low + high) / 2.0, 6, 30.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    baked = ["--scene", str(tmp_path / "scene.blend"), "--output", str(tmp_path / "scene")]
    assert command_line.run(["bake", *baked]) == 0

    one, two = Cache(tmp_path / "files"), Cache(tmp_path / "scene")
    assert (one.facts.first, one.facts.last, one.facts.frame_rate) == (0, 6, 30.0)
    assert one.facts.frame_hashes == two.facts.frame_hashes
    assert one.facts.rig_hash == two.facts.rig_hash
    pairs = [(one.constants(), two.constants())]
    pairs += [(one.frame(frame), two.frame(frame)) for frame in range(7)]
    for ours, theirs in pairs:
        assert ours.keys() == theirs.keys()
        for name, array in ours.items():
            np.testing.assert_array_equal(array, theirs[name], err_msg=name)
    moved = one.frame(6)["guides"] - one.frame(0)["guides"]
    assert np.abs(moved).max() > 1e-3, "nothing moved"
