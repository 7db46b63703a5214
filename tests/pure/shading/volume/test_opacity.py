"""Opacity maps in numpy against strands that are counted one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hair_ball import combed_strands
from shadow_errors import slice_spans
from tiers import few_in_commits

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.volume.light_frame import ball_around, light_frame
from hairloom.addon.shading.volume.map_size import requested_size, size_for_spacing
from hairloom.addon.shading.volume.opacity import (
    MIN_THICKNESS,
    Coverage,
    LayerSpans,
    coverage,
    layer_ends,
    layer_weights,
    layers_including,
    look_up,
    transmittance,
)
from hairloom.addon.shading.volume.settings import VolumeSettings

SIZE = 64
SUN = Light.sun((0.0, 0.0, -1.0), (1, 1, 1), 3.0)


@pytest.mark.parametrize(
    "settings",
    [
        VolumeSettings(shadows="slices"),
        VolumeSettings(shadows="slices", slices=64),
        VolumeSettings(shadows="deep"),
        VolumeSettings(shadows="deep", layers=2, layer_depth=0.9),
        VolumeSettings(shadows="deep", layers=64, layer_depth=0.001),
    ],
)
def test_layers_end_one_behind_the_other_and_the_last_behind_all(settings: VolumeSettings) -> None:
    ends = layer_ends(settings)
    assert (np.diff(ends) > 0.0).all() and ends[0] > 0.0 and ends[-1] == 1.0
    depth = np.linspace(-0.5, 1.0, 301)
    assert layers_including(depth, ends)[:, -1].all()


def test_weights_give_back_what_grows_evenly() -> None:
    """Sums that grow linearly with depth, as in hair of constant density, are reproduced
    exactly."""
    ends = np.array([0.1, 0.3, 0.4, 1.0])
    depth = np.linspace(-0.2, 1.0, 50)
    sums = layer_weights(depth, ends) @ ends
    assert np.allclose(sums, np.maximum(depth, 0.0), atol=1e-12)


def hair(count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    roots = random.uniform(-0.1, 0.1, size=(count, 3))
    direction = random.normal(size=(count, 3)) * 0.02
    strands = roots[:, None] + direction[:, None] * np.linspace(0, 1, 5)[:, None]
    return strands, np.full((count, 5), 1e-4)


def counted(light: Light = SUN) -> tuple[Coverage, np.ndarray, np.ndarray, np.ndarray]:
    """Coverage, and for random places on strands: their texels, positions in the map [texels], and
    depths."""
    strands, radius = hair()
    frame = light_frame(light, ball_around(strands))
    assert frame is not None
    place, depth = frame.places(np.random.default_rng(5).permutation(strands.reshape(-1, 3)))
    place *= SIZE
    column, row = np.floor(place).astype(np.int64).T
    return coverage(strands, radius, frame, SIZE), row * SIZE + column, place, depth


def test_coverage_is_length_times_width() -> None:
    """For strands across the light: over the area of a texel, whatever the resolution."""
    strands, radius = hair()
    strands[..., 2] = 0.0
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    area = (np.linalg.norm(np.diff(strands, axis=1), axis=2) * 2.0 * radius[:, 1:]).sum()
    for size in (16, 64):
        cover = coverage(strands, radius, frame, size)
        texel = 1.0 / (frame.strand_area(np.zeros(3), np.array([1.0, 0.0, 0.0])) * size**2)
        assert cover.covered.sum() * texel == pytest.approx(area, rel=1e-6)


def test_strands_along_the_light_cover_nothing() -> None:
    strands = np.zeros((3, 4, 3))
    strands[..., 2] = np.linspace(-0.1, 0.1, 4)
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    cover = coverage(strands, np.full((3, 4), 1e-4), frame, 32)
    assert cover.covered.sum() < 1e-9


def test_counting_one_by_one_is_the_sum_over_what_is_in_front() -> None:
    cover, texel, _, depth = counted()
    for which in range(0, 60, 3):
        in_front = (cover.texel == texel[which]) & (cover.depth < depth[which])
        expected = cover.covered[in_front].sum()
        one = slice(which, which + 1)
        assert cover.optical_depth(texel[one], depth[one])[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_at_the_ends_of_layers_sums_are_exact(shadows: str) -> None:
    settings = VolumeSettings(shadows=shadows)
    cover = counted()[0]
    ends = layer_ends(settings)
    layer_spans = without_slopes(spans(cover, settings, block=1))
    layers = cover.layers(ends, layer_spans)
    filled = np.flatnonzero(layers[:, -1] > 0.0)
    starts, thickness = in_texels(layer_spans)
    for number, end in enumerate(ends[:-1]):
        depth = starts[filled] + end * thickness[filled]
        # a piece may lie exactly at the end
        before, after = (cover.optical_depth(filled, depth + step) for step in (-1e-9, 1e-9))
        held = layers[filled, number]
        assert (before < held + 1e-6).all() and (held < after + 1e-6).all()


def test_layers_hold_what_adds_to_them() -> None:
    cover = counted()[0]
    ends = np.array([0.2, 0.5, 1.0])
    layer_spans = cover.spans(4)
    expected = np.zeros((SIZE * SIZE, len(ends)))
    row, column = np.divmod(cover.texel, SIZE)
    behind = np.minimum(layer_spans.fraction(row, column, cover.place, cover.depth), 1.0)
    np.add.at(expected, cover.texel, layers_including(behind, ends) * cover.covered[:, None])
    assert np.allclose(cover.layers(ends, layer_spans), expected)


def spans(cover: Coverage, settings: VolumeSettings, block: int) -> LayerSpans:
    if settings.shadows == "deep":
        return cover.spans(block)
    return slice_spans(cover.resolution)


def without_slopes(spans: LayerSpans) -> LayerSpans:
    return LayerSpans(spans.start * [1, 0, 0], spans.thickness * [1, 0, 0], spans.block)


def in_texels(spans: LayerSpans) -> tuple[np.ndarray, np.ndarray]:
    """Start and thickness of layers at the centres of blocks."""
    return spans.start[..., 0].ravel(), np.maximum(spans.thickness[..., 0], MIN_THICKNESS).ravel()


def test_deep_layers_lie_between_the_first_and_the_last_hair() -> None:
    """The first and last hair of a texel, or of all texels of a block."""
    cover = counted()[0]
    for block in (1, 4):
        side = SIZE // block
        starts, thickness = in_texels(cover.spans(block))
        row, column = np.divmod(cover.texel, SIZE)
        of_block = row // block * side + column // block
        for which in np.unique(of_block)[::97]:
            inside = cover.depth[of_block == which]
            assert starts[which] == inside.min()
            assert thickness[which] == pytest.approx(max(np.ptp(inside), MIN_THICKNESS))
        bare = np.setdiff1d(np.arange(side * side), of_block)[0]
        assert starts[bare] == thickness[bare] == 1.0


def test_layers_go_on_from_block_to_block_as_planes_but_not_over_edges() -> None:
    """Exact on a slope; planes do not interpolate between a lock and the hair behind it."""
    row, column = np.mgrid[:8, :8]
    slope = 0.2 + 0.03 * column + 0.01 * row
    planes = LayerSpans.from_first_and_last(slope, slope + 0.1, 4)
    inner = np.argwhere((row % 7 > 0) & (column % 7 > 0)).T * 4
    place = inner[::-1].T + np.array([0.7, 3.1])
    expected = 0.2 + 0.03 * (place[:, 0] / 4 - 0.5) + 0.01 * (place[:, 1] / 4 - 0.5)
    start, thickness = planes.at(*inner, place)
    assert np.allclose(start, expected) and np.allclose(thickness, 0.1)
    lock = np.where(column < 4, 0.1, 0.6)
    ahead = LayerSpans.from_first_and_last(lock, lock + 0.1, 4)
    assert not ahead.start[..., 1:].any() and not ahead.thickness[..., 1:].any()
    bare = np.where(column == 3, np.inf, 0.5)
    assert not LayerSpans.from_first_and_last(bare, -bare + 1.0, 4).start[..., 1:].any()


def test_hair_that_light_grazes_is_evenly_lit() -> None:
    """A slab of strands whose face no hair shades, with the sun 25 degrees above it. With one start
    per block, the face had bright and dark bands.
    """
    random, count = np.random.default_rng(3), 6000
    strands = np.zeros((count, 2, 3))
    strands[..., 0] = -1.0, 1.0
    strands[..., 1] = random.uniform(-1.0, 1.0, count)[:, None]
    strands[..., 2] = random.uniform(-0.2, 0.0, count)[:, None]
    angle = np.radians(25.0)
    sun = Light.sun((0.0, np.cos(angle), -np.sin(angle)), (1, 1, 1), 1.0)
    frame = light_frame(sun, ball_around(strands))
    assert frame is not None
    cover = coverage(strands, np.full((count, 2), 1e-3), frame, 128)
    points = np.zeros((300, 3))
    points[:, 1] = np.linspace(-0.6, 0.6, 300)
    place, depth = frame.places(points)
    ends, planes, light = layer_ends(VolumeSettings(layers=8)), cover.spans(4), []
    for spans in (without_slopes(planes), planes):
        sums, meshes = cover.layers(ends, spans).reshape(128, 128, -1), np.ones((128, 128))
        tau, _, _ = look_up(sums, spans, meshes, ends, place, depth, VolumeSettings().bias)
        light.append(transmittance(tau, 1.0))
    blocky, even = light
    assert even.mean() > 0.87 > 0.75 > blocky.mean() and even.std() < 0.75 * blocky.std()


def tau_in_texels(
    cover: Coverage,
    spans: LayerSpans,
    ends: np.ndarray,
    texel: np.ndarray,
    place: np.ndarray,
    depth: np.ndarray,
) -> np.ndarray:
    """Optical depth at places, each from its own texel alone."""
    row, column = np.divmod(texel, cover.resolution)
    weights = layer_weights(spans.fraction(row, column, place, depth), ends)
    tau: np.ndarray = (cover.layers(ends, spans)[texel] * weights).sum(axis=1)
    return tau


def mean_error(
    of: tuple[Coverage, np.ndarray, np.ndarray, np.ndarray],
    settings: VolumeSettings,
    extinction: float,
) -> float:
    """Mean error of the transmittance at random places."""
    cover, texel, place, depth = of
    exact = transmittance(cover.optical_depth(texel, depth), extinction)
    ends = layer_ends(settings)
    tau = tau_in_texels(cover, spans(cover, settings, block=4), ends, texel, place, depth)
    return float(np.abs(transmittance(tau, extinction) - exact).mean())


def test_error_falls_with_slices_and_deep_layers_beat_as_many_even_ones() -> None:
    of = counted(Light.sun((0.4, -1.0, -0.6), (1, 1, 1), 3.0))
    slices = [VolumeSettings(shadows="slices", slices=count) for count in (4, 8, 16, 64)]
    even = [mean_error(of, settings, 2.0) for settings in slices]
    assert all(finer < coarser for coarser, finer in pairwise(even))
    layered = [VolumeSettings(shadows="deep", layers=count) for count in (4, 8)]
    deep = [mean_error(of, settings, 2.0) for settings in layered]
    assert deep[1] < deep[0] < even[0] and deep[1] < even[1]


def test_four_deep_layers_beat_sixteen_slices_on_a_head_of_hair() -> None:
    strands = combed_strands(3000)
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    size = 4 * SIZE
    cover = coverage(strands, np.full(strands.shape[:2], 3e-3), frame, size)
    points = np.random.default_rng(5).permutation(strands.reshape(-1, 3))[:5000]
    place, depth = frame.places(points)
    column, row = np.floor(place * size).astype(np.int64).T
    of = cover, row * size + column, size * place, depth - VolumeSettings().bias
    deep, even = (
        mean_error(of, VolumeSettings(shadows=shadows, layers=4, slices=16), 1.0)
        for shadows in ("deep", "slices")
    )
    assert deep < even


@pytest.mark.parametrize("radius", few_in_commits([3e-3, 1e-3]))
def test_default_maps_leave_as_much_light_as_strands_counted_one_by_one(radius: float) -> None:
    """On average over the half of the hair that the head does not hide; these maps have no head. A
    bias of 0.01 let through 1.56 times the light in thick hair.
    """
    strands, settings = combed_strands(6000), VolumeSettings()
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    size = settings.resolution
    is_hidden = frame.places(strands.reshape(-1, 3))[1].reshape(strands.shape[:2]) > 0.5
    strands = strands[~is_hidden.any(axis=1)]
    cover = coverage(strands, np.full(strands.shape[:2], radius), frame, size)
    points = np.random.default_rng(5).permutation(strands.reshape(-1, 3))[:8000]
    place, depth = frame.places(points)
    column, row = np.floor(place * size).astype(np.int64).T
    texel, ends = row * size + column, layer_ends(settings)
    tau = tau_in_texels(cover, cover.spans(4), ends, texel, size * place, depth - settings.bias)
    # without the strand itself
    exact = transmittance(cover.optical_depth(texel, depth - 1e-4), settings.extinction).mean()
    assert transmittance(tau, settings.extinction).mean() == pytest.approx(exact, rel=0.16)


def test_blended_look_up_of_equal_texels_is_that_of_one() -> None:
    ends = np.array([0.5, 1.0])
    layers = np.broadcast_to(np.array([1.0, 3.0]), (8, 8, 2))
    places = np.random.default_rng(0).uniform(size=(50, 2))
    depth = np.linspace(0.0, 1.0, 50)
    tau, beyond, lit = look_up(layers, slice_spans(8), np.ones((8, 8)), ends, places, depth, 0.0)
    assert np.allclose(tau, np.where(depth < 0.5, 2.0 * depth, 4.0 * depth - 1.0))
    assert np.allclose(tau + beyond, 3.0) and np.allclose(lit, 1.0)


def test_behind_a_mesh_it_is_dark_and_hair_behind_it_does_not_count() -> None:
    layers, ends = np.full((4, 4, 1), 2.0), np.array([1.0])
    meshes, places = np.full((4, 4), 0.5), np.full((2, 2), 0.4)
    tau, beyond, lit = look_up(
        layers, slice_spans(4), meshes, ends, places, np.array([0.25, 0.75]), 0.0
    )
    assert np.allclose(tau, [0.5, 1.5]) and np.allclose(beyond, [0.5, 0.0])
    assert np.allclose(lit, [1.0, 0.0])


def test_outside_of_a_map_nothing_shades() -> None:
    layers, ends = np.ones((4, 4, 1)), np.array([1.0])
    places = np.array([[-0.1, 0.5], [0.5, 1.1]])
    tau, beyond, lit = look_up(
        layers, slice_spans(4), np.zeros((4, 4)), ends, places, np.ones(2), 0.0
    )
    assert not tau.any() and not beyond.any() and (lit == 1.0).all()


@pytest.mark.parametrize("extinction", [0.0, 1000.0])
def test_transmittance_stays_a_fraction(extinction: float) -> None:
    left = transmittance(np.array([0.0, 1e-6, 1.0, 1e6]), extinction)
    assert np.isfinite(left).all() and (left >= 0.0).all() and (left <= 1.0).all()
    assert left[0] == 1.0


def crossed(strands: np.ndarray, radius: float, lamp: np.ndarray, place: np.ndarray) -> int:
    """The number of segments that a ray from a lamp to a place meets."""
    start, along = strands[:, :-1].reshape(-1, 3), np.diff(strands, axis=1).reshape(-1, 3)
    direction = place - lamp
    off = start - lamp
    a, b, c = (along**2).sum(axis=1), along @ direction, direction @ direction
    d, e = (along * off).sum(axis=1), off @ direction
    rest = a * c - b * b
    on_segment, on_way = (b * e - c * d) / rest, (a * e - b * d) / rest
    gap = np.linalg.norm(off + on_segment[:, None] * along - on_way[:, None] * direction, axis=1)
    meets = (on_segment >= 0.0) & (on_segment <= 1.0) & (on_way > 0.0) & (on_way < 1.0)
    return int((meets & (gap < radius)).sum())


@pytest.mark.slow
def test_a_lamp_within_the_ball_counts_as_many_strands_as_its_rays_meet() -> None:
    """Against rays, also near the border of its wide map, for strands of all directions."""
    random, radius, lamp = np.random.default_rng(7), 5e-4, np.array([0.0, 0.02, 0.07])
    middles = random.uniform(-0.1, 0.1, size=(16000, 3))
    is_hair = (np.linalg.norm(middles, axis=1) < 0.1) & (
        np.linalg.norm(middles - lamp, axis=1) > 0.03
    )
    middles = middles[is_hair]
    direction = random.normal(size=middles.shape)
    direction *= 0.01 / np.linalg.norm(direction, axis=1, keepdims=True)
    strands = middles[:, None] + direction[:, None] * np.array([-1.0, 0.0, 1.0])[:, None]
    ball = ball_around(strands)
    frame = light_frame(Light.point(tuple(lamp), (1, 1, 1), 3.0), ball)
    assert frame is not None
    cover = coverage(strands, np.full(strands.shape[:2], radius), frame, SIZE)
    axis = (ball.center - lamp) / np.linalg.norm(ball.center - lamp)
    away = random.normal(size=(20000, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    for low, high in pairwise((0.26, 0.4, 0.6, 0.8, 1.0)):
        ring = away[(away @ axis > low) & (away @ axis < high)][:600]
        points = lamp + ring * random.uniform(0.04, 0.12, size=(len(ring), 1))
        points = points[np.linalg.norm(points, axis=1) < 0.1]
        place, depth = frame.places(points)
        column, row = np.clip(place * SIZE, 0, SIZE - 1).astype(np.int64).T
        tau = cover.optical_depth(row * SIZE + column, depth)
        counts = [crossed(strands, radius, lamp, point) for point in points]
        assert np.mean(counts) > 1.0
        assert tau.mean() == pytest.approx(np.mean(counts), rel=0.08)


def light_through_slab(count: int, *, is_even: bool) -> float:
    """Mean light behind evenly spaced parallel strands with a total optical depth of 2."""
    random = np.random.default_rng(5)
    strands = np.zeros((count, 2, 3))
    strands[:, :, 0] = -1.0, 1.0
    strands[:, :, 1] = (2.0 * (np.arange(count) + random.random(count)) / count - 1.0)[:, None]
    strands[:, :, 2] = random.uniform(-0.1, 0.1, count)[:, None]
    radius = np.full((count, 2), 2.0 / count)
    ball = ball_around(strands)
    frame = light_frame(SUN, ball)
    assert frame is not None
    # four strands overlap at any place
    spacing, requested = 4.0 * 2.0 / count, requested_size(VolumeSettings(resolution=256), 1)
    size = size_for_spacing(requested, spacing if is_even else 0.0, ball.radius)
    cover = coverage(strands.astype(np.float32), radius, frame, size.side)
    sums = np.bincount(cover.texel, cover.covered, size.side**2).reshape(size.side, size.side, 1)
    behind = random.uniform((-0.8, -0.8, -0.3), (0.8, 0.8, -0.3), (4000, 3))
    places, depth = frame.places(behind)
    spans, meshes = slice_spans(size.side), np.ones((size.mesh_side, size.mesh_side))
    # all strands are in front of these places, so that one layer holds them
    tau, _, lit = look_up(sums, spans, meshes, np.array([0.5]), places, depth, 0.0)
    np.testing.assert_allclose(lit, 1.0)
    return float(transmittance(tau, 1.0).mean())


def test_a_slab_lets_as_much_light_through_by_few_strands_as_by_many() -> None:
    """Against exp(-2). With texels smaller than gaps, too much light comes through (Jensen's
    inequality)."""
    for count in (60, 240, 1200):
        assert light_through_slab(count, is_even=True) == pytest.approx(np.exp(-2.0), rel=0.08)
    assert light_through_slab(60, is_even=False) > 3.0 * np.exp(-2.0)
