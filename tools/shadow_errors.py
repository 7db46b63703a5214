"""Errors of opacity maps, against counting the strands between light and point one by one.

The mean error of T at random points of strands, relative to the mean of T, by method of placing
layers. Needs the package `hairloom`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.volume.light_frame import ball_around, light_frame
from hairloom.addon.shading.volume.map_size import START_TEXELS
from hairloom.addon.shading.volume.opacity import (
    Coverage,
    LayerSpans,
    coverage,
    layer_ends,
    layer_weights,
    transmittance,
)
from hairloom.addon.shading.volume.settings import VolumeSettings

RESOLUTION, POINTS = 512, 10_000
SLICES, LAYERS = (4, 8, 16, 64, 255), (4, 8, 16)


def slice_spans(resolution: int) -> LayerSpans:
    """The spans of slices: the whole depth, in each texel."""
    whole = np.tile([1.0, 0.0, 0.0], (resolution, resolution, 1))
    return LayerSpans(0.0 * whole, whole, 1)


@dataclass(frozen=True)
class SamplePoints:
    """Random points of strands, T as counted there, and the coverage that maps are made from."""

    exact: Coverage
    texel: np.ndarray
    position: np.ndarray
    depth: np.ndarray
    counted_transmittance: np.ndarray

    def error(self, settings: VolumeSettings, ends: np.ndarray) -> float:
        """The error with layers of these ends, and spans as coarse as the shader's."""
        spans = slice_spans(RESOLUTION)
        if settings.shadows == "deep":
            spans = self.exact.spans(START_TEXELS)
        behind = spans.fraction(*np.divmod(self.texel, RESOLUTION), self.position, self.depth)
        layers = self.exact.layers(ends, spans)[self.texel]
        return self.error_of((layers * layer_weights(behind, ends)).sum(axis=1))

    def error_of(self, tau: np.ndarray) -> float:
        error = np.abs(transmittance(tau, 1.0) - self.counted_transmittance)
        return float(error.mean() / self.counted_transmittance.mean())


def errors(
    strands: np.ndarray,
    radius: float,
    sun: Light,
    slices: tuple[int, ...] = SLICES,
    layers: tuple[int, ...] = LAYERS,
) -> dict[str, float]:
    """Errors by method: slicesN, deepN; none is light without shadow.

    Args:
        strands: (strand_count, cv_count, 3) [m] float64. radius: of all of them [m].
    """
    points = _sample_points(strands, radius, sun)
    result = {"none": points.error_of(np.zeros(POINTS))}
    for count in slices:
        ends = np.arange(1, count + 1) / count
        result[f"slices{count}"] = points.error(VolumeSettings(shadows="slices"), ends)
    for count in layers:
        settings = VolumeSettings(shadows="deep", layers=count)
        result[f"deep{count}"] = points.error(settings, layer_ends(settings))
    return result


def _sample_points(strands: np.ndarray, radius: float, sun: Light) -> SamplePoints:
    frame = light_frame(sun, ball_around(strands))
    assert frame is not None
    exact = coverage(strands, np.full(strands.shape[:2], radius), frame, RESOLUTION)
    points = strands.reshape(-1, 3)
    index = np.random.default_rng(1).integers(len(points), size=POINTS)
    position, depth = frame.places(points[index])
    position *= RESOLUTION
    column, row = np.floor(position).astype(np.int64).T
    texel, depth = row * RESOLUTION + column, depth - VolumeSettings().bias
    return SamplePoints(
        exact, texel, position, depth, transmittance(exact.optical_depth(texel, depth), 1.0)
    )
