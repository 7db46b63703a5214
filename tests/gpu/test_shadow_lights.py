"""Lights and hair that opacity maps cannot represent: the rest of the picture stays right."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import LIGHT_CAPACITY, Cone, Light
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 48
FORMS = ["slices", "deep"]
SUN = Light.sun((-0.5, 0.2, -0.6), (1.0, 1.0, 1.0), 3.0)
PLAIN = ShadingSettings(model="kajiya_kay", color_variation=0.0, shift_noise=0.0, sparkle=0.0)


@pytest.fixture
def frame() -> Any:
    from hairloom.addon.render import frame

    return frame


def curtain(x: float, seed: int = 1) -> np.ndarray:
    """A curtain of hanging strands at one x, 0.2 m wide along y and 0.2 m high."""
    y = np.random.default_rng(seed).uniform(-0.1, 0.1, 120)
    strands = np.zeros((len(y), 6, 3), np.float32)
    strands[..., 0], strands[..., 1] = x, y[:, None]
    strands[..., 2] = np.linspace(0.1, -0.1, 6)
    return strands


HAIR = np.concatenate([curtain(x, int(50 * x + 9)) for x in (-0.08, -0.04, 0.04, 0.08)])


def of_form(form: str, **more: Any) -> VolumeSettings:
    settings = {"resolution": 64, "strand_fraction": 1.0, "scattering": False, "bias": 0.002}
    settings["max_lights"] = 2
    return VolumeSettings(shadows=form, **{**settings, **more})


def snapshot_of(volume: VolumeSettings, *lights: Light, **more: Any) -> Any:
    strands = more.pop("strands", HAIR)
    settings: dict[str, Any] = {
        "radius": np.full(strands.shape[:2], 1e-3, np.float32),
        "ambient": (0.0, 0.0, 0.0),
        "shading": PLAIN,
        "strand_settings": StrandSettings(tip_width=1.0, minimum_width=0.0, transparency="none"),
        "detail": DetailSettings(culling="none", lod_size=0.0),
        "volume_center": np.array([-9.0, 0.0, 0.0], np.float32),
        "table_size": PREVIEW_SIZE,
    }
    return Snapshot(strands, lights=lights, volume=volume, **{**settings, **more})


def drawn(frame: Any, *arguments: Any, from_x: float = 1.0, **more: Any) -> np.ndarray:
    """The picture, seen along x."""
    camera = Camera(look_at((from_x, 0.0, 0.0), (0.0, 0.0, 0.0)), orthographic(0.2, 1.0, 0.0, 3.0))
    picture: np.ndarray = frame.render_image(snapshot_of(*arguments, **more), camera, SIZE, SIZE, 1)
    assert np.isfinite(picture).all()
    return picture


def lamp(*place: float) -> Light:
    return Light.point(place, (1.0, 1.0, 1.0), 0.5)


@pytest.mark.parametrize("form", FORMS)
def test_a_lamp_amidst_the_hair_leaves_the_shadows_of_others_as_they_are(
    frame: Any, form: str
) -> None:
    lights = SUN, lamp(0.0, 0.0, 0.01)
    alone, both, unshaded = (
        drawn(frame, volume, *which)
        for volume, which in (
            (of_form(form), (SUN,)),
            (of_form(form), lights),
            (VolumeSettings(shadows="none"), (lights[1],)),
        )
    )
    assert alone[..., 0].max() > 0.01 and unshaded[..., 0].max() > 0.01
    assert np.allclose(both[..., :3], (alone + unshaded)[..., :3], rtol=1e-3)
    # nor does it replace a light that could cast a shadow
    assert np.array_equal(both, drawn(frame, of_form(form, max_lights=1), *lights))


@pytest.mark.parametrize("form", FORMS)
def test_a_lamp_between_hair_is_shaded_before_it_and_not_behind(frame: Any, form: str) -> None:
    """Two curtains on each side of a lamp nearer to those at x > 0, so that its map is of the rest.

    Seen from -x, the outer curtain is in the shadow of the inner one; seen from +x it is not.
    """
    light = lamp(0.055, 0.0, 0.0)
    hair = HAIR[HAIR[:, 0, 0] != np.float32(0.04)]
    for from_x, is_shaded in ((-1.0, True), (1.0, False)):
        # the visible hair faces the lamp
        away = np.array([9.0 * from_x, 0.0, 0.0], np.float32)
        lit, shaded = (
            drawn(frame, volume, light, strands=hair, from_x=from_x, volume_center=away)[..., 0]
            for volume in (of_form(form, extinction=0.0), of_form(form))
        )
        ratio = shaded[12:36, 12:36].sum() / lit[12:36, 12:36].sum()
        assert ratio < 0.75 if is_shaded else ratio > 0.999


@pytest.mark.parametrize("form", FORMS)
def test_a_spot_that_shines_away_changes_nothing(frame: Any, form: str) -> None:
    cone = Cone(((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)), 1.0, 0.1)
    for place in ((0.5, 0.0, 0.0), (0.16, 0.0, 0.0)):
        away = Light.spot(place, (1.0, 1.0, 1.0), 50.0, cone)
        assert np.array_equal(
            drawn(frame, of_form(form), SUN), drawn(frame, of_form(form), SUN, away)
        )


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_hair_of_no_extent_leaves_the_rest_of_the_picture(
    frame: Any, form: str, model: str
) -> None:
    """One strand of radius 0 whose CVs coincide."""
    wall = Surface(
        np.array([[-0.1, -1, -1], [-0.1, 1, -1], [-0.1, 1, 1], [-0.1, -1, 1]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    strands = np.zeros((1, 6, 3), np.float32)
    more = {
        "strands": strands,
        "meshes": (MeshSnapshot.of(wall),),
        "shading": replace(PLAIN, model=model),
    }
    light = Light.sun((-1.0, 0.1, -0.2), (1.0, 1.0, 1.0), 3.0)
    for width in (0.0, 1.0):
        strands_settings = StrandSettings(minimum_width=width)
        none, found = (
            drawn(
                frame,
                volume,
                light,
                lamp(0.3, 0.0, 0.0),
                radius=np.zeros((1, 6), np.float32),
                strand_settings=strands_settings,
                **more,
            )
            for volume in (VolumeSettings(shadows="none"), of_form(form, scattering=True))
        )
        aside = np.ones((SIZE, SIZE), bool)
        aside[22:26, 22:26] = False
        assert none[aside][:, 0].min() > 0.01
        assert np.allclose(none[aside], found[aside], rtol=1e-5)


@pytest.mark.parametrize("form", FORMS)
def test_of_twenty_lights_the_first_eight_shine_and_two_throw_shadows(
    frame: Any, form: str
) -> None:
    lights = tuple(
        Light.sun((-1.0, np.sin(turn), -1.0), (1.0, 1.0, 1.0), 1.0 / (1 + turn))
        for turn in range(20)
    )
    found = drawn(frame, of_form(form), *lights, from_x=-1.0)
    eight = drawn(frame, of_form(form), *lights[:LIGHT_CAPACITY], from_x=-1.0)
    assert np.array_equal(found, eight)
    one, two = (
        drawn(frame, of_form(form, max_lights=most), *lights, from_x=-1.0) for most in (1, 2)
    )
    assert np.array_equal(found, two) and one[..., 0].sum() > two[..., 0].sum()


@pytest.mark.parametrize("form", FORMS)
def test_both_ends_of_the_extinction(frame: Any, form: str) -> None:
    """At 0 all hair is lit as if alone, at 1000 the hair in front still is."""
    light = Light.sun((-1.0, 0.0, 0.0), (1.0, 1.0, 1.0), 3.0)
    front = HAIR[HAIR[:, 0, 0] == np.float32(0.08)]
    alone = drawn(frame, VolumeSettings(shadows="none"), light, strands=front)
    none = drawn(frame, of_form(form, extinction=0.0), light, strands=front)
    assert np.allclose(alone, none, rtol=1e-4)
    # seen from behind the first curtain
    hard, soft = (
        drawn(frame, of_form(form, extinction=much, bias=0.05), light) for much in (1000.0, 0.0)
    )
    is_front = drawn(frame, VolumeSettings(shadows="none"), light, strands=front)[..., 3] > 0.999
    assert is_front.mean() > 0.3
    assert np.allclose(hard[is_front], soft[is_front], rtol=5e-3)
    covered = ~is_front & (soft[..., 0] > 0.0)
    assert covered.sum() > 20
    assert hard[covered][:, 0].mean() < 0.8 * soft[covered][:, 0].mean()
