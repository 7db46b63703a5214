"""Shafts of light: the error of resampling to polar coordinates and back, on the GPU's grid."""

from __future__ import annotations

import numpy as np

from hairloom.addon.shading.shafts import PolarGrid, from_polar, to_polar

WIDTH, HEIGHT = 480, 360
#: places of the light [pixels]: in the middle, off it, on the border, and outside
PLACES = ((240.0, 180.0), (100.5, 300.5), (0.0, 180.0), (-60.0, 420.0))


def shafts_figures() -> dict[str, float]:
    """Mean error of a picture with soft edges that was resampled twice, for the worst place."""
    picture = _picture()
    differences = []
    for place in PLACES:
        grid = PolarGrid.over(place, WIDTH, HEIGHT)
        again = from_polar(to_polar(picture, grid), grid, WIDTH, HEIGHT)
        differences.append(float(np.abs(again - picture).mean()))
    return {"polar_difference": max(differences)}


def _picture() -> np.ndarray:
    """Disks whose edges are a pixel wide, as an averaged picture's are."""
    random, picture = np.random.default_rng(3), np.zeros((HEIGHT, WIDTH, 3))
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    for _ in range(40):
        away = np.hypot(x - random.uniform(0, WIDTH), y - random.uniform(0, HEIGHT))
        coverage = np.clip(random.uniform(5.0, 60.0) - away + 0.5, 0.0, 1.0)[..., None]
        picture = picture * (1.0 - coverage) + random.random(3) * coverage
    return picture
