"""Detail factors: the error bound by brute force, segments outside, ragged points, the modes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refinement_probes import adaptive_points

from hairloom.addon.arrays import Floats
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.refine.detail import (
    PictureView,
    detail_factors,
    stations,
)
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import frame_camera, look_at, orthographic, perspective

MOST = 64
WIDTH, HEIGHT = 960, 720


def shifted(projection: Floats, x: float, y: float) -> Floats:
    """The same projection with a lens shift."""
    result = projection.copy()
    result[0, 2], result[1, 2] = x, y
    return result


ASPECT = WIDTH / HEIGHT
PROJECTIONS = {
    "usual": perspective(0.6, ASPECT, 0.01, 100.0),
    "hard perspective": perspective(2.6, ASPECT, 0.01, 100.0),
    "telephoto": perspective(0.02, ASPECT, 0.01, 100.0),
    "shifted": shifted(perspective(0.9, ASPECT, 0.01, 100.0), 0.7, -1.2),
    "orthographic": orthographic(2.0, ASPECT, -10.0, 10.0),
}


def wandering(random: np.random.Generator, projection: Floats, count: int) -> Floats:
    """Strands of six CVs in view space, in and around the picture, from far away to behind the
    eye."""
    depth = np.exp(random.uniform(np.log(0.05), np.log(5.0), (count, 1)))
    if projection[3, 3] == 1.0:
        depth = np.ones_like(depth)
    reach = depth / np.diag(projection)[:2]
    start = np.hstack([random.uniform(-1.0, 1.0, (count, 2)) * reach, -depth])
    size = np.exp(random.uniform(np.log(0.01), np.log(1.0), (count, 1))) * reach[:, 1:]
    step = random.normal(size=(count, 6, 3)) * size[:, None]
    return start[:, None] + np.cumsum(step, axis=1)


def cusps(random: np.random.Generator, projection: Floats, count: int) -> Floats:
    """Strands that turn back on themselves, with coincident CVs."""
    strands = wandering(random, projection, count)
    strands[:, 2] = strands[:, 0]
    strands[:, 4:] = strands[:, 3:4]
    strands[1::2, 1] = strands[1::2, 0]
    return strands


def receding(random: np.random.Generator, projection: Floats, count: int) -> Floats:
    """Strands almost along the line of sight, where perspective makes the speed uneven."""
    strands = wandering(random, projection, count)
    along = random.uniform(1.0, 8.0, (count, 1)) * np.linspace(0.0, 1.0, 6) ** 2
    near = strands[:, 0] * 0.1
    return near[:, None] * (1.0 + along[..., None]) + 0.003 * random.normal(size=(count, 6, 3))


def bows(random: np.random.Generator, projection: Floats, count: int) -> Floats:
    """Parabolas that deviate from their chords by about half a pixel, so that one piece is just
    enough."""
    strands = wandering(random, projection, count)
    start, way = strands[:, :1], strands[:, 1:2] - strands[:, :1]
    distance = 1.0 if projection[3, 3] == 1.0 else -start[:, :, 2:]
    pixel = distance / projection[1, 1] * 2.0 / HEIGHT
    # p = c k^2 leaves the chord between two whole k by c / 4
    turn, size = random.uniform(0.0, 6.3, (count, 1)), random.uniform(1.6, 2.6, (count, 1, 1))
    bend = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1) * size * pixel
    along = np.arange(6.0)[:, None]
    return start + 0.2 * way * along + bend * along**2


def straight(random: np.random.Generator, projection: Floats, count: int) -> Floats:
    strands = wandering(random, projection, count)
    return strands[:, :1] + (strands[:, 1:2] - strands[:, :1]) * np.linspace(0, 1, 6)[:, None]


SHAPES: list[Callable[[np.random.Generator, Floats, int], Floats]] = [
    wandering,
    cusps,
    receding,
    bows,
    straight,
]


@pytest.mark.alike
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_the_line_is_everywhere_within_the_error_of_the_exact_curve(
    exact: Any, name: str, shape: Callable[[np.random.Generator, Floats, int], Floats]
) -> None:
    random = np.random.default_rng([*name.encode(), len(shape.__name__)])
    view = PictureView(look_at((0.3, -1.2, 0.4), (0.1, 0.2, 0.0)), PROJECTIONS[name], WIDTH, HEIGHT)
    seen = shape(random, view.projection, 16)
    world = (seen - view.view[:3, 3]) @ view.view[:3, :3]
    points = world.astype(np.float32)
    checked = 0
    for error in (0.5, 0.05):
        settings = DetailSettings(error=error, max_subdivisions=MOST)
        factors = detail_factors(points, view, settings)
        assert factors.min() >= 1 and factors.max() <= MOST
        for strand, pieces in zip(points, factors, strict=True):
            for coefficients, n in zip(exact.power_basis(strand), pieces, strict=True):
                if n == MOST:
                    continue  # the bound does not hold at the maximum
                curve = exact.curve(coefficients, np.linspace(0.0, 1.0, exact.SAMPLES))
                _, clip = exact.seen(curve, view)
                is_seen = (np.abs(clip[:, :3]) <= clip[:, 3:]).all(axis=1)
                if n == 1 and not is_seen.any():
                    continue  # outside of the picture
                # 0.001 pixels for float32, where the eye is near
                assert exact.drawn_error(coefficients, int(n), view) <= error + 0.001
                checked += 1
    assert checked > 15


def test_a_segment_in_sight_never_counts_as_outside(exact: Any) -> None:
    """Segments that get one piece for being outside have no sample of curve or chord in the
    picture."""
    random = np.random.default_rng(5)
    for projection in PROJECTIONS.values():
        view = PictureView(look_at((0.0, -1.0, 0.3), (0, 0, 0)), projection, WIDTH, HEIGHT)
        seen = 1.5 * wandering(random, projection, 200)
        points = ((seen - view.view[:3, 3]) @ view.view[:3, :3]).astype(np.float32)
        settings = DetailSettings(error=0.01)
        everywhere = detail_factors(points, wide(view), settings)
        factors = detail_factors(points, view, settings)
        outside = np.argwhere(factors < everywhere)
        assert len(outside) > 20
        for strand, segment in outside:
            coefficients = exact.power_basis(points[strand])[segment]
            _, clip = exact.seen(exact.curve(coefficients, np.linspace(0, 1, 200)), view)
            assert factors[strand, segment] == 1
            assert not (np.abs(clip[:, :3]) <= clip[:, 3:]).all(axis=1).any()


def wide(view: PictureView) -> PictureView:
    """A picture of the same resolution per angle, 50 times as large, with distant clip planes."""
    projection = view.projection.copy()
    projection[:2] /= 50.0
    if projection[3, 3] == 0.0:
        near, far = 1e-4, 1e4
        projection[2, 2:] = (far + near) / (near - far), 2.0 * far * near / (near - far)
    else:
        projection[2, 2:] = -1e-4, 0.0
    return PictureView(view.view, projection, 50 * view.width, 50 * view.height)


def test_factors_are_hardly_more_than_what_the_error_needs(exact: Any, shared_data: Path) -> None:
    """Against the least factors, by brute force, on a real groom with the whole head in view; the
    measured ratio is 1.06."""
    path = shared_data / "sintel" / "SintelHairOriginal-sintel_hair.16points.tfx"
    grid = read_tfx(path).strands.grid
    bounds = grid.min(axis=(0, 1)), grid.max(axis=(0, 1))
    camera = frame_camera(bounds, (-0.5, -1.0, 0.2), 0.5, ASPECT)
    view = PictureView(camera.view, camera.projection, WIDTH, HEIGHT)
    every = detail_factors(grid, view, DetailSettings())
    assert every.mean() < 1.5
    assert 64.0 / every.mean() > 42.0
    some = slice(None, None, 57)
    for error, limit in ((0.5, 1.15), (0.1, 1.3)):
        factors = detail_factors(grid[some], view, DetailSettings(error=error))
        least = [
            least_pieces(exact, coefficients, int(n), error, view)
            for strand, pieces in zip(grid[some], factors, strict=True)
            for coefficients, n in zip(exact.power_basis(strand), pieces, strict=True)
        ]
        assert factors.mean() < limit * np.mean(least)


def least_pieces(
    exact: Any, coefficients: Floats, enough: int, error: float, view: PictureView
) -> int:
    for pieces in range(1, enough):
        if exact.drawn_error(coefficients, pieces, view) <= error:
            return pieces
    return enough


@pytest.mark.parametrize("mode", ["adaptive", "heuristic", "fixed"])
def test_nothing_depends_on_what_else_is_there(mode: str) -> None:
    """A strand's factors are the same alone; for more strands than a chunk, none, and two CVs."""
    random = np.random.default_rng(8)
    view = PictureView(look_at((0, -3, 0), (0, 0, 0)), PROJECTIONS["usual"], WIDTH, HEIGHT)
    points = np.cumsum(random.normal(0.0, 0.1, (2500, 5, 3)), axis=1).astype(np.float32)
    settings = DetailSettings(mode=mode, piece_length=20.0)
    factors = detail_factors(points, view, settings)
    assert factors.dtype == np.int32
    for strand in (0, 1023, 1024, 2499):
        alone = detail_factors(points[strand : strand + 1], view, settings)
        assert (factors[strand] == alone[0]).all()
    assert detail_factors(points[:0], view, settings).shape == (0, 4)
    expected = 2 if mode == "fixed" else 1
    assert (detail_factors(points[:, :2], view, settings) == expected).all()


def test_fixed_takes_the_same_everywhere_whatever_other_modes_may_take() -> None:
    view = PictureView(np.eye(4), PROJECTIONS["usual"], WIDTH, HEIGHT)
    points = np.zeros((3, 4, 3), np.float32)
    assert (detail_factors(points, view, DetailSettings(mode="fixed", subdivisions=5)) == 5).all()
    other = DetailSettings(mode="fixed", subdivisions=9, max_subdivisions=6)
    assert (detail_factors(points, view, other) == 9).all()


def test_the_heuristic_counts_pixels_and_the_larger_angle() -> None:
    """Against hand-computed numbers: 1 m is 100 pixels, with pieces of 10.5 pixels where strands
    bend enough."""
    projection = orthographic(7.2, ASPECT, -10.0, 10.0)
    view = PictureView(np.eye(4), projection, WIDTH, HEIGHT)
    turn = np.deg2rad([0.0, 0.0, 30.0, 100.0, 100.0])
    way = np.stack([np.cos(turn), np.sin(turn), np.zeros(5)], axis=1)
    points = np.vstack([np.zeros(3), np.cumsum(way, axis=0)])[None].astype(np.float32)
    factors = detail_factors(points, view, DetailSettings(mode="heuristic", piece_length=10.5))
    # angles at the segments' ends: 0, 30; 30, 70; 70, 0 degrees; from 45 on, factors are whole
    assert factors.tolist() == [[1, 7, 10, 10, 1]]


def test_the_heuristic_ignores_what_is_straight_and_survives_no_length() -> None:
    view = PictureView(look_at((0, -3, 0), (0, 0, 0)), PROJECTIONS["usual"], WIDTH, HEIGHT)
    settings = DetailSettings(mode="heuristic")
    line = np.linspace(0, 1, 7)[:, None] * [0.5, 0.1, 0.2]
    still = np.zeros((7, 3))
    behind = line + [0.0, -5.0, 0.0]
    points = np.stack([line, still, behind]).astype(np.float32)
    assert (detail_factors(points, view, settings) == 1).all()


def test_what_passes_the_eye_gets_all_pieces_and_broken_points_a_number() -> None:
    view = PictureView(look_at((0, 0, 0), (0, 1, 0)), PROJECTIONS["usual"], WIDTH, HEIGHT)
    through = np.array([[0.02, -1, 0], [0, -0.5, 0.01], [0.01, 0.5, 0], [0, 1, 0]], np.float32)
    settings = DetailSettings(max_subdivisions=20)
    assert detail_factors(through[None], view, settings)[0, 1] == 20
    broken = np.full((1, 4, 3), np.nan, np.float32)
    for mode in ("adaptive", "heuristic"):
        factors = detail_factors(broken, view, DetailSettings(mode=mode, max_subdivisions=20))
        assert ((factors >= 1) & (factors <= 20)).all()


def test_stations_count_on_from_root_to_tip() -> None:
    factors = np.array([[1, 2, 3], [4, 1, 1]], np.int32)
    assert stations(factors).tolist() == [[0, 1, 3, 6], [0, 4, 5, 6]]


def test_the_points_lie_on_the_exact_curve_at_their_stations(exact: Any) -> None:
    random = np.random.default_rng(4)
    grid = random.normal(size=(2100, 5, 3)).astype(np.float32)
    factors = random.integers(1, 7, (2100, 4)).astype(np.int32)
    points, offsets = adaptive_points(grid, factors)
    assert points.dtype == np.float32
    assert (np.diff(offsets) == factors.sum(axis=1) + 1).all()
    assert offsets[0] == 0 and offsets[-1] == len(points)
    for strand in (0, 1, 1023, 1024, 2099):
        expected = [
            exact.curve(coefficients, np.arange(n) / n)
            for coefficients, n in zip(
                exact.power_basis(grid[strand]), factors[strand], strict=True
            )
        ]
        drawn = points[offsets[strand] : offsets[strand + 1]]
        assert drawn[:-1] == pytest.approx(np.vstack(expected), abs=2e-6)
        # the CVs are among them, bit for bit: neighbours share them
        assert (drawn[stations(factors[strand : strand + 1])[0]] == grid[strand]).all()
    nothing, zero = adaptive_points(grid[:0], factors[:0])
    assert nothing.shape == (0, 3) and zero.tolist() == [0]
