"""Lights: the shader against Python, and both at numerical limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gpu_rounding import tolerance

from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import (
    Cone,
    Light,
    light_at,
    light_irradiance,
    pack_lights,
)

HERE, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
#: a random rotation; rows: right, up and ahead
TURNED = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]


def cone(axes: np.ndarray, size: float, blend: float) -> Cone:
    x, y, z = (tuple(row) for row in axes.tolist())
    return Cone((x, y, z), size, blend)


def area(axes: np.ndarray, width: float, height: float, **settings: Any) -> Light:
    right, up, ahead = (tuple(row) for row in axes.tolist())
    return Light.area(HERE, WHITE, 9.0, Panel(right, up, ahead, width, height, **settings))


TWINS = {
    "soft point": Light.point(HERE, (0.2, 0.4, 1.0), 60.0, 0.3),
    "ball": Light.point(HERE, WHITE, 60.0, 0.5, True),
    "spot": Light.spot(HERE, WHITE, 9.0, cone(TURNED, 1.2, 0.6)),
    "spot of half a turn": Light.spot(HERE, WHITE, 9.0, cone(TURNED, np.pi, 1.0), 0.1),
    "narrow and squeezed spot": Light.spot(
        HERE, WHITE, 9.0, cone(TURNED * [[0.3], [1.0], [0.5]], 0.5, 0.5), 0.2, True
    ),
    "rectangle": area(TURNED, 0.5, 0.2),
    "tube": area(TURNED, 0.6, 0.03),
    "disk": area(TURNED, 0.4, 0.4, is_round=True),
    "ellipse": area(TURNED, 0.4, 0.2, is_round=True),
    "narrow rectangle": area(TURNED, 0.5, 0.2, spread=1.0),
    "wide disk": area(TURNED, 0.4, 0.4, is_round=True, spread=2.9),
}


def computed(
    compute: Callable[..., np.ndarray], light: Light, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The shader's directions and irradiances at points (n, 3)."""
    found = compute(
        "lights.glsl",
        (len(points), 2),
        textures={"points": np.pad(points, ((0, 0), (0, 1)))[None].astype(np.float32)},
        blocks={"lights": ("Lights", pack_lights((light,), (0.0, 0.0, 0.0)))},
        structs=("struct_lights.glsl",),
    )
    return found[0, :, :3], found[1, :, :3]


@pytest.mark.parametrize("light", TWINS.values(), ids=TWINS)
def test_twins(compute: Callable[..., np.ndarray], light: Light) -> None:
    """All around a light, from 5 cm to 300 m."""
    points = np.random.default_rng(7).normal(size=(2000, 3))
    points *= (np.geomspace(0.05, 300.0, 2000) / np.linalg.norm(points, axis=1))[:, None]
    points = points.astype(np.float32)
    direction, irradiance = computed(compute, light, points)
    exact = points.astype(np.float64)
    expected = light_irradiance(light, exact)
    # less than a hundredth of the maximum at a distance counts as dark
    least = 1e-2 * np.array(light.power) / (np.pi * np.sum(exact * exact, axis=1)[:, None])
    is_lit = (expected > least).all(axis=1)
    assert is_lit.sum() > 10
    most = tolerance(1e-4, 1e-3)
    assert (np.abs(irradiance - expected) <= most * np.maximum(expected, least)).all()
    # edge-on to a panel little light arrives, and rounding changes its direction
    edge_on = np.maximum(1.0, 30.0 * (least / np.maximum(expected, least)).max(axis=1))
    turned = np.abs(direction - light_at(light, exact)[0]).max(axis=1)
    assert (turned <= 1e-4 * edge_on)[is_lit].all()


STRAIGHT = np.eye(3)
EXTREMES = {
    "point": Light.point(HERE, WHITE, 9.0),
    "ball": Light.point(HERE, WHITE, 9.0, 0.5, True),
    "spot of no blend": Light.spot(HERE, WHITE, 9.0, cone(STRAIGHT, 0.5, 0.0)),
    "spot of no angle": Light.spot(HERE, WHITE, 9.0, cone(STRAIGHT, 0.0, 0.0)),
    "spot of no axes": Light.spot(HERE, WHITE, 9.0, cone(0.0 * STRAIGHT, 1.0, 1.0)),
    **{
        f"{'ellipse' if is_round else 'rectangle'} of {width} x {height} m into {spread:.2f}": area(
            STRAIGHT, width, height, is_round=is_round, spread=spread
        )
        for is_round in (False, True)
        for width, height in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (1e4, 1e4))
        for spread in (0.0, 1.0, np.pi)
    },
}


@pytest.mark.parametrize("light", EXTREMES.values(), ids=EXTREMES)
def test_nothing_is_infinite(compute: Callable[..., np.ndarray], light: Light) -> None:
    """Also at the light itself, in its plane, on its rim and axis, very near and very far."""
    steps = (0.0, 1e-9, 1e-6, 1e-3, 0.5, 1e4)
    row = np.array([*steps, *(-step for step in steps[1:])])
    points = np.stack(np.meshgrid(row, row, row), axis=-1).reshape(-1, 3).astype(np.float32)
    with np.errstate(all="raise", under="ignore"):
        expected = light_at(light, points)[0], light_irradiance(light, points)
    for direction, irradiance in (expected, computed(compute, light, points)):
        assert np.isfinite(direction).all() and np.isfinite(irradiance).all()
        assert np.linalg.norm(direction, axis=1).max() < 1.0 + tolerance(1e-5, 1e-4)
        assert irradiance.min() >= 0.0
