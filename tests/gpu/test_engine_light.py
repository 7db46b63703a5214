"""Light of hair in engines, whose shaders have no shadow maps and no scattering, beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import hair_hlsl
import numpy as np
import pytest
from hlsl_on_gpu import probe_glsl

from hairloom.addon.shading.environment import (
    OCTANT_BLUR,
    Environment,
    hair_ambient,
    openness_from_occlusion,
)
from hairloom.addon.shading.marschner.look import fibre_of, lit_fraction, strand_color
from hairloom.addon.shading.marschner.pigment import COLOR_FACTOR, melanin_absorption
from hairloom.addon.shading.marschner.tables import marschner_tables, table_level
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.dual import fractions, scattering_light
from hairloom.addon.shading.volume.settings import VolumeSettings

LOOK = ShadingSettings(model="marschner", shift_noise=0.0, sparkle=0.0)
OCCLUSIONS = (0.2, 0.4, 0.6)
MELANINS = (0.0, 0.25, 0.5, 0.75, 1.0)

PROBE = """
vec4 result_of_probe;

// at.x: 0.05 times the number of a place, with an absorption of 0 to 3 and one of four occlusions
vec4 probe(vec2 at)
{
  float number = at.x / 0.05;
  HairMaterial hair;
  hair.model = 1;
  hair.tip_tint = hair.grey_fraction = 0.0;
  hair.tint_start = 0.0;
  hair.tint_end = 1.0;
  hair.ambient = 1.0;
  hair.fibre_root = vec4(vec3(mod(number, 256.0) * 0.0125), FACTOR);
  hair.fibre_tip = vec4(0.0);
  hair.fibre_strengths = vec4(1.0);
  float occlusion = 0.2 * (1.0 + floor(mod(number, 1024.0) / 256.0));
  return vec4(hair.fibre_root.x,
              occlusion,
              hair_ambient(hair, 0.5, vec3(1.0), occlusion).x,
              hair_lit_fraction(hair, occlusion));
}
"""


@pytest.fixture(scope="module")
def in_engines(gpu_context: Any, tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """Absorption, occlusion, ambient light and lit fraction, each row one place."""
    shading = hair_hlsl.SOURCE.read_text(encoding="utf-8")
    text = shading + PROBE.replace("FACTOR", repr(COLOR_FACTOR))
    file: Path = tmp_path_factory.mktemp("engine_light") / "probe.glsl"
    found = probe_glsl(file, text, "result_of_probe = probe(place)").reshape(-1, 4)
    assert np.unique(found[:, 1]).size == 4 and np.isfinite(found).all()
    return found


def light_of_hair(melanin: float, occlusion: float) -> np.ndarray:
    """Radiance of hair that lies on a large surface, in a white world of radiance 1: the mean over
    all directions to the eye, (3,)."""
    to_eye = np.random.default_rng(1).normal(size=(48, 3))
    to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
    to_eye[:, 2] = np.abs(to_eye[:, 2])
    tangent, normal = (np.broadcast_to(axis, to_eye.shape) for axis in np.eye(3)[[0, 2]])
    absorption = np.broadcast_to(melanin_absorption(melanin, 0.3), to_eye.shape)
    tables, half = marschner_tables(fibre_of(LOOK), 48), np.full(len(to_eye), 0.5)
    sides = fractions(tables)

    def light(towards: np.ndarray, path: np.ndarray) -> np.ndarray:
        return scattering_light(
            tables,
            sides,
            tangent,
            normal,
            np.broadcast_to(towards, to_eye.shape),
            to_eye,
            half,
            half,
            absorption,
            LOOK,
            VolumeSettings().density,
            np.zeros(3),
            level=table_level(OCTANT_BLUR, 48),
            tau=path[..., 0],
            beyond=path[..., 1],
        )

    openness = openness_from_occlusion(np.full(len(to_eye), occlusion), normal)
    return hair_ambient(Environment((1.0, 1.0, 1.0)), openness, light).mean(axis=0)


@pytest.mark.parametrize("occlusion", OCCLUSIONS)
def test_ambient_light_of_engines_is_that_of_dual_scattering(
    in_engines: np.ndarray, occlusion: float
) -> None:
    """Within a factor of 1.5 for all natural colours. The colour of a mass of brown hair alone
    would have less than a quarter of the light. Real hair, which the formula is fitted to, is no
    flat surface."""
    here = in_engines[np.abs(in_engines[:, 1] - occlusion) < 0.01]
    order = np.argsort(here[:, 0])
    for melanin in MELANINS:
        absorption = melanin_absorption(melanin, 0.3)
        ours = light_of_hair(melanin, occlusion)
        theirs = np.interp(absorption, here[order, 0], here[order, 2])
        inside = absorption < here[:, 0].max()
        assert (np.abs(np.log(theirs / ours))[inside] < np.log(1.5)).all(), (melanin, theirs / ours)
        if melanin == 0.5:
            assert (strand_color(absorption) * occlusion < 0.25 * ours).all()


def test_lamps_of_engines_reach_the_outside_as_in_pictures_without_maps(
    in_engines: np.ndarray,
) -> None:
    assert in_engines[:, 3] == pytest.approx(lit_fraction(in_engines[:, 1]), abs=1e-5)
    assert in_engines[:, 3].max() == 1.0 and in_engines[:, 3].min() < 0.5
