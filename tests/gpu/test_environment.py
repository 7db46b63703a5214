"""The world's light: the shader against Python, and in pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import is_same
from hair_ball import ball_mesh, combed_strands
from tiers import few_in_commits

from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.environment import (
    Environment,
    diffuse_light,
    environment_of,
    octant_light,
    panorama_directions,
    path_from_openness,
    radiance_from,
)
from hairloom.addon.shading.lights import pack_lights
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.strands import Surface

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def sky() -> Environment:
    """A sky of many colours, brightest at one side, with a sun."""
    directions, _ = panorama_directions(32, 64)
    x, y, z = np.moveaxis(directions, -1, 0)
    radiance = np.stack([1.0 + 0.8 * x, 0.8 + 0.4 * y * z, 0.7 + 0.6 * z * x], axis=-1)
    radiance[24, 10] += 300.0
    return environment_of(radiance)


def test_twins(compute: Callable[..., np.ndarray]) -> None:
    environment, count = sky(), 64
    random = np.random.default_rng(2)
    towards = random.normal(size=(count, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    openness = random.uniform(-0.5, 1.0, (count, 4))
    block = pack_lights((), environment.ambient, environment.harmonics)
    found = compute(
        "environment.glsl",
        (count, 4),
        textures={
            "directions": np.pad(towards, ((0, 0), (0, 1)))[None].astype(np.float32),
            "open_at": openness[None].astype(np.float32),
        },
        blocks={"lights": ("Lights", block)},
        structs=("struct_lights.glsl",),
    )
    assert found[0, :, :3] == pytest.approx(
        radiance_from(environment, towards, (0.9, 0.7)), abs=1e-5
    )
    assert found[1, :, :3] == pytest.approx(diffuse_light(environment, towards), abs=1e-5)
    corners = octant_light(environment, np.arange(count) % 8)
    assert found[2, :, :3] == pytest.approx(corners, abs=1e-5)
    assert found[3, :, :2] == pytest.approx(path_from_openness(openness, towards), abs=1e-3)


def lit(environment: Environment, turn: np.ndarray, model: str = "marschner") -> Snapshot:
    """Hair on a ball, both turned, in this light."""
    points = combed_strands(1500)
    radius = np.full(points.shape[:2], 0.01, np.float32)
    positions, triangles = ball_mesh(24)
    surface = Surface((positions @ turn.T).astype(np.float32), triangles)
    openness = np.tile(np.float32([0.45, 0.1, 0.35, 0.05]), (points.shape[0] * points.shape[1], 1))
    return Snapshot(
        (points @ turn.T).astype(np.float32),
        radius,
        meshes=(MeshSnapshot.of(surface),),
        lights=environment.suns,
        ambient=environment.ambient,
        harmonics=environment.harmonics,
        openness=openness,
        shading=ShadingSettings(model=model),
        volume_center=np.zeros(3, np.float32),
    )


def seen(frame: Any, snapshot: Snapshot, turn: np.ndarray) -> np.ndarray:
    eye, up = turn @ np.array([0.4, -4.0, 1.0]), turn @ np.array([0.0, 0.0, 1.0])
    view = look_at(tuple(eye), (0.0, 0.0, 0.0), up=tuple(up))
    camera = Camera(view, perspective(np.radians(35.0), 1.0, 0.1, 20.0))
    return frame.render_image(snapshot, camera, 96, 96, 2)


@pytest.mark.parametrize("model", few_in_commits(["marschner", "kajiya_kay"]))
def test_turning_the_world_is_turning_all_else(frame: Any, model: str) -> None:
    directions, _ = panorama_directions(32, 64)
    radiance = 1.0 + 0.9 * directions[..., :1] * np.ones(3)
    radiance[20, 40] += 200.0
    still = seen(frame, lit(environment_of(radiance), np.eye(3), model), np.eye(3))
    turned = seen(frame, lit(environment_of(radiance, QUARTER), QUARTER, model), QUARTER)
    other = seen(frame, lit(environment_of(radiance, QUARTER), np.eye(3), model), np.eye(3))
    assert np.abs(turned - still).mean() < 2e-3
    assert np.abs(other - still).mean() > 2e-2, "the world has to be seen to turn"


def test_an_even_panorama_is_a_plain_world(frame: Any) -> None:
    """Bit for bit, since it has no harmonics; harmonics of 0 change nothing either."""
    environment = environment_of(np.full((8, 16, 3), 0.4))
    plain = lit(Environment((0.4, 0.4, 0.4)), np.eye(3))
    by_picture = lit(environment, np.eye(3))
    assert is_same(seen(frame, by_picture, np.eye(3)), seen(frame, plain, np.eye(3)))
    nought = replace(plain, harmonics=np.zeros((8, 3), np.float32))
    assert is_same(seen(frame, nought, np.eye(3)), seen(frame, plain, np.eye(3)))


def test_hashed_strands_have_the_same_light(frame: Any) -> None:
    layers = lit(sky(), np.eye(3))
    hashed = replace(layers, strand_settings=replace(layers.strand_settings, transparency="hashed"))
    one, other = (seen(frame, each, np.eye(3))[..., :3].mean() for each in (layers, hashed))
    assert other == pytest.approx(one, rel=0.03)


def test_closed_hair_gets_no_light_of_the_world(frame: Any) -> None:
    environment = replace(sky(), suns=())
    open_hair = lit(environment, np.eye(3))
    closed = replace(open_hair, openness=np.zeros_like(open_hair.openness))
    assert (
        seen(frame, closed, np.eye(3))[..., :3].mean()
        < 0.7 * seen(frame, open_hair, np.eye(3))[..., :3].mean()
    )
