"""Opacity maps drawn on the GPU against strands that are counted one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gpu_rounding import tolerance
from shadow_errors import slice_spans
from tiers import few_in_commits

from hairloom.addon.render.strand_layout import StrandLayout
from hairloom.addon.shading.lights import Light, brightest_lights
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.volume.light_frame import (
    Ball,
    LightFrame,
    ball_around,
    is_too_near,
    light_frame,
)
from hairloom.addon.shading.volume.opacity import (
    LayerSpans,
    coverage,
    layer_ends,
    look_up,
    self_tau,
)
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

PLAIN = StrandSettings(tip_width=1.0)
LIGHTS = {
    "sun": Light.sun((0.3, -1.0, -0.5), (1, 1, 1), 3.0),
    "point": Light.point((0.3, 0.3, 0.4), (1, 1, 1), 10.0),
    "within the ball": Light.point((0.06, 0.03, 0.11), (1, 1, 1), 10.0),
}


def dome(count: int = 3000, cv_count: int = 12, radius: float = 2e-4) -> tuple[Any, Any]:
    """Hair that leaves the upper half of a ball of 10 cm, and falls."""
    random = np.random.default_rng(3)
    away = random.normal(size=(count, 3))
    away[:, 2] = np.abs(away[:, 2])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, cv_count)[:, None]
    strands = away[:, None] * (0.1 + 0.06 * along) - np.array([0, 0, 0.08]) * along**2
    return strands.astype(np.float32), np.full((count, cv_count), radius, np.float32)


def points_of(strands: np.ndarray, radius: np.ndarray) -> Any:
    from hairloom.addon.render.strand_layout import strand_rows
    from hairloom.addon.render.textures import texture_from

    return texture_from(
        strand_rows(np.concatenate([strands, radius[..., None]], axis=-1)), "RGBA32F"
    )


def layout_of(strands: np.ndarray) -> StrandLayout:
    return StrandLayout.uniform(*strands.shape[:2])


def drawn(
    strands: np.ndarray,
    radius: np.ndarray,
    light: Light,
    settings: VolumeSettings,
    look: StrandSettings = PLAIN,
    ball: Ball | None = None,
) -> tuple[Any, Ball]:
    """The maps of one light, and the ball that they cover."""
    from hairloom.addon.render.opacity_pass import OpacityPass

    points, ball = points_of(strands, radius), ball or ball_around(strands)
    return OpacityPass().maps(points, 1, layout_of(strands), ball, (light,), settings, look), ball


def balls(strands: np.ndarray, count: int = 4) -> list[Ball]:
    """Balls around hair that differ a little, so that the texels of their maps lie elsewhere.

    Errors from the position of texels cancel on average.
    """
    tight, random = ball_around(strands), np.random.default_rng(4)
    return [
        Ball(
            tight.center + tight.radius * random.uniform(-0.01, 0.01, 3),
            tight.radius * (1.02 + 0.05 * step / count),
        )
        for step in range(count)
    ]


def layers_of(maps: Any) -> np.ndarray:
    """The layers of the first map, drawn in one pass, (height, width, n)."""
    from hairloom.addon.render.textures import texture_to_array

    return np.concatenate([texture_to_array(slot) for slot in maps.slots], axis=-1)


@pytest.mark.alike
@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_sums_are_those_of_the_strands(gpu_context: Any, light: Light, shadows: str) -> None:
    """All coverage is in the map, at its place within a texel."""
    strands, radius = dome(1000)
    settings = VolumeSettings(
        shadows=shadows, slices=8, layers=8, resolution=128, strand_fraction=1.0
    )
    sums = []
    for ball in balls(strands):
        maps, _ = drawn(strands, radius, light, settings, ball=ball)
        frame = light_frame(light, ball)
        assert frame is not None
        exact = coverage(strands, radius, frame, 128)
        found = layers_of(maps)[..., 7]
        expected = np.bincount(exact.texel, exact.covered, 128 * 128)
        sums.append((found.sum(), expected.sum()))
        blocks = [each.reshape(8, 16, 8, 16).sum(axis=(1, 3)) for each in (found, expected)]
        assert np.abs(blocks[0] - blocks[1]).max() < 0.05 * blocks[1].max()
    found, expected = np.mean(sums, axis=0)
    # in wide maps, the width of bent strands differs between CVs
    is_wide = is_too_near(light, ball_around(strands))
    assert found == pytest.approx(expected, rel=2e-2 if is_wide else 4e-3)


@pytest.mark.alike
@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_look_up_agrees_with_its_twin(
    gpu_context: Any, compute: Callable[..., np.ndarray], light: Light, shadows: str
) -> None:
    strands, radius = dome()
    settings = VolumeSettings(shadows=shadows, slices=7, layers=6, resolution=64, bias=0.02)
    maps, ball = drawn(strands, radius, light, settings)
    frame = light_frame(light, ball)
    assert frame is not None
    points = strands.reshape(-1, 3)[::7]
    points = np.concatenate([points, 0.3 * np.random.default_rng(1).normal(size=(500, 3))])
    found = path_at(compute, maps, points)

    ends = layer_ends(settings)
    layers = layers_of(maps)
    spans = spans_of(maps)
    place, depth = frame.places(points.astype(np.float64))
    meshes = np.ones((64, 64))
    bias, layers = settings.bias, layers[..., : len(ends)]
    expected = look_up(layers, spans, meshes, ends, place, depth, bias)
    assert (expected[0] > 0.5).sum() > 300 and (expected[1] > 0.5).sum() > 300
    # a driver interpolates with weights of eight bits
    for number, values in enumerate(expected):
        assert np.abs(found[:, number] - values).max() < (1e-3 if shadows == "deep" else 2e-2)


@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_strands_that_stand_for_many_are_blurred_and_meshes_are_not(
    gpu_context: Any, compute: Callable[..., np.ndarray], shadows: str
) -> None:
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome()
    ball, light = ball_around(strands), LIGHTS["sun"]
    settings = VolumeSettings(shadows=shadows, slices=8, layers=8, resolution=96, bias=0.02)
    frame = light_frame(light, ball)
    assert frame is not None
    mesh = Surface(ball.center + 0.1 * np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    maps = OpacityPass().maps(
        points_of(strands, radius),
        1,
        layout_of(strands),
        ball,
        (light,),
        settings,
        PLAIN,
        (mesh,),
        4.0 * ball.radius / 40.0,
    )
    assert maps.slots[0].width == 40 and maps.meshes.width == 96
    points = ball.center + ball.radius * np.random.default_rng(1).uniform(-0.6, 0.6, (900, 3))
    found = path_at(compute, maps, points)
    spans = spans_of(maps)
    place, depth = frame.places(points)
    meshes = np.asarray(maps.meshes.read()).reshape(-1, 96, 96)[0].astype(np.float64)
    ends, layers = layer_ends(settings), layers_of(maps)
    expected = look_up(layers, spans, meshes, ends, place, depth, settings.bias)
    assert 50 < (expected[2] < 0.5).sum() < 800 and (expected[0] > 0.1).sum() > 200
    assert np.abs(found[:, 0] - expected[0]).max() < (1e-3 if shadows == "deep" else 2e-2)
    # a place right at the depth of a mesh may lie on either side of it
    assert np.quantile(np.abs(found[:, 2] - expected[2]), 0.99) < 1e-3
    if shadows == "deep":
        assert np.abs(found[:, 1] - expected[1]).max() < 1e-3


@pytest.mark.parametrize("light", ["sun", "point"])
@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_hair_that_a_mesh_hides_from_the_light_is_left_out(
    gpu_context: Any, compute: Callable[..., np.ndarray], light: str, shadows: str
) -> None:
    """A wall whose edge is amid the hair: at lit places, errors against counted strands are no
    larger than those of maps that contain the hair behind the wall.
    """
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome()
    ball = ball_around(strands)
    settings = VolumeSettings(
        shadows=shadows, slices=16, layers=8, resolution=64, strand_fraction=1.0, bias=0.01
    )
    frame = light_frame(LIGHTS[light], ball)
    assert frame is not None
    along = frame.to_depth[:3] / np.linalg.norm(frame.to_depth[:3])
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    upward = np.cross(across, along)
    corners = [0.05 * across + side * upward for side in (-1.0, 1.0)]
    corners += [2.0 * across + side * upward for side in (1.0, -1.0)]
    wall = Surface(
        (ball.center + np.array(corners)).astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]])
    )
    points = np.random.default_rng(3).permutation(strands.reshape(-1, 3))[:6000]
    place, depth = frame.places(points.astype(np.float64))
    column, row = np.floor(place * 64).astype(int).T
    exact = coverage(strands, radius, frame, 64)
    counted = exact.optical_depth(row * 64 + column, depth - settings.bias)
    sums, error, thick, lit = [], [], [], np.ones(len(points))
    for meshes in ((), (wall,)):
        maps = OpacityPass().maps(
            points_of(strands, radius),
            1,
            layout_of(strands),
            ball,
            (LIGHTS[light],),
            settings,
            PLAIN,
            meshes,
        )
        found = path_at(compute, maps, points)
        lit = found[:, 2]
        thick.append(spans_of(maps).thickness[..., 0])
        sums.append(layers_of(maps)[..., len(layer_ends(settings)) - 1].sum())
        error.append(np.abs(np.exp(-found[:, 0]) - np.exp(-counted)))
    assert 500 < (lit < 1.0).sum() < 5000
    assert sums[1] < 0.95 * sums[0]
    # before the wall, layers end at the last hair there
    assert shadows == "slices" or (thick[1] < 0.7 * thick[0]).sum() > 5
    assert error[1][lit > 0.0].mean() < 1.002 * error[0][lit > 0.0].mean()


def spans_of(maps: Any) -> LayerSpans:
    """Start and total thickness of the first map's layers."""
    side = maps.slots[0].width
    if maps.starts is None:
        return slice_spans(side)
    kept = np.asarray(maps.starts.read()).reshape(-1, side // 2)[: side // 4] / float(1 << 24)
    first, last = np.split(kept, 2, axis=1)
    from hairloom.addon.render.textures import texture_to_array

    spans = LayerSpans.from_first_and_last(
        np.where(first > 1.0, np.inf, first), np.where(last > 1.0, -np.inf, 1.0 - last), 4
    )
    drawn = texture_to_array(maps.spans)[: side // 4, :, :3]
    assert np.abs(drawn[:, : side // 4] - spans.start).max() < 1e-6
    assert np.abs(drawn[:, side // 4 :] - spans.thickness).max() < 1e-6
    return spans


def path_at(compute: Callable[..., np.ndarray], maps: Any, points: np.ndarray) -> np.ndarray:
    """The shader's results for points, (n, 3)."""
    return compute(
        "light_path.glsl",
        (len(points), 1),
        textures={"points": np.pad(points, ((0, 0), (0, 1)))[None].astype(np.float32)},
        blocks={"opacity": ("Opacity", maps.values)},
        samplers=maps.feature.textures,
        structs=("struct_opacity.glsl",),
        defines=tuple(maps.feature.defines.items()),
    )[0, :, :3]


@pytest.mark.alike
@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_the_map_holds_as_much_of_a_strand_itself_as_is_subtracted(
    gpu_context: Any, compute: Callable[..., np.ndarray], light: Light
) -> None:
    """With a single strand, a chord of the ball, a light path meets only the strand itself; the
    expected own depth is subtracted."""
    random = np.random.default_rng(8)
    settings = VolumeSettings(shadows="deep", resolution=256, strand_fraction=1.0, bias=0.0)
    for radius in (1e-4, 5e-4, 1.5e-3):
        found, expected, left = [], [], []
        for _ in range(12):
            ends = random.normal(size=(2, 3))
            ends *= 0.1 / np.linalg.norm(ends, axis=1, keepdims=True)
            strand = (ends[0] + np.linspace(0, 1, 33)[:, None] * (ends[1] - ends[0]))[None]
            strand, widths = strand.astype(np.float32), np.full((1, 33), radius, np.float32)
            direction = ends[1] - ends[0]
            along = np.broadcast_to(direction / np.linalg.norm(direction), (17, 3))
            for ball in balls(strand):
                maps, _ = drawn(strand, widths, light, settings, ball=ball)
                frame = light_frame(light, ball)
                assert frame is not None
                points = strand[0, 8:-8] + random.uniform(-0.5, 0.5, (17, 1)) * direction / 32
                half_width = radius * frame.strand_breadth(points, along) * 256
                path = path_at(compute, maps, points)
                found.append(path[:, 0] + path[:, 1])
                expected.append(self_tau(half_width))
                twin = of_strands(compute, "self_tau.glsl", maps, points, along, radius)
                assert np.abs(twin[:, 0] - expected[-1]).max() < 1e-4
                left.append(of_strands(compute, "strand_path.glsl", maps, points, along, radius))
        assert np.mean(found) == pytest.approx(np.mean(expected), rel=0.06)
        # then it shades itself neither from the front nor from behind
        assert np.mean(np.array(left)[..., 0]) < 0.2 * np.mean(expected)
        assert np.mean(np.array(left)[..., 1]) < 0.2 * np.mean(expected)


def of_strands(
    compute: Callable[..., np.ndarray],
    shader: str,
    maps: Any,
    points: np.ndarray,
    along: np.ndarray,
    radius: float,
) -> np.ndarray:
    """A shader's results for strands with these directions, (n, 4)."""
    places = np.concatenate([points, np.full((len(points), 1), radius)], axis=1)
    return compute(
        shader,
        (len(points), 1),
        textures={
            "points": places[None].astype(np.float32),
            "tangents": np.pad(along, ((0, 0), (0, 1)))[None].astype(np.float32),
        },
        blocks={"opacity": ("Opacity", maps.values)},
        samplers=maps.feature.textures,
        structs=("struct_opacity.glsl",),
        defines=tuple(maps.feature.defines.items()),
    )[0]


@pytest.mark.parametrize("transparency", ["none", "hashed", "layers"])
@pytest.mark.parametrize("opacity", [0.0, 0.5, 1.0])
def test_less_opaque_strands_cast_less_shadow(
    gpu_context: Any, transparency: str, opacity: float
) -> None:
    """Half of tau at an opacity of 0.5; without transparency all of it."""
    strands, radius = dome(300)
    settings = VolumeSettings(shadows="deep", layers=8, resolution=64, strand_fraction=1.0)
    look = StrandSettings(tip_width=1.0, transparency=transparency, opacity=opacity)
    maps, ball = drawn(strands, radius, LIGHTS["sun"], settings, look)
    frame = light_frame(LIGHTS["sun"], ball)
    assert frame is not None
    fraction = 1.0 if transparency == "none" else opacity
    expected = coverage(strands, radius, frame, 64, fraction).covered.sum()
    assert layers_of(maps)[..., 7].sum() == pytest.approx(expected, rel=2e-2, abs=1e-6)
    assert expected == pytest.approx(fraction * coverage(strands, radius, frame, 64).covered.sum())


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_depths_of_large_meshes_are_those_of_rays(gpu_context: Any, light: Light) -> None:
    """Two slanted triangles, one much larger than the hair, one close to a light amid the hair."""
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(50)
    ball, settings = ball_around(strands), VolumeSettings(shadows="deep", resolution=64)
    frame = light_frame(light, ball)
    assert frame is not None
    middle = np.argmin(np.abs(frame.to_depth[:3]))
    for scale, slant in ((2.0, 0.3), (0.2, 1.2)):
        corners = scale * np.array([[-1.0, -1.0, 0.0], [1.2, -0.8, 0.0], [0.0, 1.3, 0.0]])
        corners[:, 2] = slant * corners[:, 0] - 0.4 * slant * corners[:, 1]
        corners = ball.center + np.roll(corners, middle, axis=1)
        mesh = Surface(corners.astype(np.float32), np.array([[0, 1, 2]], np.int32))
        maps = OpacityPass().maps(
            points_of(strands, radius),
            1,
            layout_of(strands),
            ball,
            (light,),
            settings,
            PLAIN,
            (mesh,),
        )
        found = np.asarray(maps.meshes.read()).reshape(64, 64)
        expected = depths_of_rays(frame, mesh.positions.astype(np.float64))
        is_hit = expected < 1.0
        assert is_hit.sum() > 300
        # a ray along the triangle's edge may miss or meet it
        differs = np.abs(found - expected) > 1e-4
        # only at edges of triangles
        assert differs.mean() < tolerance(0.03, 0.04)
        assert not differs[2:-2, 2:-2][inner(is_hit)[2:-2, 2:-2]].any()


def depths_of_rays(frame: LightFrame, corners: np.ndarray) -> np.ndarray:
    """Depths at which rays through the centres of texels meet a triangle, (64, 64); 1 if they
    miss."""
    across = (np.arange(64) + 0.5) / 32.0 - 1.0
    y, x = np.meshgrid(across, across, indexing="ij")
    rows = frame.to_map[[0, 1]][:, None, None] - np.stack([x, y])[..., None] * frame.to_map[3]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    plane = np.broadcast_to(normal, (64, 64, 3))
    left = np.stack([rows[0, ..., :3], rows[1, ..., :3], plane], axis=-2)
    right = np.stack([-rows[0, ..., 3], -rows[1, ..., 3], np.full((64, 64), normal @ corners[0])])
    points = np.linalg.solve(left, np.moveaxis(right, 0, -1)[..., None])[..., 0]
    inside = np.ones((64, 64), bool)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= np.cross(end - start, points - start) @ normal >= 0.0
    depth = points @ frame.to_depth[:3] + frame.to_depth[3]
    return np.where(inside & frame.is_ahead(points), np.clip(depth, 0.0, 1.0), 1.0)


def inner(is_hit: np.ndarray) -> np.ndarray:
    """The texels whose neighbours are also in the mask."""
    shifted = [np.roll(is_hit, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    found: np.ndarray = np.logical_and.reduce(shifted)
    return found


def test_a_map_is_drawn_again_only_when_something_changed(gpu_context: Any) -> None:
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(50)
    points, ball, opacity = points_of(strands, radius), ball_around(strands), OpacityPass()

    layout = layout_of(strands)

    def maps(serial: int, light: Light, **settings: Any) -> Any:
        chosen = VolumeSettings(resolution=32, **settings)
        return opacity.maps(points, serial, layout, ball, (light,), chosen, PLAIN)

    first = maps(1, LIGHTS["sun"])
    assert maps(1, LIGHTS["sun"]) is first
    assert maps(2, LIGHTS["sun"]) is not first
    assert maps(2, LIGHTS["sun"], bias=0.1).values.tobytes() != first.values.tobytes()
    assert maps(2, LIGHTS["point"]) is not first


def test_more_layers_than_one_pass_can_draw(
    gpu_context: Any, compute: Callable[..., np.ndarray]
) -> None:
    """64 slices in three passes have smaller errors than 8."""
    strands, radius = dome()
    error = []
    for count in (8, 64):
        settings = VolumeSettings(
            shadows="slices", slices=count, resolution=64, strand_fraction=1.0, bias=0.0
        )
        maps, ball = drawn(strands, radius, LIGHTS["sun"], settings)
        frame = light_frame(LIGHTS["sun"], ball)
        assert frame is not None
        exact = coverage(strands, radius, frame, 64)
        points = np.random.default_rng(2).permutation(strands.reshape(-1, 3))[:4000]
        place, depth = frame.places(points.astype(np.float64))
        column, row = np.floor(place * 64).astype(int).T
        expected = np.exp(-exact.optical_depth(row * 64 + column, depth))
        found = np.exp(-path_at(compute, maps, points)[:, 0])
        error.append(np.abs(found - expected).mean())
    assert error[1] < 0.7 * error[0]


@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_a_light_in_the_hair_throws_no_shadow(
    gpu_context: Any, compute: Callable[..., np.ndarray], shadows: str
) -> None:
    strands, radius = dome(200)
    settings = VolumeSettings(shadows=shadows, resolution=32)
    light = Light.point((0.0, 0.0, 0.05), (1, 1, 1), 10.0)
    maps, _ = drawn(strands, radius, light, settings)
    points = np.asarray(strands.reshape(-1, 3)[::10])
    assert not path_at(compute, maps, points)[:, 0].any()


def test_hair_that_moves_keeps_its_textures(gpu_context: Any) -> None:
    """On Vulkan, textures that are created in every frame pile up until something is read back."""
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(50)
    ball, opacity = ball_around(strands), OpacityPass()

    def textures(serial: int, resolution: int) -> set[int]:
        settings = VolumeSettings(shadows="deep", layers=8, resolution=resolution)
        moved = points_of(strands + np.float32(1e-4 * serial), radius)
        light = (LIGHTS["sun"],)
        maps = opacity.maps(moved, serial, layout_of(strands), ball, light, settings, PLAIN)
        kept.append(maps)
        return {id(texture) for _, texture in maps.feature.textures.values()}

    kept: list[Any] = []
    first = textures(0, 32)
    assert all(textures(serial, 32) == first for serial in range(1, 20))
    assert len(first) == 4 and not textures(20, 64) & first


def test_textures_that_are_kept_hold_nothing_of_the_frame_before(gpu_context: Any) -> None:
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(300)
    box = Surface(np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    opacity, settings = OpacityPass(), VolumeSettings(shadows="deep", resolution=64)
    ball = ball_around(np.concatenate([strands, 0.5 * strands]))

    def held(drawn_by: OpacityPass, serial: int, scale: float, meshes: tuple[Any, ...]) -> Any:
        points = points_of(np.float32(scale) * strands, radius)
        layout, light = layout_of(strands), (LIGHTS["sun"],)
        maps = drawn_by.maps(points, serial, layout, ball, light, settings, PLAIN, meshes)
        meshes_depth = np.asarray(maps.meshes.read())
        return layers_of(maps), np.asarray(maps.starts.read()), meshes_depth

    held(opacity, 1, 1.0, (box,))
    for serial, (scale, meshes) in enumerate([(0.5, (box,)), (0.5, ()), (1.0, (box,))], start=2):
        again = held(opacity, serial, scale, meshes)
        anew = held(OpacityPass(), 1, scale, meshes)
        assert (anew[1] == 0xFFFFFFFF).any() and (anew[1] < 1 << 24).any()
        for one, other in zip(again, anew, strict=True):
            assert np.array_equal(one, other)


@pytest.mark.parametrize("shadows", few_in_commits(["deep", "slices"]))
def test_maps_too_large_for_memory_are_drawn_smaller_and_still_right(
    gpu_context: Any, compute: Callable[..., np.ndarray], shadows: str
) -> None:
    """Eight lights with the most layers, with a memory limit that allows few texels."""
    from hairloom.addon.render import gpu_memory
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(300)
    lights = [Light.sun((np.sin(turn), np.cos(turn), -1.0), (1, 1, 1), 3.0) for turn in range(8)]
    settings = VolumeSettings(
        shadows=shadows, slices=64, layers=64, resolution=2048, max_lights=8, strand_fraction=1.0
    )
    points, ball, opacity = points_of(strands, radius), ball_around(strands), OpacityPass()
    maps = opacity.maps(points, 1, layout_of(strands), ball, lights, settings, PLAIN)
    assert (
        maps.size.bytes <= gpu_memory.shadow_map_budget() and f"have {maps.size.side}" in maps.note
    )
    frame = light_frame(lights[0], ball)
    assert frame is not None
    exact = coverage(strands, radius, frame, 64)
    places = ball.center + 0.5 * ball.radius * np.random.default_rng(2).uniform(-1, 1, (16000, 3))
    place, depth = frame.places(places)
    column, row = np.floor(place * 64).astype(int).T
    expected = exact.optical_depth(row * 64 + column, depth - settings.bias).mean()
    assert path_at(compute, maps, places)[:, 0].mean() == pytest.approx(expected, rel=0.05)


def test_of_twenty_lights_the_strongest_throw_shadows(gpu_context: Any) -> None:
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome(50)
    points, ball = points_of(strands, radius), ball_around(strands)
    strength = np.random.default_rng(4).permutation(np.arange(1.0, 21.0))
    given = [Light.sun((0.1 * n, 1.0, -1.0), (1, 1, 1), e) for n, e in enumerate(strength)]
    settings = VolumeSettings(shadows="slices", resolution=32, max_lights=3)
    kept = brightest_lights(given, np.zeros(3))
    maps = OpacityPass().maps(points, 1, layout_of(strands), ball, kept, settings, PLAIN)
    map_of = maps.values[128:160].reshape(8, 4)[:, 0]
    casting = {kept[light].power[0] for light in np.flatnonzero(map_of >= 0.0)}
    assert maps.size.map_count == 3 and casting == {20.0, 19.0, 18.0}


def test_strands_of_the_lowest_ranks_throw_the_shadow_of_all(gpu_context: Any) -> None:
    """With half of the strands, neither the places of the others nor their order matter."""
    from hairloom.addon.render.opacity_pass import OpacityPass

    strands, radius = dome()
    ball, light = ball_around(strands), LIGHTS["sun"]
    settings = VolumeSettings(shadows="deep", layers=8, resolution=64, strand_fraction=0.5)
    rank = np.random.default_rng(3).permutation(len(strands)) / np.float32(len(strands))

    def layers(grid: np.ndarray, of: np.ndarray, radius: np.ndarray = radius) -> np.ndarray:
        points, layout = points_of(grid, radius), layout_of(grid)
        maps = OpacityPass().maps(
            points, 1, layout, ball, (light,), settings, PLAIN, rank=of.astype(np.float32)
        )
        return layers_of(maps).astype(np.float64)

    moved = np.where((rank < 0.5)[:, None, None], strands, ball.center.astype(np.float32))
    truth = layers(strands, rank)
    assert truth.max() > 0.0
    assert np.abs(layers(moved, rank) - truth).max() <= 1e-6 * truth.max()
    assert np.abs(layers(moved, 1.0 - rank) - truth).max() > 0.1 * truth.max()
    mixed = np.random.default_rng(4).permutation(len(strands))
    assert (
        np.abs(layers(strands[mixed], rank[mixed], radius[mixed]) - truth).max()
        <= 1e-5 * truth.max()
    )
