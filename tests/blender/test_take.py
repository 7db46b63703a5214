"""The command line's take of a scene: the scene's wind, gravity and smooth ways move the hair."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.bakes.take import TakeDrive, scene_drive
from hairloom.addon.blender.command_line import command_line

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
    with np.load(path) as data:
        return data["guides"]


def tips(guides):
    return (guides[-1] - guides[0])[:, -1].mean(axis=0)


def test_a_wind_force_field_blows_the_hair(scene, tmp_path):
    still = simulated(tmp_path / "still.npz")
    assert np.abs(tips(still)).max() < 1e-3
    bpy.ops.object.effector_add(type="WIND", rotation=(0.0, np.pi / 2.0, 0.0))
    bpy.context.object.field.strength = 10.0
    drive = scene_drive("Head")
    assert np.array(drive.winds) == pytest.approx(np.tile([10.0, 0.0, 0.0], (10, 1)), abs=1e-4)
    blown = tips(simulated(tmp_path / "blown.npz", "--set", "dynamics.damping=10"))
    assert blown[0] > 0.005 and blown[0] > 3.0 * np.abs(blown[1:]).max()


def test_the_scenes_gravity_is_used(scene, tmp_path):
    limp = ["--set", "dynamics.weight_held=0", "--set", "dynamics.style_along=0,0,0,0,0"]
    scene.gravity = (0.0, 5.0, 0.0)
    sideways = tips(simulated(tmp_path / "sideways.npz", *limp))
    assert sideways[1] > 0.001 and sideways[1] > 3.0 * np.abs(sideways[[0, 2]]).max()
    scene.use_gravity = False
    assert np.abs(tips(simulated(tmp_path / "none.npz", *limp))).max() < 1e-3


def test_a_shake_has_still_air_and_the_earths_gravity():
    drive = TakeDrive([], 60.0)
    assert drive.winds == () and drive.gravity == pytest.approx([0.0, 0.0, -9.81])
