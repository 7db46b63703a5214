"""Shadows of hair and meshes as drawn on Blender's GPU."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import SHADOWS, VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context")]

SIZE = 64
PLAIN = ShadingSettings(color_variation=0.0, shift_noise=0.0, sparkle=0.0)
WIDE = StrandSettings(tip_width=1.0, minimum_width=0.0)
FORMS = [form for form, _, _ in SHADOWS if form != "none"]
#: shines straight down
SUN = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 3.0)


@pytest.fixture
def frame() -> Any:
    from hairloom.addon.render import frame

    return frame


def curtain(count: int, spacing: float, height: float) -> np.ndarray:
    """Strands along y, side by side in x, at one height."""
    x = spacing * (np.arange(count) - 0.5 * (count - 1))
    strands = np.zeros((count, 6, 3), np.float32)
    strands[..., 0] = x[:, None]
    strands[..., 1] = np.linspace(-0.1, 0.1, 6)
    strands[..., 2] = height
    return strands


def seen(frame: Any, snapshot: Any, height: float = 0.2) -> np.ndarray:
    """Seen from below; the picture covers `height` [m]."""
    view = look_at((0.0, 0.0, -1.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = Camera(view, orthographic(height, 1.0, 0.0, 3.0))
    picture: np.ndarray = frame.render_image(snapshot, camera, SIZE, SIZE, 1)
    return picture


def snapshot_of(strands: np.ndarray, **more: Any) -> Any:
    settings: dict[str, Any] = {
        "radius": np.full(strands.shape[:2], 1.0e-3, np.float32),
        "lights": (SUN,),
        "ambient": (0.0, 0.0, 0.0),
        "shading": PLAIN,
        "strand_settings": WIDE,
        "detail": DetailSettings(culling="none", lod_size=0.0),
        # the hair's volume faces the light
        "volume_center": np.array([0.0, 0.0, -9.0], np.float32),
        "table_size": PREVIEW_SIZE,
    }
    return Snapshot(strands, **{**settings, **more})


def of_form(form: str, **more: Any) -> VolumeSettings:
    settings = {"resolution": 128, "strand_fraction": 1.0, "scattering": False}
    return VolumeSettings(shadows=form, **{**settings, **more})


@pytest.mark.alike
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("extinction", [1.0, 3.0])
def test_hair_behind_hair_gets_the_transmitted_light(
    frame: Any, form: str, extinction: float
) -> None:
    """A strand below strands that cover a third of the area gets exp(-K / 3) of the light."""
    above, below = curtain(33, 6.0e-3, 0.03), curtain(1, 1.0, 0.0)
    strands = np.concatenate([below, above])
    radius = np.full(strands.shape[:2], 1.0e-3, np.float32)
    radius[0] = 1.0e-4  # thin, so that it hardly shades itself
    # coarse texels, which average over many strands
    volume = of_form(form, extinction=extinction, resolution=16)
    lit = seen(frame, snapshot_of(below, radius=radius[:1], volume=volume), 1e-3)
    shaded = seen(frame, snapshot_of(strands, radius=radius, volume=volume), 1e-3)
    middle = (slice(24, 40), slice(31, 33))
    is_hair = lit[middle][..., 3] == 1.0
    assert is_hair.any()
    left = shaded[middle][is_hair][..., 0] / lit[middle][is_hair][..., 0]
    assert left.mean() == pytest.approx(np.exp(-extinction / 3.0), abs=0.06)


@pytest.mark.parametrize("form", FORMS)
def test_a_mesh_between_hair_and_light_leaves_it_dark(frame: Any, form: str) -> None:
    """Half of the hair is behind the mesh, which is drawn or only casts a shadow."""
    roof = Surface(
        np.array([[0, -1, 0.1], [1, -1, 0.1], [1, 1, 0.1], [0, 1, 0.1]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    strands = curtain(60, 2.0e-3, 0.0)
    for more in ({"casters": (roof,)}, {"meshes": (MeshSnapshot.of(roof),)}):
        picture = seen(frame, snapshot_of(strands, volume=of_form(form), **more))
        hair = picture[20:44, 14:50, 0]
        # seen from below, x points to the left
        assert hair[:, :16].max() < 1e-6 or hair[:, 20:].max() < 1e-6
        assert max(hair[:, :16].mean(), hair[:, 20:].mean()) > 0.01


@pytest.mark.parametrize("form", FORMS)
def test_hair_shades_the_skin_below(frame: Any, form: str) -> None:
    """Below hair that covers half of the area, exp(-1/2) of the light is left; beside it, all."""
    floor = Surface(
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    strands = curtain(24, 4.0e-3, 0.05)
    mesh = MeshSnapshot.of(floor)
    view = look_at((0.0, -2.0, 0.6), (0.0, 0.0, 0.0))
    camera = Camera(view, orthographic(0.2, 1.0, 0.0, 9.0))

    def floor_seen(volume: VolumeSettings) -> np.ndarray:
        snapshot = snapshot_of(strands, meshes=(mesh,), volume=volume)
        picture: np.ndarray = frame.render_image(snapshot, camera, SIZE, SIZE, 1)
        return picture[:, :, 0]

    open_sky, shaded = floor_seen(of_form("none")), floor_seen(of_form(form, resolution=16))
    ratio = shaded / np.maximum(open_sky, 1e-9)
    assert ratio[30:34, 2:8].min() > 0.99
    assert ratio[30:34, 30:34].mean() == pytest.approx(np.exp(-0.5), abs=0.1)


def ends() -> Iterator[tuple[str, Any]]:
    """Each parameter's name with each of its choices or range limits."""
    for parameter in VolumeSettings.parameters():
        if parameter.kind == "choice":
            yield from ((parameter.name, identifier) for identifier, _, _ in parameter.choices)
        elif parameter.kind == "toggle":
            yield from ((parameter.name, value) for value in (False, True))
        else:
            assert parameter.hard_range is not None
            yield from ((parameter.name, value) for value in parameter.hard_range)


@pytest.mark.alike
@pytest.mark.parametrize(("name", "value"), list(ends()))
@pytest.mark.parametrize("model", few_in_commits(["marschner", "kajiya_kay"]))
def test_no_end_of_a_range_draws_anything_but_numbers(
    frame: Any, model: str, name: str, value: Any
) -> None:
    """Pixels are finite with lights around, in and behind the hair, more than get shadows."""
    lights = (
        SUN,
        Light.point((0.0, 0.0, 0.001), (1, 1, 1), 1.0),
        Light.point((0.0, 0.0, -0.3), (1, 1, 1), 1.0),
    )
    strands = np.concatenate([curtain(9, 4.0e-3, height) for height in (0.0, 0.01, 0.02)])
    form = "slices" if name == "slices" else "deep"
    volume = replace(VolumeSettings(shadows=form, resolution=64), **{name: value})
    shading = replace(PLAIN, model=model, base_color=(0.5, 0.4, 0.3))
    picture = seen(frame, snapshot_of(strands, lights=lights, volume=volume, shading=shading))
    assert np.isfinite(picture).all()
    assert picture[..., 0].max() > 0.0


def test_light_from_strand_to_strand_brightens_light_hair_and_not_black(frame: Any) -> None:
    """Seen from the dark side, which no light reaches directly."""
    strands = np.concatenate([curtain(40, 2.0e-3, 0.002 * layer) for layer in range(8)])
    gain = []
    for melanin in (0.1, 1.0):
        shading = replace(
            PLAIN, model="marschner", pigment="melanin", melanin=melanin, fake_scattering=0.0
        )
        pictures = [
            seen(frame, snapshot_of(strands, shading=shading, volume=volume))
            for volume in (of_form("deep"), replace(of_form("deep"), scattering=True))
        ]
        alone, among = (picture[20:44, 20:44, 0].mean() for picture in pictures)
        gain.append(float(among - alone))
    assert gain[0] > 0.02 and abs(gain[1]) < 0.01 * gain[0]


def test_a_curtain_of_strands_in_any_order_throws_the_same_shadow(frame: Any) -> None:
    strands = np.concatenate([curtain(20, 4.0e-3, 0.004 * layer) for layer in range(5)])
    seeds = np.arange(len(strands))
    order = np.random.default_rng(3).permutation(len(strands))
    pictures = [
        seen(frame, snapshot_of(strands[rows], seed=seeds[rows], volume=of_form("deep")))
        for rows in (seeds, order)
    ]
    assert np.abs(pictures[0] - pictures[1]).max() < 1.0 / 255.0
