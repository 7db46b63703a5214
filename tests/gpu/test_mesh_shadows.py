"""Shadows of meshes on meshes: against rays through boxes, and against the reference in numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import LIGHT_CAPACITY, Cone, Light, light_irradiance
from hairloom.addon.shading.mesh_shadow_settings import MeshShadowSettings
from hairloom.addon.shading.volume.mesh_frames import ball_of_casters, extent_of, mesh_frames
from hairloom.addon.shading.volume.mesh_light import disk_radius, mesh_light
from hairloom.addon.strands import Surface

WHITE = (1.0, 1.0, 1.0)
UP = np.array([0.0, 0.0, 1.0])
DOWN = Cone(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), 1.4, 0.1)
#: centres and sides of boxes on or above the ground [m]
BOXES = (((0.0, 0.0, 0.5), 1.0), ((-1.6, 0.7, 1.5), 0.5), ((1.5, -0.4, 0.2), 0.4))
LIGHTS = {
    "sun": Light.sun((0.5, 0.6, -0.7), WHITE, 3.0),
    "lamp": Light.point((-2.5, -3.0, 4.0), WHITE, 100.0),
    "lamp amidst": Light.point((-0.6, -1.0, 0.8), WHITE, 100.0),
    "spot": Light.spot((0.4, -0.3, 3.0), WHITE, 100.0, DOWN),
    "panel": Light.area(
        (0.9, 0.9, 0.9),
        WHITE,
        100.0,
        Panel((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), 0.1, 0.1),
    ),
}
SETTINGS = MeshShadowSettings(mesh_resolution=512)


def box(center: tuple[float, float, float], side: float) -> Surface:
    """A box of triangles with four vertices per face."""
    faces = []
    for axis in range(3):
        for sign in (-0.5, 0.5):
            ring = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])[:: int(2 * sign)]
            faces.append(np.roll(np.insert(ring, 0, sign, axis=1), axis, axis=1))
    positions = np.concatenate(faces) * side + center
    quads = 4 * np.arange(6)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return Surface(positions.astype(np.float32), quads.reshape(-1, 3).astype(np.int32))


def ground(half: float = 30.0, height: float = 0.0) -> Surface:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    positions = np.insert(corners, 2, height, axis=1).astype(np.float32)
    return Surface(positions, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


SCENE = (ground(), *(box(*each) for each in BOXES))


def is_lit(light: Light, points: np.ndarray) -> np.ndarray:
    """Whether no box blocks the light, by ray tests against the slabs of its faces."""
    direction = np.asarray(light.vector) - (0.0 if light.kind == "sun" else points)
    direction = np.broadcast_to(direction, points.shape)
    farthest = np.inf if light.kind == "sun" else 1.0
    lit = np.ones(len(points), bool)
    for center, side in BOXES:
        with np.errstate(divide="ignore"):
            ends = [(np.array(center) + sign * 0.5 * side - points) / direction for sign in (-1, 1)]
        enters, leaves = np.minimum(*ends).max(axis=1), np.maximum(*ends).min(axis=1)
        lit &= ~((enters < leaves) & (leaves > 1e-9) & (enters < farthest))
    return lit


def found_light(
    compute: Callable[..., np.ndarray], maps: Any, points: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """The light that the shader finds from the first two lights, (n, 2)."""
    textures = {"points": points, "normals": np.broadcast_to(normals, points.shape)}
    return compute(
        "mesh_light.glsl",
        (len(points), 1),
        textures={
            name: np.pad(values, ((0, 0), (0, 1)))[None].astype(np.float32)
            for name, values in textures.items()
        },
        blocks={"mesh_shadows": maps.feature(0).blocks["mesh_shadows"]},
        samplers={"mesh_depths": ("DEPTH_2D_ARRAY", maps.depths)},
        structs=("struct_mesh_shadows.glsl",),
    )[0, :, :2]


def maps_of(casters: Any, lights: Any, settings: MeshShadowSettings = SETTINGS) -> Any:
    from hairloom.addon.render.mesh_shadows import MeshShadowPass

    return MeshShadowPass().maps(casters, lights, settings)


def texel_at(light: Light, points: np.ndarray) -> np.ndarray:
    """Size of a texel on the ground at these points, along its longer side, (n,) [m]."""
    ball = ball_of_casters([extent_of(each) for each in SCENE])
    assert ball is not None
    size = np.full(len(points), np.inf)
    for frame in mesh_frames(light, ball):
        place, _ = frame.places(points)
        inside = ((place >= 0.0) & (place <= 1.0)).all(axis=1)
        steps = [frame.places(points + 1e-4 * np.eye(3)[axis])[0] - place for axis in (0, 1)]
        turn = np.stack(steps, axis=2) / 1e-4
        least = np.linalg.svd(turn, compute_uv=False)[:, -1]
        size = np.where(inside, 1.0 / (SETTINGS.mesh_resolution * np.maximum(least, 1e-9)), size)
    return np.where(np.isfinite(size), size, 0.0)


@pytest.mark.parametrize("name", LIGHTS)
def test_shadows_on_the_ground_are_those_of_rays(
    gpu_context: Any, compute: Callable[..., np.ndarray], name: str
) -> None:
    """At lit and at shaded points, except within the filter disk's width of an edge."""
    light, random = LIGHTS[name], np.random.default_rng(5)
    points = np.zeros((12000, 3))
    points[:, :2] = random.uniform(-4.0, 4.0, (12000, 2))
    texels = disk_radius(SETTINGS.mesh_resolution) + 2.0
    aside = texels * texel_at(light, points)[:, None]
    ways = [aside * np.array([np.cos(a), np.sin(a), 0.0]) for a in np.arange(0.0, 6.2, 0.7854)]
    expected = is_lit(light, points)
    is_clear = np.all([is_lit(light, points + direction) == expected for direction in ways], axis=0)
    under = [np.abs(points - center)[:, :2].max(axis=1) < 0.5 * side for center, side in BOXES]
    is_clear &= ~np.any(under, axis=0)
    is_clear &= light_irradiance(light, points).sum(axis=1) > 0.0
    assert is_clear.mean() > 0.2
    assert 0.02 < (~expected[is_clear]).mean() < 0.9
    maps = maps_of(SCENE, (LIGHTS["sun"], light))
    found = found_light(compute, maps, points[is_clear], UP)[:, 1]
    np.testing.assert_allclose(found, expected[is_clear], atol=1e-4)


@pytest.mark.parametrize("name", ["sun", "lamp"])
def test_an_edge_lies_where_it_should(
    gpu_context: Any, compute: Callable[..., np.ndarray], name: str
) -> None:
    """The place of half light is within half a texel of the edge; bias does not move it."""
    light = {
        "sun": Light.sun((0.5, 0.0, -1.0), WHITE, 3.0),
        "lamp": Light.point((-1.5, 0.2, 2.0), WHITE, 100.0),
    }[name]
    edge = {"sun": 1.0, "lamp": 2.5}[name]
    maps = maps_of((ground(), box((0.0, 0.0, 0.5), 1.0)), (light,))
    points = np.zeros((2001, 3))
    points[:, 0] = edge + np.linspace(-0.1, 0.1, 2001)
    points[:, 1] = 0.2
    found = found_light(compute, maps, points, UP)[:, 0]
    half = points[np.searchsorted(found, 0.5), 0]
    texel = {"sun": 2.0, "lamp": 5.0}[name] / SETTINGS.mesh_resolution
    assert abs(half - edge) < 0.75 * texel
    assert found[0] == 0.0 and found[-1] == pytest.approx(1.0, abs=1e-6)
    assert (np.diff(found) >= -1e-6).all()
    # beside the box there is no gap between it and its shadow
    points[:, 0] = np.linspace(0.5 + 2.0 * texel, 0.9, 2001)
    assert found_light(compute, maps, points, UP)[:, 0].max() < 1e-6


def along_an_edge(compute: Callable[..., np.ndarray], resolution: int) -> np.ndarray:
    """The remaining light of a sun beside the oblique edge of a sheet's shadow: a row for each
    distance from -0.1 to 0.1 m, (150, 100)."""
    sheet, angle = ground(1.0, 1.0), np.radians(20.0)
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    across = np.cross(UP, along)
    turned = sheet.positions @ np.stack([along, across, UP])
    maps = maps_of(
        (ground(), Surface(turned.astype(np.float32), sheet.triangles), box((0.0, 0.0, 0.1), 0.1)),
        (Light.sun((0.0, 0.0, -1.0), WHITE, 3.0),),
        replace(SETTINGS, mesh_resolution=resolution),
    )
    steps, distances = np.linspace(-0.5, 0.5, 100), np.linspace(-0.1, 0.1, 150)
    points = steps[:, None] * along + (1.0 + distances)[:, None, None] * across
    return found_light(compute, maps, points.reshape(-1, 3), UP)[:, 0].reshape(150, 100)


def test_an_oblique_edge_has_no_steps(gpu_context: Any, compute: Callable[..., np.ndarray]) -> None:
    """Brightness is nearly constant along it; with unfiltered texels it ranges from dark to
    light."""
    found = along_an_edge(compute, 1024)
    assert found[0].max() == 0.0 and found[-1].min() > 0.999
    assert np.ptp(found, axis=1).max() < 0.12
    assert (np.diff(found.mean(axis=1)) > -1e-3).all()


def test_an_edge_is_as_soft_at_any_resolution(
    gpu_context: Any, compute: Callable[..., np.ndarray]
) -> None:
    widths = []
    for resolution in (1024, 4096):
        profile = along_an_edge(compute, resolution).mean(axis=1)
        widths.append(((profile > 0.1) & (profile < 0.9)).sum())
    assert widths[0] == pytest.approx(widths[1], rel=0.25)
    assert widths[1] > 8


def test_samples_of_a_picture_look_up_places_all_around(gpu_context: Any) -> None:
    """Shifts up to a texel, evenly in all directions, give smooth edges in the mean of samples."""
    maps = maps_of((ground(), box((0.0, 0.0, 0.5), 1.0)), (LIGHTS["sun"],))
    shifts = np.array(
        [maps.feature(sample).blocks["mesh_shadows"][1][-4:-2] for sample in range(64)]
    )
    assert np.abs(shifts).max() <= 1.0
    for across in (-1.0, 1.0):
        for upward in (-1.0, 1.0):
            assert 12 <= ((shifts * (across, upward)) > 0.0).all(axis=1).sum() <= 20
    rest = [
        np.delete(maps.feature(sample).blocks["mesh_shadows"][1], [-4, -3]) for sample in (0, 5)
    ]
    np.testing.assert_array_equal(*rest)


def test_nothing_shades_itself(gpu_context: Any, compute: Callable[..., np.ndarray]) -> None:
    """Not the ground under a low sun, nor the sides of a box, nor a ball of many triangles."""
    sun = Light.sun((0.9, 0.35, -0.12), WHITE, 3.0)
    turns, rises = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 129), np.linspace(0.0, np.pi, 65))
    ball = np.stack(
        [np.sin(rises) * np.cos(turns), np.sin(rises) * np.sin(turns), np.cos(rises)], axis=2
    ).reshape(-1, 3)
    first = (np.arange(64)[:, None] * 129 + np.arange(128)).reshape(-1, 1)
    quads = first + np.array([0, 129, 130, 0, 130, 1])
    positions = (ball + (0.0, 0.0, 8.0)).astype(np.float32)
    round_one = Surface(positions, quads.reshape(-1, 3).astype(np.int32))
    maps = maps_of((ground(), round_one), (sun,))
    corners, normals = round_one.corners, round_one.triangle_normals()
    faces_it = normals @ np.array(sun.vector) > 0.05
    middles = corners.mean(axis=1)
    found = found_light(compute, maps, middles[faces_it], normals[faces_it])[:, 0]
    assert found.min() > 0.999
    flat = np.zeros((5000, 3))
    flat[:, :2] = np.random.default_rng(1).uniform(-3.0, -1.0, (5000, 2))
    maps = maps_of((ground(), box((0.0, 0.0, 0.5), 1.0)), (sun,))
    assert found_light(compute, maps, flat, UP)[:, 0].min() > 0.999


def test_the_shader_agrees_with_its_twin(
    gpu_context: Any, compute: Callable[..., np.ndarray]
) -> None:
    from hairloom.addon.render.textures import texture_to_array

    random = np.random.default_rng(7)
    for name in ("sun", "lamp"):
        settings = replace(SETTINGS, mesh_resolution=64)
        maps = maps_of(SCENE, (LIGHTS[name],), settings)
        depths = texture_to_array(maps.depths)[..., 0]
        points = random.uniform((-3.0, -3.0, 0.0), (3.0, 3.0, 2.0), (4000, 3))
        normals = random.normal(size=(4000, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        ball = ball_of_casters([extent_of(each) for each in SCENE])
        assert ball is not None
        (frame,) = mesh_frames(LIGHTS[name], ball)
        expected = mesh_light(frame, depths, points, normals)
        assert 0.03 < (expected < 0.5).mean() < 0.9
        found = found_light(compute, maps, points, normals)[:, 0]
        # rounding decides where compared depths are equal
        assert (np.abs(found - expected) > 1e-3).mean() < 2e-3


def test_each_light_has_its_maps_when_all_are_amidst_meshes(gpu_context: Any) -> None:
    from hairloom.addon.render.mesh_shadows import pack_mesh_shadows

    ball = ball_of_casters([extent_of(each) for each in SCENE])
    assert ball is not None
    places = np.linspace((-0.6, -1.0, 0.8), (0.9, -1.2, 1.0), LIGHT_CAPACITY)
    lamps = [Light.point(tuple(place), WHITE, 100.0) for place in places.tolist()]
    frames = [mesh_frames(lamp, ball) for lamp in lamps]
    assert sum(map(len, frames)) > 4 * 6 and min(map(len, frames)) >= 5
    settings = MeshShadowSettings(mesh_resolution=64)
    values = maps_of(SCENE, lamps, settings).feature(0).blocks["mesh_shadows"][1]
    assert (values == pack_mesh_shadows(frames, 64)).all()


def test_alpha_lets_light_through(gpu_context: Any, compute: Callable[..., np.ndarray]) -> None:
    """For a sheet with a picture that covers half of it, and for one with an alpha of 0.5."""
    from hairloom.addon.render.snapshot import MeshPictures, MeshSnapshot

    sun = Light.sun((0.0, 0.0, -1.0), WHITE, 3.0)
    plain = ground(1.0, 1.0)
    uv = (plain.corners[..., :2] + 1.0) / 2.0
    leaf = np.ones((64, 64, 4), np.float32)
    leaf[:, 32:, 3] = 0.0
    sheet = MeshSnapshot.of(Surface(plain.positions, plain.triangles, uv))
    points = np.zeros((4000, 3))
    points[:, :2] = np.random.default_rng(2).uniform(-0.9, 0.9, (4000, 2))
    cut = replace(sheet, pictures=MeshPictures(color=leaf), transparency="hashed")
    found = found_light(compute, maps_of((ground(), cut), (sun,)), points, UP)[:, 0]
    assert found[points[:, 0] < -0.05].max() == 0.0
    assert found[points[:, 0] > 0.05].min() == pytest.approx(1.0, abs=1e-6)
    for transparency in ("hashed", "blended"):
        half = replace(sheet, alpha=0.4, transparency=transparency)
        found = found_light(compute, maps_of((ground(), half), (sun,)), points, UP)[:, 0]
        assert found.mean() == pytest.approx(0.6, abs=0.02)
    # a second one behind it has its holes elsewhere
    lower = replace(half, surface=Surface(plain.positions - UP / 2.0, plain.triangles, uv))
    found = found_light(compute, maps_of((ground(), half, lower), (sun,)), points, UP)[:, 0]
    assert found.mean() == pytest.approx(0.36, abs=0.05)


def test_maps_are_drawn_only_when_something_moved(gpu_context: Any) -> None:
    from hairloom.addon.render.mesh_shadows import MeshShadowPass

    shadows, sun = MeshShadowPass(), LIGHTS["sun"]
    first = shadows.maps(SCENE, (sun,), SETTINGS)
    assert first is not None and shadows.maps(SCENE, (sun,), SETTINGS) is first
    moved = (*SCENE[:-1], box((1.4, -0.4, 0.2), 0.4))
    second = shadows.maps(moved, (sun,), SETTINGS)
    assert second is not first
    # the same size and place, so that the light's frame is the same too
    holed = (*moved[:-1], Surface(moved[-1].positions, moved[-1].triangles[2:]))
    third = shadows.maps(holed, (sun,), SETTINGS)
    assert third is not second and np.array_equal(third.values, second.values)
    assert shadows.maps(SCENE[:1], (sun,), SETTINGS) is None
    assert shadows.maps((), (sun,), SETTINGS) is None
    assert shadows.maps(SCENE, (), SETTINGS) is None
    assert shadows.maps(SCENE, (replace(sun, casts_shadow=False),), SETTINGS) is None
    assert shadows.maps(SCENE, (sun,), replace(SETTINGS, mesh_shadows=False)) is None
