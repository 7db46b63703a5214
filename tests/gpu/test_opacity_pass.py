"""Opacity maps drawn on the GPU against strands counted one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.volume.light_frame import Ball, ball_around, light_frame
from hairloom.addon.shading.volume.opacity import coverage, layer_ends, look_up
from hairloom.addon.shading.volume.settings import VolumeSettings

PLAIN = StrandSettings(tip_width=1.0)
LIGHTS = {
    "sun": Light.sun((0.3, -1.0, -0.5), (1, 1, 1), 3.0),
    "point": Light.point((0.3, 0.3, 0.4), (1, 1, 1), 10.0),
}


def dome(count: int = 3000, cv_count: int = 12, radius: float = 2e-4) -> tuple[Any, Any]:
    """Hair that stands on the upper half of a ball of 10 cm, and falls."""
    random = np.random.default_rng(3)
    away = random.normal(size=(count, 3))
    away[:, 2] = np.abs(away[:, 2])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, cv_count)[:, None]
    strands = away[:, None] * (0.1 + 0.06 * along) - np.array([0, 0, 0.08]) * along**2
    return strands.astype(np.float32), np.full((count, cv_count), radius, np.float32)


def points_of(strands: np.ndarray, radius: np.ndarray) -> Any:
    from hairloom.addon.render.textures import strand_rows, texture_from

    return texture_from(
        strand_rows(np.concatenate([strands, radius[..., None]], axis=-1)), "RGBA32F"
    )


def drawn(
    strands: np.ndarray, radius: np.ndarray, light: Light, settings: VolumeSettings
) -> tuple[Any, Ball]:
    """The maps of one light, and the ball that they cover."""
    from hairloom.addon.render.opacity_pass import OpacityPass

    points, ball = points_of(strands, radius), ball_around(strands)
    return OpacityPass().maps(points, 1, strands.shape[:2], ball, (light,), settings, PLAIN), ball


def layers_of(maps: Any) -> np.ndarray:
    """The layers of the first map, drawn in one pass, (height, width, n)."""
    from hairloom.addon.render.textures import texture_to_array

    return np.concatenate([texture_to_array(slot) for slot in maps.slots], axis=-1)


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_sums_are_those_of_the_strands(gpu_context: Any, light: Light, shadows: str) -> None:
    """All coverage is there, and lies where it should, give or take a texel."""
    strands, radius = dome()
    settings = VolumeSettings(shadows=shadows, slices=8, layers=8, resolution=64, strand_share=1.0)
    maps, ball = drawn(strands, radius, light, settings)
    frame = light_frame(light, ball)
    assert frame is not None
    exact = coverage(strands, radius, frame, 64)
    found = layers_of(maps)[..., 7]
    expected = np.zeros(64 * 64)
    np.add.at(expected, exact.texel, exact.covered)
    assert found.sum() == pytest.approx(expected.sum(), rel=2e-3)
    blocks = [picture.reshape(8, 8, 8, 8).sum(axis=(1, 3)) for picture in (found, expected)]
    assert np.abs(blocks[0] - blocks[1]).max() < 0.05 * blocks[1].max()


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_look_up_agrees_with_its_twin(
    gpu_context: Any, compute: Callable[..., np.ndarray], light: Light, shadows: str
) -> None:
    strands, radius = dome()
    settings = VolumeSettings(shadows=shadows, slices=7, layers=6, resolution=64, bias=0.02)
    maps, ball = drawn(strands, radius, light, settings)
    frame = light_frame(light, ball)
    assert frame is not None
    points = strands.reshape(-1, 3)[::7]
    points = np.concatenate([points, 0.3 * np.random.default_rng(1).normal(size=(500, 3))])
    found = path_at(compute, maps, points)

    ends = layer_ends(settings)
    layers = layers_of(maps)
    starts = np.zeros((64, 64))
    if maps.starts is not None:
        kept = np.asarray(maps.starts.read()).reshape(16, 16)
        starts = np.kron(np.minimum(kept / float(1 << 24), 1.0), np.ones((4, 4)))
    place, depth = frame.places(points.astype(np.float64))
    meshes = np.ones((64, 64))
    expected = look_up(layers[..., : len(ends)], starts, meshes, ends, place, depth, settings.bias)
    assert (expected[0] > 0.5).sum() > 300 and (expected[1] > 0.5).sum() > 300
    # a driver interpolates with weights of eight bits
    for number, values in enumerate(expected):
        assert np.abs(found[:, number] - values).max() < (1e-3 if shadows == "deep" else 2e-2)


def path_at(compute: Callable[..., np.ndarray], maps: Any, points: np.ndarray) -> np.ndarray:
    """What the shader finds, (n, 3)."""
    samplers = {name: (kind, maps.textures[name]) for kind, name in maps.form.samplers}
    return compute(
        "light_path.glsl",
        (len(points), 1),
        textures={"points": np.pad(points, ((0, 0), (0, 1)))[None].astype(np.float32)},
        blocks={"opacity": ("Opacity", maps.values)},
        samplers=samplers,
        structs=("struct_opacity.glsl",),
        defines=maps.form.defines,
    )[0, :, :3]


def test_a_map_is_drawn_again_only_when_something_changed(gpu_context: Any) -> None:
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(50)
    points, ball, opacity = points_of(strands, radius), ball_around(strands), OpacityPass()

    def maps(serial: int, light: Light, **settings: Any) -> Any:
        chosen = VolumeSettings(resolution=32, **settings)
        return opacity.maps(points, serial, strands.shape[:2], ball, (light,), chosen, PLAIN)

    first = maps(1, LIGHTS["sun"])
    assert maps(1, LIGHTS["sun"]) is first
    assert maps(2, LIGHTS["sun"]) is not first
    assert maps(2, LIGHTS["sun"], bias=0.1).values.tobytes() != first.values.tobytes()
    assert maps(2, LIGHTS["point"]) is not first


def test_more_layers_than_one_pass_can_draw(
    gpu_context: Any, compute: Callable[..., np.ndarray]
) -> None:
    """64 slices in three passes, nearer to what is counted than 8."""
    strands, radius = dome()
    error = []
    for count in (8, 64):
        settings = VolumeSettings(
            shadows="slices", slices=count, resolution=64, strand_share=1.0, bias=0.0
        )
        maps, ball = drawn(strands, radius, LIGHTS["sun"], settings)
        frame = light_frame(LIGHTS["sun"], ball)
        assert frame is not None
        exact = coverage(strands, radius, frame, 64)
        points = np.random.default_rng(2).permutation(strands.reshape(-1, 3))[:4000]
        place, depth = frame.places(points.astype(np.float64))
        column, row = np.floor(place * 64).astype(int).T
        expected = np.exp(-exact.optical_depth(row * 64 + column, depth))
        found = np.exp(-path_at(compute, maps, points)[:, 0])
        error.append(np.abs(found - expected).mean())
    assert error[1] < 0.7 * error[0]


@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_a_light_in_the_hair_throws_no_shadow(
    gpu_context: Any, compute: Callable[..., np.ndarray], shadows: str
) -> None:
    strands, radius = dome(200)
    settings = VolumeSettings(shadows=shadows, resolution=32)
    light = Light.point((0.0, 0.0, 0.05), (1, 1, 1), 10.0)
    maps, _ = drawn(strands, radius, light, settings)
    points = np.asarray(strands.reshape(-1, 3)[::10])
    assert not path_at(compute, maps, points)[:, 0].any()
