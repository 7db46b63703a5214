"""Strands that cover part of a pixel: against areas, and against all layers sorted in numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import SUBPIXEL, is_same, tolerance
from tiers import few_in_commits

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.shading.volume.transparency import (
    LAYERS,
    layer_fractions,
    strip_coverage,
)
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 96
#: a look in which a strand's colour equals its occlusion
FLAT = ShadingSettings(model="kajiya_kay", base_color=(1.0, 1.0, 1.0), color_variation=0.0)
WHITE = (1.0, 1.0, 1.0)
COLORED = replace(FLAT, tip_color=(0.1, 0.3, 1.0), tip_tint=1.0, tint_start=0.0, tint_end=1.0)


@pytest.fixture(scope="module")
def front(square_camera: Any) -> Any:
    """A camera along +y for x and z from 0 to SIZE, with pixels of a metre."""
    return square_camera(SIZE)


def snapshot_of(strands: np.ndarray, radius: float, **more: Any) -> Any:
    settings = {
        "ambient": WHITE,
        "shading": FLAT,
        "strand_settings": StrandSettings(tip_width=1.0),
        "detail": DetailSettings(lod_size=0.0),
        "volume": VolumeSettings(shadows="none"),
    }
    shape = strands.shape[:2]
    points = strands.astype(np.float32)
    return Snapshot(points, np.full(shape, radius, np.float32), **(settings | more))


def test_coverage_is_that_of_numpy(compute: Callable[..., np.ndarray]) -> None:
    random = np.random.default_rng(3)
    angle, distance = random.uniform(-4.0, 4.0, (2, 64, 64))
    half_width = 10.0 ** random.uniform(-3.0, 1.0, (64, 64))
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    normal[0, :4] = (1, 0), (0, -1), (-0.6, 0.8), np.sqrt((0.5, 0.5))
    packed = np.concatenate([distance[..., None], half_width[..., None], normal], axis=-1)
    packed = packed.astype(np.float32)
    found = compute("coverage.glsl", (64, 64), textures={"strips": packed})[..., 0]
    exact = packed.astype(np.float64)
    expected = strip_coverage(exact[..., 0], exact[..., 1], np.abs(exact[..., 2:]))
    assert 0.1 < (expected > 0.0).mean() < 0.9
    assert np.abs(found - expected).max() < 2e-6


@pytest.mark.parametrize("width", [0.05, 0.7, 6.0])
@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0, 90.0])
def test_what_a_strand_covers_is_its_width(
    frame: Any, front: Any, width: float, degrees: float
) -> None:
    """The coverage summed over each row or column that it crosses, wherever it lies."""
    turn = np.radians(degrees)
    direction = np.array([np.sin(turn), 0.0, np.cos(turn)])
    across = 0 if degrees <= 45.0 else 1
    expected = width / max(abs(direction[0]), abs(direction[2]))
    for shift in (0.0, 0.21, 0.5):
        middle = np.array([SIZE / 2 + shift, 0.0, SIZE / 2 + shift])
        strand = np.stack([middle - 200.0 * direction, middle + 200.0 * direction])[None]
        picture = frame.render_image(snapshot_of(strand, width / 2.0), front, SIZE, SIZE, 1)
        sums = picture[..., 3].sum(axis=1 - across)[30:-30]
        # alpha has steps of 1 / 4095, and errors of several pixels in a row add up
        most = tolerance(1e-3, SUBPIXEL)
        assert sums == pytest.approx(np.full(sums.shape, expected), abs=most)
        assert np.allclose(picture[..., :3], picture[..., 3:], atol=1e-5), "premultiplied"


def test_a_tip_thins_out_and_does_not_break_up(frame: Any, front: Any) -> None:
    strand = np.array([[[40.3, 0.0, -10.0], [44.7, 0.0, SIZE + 10.0]]])
    settings = StrandSettings(tip_width=0.0)
    picture = frame.render_image(
        snapshot_of(strand, 0.5, strand_settings=settings), front, SIZE, SIZE, 1
    )
    rows = np.arange(SIZE) + 0.5
    lean = np.hypot(4.4, SIZE + 20.0) / (SIZE + 20.0)
    expected = (1.0 - (rows + 10.0) / (SIZE + 20.0)) * lean
    assert picture[..., 3].sum(axis=1) == pytest.approx(expected, abs=3e-3)


def crossing(count: int, random: Any) -> tuple[np.ndarray, np.ndarray]:
    """Straight strands through the picture at all depths and angles, and their colours."""
    ends = random.uniform(0.0, SIZE, (count, 2, 3))
    ends[..., 1] = random.uniform(-40.0, 40.0, (count, 2))
    return ends, random.random(count)


def layers_of(
    strands: np.ndarray, width: float, camera: Any, opacity: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth, alpha and place along it of each straight strand in each pixel, (pixels, strands)."""
    matrix = camera.projection @ camera.view
    clip = np.concatenate([strands, np.ones((*strands.shape[:2], 1))], axis=-1) @ matrix.T
    w = clip[..., 3]
    seen = (clip[..., :2] / w[..., None] + 1.0) / 2.0 * SIZE
    row, column = np.mgrid[:SIZE, :SIZE] + 0.5
    pixel = np.stack([column.ravel(), row.ravel()], axis=-1)
    run = seen[:, 1] - seen[:, 0]
    length = np.linalg.norm(run, axis=-1)
    away = pixel[:, None] - seen[None, :, 0]
    fraction = (away * run).sum(-1) / length**2
    distance = (away[..., 0] * -run[:, 1] + away[..., 1] * run[:, 0]) / length
    normal = np.abs(np.stack([-run[:, 1], run[:, 0]], axis=-1) / length[:, None])
    focal = camera.projection[1, 1] * SIZE / 2.0
    half = width / 2.0 * focal / w
    half = half[:, 0] + fraction * (half[:, 1] - half[:, 0])
    alpha = opacity * strip_coverage(distance, half, np.broadcast_to(normal, away.shape))
    alpha[(fraction < 0.0) | (fraction > 1.0)] = 0.0
    depth = clip[:, 0, 2] / w[:, 0] * (1.0 - fraction) + clip[:, 1, 2] / w[:, 1] * fraction
    along = fraction / w[:, 1] / ((1.0 - fraction) / w[:, 0] + fraction / w[:, 1])
    return depth, np.round(alpha * 4095.0) / 4095.0, along


@pytest.mark.parametrize("width", few_in_commits([1.3, 0.4, 5.0]))
@pytest.mark.parametrize("opacity", few_in_commits([0.2, 1.0]))
def test_crossing_strands_are_those_sorted_in_numpy(
    frame: Any, width: float, opacity: float
) -> None:
    """In perspective, with dozens of layers, for strands whose colours change along them."""
    random = np.random.default_rng(7)
    strands, brightness = crossing(160, random)
    camera = Camera(
        look_at((SIZE / 2, -150.0, SIZE / 2), (SIZE / 2, 0.0, SIZE / 2)),
        perspective(0.6, 1.0, 50.0, 300.0),
    )
    settings = StrandSettings(tip_width=1.0, opacity=opacity)
    occlusion = np.repeat(brightness[:, None], 2, axis=1).astype(np.float32)
    shown = snapshot_of(
        strands,
        width / 2.0,
        occlusion=occlusion,
        shading=COLORED,
        strand_settings=settings,
        detail=DetailSettings(mode="fixed", subdivisions=1),
    )
    found = frame.render_image(shown, camera, SIZE, SIZE, 1).reshape(-1, 4)
    depth, alpha, along = layers_of(strands, width, camera, opacity)
    tint = along * along * (3.0 - 2.0 * along)
    tint = np.clip(tint, 0.0, 1.0)[..., None]
    colors = brightness[:, None] * (1.0 + tint * (np.array(COLORED.tip_color) - 1.0))
    count = alpha.shape[1]
    exact = over_layers(depth, alpha, colors, layers=count, unseen_fraction=0.0)
    assert ((alpha > 0.0).sum(axis=1) > 8).any(), "more than are kept"
    assert np.abs(found - exact).mean() < 0.02
    assert opacity < 1.0 or np.abs(found - exact).mean() < 0.004
    assert np.abs(found[:, 3] - exact[:, 3]).mean() < 1e-3
    same = over_layers(depth, alpha, colors)
    assert np.abs(found - same).mean() < 0.002


def over_layers(depth, alpha, colors, **limits):
    """Composited layers of pixels, premultiplied (pixel_count, 4)."""
    light = np.einsum("pn,pnc->pc", layer_fractions(depth, alpha, **limits), colors)
    return np.column_stack([light, 1.0 - np.prod(1.0 - alpha, axis=-1)])


def seen_at_points(strands: np.ndarray, width: float, brightness: np.ndarray) -> float:
    """Mean brightness of the nearest strand at random places, where there is one.

    For straight opaque strands, seen along +y without perspective.
    """
    places = np.random.default_rng(2).uniform(0.0, SIZE, (6000, 2))
    ends = strands[..., [0, 2]]
    run = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(run, axis=-1)
    away = places[:, None] - ends[None, :, 0]
    fraction = (away * run).sum(-1) / length**2
    distance = (away[..., 0] * -run[:, 1] + away[..., 1] * run[:, 0]) / length
    is_there = (np.abs(distance) < width / 2.0) & (fraction >= 0.0) & (fraction <= 1.0)
    depth = strands[:, 0, 1] + fraction * (strands[:, 1, 1] - strands[:, 0, 1])
    nearest = np.where(is_there, depth, np.inf).argmin(axis=1)
    return float(brightness[nearest[is_there.any(axis=1)]].mean())


@pytest.mark.parametrize("opacity", few_in_commits([0.3, 1.0]))
def test_hair_is_as_bright_in_small_pictures(frame: Any, front: Any, opacity: float) -> None:
    """Inner strands are darker, and in small pictures each pixel holds more of them."""
    random = np.random.default_rng(14)
    width, count = 0.35, 2500
    strands, _ = crossing(count, random)
    strands[..., 1] = random.uniform(-40.0, 40.0, (count, 1))
    brightness = 0.9 - (strands[:, 0, 1] + 40.0) / 100.0
    settings = StrandSettings(tip_width=1.0, opacity=opacity)
    shown = snapshot_of(
        strands,
        width / 2.0,
        occlusion=np.repeat(brightness[:, None], 2, axis=1).astype(np.float32),
        strand_settings=settings,
        detail=DetailSettings(lod_size=0.0, mode="fixed", subdivisions=1),
    )
    pictures = {
        size: frame.render_image(shown, front, size, size, 1) for size in (12, 24, 48, 96, 384)
    }
    means = {size: p[..., 0].sum() / p[..., 3].sum() for size, p in pictures.items()}
    expected = seen_at_points(strands, width, brightness) if opacity == 1.0 else means[384]
    assert expected < 0.8, "more is seen than the outermost"
    assert list(means.values()) == pytest.approx([expected] * len(means), rel=0.02)
    large = pictures[384].reshape(24, 16, 24, 16, 4).mean(axis=(1, 3))
    assert np.abs(pictures[24] - large).mean() < 0.03


def test_shaded_layers_represent_all_layers() -> None:
    """At most LAYERS of them are shaded, with weights that sum to all light; layers with much light
    keep their own weight."""
    random = np.random.default_rng(15)
    depths, alphas = random.random((500, 60)), 0.3 * random.random((500, 60)) ** 2
    alphas[:, 7] = 0.6
    exact = layer_fractions(depths, alphas, layers=60, unseen_fraction=0.0)
    fractions = layer_fractions(depths, alphas)
    covered = 1.0 - np.prod(1.0 - alphas, axis=1)
    assert ((fractions > 0.0).sum(axis=1) <= LAYERS).all()
    assert fractions.sum(axis=1) == pytest.approx(covered)
    assert exact.sum(axis=1) == pytest.approx(covered)
    is_large = exact > covered[:, None] / LAYERS
    assert is_large.any() and fractions[is_large] == pytest.approx(exact[is_large])
    of_depth = (fractions * depths).sum(axis=1) - (exact * depths).sum(axis=1)
    assert abs(of_depth.mean()) < 0.01 and np.abs(of_depth).max() < 0.05


@pytest.mark.parametrize("mode", ["fixed", "adaptive"])
def test_no_order_of_strands_changes_the_picture(frame: Any, mode: str) -> None:
    """Many of the strands lie in one plane and have equal depths."""
    random = np.random.default_rng(8)
    strands, brightness = crossing(600, random)
    strands[:200, :, 1] = 0.0
    occlusion = np.repeat(brightness[:, None], 2, axis=1).astype(np.float32)
    camera = Camera(
        look_at((SIZE / 2, -150.0, SIZE / 2), (SIZE / 2, 0.0, SIZE / 2)),
        perspective(0.6, 1.0, 50.0, 300.0),
    )
    shown = snapshot_of(
        strands,
        0.8,
        occlusion=occlusion,
        seed=np.arange(600),
        shading=replace(COLORED, color_variation=1.0),
        strand_settings=StrandSettings(tip_width=1.0, opacity=0.7),
        detail=DetailSettings(mode=mode, lod_size=0.0),
    )
    first = frame.render_image(shown, camera, SIZE, SIZE, 1)
    assert first[..., 3].mean() > 0.5
    for _ in range(4):
        order = random.permutation(600)
        moved = replace(
            shown,
            points=strands[order],
            occlusion=occlusion[order],
            seed=order,
        )
        again = frame.render_image(moved, camera, SIZE, SIZE, 1)
        assert np.abs(again - first).max() < 1.0 / 255.0


def test_a_mesh_hides_layers_behind_it(frame: Any, front: Any) -> None:
    square = np.array([[0, 0, 0], [48, 0, 0], [48, 0, SIZE], [0, 0, SIZE]], np.float32)
    matt = MeshSnapshot.of(Surface(square, np.array([[0, 1, 2], [0, 2, 3]])), color=(0.0, 0.0, 0.0))
    mesh = replace(matt, specular=0.0)
    strand = np.array([[[-5.0, 0.0, 30.3], [SIZE + 5.0, 0.0, 30.3]]])
    behind, before = strand + [0, 20.0, 20.0], strand - [0, 20.0, 0]
    shown = snapshot_of(np.concatenate([behind, before]), 0.2, meshes=(mesh,))
    picture = frame.render_image(shown, front, SIZE, SIZE, 1)
    sums = picture[..., 0].sum(axis=0)
    assert sums[2:46] == pytest.approx(np.full(44, 0.4), abs=2e-3), "only the one before it"
    assert sums[50:94] == pytest.approx(np.full(44, 0.8), abs=2e-3), "both"
    assert picture[:, :48, 3] == pytest.approx(1.0), "a mesh stays opaque under hair"


def test_opaque_hair_hides_later_draws(gpu_context: Any, front: Any) -> None:
    """Depth is written only where hair covers more than half."""
    import gpu

    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.render.textures import drawing_into

    strand = np.array([[[20.0, 0.0, -5.0], [20.0, 0.0, SIZE + 5.0]]])
    thin, wide = (snapshot_of(strand + [x, 0, 0], r) for x, r in ((0, 0.2), (40, 6.0)))
    level = np.array([[[-5.0, 30.0, 50.0], [SIZE + 5.0, 30.0, 50.0]]])
    later = snapshot_of(level, 4.0, ambient=(0.0, 0.0, 1.0))
    color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    drawn = [StrandPass() for _ in range(3)]
    with drawing_into(target):
        target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        for own, shown in zip(drawn, (thin, wide, later), strict=True):
            own.draw(shown, front, SIZE, SIZE)
    picture = np.asarray(color.read()).reshape(SIZE, SIZE, 4)
    assert picture[50, 60].tolist() == [1.0, 1.0, 1.0, 1.0], "hidden by the wide one"
    assert picture[50, 20, 2] == pytest.approx(1.0) and picture[50, 20, 0] < 0.5, "not by the thin"


@pytest.mark.parametrize("transparency", ["layers", "hashed"])
@pytest.mark.parametrize(
    "change", [{"opacity": 0.0}, {"fullness": 0.0}], ids=["no opacity", "no width"]
)
def test_strands_without_width_or_opacity_draw_nothing(
    frame: Any, front: Any, transparency: str, change: dict[str, float]
) -> None:
    strands, _ = crossing(50, np.random.default_rng(9))
    settings = StrandSettings(transparency=transparency, **change)
    shown = snapshot_of(strands, 0.5, strand_settings=settings)
    assert not frame.render_image(shown, front, SIZE, SIZE, 1).any()


@pytest.mark.parametrize("transparency", ["layers", "hashed"])
def test_bad_hair_gives_finite_pictures(frame: Any, transparency: str) -> None:
    """Strands without length, through the eye, and too many in one pixel."""
    random = np.random.default_rng(10)
    strands, _ = crossing(300, random)
    strands[:50, 1] = strands[:50, 0]
    strands[50:250] = strands[50]
    strands[250:] += [0.0, -150.0, 0.0]
    camera = Camera(
        look_at((SIZE / 2, -150.0, SIZE / 2), (SIZE / 2, 0.0, SIZE / 2)),
        perspective(0.6, 1.0, 0.1, 300.0),
    )
    shown = snapshot_of(strands, 0.5, strand_settings=StrandSettings(transparency=transparency))
    shown.radius[10:20] = 1e4
    shown.radius[20:30] = 0.0
    picture = frame.render_image(shown, camera, SIZE, SIZE, 1)
    assert np.isfinite(picture).all()
    assert picture.min() >= 0.0 and picture[..., 3].max() <= 1.0 + 1e-5
    assert picture[..., 3].any()


def test_an_empty_groom_and_other_sizes(frame: Any, front: Any) -> None:
    """Buffers are recreated or kept as pictures of other sizes are drawn in between."""
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass

    passes = MeshPass(), StrandPass()
    strands, _ = crossing(80, np.random.default_rng(11))
    shown = snapshot_of(strands, 0.4)
    first = frame.render_image(shown, front, SIZE, SIZE, 1, passes=passes)
    for size in ((7, 5), (SIZE, 2 * SIZE), (SIZE, SIZE)):
        again = frame.render_image(shown, front, *size, 1, passes=passes)
    assert is_same(again, first)
    empty = snapshot_of(strands[:0], 0.4)
    assert not frame.render_image(empty, front, SIZE, SIZE, 1, passes=passes).any()


def test_lists_grow_until_all_fragments_have_room(
    frame: Any, front: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hairloom.addon.render import strand_layers

    strands, _ = crossing(3000, np.random.default_rng(12))
    shown = snapshot_of(strands, 0.4)
    first = frame.render_image(shown, front, SIZE, SIZE, 1)
    monkeypatch.setattr(strand_layers, "INITIAL_ROWS", 1)
    strand_layers.LAYERS_OF_PIXELS.release()
    assert is_same(frame.render_image(shown, front, SIZE, SIZE, 1), first)


def test_hashed_strands_cover_as_much_on_average(frame: Any, front: Any) -> None:
    strands, _ = crossing(200, np.random.default_rng(13))
    settings = StrandSettings(tip_width=1.0, opacity=0.8)
    shown = snapshot_of(strands, 0.4, strand_settings=settings)
    exact = frame.render_image(shown, front, SIZE, SIZE, 1)
    hashed = replace(shown, strand_settings=replace(settings, transparency="hashed"))
    noisy = frame.render_image(hashed, front, SIZE, SIZE, 1)
    calm = frame.render_image(hashed, front, SIZE, SIZE, 6)
    assert set(np.unique(noisy[..., 3])) == {0.0, 0.5, 1.0}, "two turns a draw"
    assert noisy[..., 3].mean() == pytest.approx(exact[..., 3].mean(), rel=0.03)
    assert np.abs(calm - exact).mean() < 0.3 * np.abs(noisy - exact).mean()
