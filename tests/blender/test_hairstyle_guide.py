"""The hairstyles that docs/hairstyles.md builds from nothing, step by step, with operators."""

import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.scene.curves import curve_offsets, curve_points
from hairloom.addon.blender.sessions.groom_source import GroomSource
from hairloom.addon.blender.sessions.prepared_groom import requested_rig

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tools"))
from guide_steps import PAGE, steps  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")
STEPS = steps()


class Walk:
    """Runs the steps of a hairstyle one after another; each returns roots and tips."""

    def __init__(self, name):
        self.known, self.codes = {}, iter(STEPS[name])

    def step(self):
        exec(compile(next(self.codes), "step", "exec"), self.known)
        bpy.context.view_layer.update()
        points = curve_points(self.hair.data)
        ends = curve_offsets(self.hair.data)
        return points[ends[:-1]], points[ends[1:] - 1]

    @property
    def hair(self):
        return self.known["hair"]


def test_the_page_has_three_of_three_steps_each_and_their_pictures():
    assert {name: len(codes) for name, codes in STEPS.items()} == {
        "bob": 3,
        "swept": 3,
        "ringlets": 3,
    }
    text = PAGE.read_text(encoding="utf-8")
    for name in STEPS:
        assert f"(images/from_nothing_{name}.jpg)" in text
        assert (PAGE.parent / "images" / f"from_nothing_{name}.jpg").is_file()


@pytest.mark.slow(
    instead="tests/blender/test_mirror.py::test_on_a_symmetric_head_only_signs_change"
)
def test_the_bob_is_alike_on_both_sides_and_ends_at_the_chin():
    walk = Walk("bob")
    walk.step()
    roots, tips = walk.step()
    left, right = roots[:, 0] > 1e-6, roots[:, 0] < -1e-6
    assert left.sum() == right.sum() > 400
    assert np.abs(tips[left] * [-1.0, 1.0, 1.0] - tips[right]).max() < 0.01
    was_below = tips[:, 2] < -0.075
    _, tips = walk.step()
    assert was_below.mean() > 0.5
    assert np.abs(tips[was_below, 2] + 0.075).max() < 1e-6
    assert tips[:, 2].min() > -0.075 - 1e-6


@pytest.mark.slow
def test_the_crop_is_swept_to_one_side():
    walk = Walk("swept")
    gone = []
    for _ in range(2):
        roots, tips = walk.step()
        is_right_top = (roots[:, 0] < -0.01) & (roots[:, 2] > 0.09)
        assert is_right_top.sum() > 50
        gone.append(np.median((tips - roots)[is_right_top, 0]))
    assert gone[0] < -0.02
    assert gone[1] > 0.02
    walk.step()
    assert walk.hair.data.hairloom.children.fly_aways == pytest.approx(0.06)


@pytest.mark.slow
def test_ringlets_wind_and_end_on_the_ball():
    walk = Walk("ringlets")
    walk.step()
    walk.hair.data.hairloom.children.strand_count = 200
    plain = children_of(walk.hair)
    walk.step()
    wound = children_of(walk.hair)
    assert np.median(wound.lengths()) > 1.3 * np.median(plain.lengths())
    assert np.median(wound.point_counts) > 60
    roots, tips = walk.step()
    inside = np.linalg.norm(roots - [0.0, 0.02, 0.0], axis=1) < 0.16
    assert inside.mean() > 0.9
    assert np.linalg.norm(tips - [0.0, 0.02, 0.0], axis=1)[inside].max() < 0.17 + 1e-6


def children_of(hair):
    rig = requested_rig(GroomSource(hair, bpy.context.evaluated_depsgraph_get()).request)
    return rig.strands.take(np.arange(rig.own_count, rig.strands.strand_count))
