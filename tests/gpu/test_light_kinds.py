"""Shaders contain only the kinds of light that a scene has, with the same picture as with all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import Cone, Light, kinds_needed
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 48
EYE, WHITE = (0.0, -6.0, 0.0), (1.0, 1.0, 1.0)
SIDE, UP, AHEAD = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
SUN = Light.sun((0.3, 1.0, -0.5), WHITE, 2.0)
POINT = Light.point((1.0, -3.0, 1.0), WHITE, 300.0)
SPOT = Light.spot((0.0, -4.0, 0.0), WHITE, 2e3, Cone((SIDE, UP, (0.0, -1.0, 0.0)), 0.6, 0.5))
AREA = Light.area((0.0, -4.0, 0.5), WHITE, 300.0, Panel(SIDE, UP, AHEAD, 1.0, 0.5))


@pytest.mark.alike
@pytest.mark.parametrize("transparency", ["layers", "none"])
@pytest.mark.parametrize(
    ("lights", "needed"),
    [
        ((), 0),
        ((SUN,), 0),
        ((SUN, POINT), 1),
        ((SPOT,), 1),
        ((AREA, SUN), 2),
        ((POINT, AREA), 2),
    ],
)
def test_light_kinds_that_are_left_out_would_add_nothing(
    lights: tuple[Light, ...], needed: int, transparency: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hairloom.addon.render import frame, view_block

    x, z = np.random.default_rng(4).uniform(-1.0, 1.0, (2, 300, 1))
    along = np.linspace(-1.5, 1.5, 6)
    places = np.broadcast_arrays(x + 0.3 * along, 0.2 * along, 0.5 * z + along)
    strands = np.stack(places, axis=-1).astype(np.float32)
    wall = np.array([[-3, 1, -3], [3, 1, -3], [3, 1, 3], [-3, 1, 3]], np.float32)
    snapshot = Snapshot(
        strands,
        np.full(strands.shape[:2], 0.02, np.float32),
        meshes=(MeshSnapshot.of(Surface(wall, np.array([[0, 1, 2], [0, 2, 3]]))),),
        lights=lights,
        shading=ShadingSettings(model="marschner"),
        strand_settings=StrandSettings(transparency=transparency),
    )
    camera = Camera(look_at(EYE, (0.0, 0.0, 0.0)), perspective(0.7, 1.0, 0.1, 20.0))
    assert kinds_needed(lights) == needed
    found = frame.render_image(snapshot, camera, SIZE, SIZE, 1)
    monkeypatch.setattr(view_block, "kinds_needed", lambda _: 2)
    of_all = frame.render_image(snapshot, camera, SIZE, SIZE, 1)
    assert np.abs(found - of_all).max() <= 1e-5 * max(of_all.max(), 1.0)
    dark = frame.render_image(replace(snapshot, lights=()), camera, SIZE, SIZE, 1)
    assert not lights or np.abs(found - dark).mean() > 0.01, "the lights are seen"
