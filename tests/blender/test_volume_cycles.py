"""Hair with shadows and multiple scattering, compared with Cycles' path tracing: a small part of
bench/_volume_sintel.py that shows changes of the light at once."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from extension_loader import REPOSITORY
from hair_ball import ball_mesh, combed_strands

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.principled import PrincipledHair, settings_from
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

sys.path.append(str(REPOSITORY / "bench"))
from _shading_room import DISTANCE, CyclesRoom

pytestmark = pytest.mark.usefixtures("gpu_context")

RADIUS = 0.004
#: strand count, texels along a side of the opacity map, tolerance of a channel's light on skin; in
#: fine maps each strand lies in its own texels
CASES = {
    "coarse map": (3000, 64, 0.11),
    "fine map": (3000, 512, 0.16),
    "few strands, fine map": (400, 512, 0.19),
}
SIZE, HEIGHT, SAMPLES = 48, 2.2, 8
BLOND = (0.06, 0.12, 0.3)
SUN = (0.45, 0.5, 0.8)
SKINS = {"black skin": (0.0, 0.0, 0.0), "skin": (0.55, 0.38, 0.31)}


def path_traced(strands: np.ndarray, ball: Surface, skin: tuple[float, float, float]) -> np.ndarray:
    room = CyclesRoom()
    room.body(ball.positions, ball.triangles, skin, casts_shadow=True)
    room.leave_out_body(True)
    room.strands(strands, RADIUS)
    room.sun(np.array(SUN))
    room.hair(BLOND, Roughness=0.3, Radial_Roughness=0.3, Offset=np.radians(2.0))
    room.paths(48, 32)
    return room.picture(SIZE, HEIGHT)


def drawn(
    strands: np.ndarray, ball: Surface, skin: tuple[float, float, float], resolution: int
) -> np.ndarray:
    from hairloom.addon.render import frame

    node = PrincipledHair(parametrization="ABSORPTION", absorption_coefficient=BLOND)
    alike = ShadingSettings(color_variation=0.0, shift_noise=0.0, sparkle=0.0)
    mesh = MeshSnapshot.of(ball, color=skin)
    snapshot = Snapshot(
        strands,
        np.full(strands.shape[:2], RADIUS, np.float32),
        meshes=(replace(mesh, specular=0.0, is_holdout=True),),
        lights=(Light.sun(np.negative(SUN), (1.0, 1.0, 1.0), 1.0),),
        ambient=(0.0, 0.0, 0.0),
        shading=settings_from(node, alike)[0],
        strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0, transparency="none"),
        detail=DetailSettings(culling="none", lod_size=0.0),
        volume=VolumeSettings(shadows="deep", strand_fraction=1.0, resolution=resolution),
        volume_center=np.zeros(3, np.float32),
    )
    view = look_at((0.0, 0.0, DISTANCE), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = Camera(view, orthographic(HEIGHT, 1.0, 1.0, 2.0 * DISTANCE))
    picture: np.ndarray = frame.render_image(snapshot, camera, SIZE, SIZE, SAMPLES)
    return picture


@pytest.mark.alike
@pytest.mark.parametrize("skin", SKINS.values(), ids=SKINS)
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_blond_hair_has_the_light_of_path_tracing(case: tuple[int, int, float], skin: Any) -> None:
    """Coverage is within 2 %, and each channel's light within the case's tolerance on skin that
    shines through the hair, and within 13 % on black skin."""
    count, resolution, tolerance = case
    strands, ball = combed_strands(count), Surface(*ball_mesh(24))
    ours, theirs = drawn(strands, ball, skin, resolution), path_traced(strands, ball, skin)
    assert np.abs(ours[..., 3] - theirs[..., 3]).mean() < 0.03
    assert ours[..., 3].mean() == pytest.approx(theirs[..., 3].mean(), rel=0.02)
    light = [picture[..., :3].mean(axis=(0, 1)) for picture in (ours, theirs)]
    # on black skin, light comes from hair only
    assert light[0] == pytest.approx(light[1], rel=tolerance if any(skin) else 0.13)
