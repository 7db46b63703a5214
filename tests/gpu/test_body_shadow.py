"""Hair's shadow over a finished picture of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.snapshot import SKIN
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.look import fibre_of
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.dual import fractions, mean_forward
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 64
#: hair that does not scatter light forward
BLACK = ShadingSettings(model="kajiya_kay")
SUN = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 3.0)
FLOOR = Surface(
    np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
)


def curtain(count: int, spacing: float, height: float) -> np.ndarray:
    strands = np.zeros((count, 6, 3), np.float32)
    strands[..., 0] = spacing * (np.arange(count) - 0.5 * (count - 1))[:, None]
    strands[..., 1] = np.linspace(-0.1, 0.1, 6)
    strands[..., 2] = height
    return strands


def shadow(
    *lights: Light,
    ambient: float = 0.0,
    depth: float = 1.0,
    shadows: str = "deep",
    eye: tuple[float, float, float] = (0.0, -2.0, 0.6),
    shading: ShadingSettings = BLACK,
) -> np.ndarray:
    """The remaining brightness over white, (SIZE, SIZE). Strands cover half of the middle."""
    import gpu

    from hairloom.addon.render.body_shadow import BodyShadow
    from hairloom.addon.render.camera import Camera, look_at, orthographic
    from hairloom.addon.render.snapshot import Snapshot
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import drawing_into, texture_to_array

    strands = curtain(24, 4.0e-3, 0.05)
    snapshot = Snapshot(
        strands,
        np.full(strands.shape[:2], 1.0e-3, np.float32),
        lights=lights,
        ambient=(ambient,) * 3,
        casters=(FLOOR,),
        shading=shading,
        strand_settings=StrandSettings(tip_width=1.0),
        volume=VolumeSettings(shadows=shadows, resolution=16, strand_fraction=1.0),
        table_size=PREVIEW_SIZE,
    )
    maps = StrandPass().opacity(snapshot)
    assert maps is not None
    camera = Camera(look_at(eye, (0.0, 0.0, 0.0)), orthographic(0.2, 1.0, 0.0, 9.0))
    color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    kept = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=kept, color_slots=(color,))
    with drawing_into(target):
        target.clear(color=(1.0, 1.0, 1.0, 1.0), depth=depth)
        BodyShadow().draw(snapshot, maps, camera, SIZE, SIZE)
    picture = texture_to_array(color)
    assert np.ptp(picture[..., :3], axis=-1).max() == 0.0
    return picture[..., 0]


def shown(light: Any) -> Any:
    """Luminance of skin in this light, (..., 3) or one number, as code values to the power of 2.2,
    in which Blender blends overlays."""
    code = 1.055 * (light * np.array(SKIN) / np.pi) ** (1.0 / 2.4) - 0.055
    return code**2.2 @ [0.2126, 0.7152, 0.0722]


@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_skin_is_as_much_darker_on_the_screen_as_hair_leaves_of_its_light(shadows: str) -> None:
    """Under strands that cover half of it, against exp(-0.5); beside them nothing changes."""
    found = shadow(SUN, shadows=shadows)
    expected = shown(3.0 * np.exp(-0.5)) / shown(3.0)
    assert found[30:34, 30:34].mean() == pytest.approx(expected, abs=0.04)
    assert found[30:34, 2:8].min() > 0.99


def test_the_shadow_is_lighter_by_what_hair_sends_on() -> None:
    blond = ShadingSettings(model="marschner", pigment="absorption", absorption=(0.06, 0.12, 0.3))
    black, found = (
        float(shadow(SUN, shading=shading)[30:34, 30:34].mean()) for shading in (BLACK, blond)
    )
    tau = np.linspace(0.0, 2.0, 2001)
    tau = np.interp(-black, -shown(3.0 * np.exp(-tau[:, None])) / shown(3.0), tau)
    sides = fractions(marschner_tables(fibre_of(blond), PREVIEW_SIZE))
    left = np.exp(-tau * (1.0 - mean_forward(sides.forward, blond)))
    expected = shown(3.0 * left) / shown(3.0)
    assert found == pytest.approx(expected, abs=0.01)
    assert found > black + 0.05


def test_other_light_fills_the_shadow() -> None:
    aside = Light.sun((0.0, 1.0, -0.02), (1.0, 1.0, 1.0), 3.0)
    middle = [
        shadow(*lights, ambient=ambient)[30:34, 30:34].mean()
        for lights, ambient in (((SUN,), 0.0), ((SUN,), 1.0), ((SUN, SUN), 0.0))
    ]
    assert middle[0] + 0.05 < middle[1] < 1.0
    assert shadow(SUN, aside)[30:34, 30:34].mean() >= middle[0] - 1e-3


def test_no_shadow_shows_from_below_or_behind_other_objects() -> None:
    assert shadow(SUN, depth=0.0).min() == 1.0
    assert shadow(SUN, eye=(0.0, -2.0, -0.6)).min() > 0.99


def test_a_mesh_that_is_there_already_is_covered_without_gaps() -> None:
    """Its depths come from another transformation, but every pixel is covered."""
    import gpu

    from hairloom.addon.render.body_shadow import BodyShadow
    from hairloom.addon.render.camera import Camera, look_at, perspective
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import drawing_into, texture_to_array

    random = np.random.default_rng(3)
    hill = np.stack(np.meshgrid(*[np.linspace(-0.1, 0.1, 60)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    hill[:, 2] = -3.0 * (hill[:, :2] ** 2).sum(axis=1) + random.normal(size=len(hill)) * 1e-4
    corner = (np.arange(59)[:, None] * 60 + np.arange(59)).ravel()
    halves = (corner, corner + 60, corner + 1), (corner + 1, corner + 60, corner + 61)
    triangles = np.concatenate([np.stack(half, axis=1) for half in halves])
    body = Surface(hill.astype(np.float32), triangles.astype(np.int32))
    strands = curtain(50, 4.0e-3, 0.05)
    volume = VolumeSettings(resolution=16, strand_fraction=1.0)
    radius = np.full(strands.shape[:2], 2e-3, np.float32)
    snapshot = Snapshot(
        strands, radius, lights=(SUN,), shading=BLACK, volume=volume, casters=(body,)
    )
    camera = Camera(look_at((0.2, -0.3, 0.3), (0.0, 0.0, 0.0)), perspective(0.6, 1.0, 0.01, 100.0))
    moved = Camera(camera.view @ np.eye(4), camera.projection * np.float32(1.0 + 1e-7))
    color = gpu.types.GPUTexture((256, 256), format="RGBA32F")
    depth = gpu.types.GPUTexture((256, 256), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    maps = StrandPass().opacity(snapshot)
    assert maps is not None
    with drawing_into(target):
        target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        white = MeshSnapshot.of(body, color=(1.0, 1.0, 1.0))
        lit = Snapshot(strands[:0], radius[:0], meshes=(white,), ambient=(1.0, 1.0, 1.0))
        MeshPass().draw(lit, moved, 256, 256)
    before = texture_to_array(color)
    with drawing_into(target):
        BodyShadow().draw(snapshot, maps, camera, 256, 256)
    left = texture_to_array(color)[..., 0] / np.maximum(before[..., 0], 1e-6)
    drawn = before[..., 3] > 0.0
    middle = np.zeros_like(drawn)
    middle[100:156, 100:156] = True
    assert (drawn & middle).sum() > 1000
    assert (left[drawn & middle] < 0.95).all()
