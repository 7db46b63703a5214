"""The fast step against the slow one: two solvers that share next to nothing must agree."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import DistanceField, SphereCollider
from hairloom.addon.dynamics.measure import deepest_penetration
from hairloom.addon.dynamics.reference import advance_slowly
from hairloom.addon.dynamics.settings import DynamicsSettings

#: [m] in 0.4 s of float32 against float64: limp strands enlarge what rounding starts about
#: seventyfold (the slow form does it too, started one rounding apart), contacts more.
FREE, TOUCHING = 2e-4, 1e-3
#: Else one form takes a last Newton step that the other finds needless by a hair.
TIGHT = {"length_tolerance": 0.0001}


def both(kit, scene, seconds=0.4, fps=50.0):
    slow = kit.Scene(**scene.__dict__ | {"advance": advance_slowly})
    return scene.play(seconds, fps), slow.play(seconds, fps)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"bend": 0.0, "damping": 3.0},
        {"weight_held": 0.0, "style_damping": 0.0},
        {"style_root": 0.0, "style_tip": 0.0, "bend": 3.0},
        {"substep_rate": 100.0, "length_iterations": 2},
    ],
)
def test_without_colliders(kit, shake, values):
    scene = kit.Scene(kit.curly(8, 12), DynamicsSettings(**TIGHT | values), shake)
    fast, slow = both(kit, scene)
    assert np.abs(fast[-1].position - fast[0].position).max() > 0.005
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=FREE)
        assert one.time_left == pytest.approx(other.time_left, abs=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_with_a_ball_and_a_mesh(kit, shake, friction):
    settings = DynamicsSettings(
        **kit.LIMP | TIGHT | {"damping": 1.0, "friction": friction, "collider_resolution": 24}
    )
    mesh = DistanceField.from_surface(kit.icosphere(0.095, 2), settings)
    grid = kit.curly(6, 12)
    ball = SphereCollider(grid[3, 7] + [0.0, 0.0, 0.03], 0.05)
    scene = kit.Scene(grid, settings, shake, on_head=(mesh,), standing=(ball,))
    fast, slow = both(kit, scene)
    assert deepest_penetration(fast[0], scene.colliders(0, 0)) > 0.0  # some start inside
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=TOUCHING)


def test_no_guides(kit, shake):
    scene = kit.Scene(np.zeros((0, 8, 3), np.float32), DynamicsSettings(), shake)
    fast, slow = both(kit, scene, 0.1)
    assert fast[-1].position.shape == slow[-1].position.shape
