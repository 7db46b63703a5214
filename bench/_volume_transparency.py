"""Layered transparency against sorting, for any order of strands, and what it costs.

Crossing ribbons in perspective, of many colours, against `sorted_picture`; then the ball of
_volume_cost, drawn opaque and with each method of transparency in turn.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from typing import Any

import gpu
import numpy as np
from hair_ball import combed_strands

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.render.textures import drawing_into
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.shading.volume.transparency import layer_fractions, strip_coverage

SIZE, RIBBONS, WIDTH_OF, OPACITY = 128, 500, 2.5, 0.7
WIDTH, HEIGHT, STRANDS, POINTS, RADIUS = 800, 600, 4_095, 30, 0.003
ROUNDS = 9
SUN = Light.sun((-0.45, -0.5, -0.8), (1.0, 1.0, 1.0), 3.0)


def transparency_figures() -> dict[str, float]:
    """The figures by name.

    transparency_error: mean difference of colour from all layers, sorted.
    permutation_difference: the largest difference between two orders of strands.
    transparency_cost_layers, transparency_cost_hashed: median time of a frame over that of opaque
        strands.
    transparency_noise_<way>: mean difference of colour, in one sample, from 8 x 8 opaque ones.
    """
    return {**ribbon_figures(), **cost_ratios(), **noise_figures()}


def ribbon_figures() -> dict[str, float]:
    random = np.random.default_rng(4)
    strands = random.uniform(0.0, SIZE, (RIBBONS, 2, 3))
    strands[..., 1] = random.uniform(-50.0, 50.0, (RIBBONS, 2))
    brightness = random.random(RIBBONS)
    middle = SIZE / 2.0
    camera = Camera(
        look_at((middle, -200.0, middle), (middle, 0.0, middle)),
        perspective(0.6, 1.0, 50.0, 400.0),
    )
    drawn = StrandPass()

    def picture(order: np.ndarray) -> np.ndarray:
        own = strands[order].astype(np.float32)
        shown = Snapshot(
            own,
            np.full(own.shape[:2], WIDTH_OF / 2.0, np.float32),
            np.repeat(brightness[order, None], 2, axis=1).astype(np.float32),
            seed=order,
            ambient=(1.0, 1.0, 1.0),
            shading=ShadingSettings(base_color=(1.0, 1.0, 1.0), color_variation=0.0),
            strand_settings=StrandSettings(tip_width=1.0, opacity=OPACITY),
            detail=DetailSettings(mode="fixed", subdivisions=1),
            volume=VolumeSettings(shadows="none"),
        )
        target, color = _target(SIZE, SIZE)
        with drawing_into(target):
            target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            drawn.draw(shown, camera, SIZE, SIZE)
        return _pixels(color)

    first = picture(np.arange(RIBBONS))
    others = [picture(random.permutation(RIBBONS)) for _ in range(6)]
    exact = sorted_picture(strands, brightness, camera)
    return {
        "transparency_error": float(np.abs(first - exact)[..., :3].mean()),
        "permutation_difference": max(float(np.abs(other - first).max()) for other in others),
    }


def sorted_picture(strands: np.ndarray, brightness: np.ndarray, camera: Camera) -> np.ndarray:
    """All layers of straight strands, sorted in each pixel, (SIZE, SIZE, 4)."""
    matrix = camera.projection @ camera.view
    clip = np.concatenate([strands, np.ones((*strands.shape[:2], 1))], axis=-1) @ matrix.T
    seen = (clip[..., :2] / clip[..., 3:] + 1.0) / 2.0 * SIZE
    row, column = np.mgrid[:SIZE, :SIZE] + 0.5
    away = np.stack([column.ravel(), row.ravel()], axis=-1)[:, None] - seen[None, :, 0]
    run = seen[:, 1] - seen[:, 0]
    length = np.linalg.norm(run, axis=-1)
    normal = np.stack([-run[:, 1], run[:, 0]], axis=-1) / length[:, None]
    along = (away * run).sum(axis=-1) / length**2

    def between(ends: np.ndarray) -> np.ndarray:
        mixed: np.ndarray = ends[:, 0] + along * (ends[:, 1] - ends[:, 0])
        return mixed

    half = between(WIDTH_OF / 2.0 * camera.projection[1, 1] * SIZE / 2.0 / clip[..., 3])
    normals = np.broadcast_to(np.abs(normal), away.shape)
    alphas = OPACITY * strip_coverage((away * normal).sum(axis=-1), half, normals)
    alphas[(along < 0.0) | (along > 1.0)] = 0.0
    colors = np.broadcast_to(brightness[:, None], (*alphas.shape, 3))
    depths = between(clip[..., 2] / clip[..., 3])
    layer_weights = layer_fractions(depths, alphas, layers=RIBBONS, unseen_fraction=0.0)
    light = np.einsum("pn,pnc->pc", layer_weights, colors)
    exact = np.column_stack([light, 1.0 - np.prod(1.0 - alphas, axis=-1)])
    return exact.reshape(SIZE, SIZE, 4)


def cost_ratios() -> dict[str, float]:
    """All methods take turns, so that load on the machine affects them alike."""
    camera, shown = _ball(WIDTH, HEIGHT)
    snapshots = {method: _with(shown, method) for method in ("none", "hashed", "layers")}
    target, color = _target(WIDTH, HEIGHT)
    passes = {method: StrandPass() for method in snapshots}
    times: dict[str, list[float]] = {method: [] for method in snapshots}
    for _ in range(ROUNDS + 1):
        for method, own in snapshots.items():
            begin = time.perf_counter()
            with drawing_into(target):
                target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
                passes[method].draw(own, camera, WIDTH, HEIGHT)
            color.read()
            times[method].append(time.perf_counter() - begin)
    opaque, *others = (statistics.median(own[1:]) for own in times.values())
    names = ("transparency_cost_hashed", "transparency_cost_layers")
    return {name: took / opaque for name, took in zip(names, others, strict=True)}


def noise_figures() -> dict[str, float]:
    width, height = WIDTH // 2, HEIGHT // 2
    camera, shown = _ball(width, height)
    bare = replace(shown, strand_settings=StrandSettings(transparency="none", minimum_width=0.0))
    exact = render_image(bare, camera, width, height, 8)
    return {
        f"transparency_noise_{method}": float(
            np.abs(render_image(_with(shown, method), camera, width, height, 1) - exact)[
                ..., :3
            ].mean()
        )
        for method in ("none", "hashed", "layers")
    }


def _ball(width: int, height: int) -> tuple[Camera, Snapshot]:
    strands = combed_strands(2 * STRANDS, POINTS)[:STRANDS]
    shown = Snapshot(
        strands,
        np.full(strands.shape[:2], RADIUS, np.float32),
        lights=(SUN,),
        shading=ShadingSettings(model="marschner"),
        volume=VolumeSettings(shadows="slices", slices=16),
    )
    eye = look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    return Camera(eye, perspective(np.radians(30.0), width / height, 0.1, 20.0)), shown


def _with(shown: Snapshot, method: str) -> Snapshot:
    return replace(shown, strand_settings=StrandSettings(transparency=method))


def _target(width: int, height: int) -> tuple[Any, Any]:
    color = gpu.types.GPUTexture((width, height), format="RGBA32F")
    depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
    return gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,)), color


def _pixels(texture: Any) -> np.ndarray:
    return np.asarray(texture.read()).reshape(texture.height, texture.width, 4).copy()
