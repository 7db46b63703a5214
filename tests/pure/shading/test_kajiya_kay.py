"""Kajiya-Kay against a scalar transcription, hand values, and the geometry of the shift."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hairloom.addon.shading.kajiya_kay import (
    GREY_COLOR,
    diffuse_bias,
    kajiya_kay,
    shifted_tangent,
    strand_base,
    strand_normal,
    strand_specular,
)
from hairloom.addon.shading.settings import ShadingSettings

X, Y, Z = np.eye(3)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def published_shader(tangent, normal, to_light, to_eye, shift, mask, settings):
    """Scheuermann's published pixel shader for one pixel, in plain Python."""

    def dot(a, b):
        return sum(p * q for p, q in zip(a, b, strict=True))

    def normalized(a):
        return [p / math.sqrt(dot(a, a)) for p in a]

    def shift_tangent(t, n, amount):
        return normalized([p + amount * q for p, q in zip(t, n, strict=True)])

    def specular(t, v, light, exponent):
        half = normalized([p + q for p, q in zip(light, v, strict=True)])
        cosine = dot(t, half)
        sine = math.sqrt(1.0 - cosine * cosine)
        x = min(max(cosine + 1.0, 0.0), 1.0)
        return x * x * (3.0 - 2.0 * x) * sine**exponent

    first = shift_tangent(tangent, normal, settings.primary_shift + shift)
    second = shift_tangent(tangent, normal, settings.secondary_shift + shift)
    diffuse = min(max(0.25 + 0.75 * dot(normal, to_light), 0.0), 1.0)
    one = specular(first, to_eye, to_light, settings.primary_exponent)
    two = mask * specular(second, to_eye, to_light, settings.secondary_exponent)
    return [
        diffuse
        * (
            1.0
            + settings.primary_strength * settings.primary_color[c] * one
            + settings.secondary_strength * settings.secondary_color[c] * two
        )
        for c in range(3)
    ]


def test_matches_the_published_shader() -> None:
    random = np.random.default_rng(4)
    settings = ShadingSettings(shift_noise=1.0, sparkle=1.0)
    tangent, outward, to_light, to_eye = unit(random.normal(size=(4, 300, 3)))
    normal = unit(outward - tangent * np.sum(outward * tangent, axis=1, keepdims=True))
    shift, mask = random.random((2, 300))
    ours = kajiya_kay(tangent, normal, to_light, to_eye, shift, mask, settings)
    for i in range(300):
        theirs = published_shader(
            tangent[i], normal[i], to_light[i], to_eye[i], shift[i] - 0.5, mask[i], settings
        )
        assert ours[i] == pytest.approx(theirs, abs=1e-12)


def test_diffuse_is_biased_and_never_negative() -> None:
    assert diffuse_bias(Z, Z) == 1.0
    assert diffuse_bias(Z, X) == 0.25
    assert diffuse_bias(Z, -Z) == 0.0
    assert diffuse_bias(Z, np.array([math.sqrt(8.0) / 3.0, 0.0, -1.0 / 3.0])) == pytest.approx(0.0)


def test_specular_is_strongest_across_the_strand() -> None:
    angle = np.radians(np.arange(0, 181))
    half = np.stack([np.cos(angle), np.zeros(181), np.sin(angle)], axis=-1)
    lobe = strand_specular(np.broadcast_to(X, half.shape), half, 40.0)
    assert lobe.argmax() == 90 and lobe[90] == 1.0
    assert lobe[60] == pytest.approx(math.sin(math.radians(60)) ** 40)
    # beyond 90 degrees, smoothstep(-1, 0, cos) attenuates
    assert lobe[120] == pytest.approx(0.5 * lobe[60])


def test_highlights_of_strength_nought_leave_the_diffuse_term() -> None:
    settings = ShadingSettings(primary_strength=0.0, secondary_strength=0.0)
    shaded = kajiya_kay(X, Z, Z, Z, np.array(0.3), np.array(0.9), settings)
    assert shaded == pytest.approx([1.0, 1.0, 1.0])


def test_sparkle_dims_the_second_highlight_only() -> None:
    settings = ShadingSettings(shift_noise=0.0, sparkle=1.0, primary_shift=0.0, secondary_shift=0.0)
    dark = kajiya_kay(X, Z, Z, Z, np.array(0.5), np.array(0.0), settings)
    first = settings.primary_strength * np.array(settings.primary_color)
    assert dark == pytest.approx(1.0 + first)
    bright = kajiya_kay(X, Z, Z, Z, np.array(0.5), np.array(1.0), settings)
    second = settings.secondary_strength * np.array(settings.secondary_color)
    assert bright - dark == pytest.approx(second)


def test_light_from_behind_the_eye_is_finite() -> None:
    """The directions to light and eye cancel out, so that there is no half vector."""
    shaded = kajiya_kay(X, Z, Y, -Y, np.array(0.5), np.array(0.5), ShadingSettings())
    assert np.isfinite(shaded).all()


def test_strand_normal_is_across_the_strand_and_outward() -> None:
    random = np.random.default_rng(7)
    point, tangent = random.normal(size=(500, 3)), unit(random.normal(size=(500, 3)))
    center = np.array([0.2, -0.1, 0.3])
    normal = strand_normal(point, tangent, center)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(np.ones(500))
    assert np.abs(np.sum(normal * tangent, axis=1)).max() < 1e-9
    assert (np.sum(normal * (point - center), axis=1) > 0.0).all()


@pytest.mark.parametrize("tangent", [X, Y, Z, -Z, unit(np.array([1.0, 1.0, 1.0]))])
def test_strand_normal_of_a_strand_that_points_outward(tangent: np.ndarray) -> None:
    normal = strand_normal(2.0 * tangent, tangent, np.zeros(3))
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert abs(normal @ tangent) < 1e-6
    assert np.isfinite(strand_normal(np.zeros(3), tangent, np.zeros(3))).all()


def highlight_place(shift: float) -> float:
    """The place of the first highlight along a hair on a sphere, 0 root to 1 tip.

    The hair runs down a meridian from near the pole to near the equator; light and eye are both
    at 45 degrees above the equator, so that the unshifted highlight is at its middle.
    """
    settings = ShadingSettings(
        primary_shift=shift, secondary_strength=0.0, shift_noise=0.0, primary_exponent=200.0
    )
    polar = np.radians(np.linspace(5.0, 85.0, 401))
    point = np.stack([np.sin(polar), np.zeros(401), np.cos(polar)], axis=-1)
    tangent = np.stack([np.cos(polar), np.zeros(401), -np.sin(polar)], axis=-1)
    towards = np.broadcast_to(unit(np.array([1.0, 0.0, 1.0])), point.shape)
    normal = strand_normal(point, tangent, np.zeros(3))
    half = np.full(401, 0.5)
    shaded = kajiya_kay(tangent, normal, towards, towards, half, half, settings)
    highlight = shaded[:, 1] - diffuse_bias(normal, towards)
    return float(highlight.argmax()) / 400.0


def test_positive_shift_moves_the_highlight_to_the_tip() -> None:
    """By geometry: T' is perpendicular to H where the polar angle has grown by atan(shift)."""
    assert highlight_place(0.0) == pytest.approx(0.5, abs=0.01)
    for shift in (0.1, 0.2, -0.1, -0.2):
        moved = math.degrees(math.atan(shift)) / 80.0
        assert highlight_place(shift) - 0.5 == pytest.approx(moved, abs=0.02)


def test_shift_keeps_the_tangent_in_its_plane() -> None:
    assert shifted_tangent(X, Z, 0.5) == pytest.approx(unit(np.array([1.0, 0.0, 0.5])))
    many = shifted_tangent(X, Z, np.array([0.0, 1.0]))
    assert many == pytest.approx(np.array([X, unit(np.array([1.0, 0.0, 1.0]))]))


def test_color_variation_keeps_the_mean() -> None:
    settings = ShadingSettings(color_variation=0.4)
    root, colored = np.zeros(3), np.ones(3)
    base = strand_base(root, np.array([0.0, 0.5, 1.0]), colored, settings)
    assert base / np.array(settings.base_color) == pytest.approx(
        np.array([[0.6] * 3, [1.0] * 3, [1.4] * 3])
    )


def test_tips_and_grey_strands_have_their_own_colours() -> None:
    settings = ShadingSettings(color_variation=0.0, tip_tint=1.0, grey_fraction=0.25)
    along, middle = np.array([0.0, 0.6, 1.0, 1.0]), np.full(4, 0.5)
    base = strand_base(along, middle, np.array([0.9, 0.9, 0.25, 0.24]), settings)
    root, tip = np.array(settings.base_color), np.array(settings.tip_color)
    assert base == pytest.approx(np.array([root, 0.5 * (root + tip), tip, GREY_COLOR]))
