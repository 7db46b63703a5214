"""A real groom on a real head: its lengths, contact with the true mesh, and the return to its
style."""

from itertools import pairwise

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import DistanceField
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.dynamics.measure import deepest_penetration, max_stretch
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import closest_point


@pytest.fixture(scope="module")
def sintel(shared_data):
    folder = shared_data / "sintel"
    groom = read_tfx(folder / "SintelHairOriginal-sintel_hair.16points.tfx").strands.grid
    vertices, triangles = [], []
    for line in (folder / "sintel-collider.obj").read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            x, y, z = map(float, words)
            vertices.append((x, -z, y))  # Y up to Z up
        elif kind == "f":
            first, *rest = (int(word.split("/")[0]) - 1 for word in words)
            triangles += [(first, *pair) for pair in pairwise(rest)]
    return groom[::57], Surface(np.array(vertices, np.float32), np.array(triangles))


def true_depth(points, surface):
    closest = closest_point(points, surface).distance
    return float((closest * (winding_number(points, surface) > 0.5)).max())


@pytest.mark.slow
def test_a_shaken_head(kit, shake, sintel):
    groom, surface = sintel
    settings = DynamicsSettings()
    field = DistanceField.from_surface(surface, settings)
    pivot = kit.translation(0.0, 0.01, 1.45)

    def motion(time):
        return pivot @ shake(time) @ np.linalg.inv(pivot) if time < 2.0 else np.eye(4)

    scene = kit.Scene(groom, settings, motion, on_head=(field,))
    states = scene.play(3.5)
    assert max(max_stretch(state) for state in states) < 0.01
    for frame, state in list(enumerate(states))[1::10]:
        assert deepest_penetration(state, scene.colliders(0, frame / 60)) < 1e-3
        local = kit.moved(np.linalg.inv(motion(frame / 60)), state.grid[:, 2:].reshape(-1, 3))
        assert true_depth(local, surface) < 1e-3
    away = np.linalg.norm(states[-1].grid[:, -1] - groom[:, -1], axis=1)
    swung = np.linalg.norm(
        states[40].grid[:, -1] - kit.moved(motion(40 / 60), groom)[:, -1], axis=1
    )
    assert np.median(swung) > 0.004
    assert np.median(away) < 0.001
    assert away.max() < 0.008  # a few that the collision radius keeps off the head
