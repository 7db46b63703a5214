"""Light that hair scatters forward onto surfaces below it, in pictures, against the reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.look import fibre_of
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.skin.settings import SkinSettings
from hairloom.addon.shading.volume.dual import fractions, mean_forward
from hairloom.addon.shading.volume.opacity import mesh_shadow_weight, transmittance
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 64
BLOND = ShadingSettings(model="marschner", pigment="absorption", absorption=(0.06, 0.12, 0.3))
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
FLOOR = Surface(CORNERS, TRIANGLES, (0.5 * CORNERS[:, :2] + 0.5)[TRIANGLES].astype(np.float32))


def snapshot_of(shading: ShadingSettings, *, scattering: bool, is_skin: bool) -> Any:
    """A floor under crossing strands, denser to one side, in the sun above."""
    from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot

    random = np.random.default_rng(2)
    strands = np.zeros((900, 6, 3), np.float32)
    strands[..., 0] = np.sqrt(random.random(900))[:, None] - 0.5
    strands[..., 0] += 0.1 * random.normal(size=(900, 1)) * np.linspace(-1, 1, 6)
    strands[..., 1] = np.linspace(-0.6, 0.6, 6)
    strands[..., 2] = random.uniform(0.3, 0.5, (900, 1))
    mesh = replace(MeshSnapshot.of(FLOOR, (1.0, 1.0, 1.0), is_skin=is_skin), specular=0.0)
    return Snapshot(
        strands,
        np.full(strands.shape[:2], 2e-3, np.float32),
        meshes=(mesh,),
        lights=(Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), np.pi),),
        ambient=(0.0, 0.0, 0.0),
        shading=shading,
        strand_settings=StrandSettings(tip_width=1.0),
        volume=VolumeSettings(strand_fraction=1.0, scattering=scattering, resolution=32),
        skin=SkinSettings(softness=1e-6 if is_skin else 0.0, skin_resolution=256),
        table_size=PREVIEW_SIZE,
    )


def left_on_the_floor(snapshot: Any) -> np.ndarray:
    """The fraction of light that arrives under the hair, seen from between hair and floor, (n,
    3)."""
    from hairloom.addon.render.camera import Camera, look_at, orthographic
    from hairloom.addon.render.frame import render_image

    camera = Camera(
        look_at((0.0, 0.0, 0.2), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        orthographic(0.8, 1.0, 0.0, 1.0),
    )
    return render_image(snapshot, camera, SIZE, SIZE, 1)[..., :3].reshape(-1, 3)


@pytest.mark.parametrize("is_skin", [False, True], ids=["mesh", "skin"])
def test_skin_under_hair_gets_the_light_that_hair_scatters_forward(*, is_skin: bool) -> None:
    """Against the reference's transmittance with forward scattering, for the tau that is measured
    without it."""
    straight = left_on_the_floor(snapshot_of(BLOND, scattering=False, is_skin=is_skin))
    found = left_on_the_floor(snapshot_of(BLOND, scattering=True, is_skin=is_skin))
    assert np.ptp(straight, axis=1).max() < 1e-6
    assert straight.min() < 0.2 and straight.max() > 0.6
    sides = fractions(marschner_tables(fibre_of(BLOND), PREVIEW_SIZE))
    forward = mean_forward(sides.forward, BLOND)
    assert forward[0] > forward[1] + 0.03 > forward[2] + 0.06
    expected = transmittance(-np.log(straight), 1.0, forward)
    # the shadow on skin is blended between texels before it is coloured
    assert found == pytest.approx(expected, abs=0.02 if is_skin else 1e-4)


def test_the_soft_edge_of_a_meshs_shadow_has_no_colour_of_hair() -> None:
    """A plate blocks the light, and hair stands only at the sides."""
    snapshot = snapshot_of(BLOND, scattering=True, is_skin=True)
    plate = Surface((0.2 * CORNERS + [-0.2, 0.0, 0.4]).astype(np.float32), TRIANGLES)
    aside = snapshot.points.copy()
    aside[:, 0] += np.where(np.arange(len(aside)) // 6 % 2, 1.2, -1.2)
    skin = replace(snapshot.skin, softness=0.03)
    found = left_on_the_floor(replace(snapshot, points=aside, casters=(plate,), skin=skin))
    assert ((found > 0.2) & (found < 0.8)).mean() > 0.02
    assert np.ptp(found, axis=1).max() < 5e-3


def test_hair_without_forward_scattering_casts_a_plain_shadow() -> None:
    kajiya_kay = replace(BLOND, model="kajiya_kay")
    alike = [
        left_on_the_floor(snapshot_of(each, scattering=scatters, is_skin=False))
        for each, scatters in ((kajiya_kay, True), (BLOND, False))
    ]
    assert np.array_equal(*alike)


def test_weights_near_the_map_border_are_those_of_the_reference(
    compute: Callable[..., np.ndarray],
) -> None:
    places = np.random.default_rng(1).uniform(-0.2, 1.2, (500, 2))
    found = compute(
        "mesh_shadow_weight.glsl",
        (500, 1),
        textures={"places": np.pad(places, ((0, 0), (0, 2)))[None].astype(np.float32)},
        structs=("struct_opacity.glsl",),
    )[0, :, 0]
    expected = mesh_shadow_weight(places)
    assert 0.1 < expected.mean() < 0.9
    assert found == pytest.approx(expected, abs=1e-5)


def test_the_shadow_of_a_mesh_goes_on_beyond_the_map_of_hair() -> None:
    """A long plank above hair and floor: its shadow is dark from end to end."""
    from hairloom.addon.render.camera import Camera, look_at, orthographic
    from hairloom.addon.render.frame import render_image
    from hairloom.addon.render.snapshot import MeshSnapshot

    plank = np.array([[-0.3, -5, 0.9], [0.3, -5, 0.9], [0.3, 5, 0.9], [-0.3, 5, 0.9]], np.float32)
    wide = Surface(4.0 * CORNERS, TRIANGLES)
    snapshot = snapshot_of(BLOND, scattering=False, is_skin=False)
    camera = Camera(
        look_at((0.0, 0.0, 0.2), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        orthographic(2.0, 1.0, 0.0, 1.0),
    )
    snapshot = replace(
        snapshot,
        meshes=(replace(MeshSnapshot.of(wide, (1.0, 1.0, 1.0)), specular=0.0),),
        casters=(Surface(plank, TRIANGLES),),
        volume=replace(snapshot.volume, extinction=0.0, resolution=256),
    )
    found = render_image(snapshot, camera, SIZE, SIZE, 1)[..., 0]
    assert found[:, SIZE // 2].max() == 0.0
    assert found[:, [0, -1]].min() > 0.99
