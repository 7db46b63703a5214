"""Marschner's model in drawn pictures: pixels against the reference, and stable highlights."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import tolerance
from tiers import few_in_commits

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.environment import (
    OCTANT_BLUR,
    Environment,
    hair_ambient,
    openness_from_occlusion,
)
from hairloom.addon.shading.kajiya_kay import strand_normal
from hairloom.addon.shading.lights import Light, light_at
from hairloom.addon.shading.marschner import tables as tables_module
from hairloom.addon.shading.marschner.look import (
    fibre_of,
    lit_fraction,
    marschner_light,
    root_absorption,
    strand_absorption,
    strand_angles,
)
from hairloom.addon.shading.marschner.tables import (
    PREVIEW_SIZE,
    MarschnerTables,
    marschner_tables,
    table_level,
)
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.skin_seen import SkinSeen
from hairloom.addon.shading.strand_noise import strand_noise
from hairloom.addon.shading.volume.dual import fractions, fractions_at, reflected_by_far_skin
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

RIBBON = StrandSettings(fullness=1.0, tip_width=1.0, minimum_width=0.0)
WHITE = (1.0, 1.0, 1.0)


EYE, CENTER = np.array([0.05, -0.6, 0.2]), np.array([0.0, 0.5, -0.3], np.float32)
LAMPS = (
    Light.sun((0.2, 0.7, -1.0), (1.0, 0.9, 0.8), 3.0),
    Light.point((0.1, 0.5, 0.2), (0.5, 0.7, 1.0), 8.0),
)
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
    """The complete fragment shader, on broad straight ribbons with a sun before and a lamp behind
    them."""
    strands = ribbons()
    seeds = np.arange(7) * 1009 + 12
    ambient = (0.1, 0.2, 0.3)
    snapshot = Snapshot(
        strands,
        np.full(strands.shape[:2], 0.012, np.float32),
        np.broadcast_to(np.float32([0.4, 0.8]), strands.shape[:2]),
        seed=seeds,
        lights=LAMPS,
        ambient=ambient,
        shading=shading,
        strand_settings=RIBBON,
        volume=VolumeSettings(shadows="none"),
        volume_center=CENTER,
        table_size=size,
    )
    camera = before_ribbons()
    picture = frame.render_image(snapshot, camera, 601, 601, 1)

    tables = marschner_tables(fibre_of(shading), size)
    column, row, along, point, tangent, normal, to_eye = on_ribbons(strands, camera)
    cells = along * shading.noise_cells
    shift, sparkle = (strand_noise(seeds[:, None], channel, cells) for channel in (0, 1))
    own = [strand_noise(seeds[:, None], channel, np.zeros((7, 9))) for channel in (2, 3)]
    absorption = strand_absorption(shading, along, *own)
    occlusion = 0.4 + 0.4 * along
    expected = np.zeros((7, 9, 3))
    for lamp in LAMPS:
        to_light, irradiance = light_at(lamp, point)
        expected += irradiance * marschner_light(
            tables, tangent, normal, to_light, to_eye, shift, sparkle, absorption, shading
        )
    expected *= lit_fraction(occlusion)[..., None]
    away = (point - CENTER) / np.linalg.norm(point - CENTER, axis=-1, keepdims=True)
    expected += hair_ambient(
        Environment(ambient),
        openness_from_occlusion(occlusion, away),
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
            level=table_level(OCTANT_BLUR, size),
            tau=path[..., 0],
        ),
    )
    found = picture[row, column]
    assert (found[..., 3] == 1.0).all()
    assert np.abs(found[..., :3] / expected - 1.0).max() < tolerance(2e-3, 4e-3)


#: as from light_flow.skin_seen_along_axes: received, beneath, depth
SEEN = np.float32([0.6, 0.15, -0.8, 0.4, 0.1, 0.5, -0.2, 4.0])
PLAIN = replace(
    ShadingSettings(model="marschner", pigment="melanin", melanin=0.4),
    color_variation=0.0,
    shift_noise=0.0,
    sparkle=0.0,
    grey_fraction=0.0,
    tip_tint=0.0,
)


@pytest.mark.parametrize("transparency", few_in_commits(["layers", "none"]))
def test_strands_gain_the_light_of_the_reference(frame: Any, transparency: str) -> None:
    """Broad straight ribbons under a sun and a lamp, with and without far skin."""
    strands = ribbons()
    corner = Surface(np.float32([[9, 9, 9], [9, 9, 9.1], [9, 9.1, 9]]), np.array([[0, 1, 2]]))
    with_skin = Snapshot(
        strands,
        np.full(strands.shape[:2], 0.012, np.float32),
        lights=LAMPS,
        ambient=(0.0, 0.0, 0.0),
        shading=PLAIN,
        strand_settings=replace(RIBBON, transparency=transparency),
        volume=VolumeSettings(),
        volume_center=CENTER,
        table_size=PREVIEW_SIZE,
        casters=(corner,),
        skin_seen=np.tile(SEEN, (14, 1)),
    )
    nothing_far = np.tile(SEEN * [0, 0, 0, 0, 1, 1, 1, 1], (14, 1)).astype(np.float32)
    camera = before_ribbons()
    pictures = [
        frame.render_image(each, camera, 601, 601, 1)
        for each in (with_skin, replace(with_skin, skin_seen=nothing_far))
    ]

    column, row, _, point, tangent, normal, to_eye = on_ribbons(strands, camera)
    axes = np.stack([tangent, normal, np.cross(tangent, normal)], axis=-2)
    received, beneath = (SEEN[first : first + 3] @ axes for first in (1, 4))
    mean = np.full((7, 9, 1), SEEN[0])
    seen = SkinSeen(np.concatenate([mean, received], axis=-1), np.full((7, 9), SEEN[7]), beneath)
    sides = fractions(marschner_tables(fibre_of(PLAIN), PREVIEW_SIZE))
    outward = np.sum(normal * to_eye, axis=-1)
    expected = np.zeros((7, 9, 3))
    for lamp in LAMPS:
        to_light, irradiance = light_at(lamp, point)
        towards = to_light + np.zeros((7, 9, 3))
        theta_i, theta_r, _ = strand_angles(
            tangent, normal, towards, to_eye, np.full((7, 9), 0.5), PLAIN
        )
        lobes = (
            fractions_at(side, np.cos(0.5 * (theta_r - theta_i)), root_absorption(PLAIN))
            for side in (sides.forward, sides.backward)
        )
        skin = np.array(with_skin.skin_color)
        expected += irradiance * reflected_by_far_skin(outward, *lobes, towards, seen, skin)
    found = (pictures[0] - pictures[1])[row, column, :3]
    assert expected.max() > 0.05
    assert np.abs(found / expected - 1.0).max() < tolerance(5e-3, 1e-2)


def ribbons() -> np.ndarray:
    """Broad straight ribbons side by side, turned so that some show a highlight."""
    ends = np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.02]])
    each = [
        ends + [0.0, 0.0, 0.05 * place] + [[0.0, 0.0, 0.0], [0.0, 0.04 * place, 0.0]]
        for place in range(-3, 4)
    ]
    return np.stack(each).astype(np.float32)


def before_ribbons() -> Any:
    return Camera(look_at(EYE, (0, 0, 0)), perspective(0.9, 1.0, 0.1, 5.0))


def on_ribbons(strands: np.ndarray, camera: Any) -> tuple[np.ndarray, ...]:
    """Nine pixels along each ribbon: column, row, place along it, point, tangent, normal and
    direction to the eye."""
    chord = (strands[:, 1:] - strands[:, :1]).astype(np.float64)
    column, row, along = seen_pixels(strands[:, :1], chord, camera.projection @ camera.view, 601)
    point = strands[:, :1] + along[..., None] * chord
    tangent = chord / np.linalg.norm(chord, axis=-1, keepdims=True) + np.zeros((7, 9, 3))
    normal = strand_normal(point, tangent, CENTER)
    to_eye = (EYE - point) / np.linalg.norm(EYE - point, axis=-1, keepdims=True)
    return column, row, along, point, tangent, normal, to_eye


def seen_pixels(
    root: np.ndarray, chord: np.ndarray, matrix: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nine pixels along each straight strand, and the strand's places nearest to their centres.

    Returns column, row and place along the strand, each (strands, 9).
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
    """Upright strands, one per column of pixels, with waves in depth of `cycle` pixels."""
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


#: directions to the light; the eye is at -y
BEFORE = ((0.62, -0.78, 0.13), (-0.75, -0.6, -0.28), (-0.9, -0.3, 0.3), (0.98, -0.2, 0.0))
BEHIND = (-0.62, 0.78, -0.13)


@pytest.mark.parametrize(
    ("cycle", "swing"),
    [
        (6.3, 0.5),
        pytest.param(15.3, 0.5, marks=pytest.mark.slow),
        pytest.param(40.3, 1.0, marks=pytest.mark.slow),
    ],
)
def test_highlights_on_waves_do_not_flicker(
    frame: Any, monkeypatch: pytest.MonkeyPatch, cycle: float, swing: float
) -> None:
    """One sample per pixel is close to 64 samples; without table levels it is not.

    For light from behind theta_h hardly changes, so levels must blur nothing.
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
    camera = Camera(look_at((0.5, -1.0, 0.5), (0.5, 0.0, 0.5)), orthographic(1.0, 1.0, 0.0, 3.0))

    def drawn(samples: int) -> np.ndarray:
        """The green channel, (lights, rows, columns)."""
        pictures = []
        for direction in (*BEFORE, BEHIND):
            snapshot = Snapshot(
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
        """Root mean square error for each light, relative to its mean."""
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
