"""How far opacity maps are from counting the strands between light and place one by one."""

from __future__ import annotations

import numpy as np
from hair_ball import combed_strands

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.volume.light_frame import ball_around, light_frame
from hairloom.addon.shading.volume.opacity import (
    coverage,
    layer_ends,
    layer_weights,
    transmittance,
)
from hairloom.addon.shading.volume.settings import VolumeSettings

STRANDS, RADIUS = 14_000, 0.003
RESOLUTION, POINTS = 512, 10_000
SUN = Light.sun((-0.45, -0.5, -0.8), (1.0, 1.0, 1.0), 1.0)


def shadow_figures() -> dict[str, float]:
    """Mean error of T over mean T, at random places of strands, by the ways to lay layers."""
    strands = combed_strands(STRANDS).astype(np.float64)
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    exact = coverage(strands, np.full(strands.shape[:2], RADIUS), frame, RESOLUTION)
    points = strands.reshape(-1, 3)
    place, depth = frame.places(points[np.random.default_rng(1).integers(len(points), size=POINTS)])
    column, row = np.floor(place * RESOLUTION).astype(np.int64).T
    texel, depth = row * RESOLUTION + column, depth - VolumeSettings().bias
    counted = transmittance(exact.optical_depth(texel, depth), 1.0)

    def error(ends: np.ndarray, starts: np.ndarray) -> float:
        tau = (exact.layers(ends, starts)[texel] * layer_weights(depth - starts[texel], ends)).sum(
            axis=1
        )
        return float(np.abs(transmittance(tau, 1.0) - counted).mean() / counted.mean())

    even = np.zeros(RESOLUTION**2)
    # as coarse as the shader has them
    first = exact.starts().reshape(RESOLUTION // 4, 4, RESOLUTION // 4, 4).min(axis=(1, 3))
    starts = np.kron(first, np.ones((4, 4))).ravel()
    found = {
        f"t_error_slices{count}": error(np.arange(1, count + 1) / count, even)
        for count in (4, 8, 16, 64, 255)
    }
    for layers in (4, 8, 16):
        ends = layer_ends(VolumeSettings(shadows="deep", layers=layers))
        found[f"t_error_deep{layers}"] = error(ends, starts)
    return found
