"""Soft shadows of a view at rest, against stills of the same hair in the same lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.light_samples import lights_at
from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot
from hairloom.addon.render.snapshot import SKIN, MeshSnapshot, Snapshot
from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import Light, light_at
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE, SAMPLES = 64, 12
#: names of the view with its own lights, and with those of a sample
HARD, SAMPLE = "hard", "sample"
WHITE = (1.0, 1.0, 1.0)
SUN = Light.sun((0.5, 0.2, -1.0), WHITE, 3.0, np.radians(20.0))
EYE = (0.1, -0.5, 0.9)
PERSPECTIVE = Camera(look_at(EYE, (0.0, 0.0, 0.03)), perspective(0.45, 1.0, 0.1, 5.0))
ORTHOGRAPHIC = Camera(look_at(EYE, (0.0, 0.0, 0.03)), orthographic(0.5, 1.0, 0.1, 5.0))
FLOOR = Surface(
    np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
)


def area() -> Light:
    """A square panel of half a metre that shines down."""
    panel = Panel((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), 0.25, 0.25)
    return Light.area((-0.3, 0.0, 0.7), WHITE, 8.0, panel)


def groom(x: float, height: float, *lights: Light) -> Snapshot:
    """A tuft above the floor, with its shadow beside it."""
    random = np.random.default_rng(int(10 * height))
    roots = random.uniform(-0.06, 0.06, (500, 3)) * [1.0, 1.0, 0.3] + [x, 0.0, height]
    ends = roots + random.normal(0.0, 0.01, (500, 3)) + [0.0, 0.08, 0.02]
    points = np.linspace(roots, ends, 4, axis=1).astype(np.float32)
    return Snapshot(
        points,
        np.full(points.shape[:2], 1.5e-3, np.float32),
        lights=lights,
        ambient=(0.1, 0.1, 0.1),
        casters=(FLOOR,),
        shading=ShadingSettings(model="kajiya_kay"),
        strand_settings=StrandSettings(tip_width=1.0),
        volume=VolumeSettings(resolution=64, strand_fraction=1.0),
    )


class View:
    """A view of grooms on a floor, as in a viewport.

    depth: the depth texture of its last redraw.
    """

    def __init__(self, grooms: Sequence[Snapshot], camera: Camera) -> None:
        from hairloom.addon.render.body_shadow import BodyShadow
        from hairloom.addon.render.cached_picture import CachedPicture
        from hairloom.addon.render.groom_pass import GroomPass
        from hairloom.addon.render.mesh_pass import MeshPass
        from hairloom.addon.render.soft_picture import SoftPicture

        self.grooms, self.camera = grooms, camera
        self.hair = [GroomPass() for _ in grooms]
        self.shadows = [BodyShadow() for _ in grooms]
        self.kept, self.soft, self.meshes = CachedPicture(), SoftPicture(), MeshPass()

    def redraw(self, draw: Any, background: float, depth: float = 1.0) -> np.ndarray:
        """The view's colours over this grey, with the floor's depths or with `depth` before it,
        (SIZE, SIZE, 4).
        """
        import gpu

        from hairloom.addon.render.textures import drawing_into, texture_to_array

        color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
        self.depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
        target = gpu.types.GPUFrameBuffer(depth_slot=self.depth, color_slots=(color,))
        floor = replace(self.grooms[0], meshes=(MeshSnapshot.of(FLOOR),))
        with drawing_into(target):
            target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=depth)
            self.meshes.draw(floor, self.camera, SIZE, SIZE)
            target.clear(color=(*(background,) * 3, 1.0))
            draw()
        return texture_to_array(color)

    def hard(self, background: float = 0.0) -> np.ndarray:
        def draw() -> None:
            self._draw_shadows(self.grooms, HARD)
            self.kept.begin()
            self.draw_hair(self.grooms, self.kept)

        return self.redraw(draw, background)

    def softened(self, samples: int = SAMPLES, background: float = 0.0) -> np.ndarray:
        center = np.mean([each.center for each in self.grooms], axis=0)
        for sample in range(samples):
            lights = lights_at(self.grooms[0].lights, sample, center)
            lit = [replace(each, lights=lights) for each in self.grooms]
            self.redraw(lambda lit=lit: self.add(lit), background)
        return self.shown(background)

    def shown(self, background: float = 0.0) -> np.ndarray:
        def draw() -> None:
            self.kept.begin()
            self.soft.show_in(self.kept, None)
            self.kept.show()

        return self.redraw(draw, background)

    def add(self, lit: Sequence[Snapshot]) -> None:
        self.soft.add(
            lambda texture: self._draw_shadows(lit, SAMPLE, sample=texture),
            lambda picture: self.draw_hair(lit, picture, SAMPLE, is_sample=True),
        )

    def _draw_shadows(self, grooms: Sequence[Snapshot], view: str, **options: Any) -> None:
        for hair, shadow, each in zip(self.hair, self.shadows, grooms, strict=True):
            maps = hair.maps(each, view=view)
            shadow.draw(each, maps, self.camera, SIZE, SIZE, **options)

    def draw_hair(
        self, grooms: Sequence[Snapshot], picture: Any, view: str = HARD, **options: Any
    ) -> None:
        from hairloom.addon.render.strand_pass import ViewState

        pairs = list(zip(self.hair, grooms, strict=True))
        maps = {key: hair.maps(each, view=view) for key, (hair, each) in enumerate(pairs)}
        for key, (hair, each) in enumerate(pairs):
            hair.strands.draw(
                *(each, self.camera, SIZE, SIZE),
                output="viewport",
                other_maps=hair.other_maps(key, each, maps),
                view=ViewState(view, picture=picture, **options),
            )


def still(grooms: Sequence[Snapshot], camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """From a render: the light of hair over a black floor, and the fraction of light that it leaves
    on the floor, (SIZE, SIZE, 3) each.
    """
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.scene_pass import ScenePass
    from hairloom.addon.render.textures import texture_to_array

    up = np.tile(np.float32([0.0, 0.0, 1.0]), (4, 1))
    floor = MeshSnapshot(FLOOR, up, (0.0, 0.0, 0.0), specular=0.0)
    scene = SceneSnapshot(
        meshes=(floor,),
        casters=(floor,),
        grooms=tuple(DrawnGroom(key, each) for key, each in enumerate(grooms)),
        lights=grooms[0].lights,
        ambient=grooms[0].ambient,
    )
    drawing, target, size = ScenePass(), Target(), (SIZE, SIZE)
    hair, left, all_light = (np.zeros((SIZE, SIZE, 3)) for _ in range(3))
    for sample in range(SAMPLES):
        moment = scene.at_sample(sample)
        drawing.draw(moment, camera, target, size, (0.0, 0.0, 0.0, 1.0))
        hair += texture_to_array(target.color)[..., :3] / SAMPLES
        drawing.draw_hair_shadow(moment, camera, target, size)
        light = floor_light(moment.lights, camera)
        left += light * texture_to_array(target.color)[..., :3]
        all_light += light
    return hair, shown(left / SAMPLES * SKIN) / shown(all_light / SAMPLES * SKIN)


def floor_light(lights: Sequence[Light], camera: Camera) -> np.ndarray:
    """The light that a matt white floor reflects, (SIZE, SIZE, 3)."""
    across = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    x, y = np.meshgrid(across, across)
    ends = []
    for depth in (-1.0, 1.0):
        clip = np.stack([x, y, np.full_like(x, depth), np.ones_like(x)], axis=-1)
        world = clip @ np.linalg.inv(camera.projection @ camera.view).T
        ends.append(world[..., :3] / world[..., 3:])
    near, far = ends
    places = near + (far - near) * (near[..., 2:] / (near - far)[..., 2:])
    total = np.full(places.shape, 0.1)
    for light in lights:
        towards, irradiance = light_at(light, places)
        total += np.maximum(towards[..., 2:], 0.0) * irradiance / np.pi
    return total


def encoded(light: np.ndarray) -> np.ndarray:
    """Values for a viewport without its own view transform."""
    light = np.clip(light, 0.0, 1.0)
    code = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
    return code**2.2


def shown(light: np.ndarray) -> np.ndarray:
    return encoded(light) @ [0.2126, 0.7152, 0.0722]


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.mean(difference**2)))


def hair_alpha(grooms: Sequence[Snapshot], camera: Camera) -> np.ndarray:
    """The hair's coverage of each pixel, (SIZE, SIZE)."""
    bare = [replace(each, casters=(), lights=()) for each in grooms]
    view = View(bare, camera)
    black, white = (view.redraw(lambda: view.draw_hair(bare, None), grey) for grey in (0.0, 1.0))
    return 1.0 - (white - black)[..., 1]


#: lights, camera, grooms, and the limit for shadows on the floor: where the shadows of two grooms
#: overlap, a view lets each remove its fraction of all light
CASES = {
    "sun": ((SUN,), PERSPECTIVE, 1, 0.005),
    "panel": ((area(),), PERSPECTIVE, 1, 0.005),
    "two grooms": ((SUN, area()), ORTHOGRAPHIC, 2, 0.03),
}


@pytest.mark.parametrize("case", few_in_commits(reversed(CASES), 2))
def test_the_mean_is_that_of_a_still(case: str) -> None:
    """For hair and for its shadow on the view's content; hard shadows are far off."""
    lights, camera, count, limit = CASES[case]
    grooms = [groom(0.0, 0.12, *lights), groom(0.1, 0.2, *lights)][:count]
    light, left = still(grooms, camera)
    alpha = hair_alpha(grooms, camera)
    is_hair, is_floor = alpha > 0.05, alpha == 0.0
    assert is_hair.mean() > 0.1 and is_floor.mean() > 0.4
    seen = alpha[..., None] * encoded(light / np.maximum(alpha, 1e-3)[..., None])
    view = View(grooms, camera)
    soft, hard = (
        (rms((black[..., :3] - seen)[is_hair]), rms(((white - black)[..., 1] - left)[is_floor]))
        for black, white in (
            (view.softened(), view.shown(1.0)),
            (view.hard(), view.hard(1.0)),
        )
    )
    assert soft[0] < 1e-3 and hard[0] > 5.0 * soft[0], (soft, hard)
    assert soft[1] < limit and hard[1] > 0.05, (soft, hard)


@pytest.mark.parametrize("background", [0.0, 0.5])
def test_one_sample_equals_the_hard_shadow(background: float) -> None:
    """The first sample is at the centre of all lights."""
    view = View([groom(0.0, 0.12, SUN)], PERSPECTIVE)
    off = np.abs(view.softened(1, background) - view.hard(background))
    assert off.max() < 1.0 / 510.0


def test_grooms_that_know_other_meshes_shade_the_floor_as_they_do_hard() -> None:
    """In the map of one groom, a sheet outside the picture blocks the sun."""
    sheet = replace(FLOOR, positions=FLOOR.positions * [0.5, 1.0, 1.0] + [-0.5, 0.0, 0.6])
    grooms = [groom(0.0, 0.12, SUN), groom(0.1, 0.2, SUN)]
    hair_alone = hair_alpha(grooms, PERSPECTIVE)
    grooms[0] = replace(grooms[0], casters=(FLOOR, sheet))
    for ordered in (grooms, grooms[::-1]):
        view = View(ordered, PERSPECTIVE)
        off = np.abs(view.softened(1, 1.0) - view.hard(1.0))[hair_alone == 0.0]
        assert off.max() < 1.0 / 510.0


def test_a_sample_leaves_a_view_as_it_was_but_for_the_depth_of_hair() -> None:
    from hairloom.addon.render.textures import texture_to_array

    grooms = [groom(0.0, 0.12, SUN), groom(0.1, 0.2, SUN)]
    view = View(grooms, PERSPECTIVE)
    empty = view.redraw(lambda: None, 0.5)
    hard = view.redraw(lambda: view.draw_hair(grooms, None), 0.5)
    depth = texture_to_array(view.depth)
    assert (view.redraw(lambda: view.add(grooms), 0.5) == empty).all()
    assert (texture_to_array(view.depth) == depth).all() and (hard != empty).any()


def test_samples_say_how_much_of_the_hair_is_hidden() -> None:
    """The number of fragments is the same each time, and 0 where something is before all hair."""
    grooms = [groom(0.0, 0.12, SUN)]
    view, statistics = View(grooms, PERSPECTIVE), []
    for depth in (1.0, 1.0, 0.0):
        view.redraw(lambda: view.add(grooms), 0.0, depth)
        statistics.append(view.hair[0].strands.statistics.layers.fragments)
    assert statistics[0] == statistics[1] > 1000 and statistics[2] == 0


def test_a_release_frees_the_gpu_memory() -> None:
    from hairloom.addon.render import gpu_objects

    grooms = [groom(0.0, 0.12, SUN)]
    view = View(grooms, PERSPECTIVE)
    view.hard()

    def held() -> int:
        gpu_objects.free_unused()
        return gpu_objects.bytes_in_use()

    before = held()
    view.softened(2)
    view.soft.release()
    view.hair[0].strands.forget_view(SAMPLE)
    assert held() == before and view.soft.count == 0
    missing: list[int] = []
    view.redraw(lambda: missing.append(view.soft.missing_bytes()), 0.0)
    before = held()
    view.redraw(lambda: view.soft.add(lambda _: None, lambda _: None), 0.0)
    assert missing[0] == pytest.approx(held() - before, abs=100)  # beside a triangle
    view.redraw(lambda: missing.append(view.soft.missing_bytes()), 0.0)
    assert missing[1] == 0
