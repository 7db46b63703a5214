"""Reflection at a surface: the limits of Fresnel's equations, and energy."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.shading.microfacet import (
    dielectric_fresnel,
    ggx_reflection,
    reflected_fraction,
)


def hemisphere(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions over the hemisphere around +z, and the solid angle of each."""
    height = (np.arange(rows) + 0.5) / rows
    turn = (np.arange(columns) + 0.5) * 2.0 * np.pi / columns
    ring = np.sqrt(1.0 - height**2)
    x, y = ring[:, None] * np.cos(turn), ring[:, None] * np.sin(turn)
    return (
        np.stack([x, y, np.broadcast_to(height[:, None], x.shape)], axis=-1),
        2.0 * np.pi / (rows * columns),
    )


def test_fresnel_at_its_known_angles() -> None:
    specular = ((1.5 - 1.0) / (1.5 + 1.0)) ** 2
    straight, brewster, grazing = dielectric_fresnel(
        np.array([1.0, np.cos(np.arctan(1.5)), 0.0]), specular
    )
    assert straight == pytest.approx(specular) and grazing == pytest.approx(1.0)
    # at Brewster's angle one polarization is not reflected, the other by ((n^2 - 1) / (n^2 + 1))^2
    assert brewster == pytest.approx(0.5 * ((1.5**2 - 1.0) / (1.5**2 + 1.0)) ** 2)
    assert dielectric_fresnel(np.linspace(0.1, 1.0, 9), 0.0) == pytest.approx(0.0)


@pytest.mark.parametrize("roughness", [0.3, 0.45, 0.8])
@pytest.mark.parametrize("seen", [1.0, 0.7, 0.35])
def test_the_fraction_is_about_that_of_all_directions(roughness: float, seen: float) -> None:
    lights, solid_angle = hemisphere(500, 400)
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), lights.shape)
    eye = np.broadcast_to(np.array([np.sqrt(1.0 - seen**2), 0.0, seen]), lights.shape)
    brdf = ggx_reflection(up, lights, eye, 0.04, roughness)
    whole = float((brdf * lights[..., 2]).sum() * solid_angle)
    assert reflected_fraction(np.array(seen), 0.04, roughness) == pytest.approx(whole, rel=0.4)


def test_light_and_eye_change_places() -> None:
    random = np.random.default_rng(4)
    one, other = random.normal(size=(2, 50, 3))
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    other /= np.linalg.norm(other, axis=-1, keepdims=True)
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), one.shape)
    there = ggx_reflection(up, one, other, 0.04, 0.4)
    assert there == pytest.approx(ggx_reflection(up, other, one, 0.04, 0.4)) and there.max() > 0.0
