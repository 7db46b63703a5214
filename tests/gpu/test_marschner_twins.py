"""Marschner's model and the hair's colours: GLSL against Python, value by value."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gpu_rounding import SUBTEXEL, tolerance

from hairloom.addon.params.glsl import struct_values
from hairloom.addon.shading.kajiya_kay import strand_base, strand_normal
from hairloom.addon.shading.marschner.fibre import directions_to_angles
from hairloom.addon.shading.marschner.look import (
    fibre_of,
    marschner_light,
    pack_fibre,
    root_absorption,
    strand_absorption,
    strand_color,
)
from hairloom.addon.shading.marschner.pigment import color_absorption
from hairloom.addon.shading.marschner.tables import (
    PREVIEW_SIZE,
    MarschnerTables,
    look_up,
    marschner_tables,
)
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.tint import tip_fraction

ROWS, COLUMNS = 96, 128
#: both are the required accuracy: GLSL within 1e-3 of Python
RELATIVE, OF_PEAK = 1.0e-3, 1.0e-5


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def texels(*parts: np.ndarray) -> np.ndarray:
    """Values side by side as channels, padded to four, float32."""
    packed = np.concatenate([np.atleast_3d(part) for part in parts], axis=-1)
    return np.pad(packed, ((0, 0), (0, 0), (0, 4 - packed.shape[-1]))).astype(np.float32)


def agree(found: np.ndarray, expected: np.ndarray, relative: float = RELATIVE) -> bool:
    """Whether values agree within `relative`, or within 1e-5 of the brightest one; on a GPU, within
    the error of three linear interpolations by its sampler."""
    of_peak = tolerance(OF_PEAK, 3.0 * SUBTEXEL)
    allowed = np.maximum(relative * np.abs(expected), of_peak * np.abs(expected).max())
    return bool(np.isfinite(found).all() and (np.abs(found - expected) <= allowed).all())


def directions(seed: int) -> np.ndarray:
    return unit(np.random.default_rng(seed).normal(size=(ROWS, COLUMNS, 3))).astype(np.float32)


def test_angles(compute: Callable[..., np.ndarray]) -> None:
    """Also if both directions are equal, opposite, or along the strand."""
    tangents, lights, eyes = directions(1), directions(2), directions(3)
    eyes[0], eyes[1] = lights[0], -lights[1]
    lights[2], lights[3], eyes[3] = tangents[2], tangents[3], -tangents[3]
    eyes[4] = unit(lights[4] + 1e-4 * directions(4)[4])
    lights[5] = unit(tangents[5] + 1e-3 * directions(5)[5])
    found = compute(
        "marschner_angles.glsl",
        (COLUMNS, ROWS),
        textures={"tangents": texels(tangents), "lights": texels(lights), "eyes": texels(eyes)},
        structs=("struct_fibre.glsl",),
        settings=(ShadingSettings,),
    )
    exact = [unit(vectors.astype(np.float64)) for vectors in (tangents, lights, eyes)]
    theta_i, theta_r, phi = directions_to_angles(*exact)
    assert np.isfinite(found).all()
    assert np.abs(found[..., 0] - theta_i).max() < 1e-6
    assert np.abs(found[..., 1] - theta_r).max() < 1e-6
    # along the strand there is no azimuth
    across = np.cos(theta_i) * np.cos(theta_r)
    assert (np.abs(found[..., 2] - phi) * across)[across > 1e-6].max() < 1e-6


SHAPES = {
    "default": ShadingSettings(),
    "sharp": ShadingSettings(width_r=0.01, width_tt=0.01, width_trt=0.02, glint_width=0.02),
    "soft and tilted": ShadingSettings(
        width_r=0.4, width_tt=0.3, width_trt=0.9, cuticle_tilt=0.3, azimuthal_width=0.5
    ),
    "flat under water": ShadingSettings(index_of_refraction=1.17, eccentricity=1.4),
}


def look_up_textures(tables: MarschnerTables) -> dict[str, np.ndarray]:
    return {
        "longitudinal": tables.longitudinal,
        "azimuthal": tables.azimuthal,
        "paths": tables.paths,
    }


@pytest.mark.parametrize("settings", SHAPES.values(), ids=SHAPES)
def test_look_up(compute: Callable[..., np.ndarray], settings: ShadingSettings) -> None:
    """For all angles including their limits, for all levels and beyond, from clear to black
    hair."""
    random = np.random.default_rng(7)
    tables = marschner_tables(fibre_of(settings), PREVIEW_SIZE)
    theta_i = np.linspace(-0.5 * np.pi, 0.5 * np.pi, COLUMNS)[None, :] + np.zeros((ROWS, 1))
    theta_r = random.uniform(-0.5 * np.pi, 0.5 * np.pi, (ROWS, COLUMNS))
    # half of them near the first highlight
    near = -theta_i[::2] + random.normal(0.0, 0.1, (ROWS // 2, COLUMNS))
    theta_r[::2] = np.clip(near, -0.5 * np.pi, 0.5 * np.pi)
    phi = random.uniform(0.0, np.pi, (ROWS, COLUMNS))
    phi[0], phi[1] = 0.0, np.pi
    level = random.uniform(0.0, 6.5, (ROWS, COLUMNS))
    level[:48] = 0.0
    absorption = 10.0 ** random.uniform(-3.0, 2.0, (ROWS, COLUMNS, 3))
    absorption[::3] = 0.0
    strengths = fibre_of(settings).strengths
    packed = texels(theta_i, theta_r, phi, level), texels(absorption)
    found = compute(
        "marschner_look_up.glsl",
        (COLUMNS, ROWS),
        textures={"angles": packed[0], "absorptions": packed[1], **look_up_textures(tables)},
        blocks={"fibre": ("Fibre", pack_fibre(settings))},
        structs=("struct_fibre.glsl",),
        settings=(ShadingSettings,),
    )[..., :3]
    theta_i, theta_r, phi, level = np.moveaxis(packed[0].astype(np.float64), -1, 0)
    absorption = packed[1][..., :3].astype(np.float64)
    expected = look_up(tables, theta_i, theta_r, phi, absorption, np.array(strengths), level)
    # with the cosine, as for light: S itself is unbounded at grazing angles
    cosine = np.cos(theta_i)[..., None]
    assert agree(found * cosine, expected * cosine)


@pytest.mark.parametrize("settings", SHAPES.values(), ids=SHAPES)
def test_light(compute: Callable[..., np.ndarray], settings: ShadingSettings) -> None:
    random = np.random.default_rng(8)
    tables = marschner_tables(fibre_of(settings), PREVIEW_SIZE)
    tangents, lights, eyes = directions(1), directions(2), directions(3)
    normals = strand_normal(directions(4).astype(np.float64), tangents, np.zeros(3))
    # many near the first highlight, with the eye in the specular cone
    mirrored = lights - 2.0 * np.sum(lights * tangents, axis=-1, keepdims=True) * tangents
    eyes[::2] = unit(mirrored + 0.2 * eyes)[::2]
    shift, sparkle, level = random.random((3, ROWS, COLUMNS)) * [[[1.0]], [[1.0]], [[5.0]]]
    packed = [
        texels(tangents, shift),
        texels(normals, sparkle),
        texels(lights, level),
        texels(eyes, random.uniform(-1.0, 3.0, (ROWS, COLUMNS))),
    ]
    found = compute(
        "marschner_light.glsl",
        (COLUMNS, ROWS),
        textures=dict(zip(("tangents", "normals", "lights", "eyes"), packed, strict=True))
        | look_up_textures(tables),
        blocks={
            "fibre": ("Fibre", pack_fibre(settings)),
            "shading": ("ShadingSettings", struct_values(settings)),
        },
        structs=("struct_fibre.glsl",),
        settings=(ShadingSettings,),
    )[..., :3]
    tangent, normal, light, eye = (values[..., :3].astype(np.float64) for values in packed)
    expected = marschner_light(
        tables,
        unit(tangent),
        normal,
        unit(light),
        unit(eye),
        packed[0][..., 3].astype(np.float64),
        packed[1][..., 3].astype(np.float64),
        root_absorption(settings),
        settings,
        packed[2][..., 3].astype(np.float64),
        packed[3][..., 3].astype(np.float64),
    )
    assert agree(found, expected)


COLORS: dict[str, dict[str, Any]] = {
    "plain": {},
    "tinted and grey": {"tip_tint": 0.8, "grey_fraction": 0.4, "pigment": "melanin"},
    "a hard step": {"tip_tint": 1.0, "tint_start": 0.5, "tint_end": 0.5, "color_variation": 1.0},
    "back to front": {"tip_tint": 1.0, "tint_start": 0.9, "tint_end": 0.1, "grey_fraction": 1.0},
}


@pytest.mark.parametrize("changes", COLORS.values(), ids=COLORS)
def test_colors(compute: Callable[..., np.ndarray], changes: dict[str, Any]) -> None:
    settings = ShadingSettings(**changes)
    places = np.random.default_rng(9).random((1, 400, 3)).astype(np.float32)
    places[0, :5, 0] = 0.0, 1.0, settings.tint_start, settings.tint_end, 0.5
    # including black, and colours above white
    roots = np.random.default_rng(10).uniform(0.0, 1.2, (1, 400, 3)).astype(np.float32) ** 3
    roots[0, 0] = 0.0
    found = compute(
        "strand_colors.glsl",
        (400, 5),
        textures={"places": texels(places), "roots": texels(roots)},
        blocks={
            "fibre": ("Fibre", pack_fibre(settings)),
            "shading": ("ShadingSettings", struct_values(settings)),
        },
        structs=("struct_fibre.glsl",),
        settings=(ShadingSettings,),
    )
    along, color_noise, grey_noise = np.moveaxis(places[0].astype(np.float64), -1, 0)
    absorption = strand_absorption(settings, along, color_noise, grey_noise)
    base = strand_base(along, color_noise, grey_noise, settings)
    assert np.abs(found[0, :, 3] - tip_fraction(along, settings)).max() < 1e-5
    assert found[0, :, :3] == pytest.approx(absorption, rel=1e-4)
    assert found[1, :, :3] == pytest.approx(strand_color(absorption), rel=1e-4)
    assert found[2, :, :3] == pytest.approx(base, rel=1e-4)
    own = roots[0].astype(np.float64)
    noises = along, color_noise, grey_noise
    absorption = strand_absorption(settings, *noises, color_absorption(own))
    assert found[3, :, :3] == pytest.approx(absorption, rel=1e-4, abs=1e-9)
    assert found[4, :, :3] == pytest.approx(strand_base(*noises, settings, own), rel=1e-4)
