"""Errors of Marschner's reference and of its tables, and how long the tables take.

`lobe_error_*` are the largest differences of N_R, N_TT, N_TRT from ten million rays traced through
a glass cylinder, relative to each lobe's peak, away from the pole of TRT. `lut_error` is that of S
from the tables of the default size, relative to the peak of S, the worst of five hair colours and
channels.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace

import numpy as np
from fibre_oracles import lobe_errors, scattered_energy, traced_lobes

from hairloom.addon.arrays import Floats
from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.pigment import melanin_absorption
from hairloom.addon.shading.marschner.scattering import marschner
from hairloom.addon.shading.marschner.tables import (
    DEFAULT_SIZE,
    PREVIEW_SIZE,
    look_up,
    marschner_tables,
)

RAYS_AT_ONCE, RAY_ROUNDS, TABLE_ROUNDS = 1_000_000, 10, 15
MELANIN_AND_REDNESS = {
    "white": (0.0, 0.0),
    "blond": (0.25, 0.3),
    "brown": (0.75, 0.3),
    "red": (0.6, 0.9),
    "black": (0.98, 0.3),
}


def reference_figures() -> dict[str, float]:
    """The figures of this part, for the benchmark to print."""
    error_r, error_tt, error_trt = ray_errors()
    energies = furnace_energies()
    return {
        "lobe_error_r": error_r,
        "lobe_error_tt": error_tt,
        "lobe_error_trt": error_trt,
        "furnace_energy": float(energies.mean()),
        "furnace_worst": float(energies.max()),
        "lut_error": max(color_errors().values()),
        "preview_tables_ms": tables_ms(PREVIEW_SIZE),
        "default_tables_ms": tables_ms(DEFAULT_SIZE),
    }


def ray_errors() -> tuple[float, float, float]:
    """Errors of R, TT, TRT, for light 20 degrees off brown hair's normal plane."""
    theta = np.radians(20.0)
    fibre = Fibre(absorption=(0.1, 0.4, 1.5), glint_width=0.0)
    rounds = [traced_lobes(RAYS_AT_ONCE, theta, fibre, seed=seed)[0] for seed in range(RAY_ROUNDS)]
    return lobe_errors(np.mean(rounds, axis=0), theta, fibre)


def furnace_energies() -> Floats:
    """Energy that a clear fibre without tilt scatters, for light from -85 to 85 degrees, (35,)."""
    fibre = Fibre(absorption=(0.0, 0.0, 0.0), cuticle_tilt=0.0)
    theta_i = np.radians(np.linspace(-85.0, 85.0, 35))
    return scattered_energy(fibre, theta_i)[:, 0]


def color_errors() -> dict[str, float]:
    """Errors of S from one set of tables, by hair colour."""
    random = np.random.default_rng(5)
    theta_i, theta_r = np.radians(random.uniform(-60.0, 60.0, (2, 20_000)))
    phi = random.uniform(-np.pi, np.pi, 20_000)
    tables = marschner_tables(Fibre(), DEFAULT_SIZE)
    errors = {}
    for name, pigment in MELANIN_AND_REDNESS.items():
        red, green, blue = absorption = melanin_absorption(*pigment)
        fibre = replace(Fibre(), absorption=(red, green, blue))
        exact = marschner(theta_i, theta_r, phi, fibre)
        strengths = np.array(fibre.strengths)
        found = look_up(tables, theta_i, theta_r, phi, absorption, strengths)
        relative_errors = np.abs(found - exact).max(axis=0) / exact.max(axis=0)
        errors[name] = float(relative_errors.max())
    return errors


def tables_ms(size: int) -> float:
    """Median processor time to make all tables of a fibre."""
    times = []
    for _ in range(TABLE_ROUNDS):
        begin = time.process_time()
        marschner_tables(Fibre(), size)
        times.append((time.process_time() - begin) * 1000.0)
    return statistics.median(times)
