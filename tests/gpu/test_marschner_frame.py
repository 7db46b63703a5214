"""Marschner as it is drawn: pixels against the reference, highlights that do not flicker."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import tolerance

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.shading.environment import (
    CORNER_BLUR,
    Environment,
    hair_ambient,
    openness_by_occlusion,
)
from hairloom.addon.shading.kajiya_kay import strand_normal
from hairloom.addon.shading.lights import Light, light_at
from hairloom.addon.shading.marschner import tables as tables_module
from hairloom.addon.shading.marschner.look import (
    fibre_of,
    marschner_light,
    strand_absorption,
)
from hairloom.addon.shading.marschner.tables import (
    PREVIEW_SIZE,
    MarschnerTables,
    marschner_tables,
    table_level,
)
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.strand_noise import strand_noise
from hairloom.addon.shading.volume.settings import VolumeSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

RIBBON = StrandSettings(fullness=1.0, tip_width=1.0, minimum_width=0.0)
WHITE = (1.0, 1.0, 1.0)


BLOND = ShadingSettings(model="marschner", pigment="melanin", melanin=0.25)
LOOKS = {
    "brown": ShadingSettings(model="marschner", noise_cells=7.0),
    "blond, tinted and grey": replace(BLOND, tip_tint=0.7, grey_fraction=0.5, cuticle_tilt=0.1),
    "without scattered light": replace(
        BLOND, fake_scattering=0.0, volume_shadow=0.0, shift_noise=1.0
    ),
}


@pytest.mark.parametrize("size", [PREVIEW_SIZE, tables_module.DEFAULT_SIZE])
@pytest.mark.parametrize("shading", LOOKS.values(), ids=LOOKS)
def test_a_pixel_has_the_colour_of_the_reference(
    frame: Any, shading: ShadingSettings, size: int
) -> None:
    """Broad straight ribbons under a sun before and a lamp behind them, the whole fragment."""
    ends = np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.02]])
    # side by side, and turned, so that some stand in a highlight
    strands = np.stack(
        [
            ends + [0.0, 0.0, 0.05 * place] + [[0.0, 0.0, 0.0], [0.0, 0.04 * place, 0.0]]
            for place in range(-3, 4)
        ]
    ).astype(np.float32)
    seeds = np.arange(7) * 1009 + 12
    lights = (
        Light.sun((0.2, 0.7, -1.0), (1.0, 0.9, 0.8), 3.0),
        Light.point((0.1, 0.5, 0.2), (0.5, 0.7, 1.0), 8.0),
    )
    center, ambient = np.array([0.0, 0.5, -0.3], np.float32), (0.1, 0.2, 0.3)
    snapshot = frame.Snapshot(
        strands,
        np.full(strands.shape[:2], 0.012, np.float32),
        np.broadcast_to(np.float32([0.4, 0.8]), strands.shape[:2]),
        seed=seeds,
        lights=lights,
        ambient=ambient,
        shading=shading,
        strand_settings=RIBBON,
        volume=VolumeSettings(shadows="none"),
        volume_center=center,
        table_size=size,
    )
    eye = np.array([0.05, -0.6, 0.2])
    camera = frame.Camera(frame.look_at(eye, (0, 0, 0)), frame.perspective(0.9, 1.0, 0.1, 5.0))
    picture = frame.render_image(snapshot, camera, 601, 601, 1)

    tables = marschner_tables(fibre_of(shading), size)
    chord = (strands[:, 1:] - strands[:, :1]).astype(np.float64)
    column, row, along = seen_pixels(strands[:, :1], chord, camera.projection @ camera.view, 601)
    point = strands[:, :1] + along[..., None] * chord
    tangent = chord / np.linalg.norm(chord, axis=-1, keepdims=True) + np.zeros((7, 9, 3))
    normal = strand_normal(point, tangent, center)
    to_eye = (eye - point) / np.linalg.norm(eye - point, axis=-1, keepdims=True)
    cells = along * shading.noise_cells
    shift, sparkle = (strand_noise(seeds[:, None], channel, cells) for channel in (0, 1))
    own = [strand_noise(seeds[:, None], channel, np.zeros((7, 9))) for channel in (2, 3)]
    absorption = strand_absorption(shading, along, *own)
    occlusion = 0.4 + 0.4 * along
    expected = np.zeros((7, 9, 3))
    for lamp in lights:
        to_light, irradiance = light_at(lamp, point)
        expected += irradiance * marschner_light(
            tables, tangent, normal, to_light, to_eye, shift, sparkle, absorption, shading
        )
    expected *= occlusion[..., None]
    away = (point - center) / np.linalg.norm(point - center, axis=-1, keepdims=True)
    expected += hair_ambient(
        Environment(ambient),
        openness_by_occlusion(occlusion, away),
        lambda towards, path: marschner_light(
            tables,
            tangent,
            normal,
            towards,
            to_eye,
            shift,
            sparkle,
            absorption,
            shading,
            level=table_level(CORNER_BLUR, size),
            tau=path[..., 0],
        ),
    )
    found = picture[row, column]
    assert (found[..., 3] == 1.0).all()
    assert np.abs(found[..., :3] / expected - 1.0).max() < tolerance(2e-3, 4e-3)


def seen_pixels(
    root: np.ndarray, chord: np.ndarray, matrix: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nine pixels along each straight strand, and what of the strand lies across from their middle.

    Returns column, row and how far along, each (strands, 9).
    """

    def pixels_of(along: np.ndarray) -> np.ndarray:
        point = np.pad(root + along[..., None] * chord, ((0, 0), (0, 0), (0, 1)), constant_values=1)
        clip = point @ matrix.T
        return (clip[..., :2] / clip[..., 3:] + 1.0) / 2.0 * size

    middle = np.floor(pixels_of(np.linspace(0.1, 0.9, 9)[None])) + 0.5
    fine = np.linspace(0.0, 1.0, 20_001)
    places = pixels_of(fine[None])
    nearest = [
        [np.square(places[strand] - middle[strand, i]).sum(axis=-1).argmin() for i in range(9)]
        for strand in range(len(root))
    ]
    column, row = np.moveaxis(middle.astype(int), -1, 0)
    return column, row, fine[np.array(nearest)]


def sheet(pixels: int, cycle: float, swing: float) -> np.ndarray:
    """Upright strands, one a column of pixels, that wave in depth, a cycle in so many pixels."""
    height = np.linspace(-0.1, 1.1, 16 * pixels)
    phase = np.random.default_rng(1).random((pixels, 1)) * 2.0 * np.pi
    rate = 2.0 * np.pi * pixels / cycle
    strands = np.zeros((pixels, len(height), 3), np.float32)
    strands[..., 0] = ((np.arange(pixels) + 0.5) / pixels)[:, None]
    strands[..., 1] = np.tan(swing) / rate * np.sin(rate * height + phase)
    strands[..., 2] = height
    return strands


def without_levels(tables: MarschnerTables) -> MarschnerTables:
    return replace(tables, longitudinal=np.repeat(tables.longitudinal[:1], 6, axis=0))


#: towards the light; the eye is at -y
BEFORE = ((0.62, -0.78, 0.13), (-0.75, -0.6, -0.28), (-0.9, -0.3, 0.3), (0.98, -0.2, 0.0))
BEHIND = (-0.62, 0.78, -0.13)


@pytest.mark.alike
@pytest.mark.parametrize(("cycle", "swing"), [(6.3, 0.5), (15.3, 0.5), (40.3, 1.0)])
def test_highlights_on_waves_do_not_flicker(
    frame: Any, monkeypatch: pytest.MonkeyPatch, cycle: float, swing: float
) -> None:
    """One sample a pixel comes close to 64 of them, where without levels it is far off.

    Light from behind stays what it is: theta_h hardly changes, and nothing may be blurred.
    """
    from hairloom.addon.render import marschner_textures

    size = 48
    strands = sheet(size, cycle, swing)
    shading = replace(
        BLOND,
        width_r=float(np.radians(2.0)),
        width_tt=float(np.radians(1.5)),
        width_trt=float(np.radians(3.0)),
        **dict.fromkeys(("color_variation", "shift_noise", "sparkle"), 0.0),
        **dict.fromkeys(("volume_shadow", "fake_scattering"), 0.0),
    )
    camera = frame.Camera(
        frame.look_at((0.5, -1.0, 0.5), (0.5, 0.0, 0.5)), frame.orthographic(1.0, 1.0, 0.0, 3.0)
    )

    def drawn(samples: int) -> np.ndarray:
        """(lights, rows, columns) of green."""
        pictures = []
        for direction in (*BEFORE, BEHIND):
            snapshot = frame.Snapshot(
                strands,
                np.full(strands.shape[:2], 0.5 / size, np.float32),
                lights=(Light.sun(-np.array(direction), WHITE, 4.0),),
                ambient=(0.0, 0.0, 0.0),
                shading=shading,
                strand_settings=RIBBON,
                volume=VolumeSettings(shadows="none"),
                detail=DetailSettings(mode="fixed", subdivisions=1),
            )
            picture = frame.render_image(snapshot, camera, size, size, samples)
            pictures.append(picture[4:-4, 4:-4, 1])
        return np.array(pictures)

    def off(pictures: np.ndarray) -> np.ndarray:
        """Root of the mean square for each light, as a factor of its mean."""
        return np.sqrt(np.mean((pictures - exact) ** 2, axis=(1, 2))) / exact.mean(axis=(1, 2))

    exact, filtered = drawn(8), drawn(1)
    monkeypatch.setattr(
        marschner_textures, "marschner_tables", lambda *a: without_levels(marschner_tables(*a))
    )
    marschner_textures.MARSCHNER.release()
    plain = drawn(1)
    marschner_textures.MARSCHNER.release()
    assert off(plain)[:-1].min() > 0.7, "there is something to fix"
    assert (off(filtered)[:-1] < 0.25 * off(plain)[:-1]).all()
    assert off(filtered)[-1] < 0.2
    assert filtered.mean(axis=(1, 2)) == pytest.approx(exact.mean(axis=(1, 2)), rel=0.15)
