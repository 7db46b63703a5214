"""Dual scattering: the shader against Python."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hairloom.addon.params.glsl import struct_values
from hairloom.addon.shading.kajiya_kay import strand_normal
from hairloom.addon.shading.marschner.look import fibre_of, pack_fibre, root_absorption
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.skin_seen import SkinSeen
from hairloom.addon.shading.volume.dual import (
    dual_scattering,
    fractions,
    fractions_at,
    scattering_light,
)

SHAPE = (64, 200)
SETTINGS = {
    "plain": ShadingSettings(),
    "wide and tilted": ShadingSettings(cuticle_tilt=0.15, width_r=0.3, width_trt=0.5),
    "narrow": ShadingSettings(width_r=0.02, width_tt=0.01, offset_trt=-0.1),
}


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_dual_scattering(compute: Callable[..., np.ndarray], settings: ShadingSettings) -> None:
    """For all angles, from clear to black hair, from the outside to deep inside."""
    random = np.random.default_rng(11)
    fibre = fibre_of(settings)
    table = fractions(marschner_tables(fibre, PREVIEW_SIZE))
    theta_i, theta_r = random.uniform(-1.5, 1.5, (2, *SHAPE))
    phi = random.uniform(0.0, np.pi, SHAPE)
    tau = 10.0 ** random.uniform(-3.0, 1.5, SHAPE)
    absorption = 10.0 ** random.uniform(-3.0, 1.0, (*SHAPE, 3))
    density = random.choice([0.0, 0.7, 1.0], SHAPE)
    single = random.random((*SHAPE, 3))
    packed = [
        np.stack([theta_i, theta_r, phi, tau], axis=-1),
        np.concatenate([absorption, density[..., None]], axis=-1),
        np.concatenate([single, random.uniform(0.0, 9.0, (*SHAPE, 1))], axis=-1),
    ]
    packed = [values.astype(np.float32) for values in packed]
    names = ("angles_and_tau", "absorption_and_density", "singles_and_beyond")
    found = compute(
        "dual.glsl",
        (SHAPE[1], SHAPE[0]),
        textures=dict(zip(names, packed, strict=True))
        | {"forward": table.forward, "backward": table.backward},
        blocks={"fibre": ("Fibre", pack_fibre(settings))},
        structs=("struct_fibre.glsl",),
        settings=(ShadingSettings,),
    )[..., :3]
    theta_i, theta_r, phi, tau = np.moveaxis(packed[0].astype(np.float64), -1, 0)
    absorption = packed[1][..., :3].astype(np.float64)
    cos_d = np.cos(0.5 * (theta_r - theta_i))
    expected = np.empty((*SHAPE, 3))
    for each in (0.0, np.float32(0.7), 1.0):
        chosen = packed[1][..., 3] == each
        sides = [
            fractions_at(part, cos_d[chosen], absorption[chosen])
            for part in (table.forward, table.backward)
        ]
        expected[chosen] = dual_scattering(
            packed[2][chosen][:, :3].astype(np.float64),
            *(values[chosen] for values in (theta_i, theta_r, phi)),
            sides[0],
            sides[1],
            tau[chosen],
            packed[2][chosen][:, 3].astype(np.float64),
            fibre,
            float(each),
        )
    assert (expected > 1e-3).mean() > 0.5
    # a driver interpolates with weights of eight bits
    assert np.abs(found - expected).max() <= 0.02 * expected.max()
    assert (np.abs(found - expected) <= 0.01 * expected + 1e-4).mean() > 0.99


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_scattering_light(compute: Callable[..., np.ndarray], settings: ShadingSettings) -> None:
    """From directions to light, with and without a known tau."""
    random = np.random.default_rng(12)
    tables = marschner_tables(fibre_of(settings), PREVIEW_SIZE)
    table = fractions(tables)
    ways = random.normal(size=(4, *SHAPE, 3))
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    ways[1] = strand_normal(ways[1], ways[0], np.zeros(3))
    lanes = random.random((4, *SHAPE)) * np.array([1.0, 1.0, 8.0, 4.0])[:, None, None]
    lanes[3] -= 1.0
    packed = np.concatenate([ways, lanes[..., None]], axis=-1).astype(np.float32)
    received = random.normal(scale=0.2, size=(*SHAPE, 4)).astype(np.float32)
    received[..., 0] = np.abs(received[..., 0])
    beneath = random.normal(scale=0.5, size=(*SHAPE, 4)).astype(np.float32)
    beneath[..., 3] = random.uniform(0.0, 100.0, SHAPE) * (random.random(SHAPE) < 0.7)
    found = compute(
        "scattering_light.glsl",
        (SHAPE[1], SHAPE[0]),
        textures=dict(zip(("tangents", "normals", "lights", "eyes"), packed, strict=True))
        | {"received": received, "beneath": beneath}
        | {"longitudinal": tables.longitudinal, "azimuthal": tables.azimuthal}
        | {"paths": tables.paths, "forward": table.forward, "backward": table.backward},
        blocks={
            "fibre": ("Fibre", pack_fibre(settings)),
            "shading": ("ShadingSettings", struct_values(settings)),
        },
        structs=("struct_fibre.glsl",),
        settings=(ShadingSettings,),
    )[..., :3]
    exact = packed.astype(np.float64)
    expected = scattering_light(
        tables,
        table,
        *(exact[which, ..., :3] for which in range(4)),
        exact[0, ..., 3],
        exact[1, ..., 3],
        root_absorption(settings),
        settings,
        0.7,
        np.array([0.6, 0.4, 0.3]),
        tau=exact[3, ..., 3],
        beyond=exact[2, ..., 3],
        skin_seen=SkinSeen(received, beneath[..., 3], beneath[..., :3]),
    )
    assert (np.abs(found - expected) <= 0.01 * expected + 1e-4).mean() > 0.99
    assert np.abs(found - expected).max() <= 0.02 * expected.max()
