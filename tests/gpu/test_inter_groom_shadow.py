"""Shadows of grooms on each other and on meshes: strands shade alike in one groom or in several."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_calls import gpu_calls
from tiers import few_in_commits

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.light_frame import Ball
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

SIZE = 128
LOOK = StrandSettings(tip_width=1.0, transparency="none")
VOLUME = VolumeSettings(resolution=256, layers=8, strand_fraction=1.0, bias=0.0, scattering=False)
SUN = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 3.0)
CAMERA = Camera(
    look_at((0.0, -0.8, 0.9), (0.0, 0.0, 0.1), up=(0.0, 0.0, 1.0)), orthographic(0.6, 1.0, 0.0, 3.0)
)
LEVEL = Camera(
    look_at((0.0, -3.0, 0.1), (0.0, 0.0, 0.1), up=(0.0, 0.0, 1.0)), orthographic(0.6, 1.0, 0.0, 9.0)
)
FLOOR = Surface(
    np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
)


def sheet(height: float, count: int = 400, seed: int = 1) -> np.ndarray:
    """Level strands side by side, each at its own height, (count, 6, 3)."""
    random = np.random.default_rng(seed)
    strands = np.zeros((count, 6, 3), np.float32)
    strands[..., 0] = np.linspace(-0.2, 0.2, 6)
    strands[..., 1] = random.uniform(-0.2, 0.2, (count, 1))
    strands[..., 2] = height + random.uniform(0.0, 0.02, (count, 1))
    return strands


def groom(key: str, strands: np.ndarray, **changes: Any) -> DrawnGroom:
    radius = np.full(strands.shape[:2], 2e-4, np.float32)
    made = Snapshot(
        strands,
        radius,
        strand_settings=LOOK,
        volume=VOLUME,
        volume_center=np.array([0.0, 0.0, -1.0]),
    )
    return DrawnGroom(key, replace(made, **changes))


def picture(*grooms: DrawnGroom, camera: Camera = CAMERA, **scene: Any) -> np.ndarray:
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass
    from hairloom.addon.render.textures import texture_to_array

    floor = replace(MeshSnapshot.of(FLOOR, (1.0, 1.0, 1.0)), specular=0.0)
    whole = SceneSnapshot(**{"meshes": (floor,), "grooms": grooms, "lights": (SUN,), **scene})
    target = Target()
    ScenePass().draw(whole, camera, target, (SIZE, SIZE), (0.0, 0.0, 0.0, 0.0))
    return texture_to_array(target.color)


def test_a_mesh_has_the_shadow_of_all_grooms(gpu_context: Any) -> None:
    """Three sheets above each other transmit as much light as the same strands in one groom."""
    sheets = [sheet(height, seed=seed) for seed, height in enumerate((0.2, 0.3, 0.4))]
    alone = picture(groom("a", np.concatenate(sheets)))[:, :, 0]
    shared = picture(*(groom(str(i), each) for i, each in enumerate(sheets)))[:, :, 0]
    one = picture(groom("a", sheets[0]))[:, :, 0]
    # in the picture, the floor's middle with its shadow is below the hair
    is_floor = np.zeros((SIZE, SIZE), bool)
    is_floor[20:50, 30:98] = True
    lit, expected, least = (each[is_floor].mean() for each in (shared, alone, one))
    assert least > 1.3 * expected
    assert lit == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("transparency", few_in_commits(["layers", "hashed", "none"]))
@pytest.mark.parametrize("model", few_in_commits(["marschner", "kajiya_kay"]))
def test_hair_has_the_shadow_of_other_grooms(
    gpu_context: Any, transparency: str, model: str
) -> None:
    """A sheet below another one, seen from the side, is as dark in two grooms as in one, and
    brighter alone. Averaged over sizes, since the texels of the maps lie differently on strands.
    """
    look = {
        "strand_settings": replace(LOOK, transparency=transparency),
        "shading": ShadingSettings(model=model),
        "volume": replace(VOLUME, layers=32, layer_depth=0.5),
    }
    light = dict.fromkeys(("one", "two", "low"), 0.0)
    for size in (1.0, 1.011, 1.022, 1.033):
        wider = np.array([size, size, 1.0], np.float32)
        low, high = wider * sheet(0.1, seed=2), wider * sheet(0.2, seed=3)
        found = {
            "one": (groom("a", np.concatenate([low, high]), **look),),
            "two": (groom("a", low, **look), groom("b", high, **look)),
            "low": (groom("a", low, **look),),
        }
        for name, grooms in found.items():
            light[name] += picture(*grooms, meshes=(), camera=LEVEL)[:76, :, :3].sum()
    assert light["low"] > 1.2 * light["one"]
    assert light["two"] == pytest.approx(light["one"], rel=0.06)


def test_balls_beside_or_before_a_groom_get_no_shadow(gpu_context: Any) -> None:
    from hairloom.addon.render.inter_groom_shadow import may_cast_shadow_on
    from hairloom.addon.render.strand_pass import StrandPass

    for light in (SUN, Light.point((0.0, 0.0, 1.2), (1.0, 1.0, 1.0), 10.0)):
        maps = StrandPass().opacity(replace(groom("a", sheet(0.3)).snapshot, lights=(light,)))
        assert maps is not None
        assert may_cast_shadow_on(maps, Ball(np.array([0.0, 0.0, 0.0]), 0.1))
        assert may_cast_shadow_on(maps, Ball(np.array([0.3, 0.0, 0.3]), 0.1))
        assert not may_cast_shadow_on(maps, Ball(np.array([1.5, 0.0, 0.0]), 0.1))
        assert not may_cast_shadow_on(maps, Ball(np.array([0.0, 0.0, 1.0]), 0.1))


def test_places_without_a_serial_are_computed_again_without_accumulating(gpu_context: Any) -> None:
    from hairloom.addon.render.inter_groom_shadow import NO_GROOM, InterGroomShadow
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import texture_from, texture_to_array

    maps = StrandPass().opacity(replace(groom("a", sheet(0.3)).snapshot, lights=(SUN,)))
    assert maps is not None
    shadow = InterGroomShadow()

    def found(x: float, serial: int | None) -> np.ndarray:
        places = np.tile(np.float32([x, 0.0, 0.0, 1.0]), (8, 8, 1))
        texture = shadow.other_tau(texture_from(places, "RGBA32F"), serial, [(NO_GROOM, maps)], 1)
        return texture_to_array(texture)[..., 0]

    below = found(0.0, None)
    assert below.min() > 0.1
    np.testing.assert_array_equal(found(0.0, None), below)
    assert found(1.5, None).max() == 0.0
    assert found(0.0, 1).min() > 0.1
    assert found(1.5, 1).min() > 0.1, "the same serial promises the same places"
    assert found(1.5, 2).max() == 0.0


def test_a_place_sums_the_optical_depth_of_all_other_grooms(gpu_context: Any) -> None:
    from hairloom.addon.render.inter_groom_shadow import InterGroomShadow
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import texture_from, texture_to_array

    lights = (SUN, Light.sun((1.0, 0.0, 0.0), (1.0, 1.0, 1.0), 3.0))
    maps = [
        StrandPass().opacity(replace(groom("a", sheet(height, count)).snapshot, lights=lights))
        for height, count in ((0.3, 400), (0.4, 200))
    ]
    assert maps[0] is not None and maps[1] is not None
    places = np.zeros((1, 8, 4), np.float32)
    places[0, :, 3] = (0.0, 1.0, 2.0, -1.0, 0.0, 1.0, 2.0, -1.0)
    places[0, 4:, 0] = 1.0  # not behind the grooms for either light
    found = texture_to_array(
        InterGroomShadow().other_tau(
            texture_from(places, "RGBA32F"), None, [(0, maps[0]), (1, maps[1])], 2
        )
    )[0]
    assert found[:4, 0].min() == 0.0 == found[3, 0]
    of_second, of_first, of_both = found[:3, 0]
    assert 0.0 < of_second < of_first
    assert of_both == pytest.approx(of_first + of_second, rel=1e-5)
    np.testing.assert_array_equal(found[4:, 0], 0.0)
    np.testing.assert_array_equal(found[:, 1:], 0.0)
    aside = np.zeros((1, 8, 4), np.float32)
    aside[0] = (0.0, 1.0, 0.31, 2.0)  # behind the groom for the second light alone
    lights = (SUN, Light.sun((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 3.0))
    of_both = StrandPass().opacity(replace(groom("a", sheet(0.3)).snapshot, lights=lights))
    assert of_both is not None
    for count in (1, 2):
        texture = InterGroomShadow().other_tau(
            texture_from(aside, "RGBA32F"), None, [(0, of_both)], count
        )
        direction = texture_to_array(texture)[0, 0]
        assert direction[0] == 0.0 and (direction[1] > 0.0) == (count == 2)


def test_grooms_may_cast_shadows_from_each_side_but_not_without_light(gpu_context: Any) -> None:
    from hairloom.addon.render.inter_groom_shadow import may_cast_shadow_on
    from hairloom.addon.render.strand_pass import StrandPass

    def maps(*lights: Light) -> Any:
        return StrandPass().opacity(replace(groom("a", sheet(0.3)).snapshot, lights=lights))

    aside = Light.sun((1.0, 0.0, 0.0), (1.0, 1.0, 1.0), 3.0)
    below, beside = Ball(np.array([0.0, 0.0, -0.4]), 0.1), Ball(np.array([1.0, 0.0, 0.3]), 0.1)
    for ball, lights, is_reached in (
        (below, (SUN,), True),
        (beside, (SUN,), False),
        (below, (aside,), False),
        (beside, (aside,), True),
        (beside, (SUN, aside), True),
        (Ball(np.array([-1.0, 0.0, 0.3]), 0.1), (SUN, aside), False),
        (Ball(np.array([0.0, 0.45, 0.0]), 0.1), (SUN,), False),
        (Ball(np.array([0.0, -0.45, 0.0]), 0.1), (SUN,), False),
        (Ball(np.array([-0.45, 0.0, 0.0]), 0.1), (SUN,), False),
        (Ball(np.array([0.0, 0.45, 0.0]), 0.3), (SUN,), True),
        (Ball(np.array([0.0, 0.0, 1.0]), 0.8), (SUN,), True),
    ):
        assert may_cast_shadow_on(maps(*lights), ball) == is_reached, (ball, lights)


def test_views_in_other_light_keep_their_inter_groom_shadow(gpu_context: Any) -> None:
    """Two views that are drawn in turn keep their look-ups until the other hair moves."""
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.groom_pass import GroomPass
    from hairloom.addon.render.strand_pass import ViewState

    light = {"a": (SUN,), "b": (Light.sun((0.3, 0.0, -1.0), (1.0, 1.0, 1.0), 3.0),)}
    low, high = groom("low", sheet(0.1)).snapshot, groom("high", sheet(0.3, seed=2)).snapshot
    passes, target = {"low": GroomPass(), "high": GroomPass()}, Target()

    def dispatches(view: str, above: Snapshot) -> int:
        lit = {"low": replace(low, lights=light[view]), "high": replace(above, lights=light[view])}
        maps = {key: passes[key].maps(each, view=view) for key, each in lit.items()}
        others = passes["low"].other_maps("low", lit["low"], maps)
        assert others == [maps["high"]]

        def draw() -> None:
            shown = ViewState(view)
            passes["low"].strands.draw(
                lit["low"], CAMERA, SIZE, SIZE, other_maps=others, view=shown
            )

        target.sized(SIZE, SIZE).clear((0.0, 0.0, 0.0, 0.0))
        with target.drawing():
            return int(gpu_calls(draw)["dispatches"])

    first = [dispatches(view, high) for view in "ab"]
    again = [dispatches(view, high) for view in "abab"]
    assert len(set(again)) == 1 and all(each > again[0] for each in first)
    moved = replace(high, points=high.points + np.float32(0.01))
    assert [dispatches(view, moved) for view in "abab"] == [
        *(again[0] + 1, again[0] + 1, again[0], again[0])
    ]


def test_masks_hold_what_alpha_shows(gpu_context: Any, compute: Callable[..., Any]) -> None:
    """Through a sheet with holes, the object behind it appears in both passes."""
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.nearest import FAR_AWAY
    from hairloom.addon.render.scene_pass import ScenePass
    from hairloom.addon.render.snapshot import MeshPictures

    camera = Camera(
        look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        orthographic(2.0, 1.0, 0.0, 9.0),
    )
    uv = (FLOOR.corners[..., :2] + 2.0) / 4.0
    leaf = np.ones((8, 8, 4), np.float32)
    leaf[:, 4:, 3] = 0.2
    high = Surface(FLOOR.positions + np.float32([0, 0, 1]), FLOOR.triangles, uv)
    sheet_of = replace(MeshSnapshot.of(high), pictures=MeshPictures(color=leaf), number=7)
    below = replace(MeshSnapshot.of(FLOOR), number=3)
    for transparency, right in (("hashed", 3.0), ("blended", 3.0), ("opaque", 7.0)):
        meshes = (below, replace(sheet_of, transparency=transparency))
        scene = SceneSnapshot(meshes=meshes)
        nearest = ScenePass().nearest(scene, camera, Target(), (SIZE, SIZE))
        distances, numbers = nearest.distances(camera), nearest.object_numbers(scene)
        assert numbers[64, 20] == 7.0 and numbers[64, 108] == right
        assert distances[64, 20] == pytest.approx(2.0, abs=1e-3)
        assert distances[64, 108] == pytest.approx(3.0 if right == 3.0 else 2.0, abs=1e-3)
    scene = SceneSnapshot()
    nearest = ScenePass().nearest(scene, camera, Target(), (SIZE, SIZE))
    distances, numbers = nearest.distances(camera), nearest.object_numbers(scene)
    assert numbers.max() == 0.0 and distances.min() == np.float32(FAR_AWAY)
