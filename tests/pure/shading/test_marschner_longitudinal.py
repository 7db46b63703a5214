"""M_p: its normalization, its narrow limit, and the direction in which highlights move."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.shading.marschner.fibre import Fibre, directions_to_angles
from hairloom.addon.shading.marschner.longitudinal import (
    longitudinal_lobe,
    longitudinal_lobes,
)

THETA = np.radians([0.0, 20.0, -20.0, 45.0, -45.0, 70.0, -70.0, 85.0, -85.0, 90.0, -90.0])


def marschner_gaussian(theta_h: Floats, width: float, shift: float) -> Floats:
    """Marschner's M_p, half of the unit Gaussian of theta_h: the narrow limit of ours."""
    return np.exp(-0.5 * ((theta_h + shift) / width) ** 2) / (2.0 * np.sqrt(2.0 * np.pi) * width)


@pytest.mark.parametrize("width", [0.5, 2.0, 5.0, 10.0, 30.0, 90.0])
@pytest.mark.parametrize("shift", [0.0, 3.0, -6.0])
def test_each_lobe_integrates_to_one(width: float, shift: float) -> None:
    """Over all directions that the shift turns into [-pi/2, pi/2], with their measure."""
    shift = np.radians(shift)
    lobe = longitudinal_lobe(np.radians(width), shift)
    turned = ((np.arange(10_000) + 0.5) / 10_000 - 0.5) * np.pi
    theta_i, theta_r = THETA[:, None] - shift, turned - shift
    measure = np.cos(turned) ** 2 / np.cos(0.5 * (theta_r - theta_i)) ** 2
    total = (lobe(theta_i, theta_r) * measure).mean(axis=1) * np.pi
    assert total == pytest.approx(1.0, abs=1e-3)


def test_both_ways_round_the_same() -> None:
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 91)
    for lobe in longitudinal_lobes(Fibre()):
        there = lobe(theta[:, None], theta)
        assert there == pytest.approx(there.T, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("width", [1.0, 3.0, 5.0])
def test_narrow_lobes_are_marschners(width: float) -> None:
    width = np.radians(width)
    theta_i = np.radians([0.0, 25.0, -40.0])[:, None]
    theta_r = -theta_i + np.linspace(-6.0, 6.0, 401) * width
    ours = longitudinal_lobe(width, 0.0)(theta_i, theta_r)
    theirs = marschner_gaussian(0.5 * (theta_i + theta_r), width, 0.0)
    assert np.abs(ours - theirs).max() < 0.02 * theirs.max()
    assert marschner_gaussian(np.linspace(-1.0, 1.0, 20_001), width, 0.1).sum() * 1e-4 == (
        pytest.approx(0.5)
    )


def traced_tilt(tilt: float, index: float) -> tuple[float, float, float]:
    """Lean of R, TT and TRT towards the tip for light across the fibre, by rays in the plane of T.

    The scales' outer normals lean towards the root; x points to the tip, y to the light.
    """

    def mirror(direction: Floats, normal: Floats) -> Floats:
        return direction - 2.0 * (direction @ normal) * normal

    def pass_through(direction: Floats, normal: Floats, ratio: float) -> Floats:
        normal = normal if direction @ normal < 0.0 else -normal
        cosine = -(direction @ normal)
        behind = np.sqrt(1.0 - ratio**2 * (1.0 - cosine**2))
        return ratio * direction + (ratio * cosine - behind) * normal

    top = np.array([-np.sin(tilt), np.cos(tilt)])
    bottom = np.array([-np.sin(tilt), -np.cos(tilt)])
    light = np.array([0.0, -1.0])
    inside = pass_through(light, top, 1.0 / index)
    directions = (
        mirror(light, top),
        pass_through(inside, bottom, index),
        pass_through(mirror(inside, bottom), top, index),
    )
    inclinations = [float(np.arcsin(direction[0])) for direction in directions]
    return (inclinations[0], inclinations[1], inclinations[2])


def test_r_leaves_towards_the_root_and_trt_towards_the_tip() -> None:
    """By -2, +1 and +4 tilts. Rays traced through tilted scales give -2, 1.1 and 4.2."""
    tilt = np.radians(2.0)
    lobes = longitudinal_lobes(Fibre(cuticle_tilt=tilt))
    theta_r = np.radians(np.linspace(-30.0, 30.0, 60_001))
    peaks = [float(theta_r[lobe(np.array(0.0), theta_r).argmax()]) for lobe in lobes]
    assert peaks == pytest.approx([-2.0 * tilt, tilt, 4.0 * tilt], abs=0.08 * tilt)
    assert peaks == pytest.approx(traced_tilt(tilt, 1.55), rel=0.12)


def test_highlight_of_r_lies_nearer_to_the_tip_on_a_head() -> None:
    """On a strand over a ball, from its top (the root) down, with light and eye at one height."""
    angle = np.radians(np.linspace(30.0, 150.0, 24_001))
    tangent = np.stack([np.cos(angle), 0.0 * angle, -np.sin(angle)], axis=1)
    to_light = np.broadcast_to([1.0, 0.0, 0.0], tangent.shape)
    theta_i, theta_r, phi = directions_to_angles(tangent, to_light, to_light)
    assert phi == pytest.approx(0.0, abs=1e-6)
    tilt = np.radians(3.0)
    lobes = longitudinal_lobes(Fibre(cuticle_tilt=tilt, offset_trt=np.radians(1.0)))
    places = [angle[lobe(theta_i, theta_r).argmax()] - 0.5 * np.pi for lobe in lobes]
    expected = [tilt, -0.5 * tilt, -2.0 * tilt + np.radians(1.0)]
    assert places == pytest.approx(expected, abs=0.1 * tilt)


def test_angles_of_directions() -> None:
    x, y, z = np.eye(3)
    theta_i, theta_r, phi = directions_to_angles(z, (x + z) / np.sqrt(2.0), y)
    assert (theta_i, theta_r, phi) == pytest.approx((np.pi / 4, 0.0, np.pi / 2))
    along = directions_to_angles(z, z, x)
    assert np.isfinite(along).all()


def test_widths_and_roughness_zero_stay_finite() -> None:
    fibre = Fibre(width_r=0.0, width_tt=0.0, width_trt=10.0)
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 181)
    for lobe in longitudinal_lobes(fibre):
        values = lobe(theta[:, None], theta)
        assert np.isfinite(values).all() and (values >= 0.0).all()
