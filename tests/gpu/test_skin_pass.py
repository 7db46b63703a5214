"""Soft shadows on skin in drawn pictures, against their reference and hard shadows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.skin.diffusion import blurred, corner_shifts, soft_shadow
from hairloom.addon.shading.skin.layout import SkinLayout, skin_layout
from hairloom.addon.shading.skin.settings import SkinSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

DEEP = VolumeSettings(shadows="deep", resolution=256, strand_fraction=1.0, scattering=False)
SUN = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 3.0)
SIDES = 16


def ball(radius: float = 0.1) -> Surface:
    """A sphere of quads by latitude and longitude; in the map each eighth is an island."""
    around = np.linspace(0.0, 2.0 * np.pi, SIDES + 1)
    polar = np.linspace(0.15, np.pi - 0.15, SIDES // 2 + 1)
    p, a = np.meshgrid(polar, around, indexing="ij")
    grid = radius * np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    row, column = (i.ravel() for i in np.indices((SIDES // 2, SIDES)))
    low = row * (SIDES + 1) + column
    up = low + SIDES + 1
    first = np.stack([low, up, up + 1], axis=1)
    triangles = np.concatenate([first, np.stack([low, up + 1, low + 1], axis=1)])
    places = np.stack([a / (2.0 * np.pi), 1.0 - p / np.pi], axis=-1).reshape(-1, 2)
    uv = places[triangles]
    # a gap after each eighth; every second one is upside down
    eighth = np.tile(column // 2, 2)
    uv[..., 0] += 0.1 * eighth[:, None]
    uv[eighth % 2 == 1, :, 1] *= -1.0
    return Surface(grid.reshape(-1, 3), triangles, uv)


def strip(heights: float = 0.14, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Dense strands above half of the ball, which block all light there."""
    strands = np.zeros((count, 6, 3), np.float32)
    strands[..., 0] = np.linspace(-0.12, -0.005, count)[:, None]
    strands[..., 1] = np.linspace(-0.12, 0.12, 6)
    strands[..., 2] = heights
    return strands, np.full((count, 6), 4.0e-3, np.float32)


def snapshot_of(surface: Surface, *, is_skin: bool, **settings: Any) -> Any:
    strands, radius = strip()
    return Snapshot(
        strands,
        radius,
        meshes=(MeshSnapshot.of(surface, is_skin=is_skin),),
        lights=(SUN,),
        ambient=(0.0, 0.0, 0.0),
        volume=DEEP,
        skin=SkinSettings(**{"skin_resolution": 256, **settings}),
        strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0),
    )


@pytest.fixture
def frame() -> Any:
    from hairloom.addon.render import frame

    return frame


def drawn(snapshot: Any, size: int = 96) -> tuple[np.ndarray, Any]:
    """The picture from the front and above, without the hair, and the mesh pass."""
    import gpu

    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import drawing_into, texture_to_array

    view = look_at((0.0, -0.6, 0.5), (0.0, 0.0, 0.02))
    camera = Camera(view, orthographic(0.24, 1.0, 0.0, 3.0))
    color = gpu.types.GPUTexture((size, size), format="RGBA32F")
    depth = gpu.types.GPUTexture((size, size), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    mesh_pass, opacity = MeshPass(), StrandPass().opacity(snapshot)
    with drawing_into(target):
        target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        mesh_pass.draw(snapshot, camera, size, size, opacity=opacity)
    return texture_to_array(color), mesh_pass


def noise(layout: SkinLayout) -> np.ndarray:
    return np.random.default_rng(7).random((*layout.island.shape, 4)).astype(np.float32)


@pytest.mark.alike
@pytest.mark.parametrize("softness", [0.0005, 0.004, 0.03])
def test_the_blur_is_its_twins(softness: float) -> None:
    from hairloom.addon.render.skin_pass import layout_textures, spread
    from hairloom.addon.render.textures import texture_from, texture_to_array

    layout = skin_layout(ball(), 256)
    textures, values = layout_textures(layout), noise(layout)
    for axis in range(2):
        found = texture_to_array(spread(texture_from(values, "RGBA32F"), textures, softness, axis))
        expected = blurred(values, layout, softness, axis)
        assert np.abs(found - expected)[layout.island >= 0].max() < 2e-5


def test_the_light_that_hair_leaves_has_its_color(compute: Callable[..., np.ndarray]) -> None:
    """Without spreading, each channel is reduced by its own fraction; no channel is negative."""
    forward = np.array([0.9, 0.35, 0.05])
    depth = np.linspace(0.0, 12.0, 50)
    mean = 1.0 - forward.mean()

    def found(soft: np.ndarray) -> np.ndarray:
        places = np.column_stack([soft, depth, 0.0 * depth, 0.0 * depth])[None]
        forwards = np.broadcast_to([*forward, 0.0], (1, len(depth), 4))
        textures = {"places": places.astype(np.float32), "forwards": forwards.astype(np.float32)}
        return compute("skin_colored.glsl", (len(depth), 1), textures=textures)[0, :, :3]

    expected = np.exp(-depth[:, None] * (1.0 - forward))
    np.testing.assert_allclose(found(np.exp(-depth * mean)), expected, rtol=1e-3, atol=1e-6)
    # the common value of a seam's two sides can be negative
    np.testing.assert_array_equal(found(np.full(50, -1.0e-3)), 0.0)


def test_look_ups_and_closed_corners_are_their_twins(
    compute: Callable[..., np.ndarray], gpu_context: Any
) -> None:
    from hairloom.addon.render.skin_pass import SKIN_TEXTURES, closing_shifts, layout_textures
    from hairloom.addon.render.textures import texture_from, texture_to_array

    # four islands around a point, the quarters of a cut plane
    line = np.linspace(0.0, 0.2, 5)
    x, y = np.meshgrid(line, line)
    row, column = np.divmod(np.arange(16), 4)
    low = row * 5 + column
    triangles = np.concatenate(
        [np.stack([low, low + 1, low + 6], axis=1), np.stack([low, low + 6, low + 5], axis=1)]
    )
    positions = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    uv = positions[triangles][..., :2] / 0.2
    uv += 0.3 * (uv.mean(axis=1, keepdims=True) > 0.5)
    layout = skin_layout(Surface(positions, triangles, uv), 256)
    values = noise(layout)
    shadow, textures = texture_from(values, "RGBA32F"), layout_textures(layout)
    shifts = closing_shifts(shadow, textures)
    expected = corner_shifts(values, layout)
    assert np.abs(expected).max() > 0.01
    found = texture_to_array(shifts).reshape(-1, 2, 4)[: len(expected)]
    assert np.abs(found - expected).max() < 1e-5

    random = np.random.default_rng(2)
    triangle = random.integers(len(triangles), size=2000)
    weights = random.dirichlet((0.3, 0.3, 0.3), size=2000)
    place = np.einsum("ni,nij->nj", weights, layout.place[triangle])
    island = layout.triangle_island[triangle]
    asked = np.column_stack([place, island, np.zeros(2000)])[None].astype(np.float32)
    samplers = {"skin_shadow": shadow, "skin_shifts": shifts} | {
        name: textures[name] for _, name in SKIN_TEXTURES[1:4]
    }
    result = compute(
        "skin_look_up.glsl",
        (2000, 1),
        textures={"places": asked},
        samplers={name: ("FLOAT_2D", texture) for name, texture in samplers.items()},
    )[0]
    soft, known = soft_shadow(values, layout, asked[0, :, :2].astype(float), island)
    off = np.abs(result[:, :3] - soft[:, :3]).max(axis=1)
    # where two seams are equally near either may be chosen
    assert np.percentile(off, 99.0) < 1e-3
    assert np.abs(result[:, 3] - known).max() < 1e-3


def test_the_map_holds_what_is_in_the_way_of_the_light(gpu_context: Any) -> None:
    """With almost no softness, the map is the shadow of the hair above and of the ball itself."""
    surface = ball()
    _, mesh_pass = drawn(snapshot_of(surface, is_skin=True, softness=1e-6))
    (shadow,) = mesh_pass.skin.drawn_shadows
    layout, found = shadow.layout, shadow.picture()[..., 0]
    weights = np.dstack([1.0 - layout.weights.sum(axis=-1), layout.weights])
    place = np.einsum("hwi,hwij->hwj", weights, surface.corners[layout.triangle])
    is_shown = layout.island >= 0
    open_sky = is_shown & (place[..., 0] > 0.01) & (place[..., 2] > 0.03)
    below_hair = is_shown & (place[..., 0] < -0.01) & (place[..., 2] > 0.03)
    # towards the border of a light's map the shadows of meshes fade
    is_amid = np.hypot(place[..., 0], place[..., 1]) < 0.08
    dark_side = is_shown & is_amid & (place[..., 2] < -0.03)
    assert found[open_sky].mean() > 0.98
    assert found[below_hair].mean() == pytest.approx(np.exp(-40 * 8.0e-3 / 0.115), abs=0.05)
    # a little light passes through the ball, which is open at both poles
    assert found[dark_side].mean() < 0.06


def test_without_softness_the_shadow_is_that_of_other_meshes(gpu_context: Any) -> None:
    """As without UVs; with little softness it hardly differs."""
    surface = ball()
    plain, _ = drawn(snapshot_of(surface, is_skin=False))
    bare, _ = drawn(snapshot_of(replace(surface, corner_uv=None), is_skin=True))
    still, _ = drawn(snapshot_of(surface, is_skin=True, softness=0.0))
    off, _ = drawn(snapshot_of(surface, is_skin=True, soft_shadow=False))
    for other in (bare, still, off):
        assert np.array_equal(plain, other)
    little = snapshot_of(surface, is_skin=True, softness=2e-4, skin_resolution=1024)
    near, _ = drawn(little)
    assert np.abs(near - plain).mean() < 0.01 * plain[..., 0].mean()


def test_soft_shadows_have_soft_edges_and_keep_their_light(gpu_context: Any) -> None:
    plain, _ = drawn(snapshot_of(ball(), is_skin=True, softness=0.0))
    soft, _ = drawn(snapshot_of(ball(), is_skin=True, softness=0.01))
    assert soft.mean() == pytest.approx(plain.mean(), rel=0.05)
    # below the opening at the pole, through which the inside is seen
    steepest = [
        np.abs(np.diff(picture[60:69, 30:66, 0], axis=1)).max() for picture in (plain, soft)
    ]
    assert steepest[1] < 0.4 * steepest[0]


def test_no_seam_is_seen_in_the_map(gpu_context: Any) -> None:
    """Both sides of seams agree where the edge of the hair's shadow crosses them."""
    _, mesh_pass = drawn(snapshot_of(ball(), is_skin=True, softness=0.003))
    (shadow,) = mesh_pass.skin.drawn_shadows
    values, layout = shadow.picture(), shadow.layout
    middle = layout.seams.mean(axis=1)
    sides = [
        soft_shadow(values, layout, middle[:, 2 * k :][:, :2], layout.seam_islands[:, k])[0]
        for k in range(2)
    ]
    assert np.ptp(sides[0][:, 0]) > 0.5
    assert np.abs(sides[0] - sides[1]).max() < 2.0 / 255.0


def test_a_head_in_parts_has_the_shadow_of_the_whole(gpu_context: Any) -> None:
    """The render engine passes one part per material; the shadow continues across parts."""
    from hairloom.addon.render.snapshot import Skin

    snapshot = snapshot_of(ball(), is_skin=True, softness=0.01)
    (whole,) = snapshot.meshes
    triangles, uv = whole.surface.triangles, whole.surface.corner_uv
    number = np.arange(len(triangles))
    parts = tuple(
        replace(
            whole,
            surface=replace(whole.surface, triangles=triangles[chosen], corner_uv=uv[chosen]),
            skin=Skin(whole.surface, chosen),
        )
        for chosen in (number[number % 3 == 0], number[number % 3 > 0])
    )
    expected, _ = drawn(snapshot)
    found, mesh_pass = drawn(replace(snapshot, meshes=parts))
    assert len(mesh_pass.skin.drawn_shadows) == 1
    assert np.abs(found - expected).max() < 1e-5


def test_it_is_drawn_again_only_when_something_moved(gpu_context: Any) -> None:
    from hairloom.addon.render.skin_pass import SkinPass
    from hairloom.addon.render.strand_pass import StrandPass

    snapshot = snapshot_of(ball(), is_skin=True)
    strand_pass, skin_pass, (mesh,) = StrandPass(), SkinPass(), snapshot.meshes

    def shadow(mesh: Any, opacity: Any, **changed: Any) -> Any:
        settings = replace(snapshot.skin, **changed)
        return skin_pass.shadows((mesh,), opacity, settings, 1)[id(mesh)]

    opacity = strand_pass.opacity(snapshot)
    first = shadow(mesh, opacity)
    assert shadow(mesh, opacity) is first
    assert shadow(mesh, opacity, softness=0.01) is not first
    before = mesh.skin.surface
    moved = Surface(before.positions + np.float32(0.01), before.triangles, before.corner_uv)
    again = shadow(MeshSnapshot.of(moved, is_skin=True), opacity)
    assert again is not first and again.layout is first.layout
    assert shadow(mesh, opacity, skin_resolution=128).layout is not first.layout
