"""The side from which hair is shown: before a face, before a sheet, beside an animal."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.camera import frame_points
from hairloom.addon.render.good_side import GoodSide, good_side
from hairloom.addon.strands import StrandSet, Surface

TURNS = (0.0, 75.0, 180.0, 262.0)


def ball(radius: float, squeeze: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Surface:
    """A sphere of triangles, scaled along the axes."""
    rows, columns = 20, 40
    down, around = np.meshgrid(
        np.linspace(0.0, np.pi, rows + 1), 2.0 * np.pi * np.arange(columns) / columns, indexing="ij"
    )
    points = np.stack(
        [np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1
    )
    row, column = np.indices((rows, columns))
    here, beside = row * columns + column, row * columns + (column + 1) % columns
    triangles = np.concatenate(
        [
            np.stack([here, beside + columns, beside], axis=-1).reshape(-1, 3),
            np.stack([here, here + columns, beside + columns], axis=-1).reshape(-1, 3),
        ]
    )
    return Surface((points.reshape(-1, 3) * squeeze * radius).astype(np.float32), triangles)


def spikes(roots: np.ndarray, outward: np.ndarray, length: float) -> np.ndarray:
    """Straight strands, (n, 6, 3)."""
    along = np.linspace(0.0, length, 6)
    return roots[:, None] + along[None, :, None] * outward[:, None]


def head() -> tuple[np.ndarray, Surface]:
    """A ball with hair all over except for a face towards -Y."""
    outward = np.random.default_rng(3).normal(size=(1500, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    outward = outward[(outward[:, 1] > -0.55) & (outward[:, 2] > -0.6)]
    return spikes(0.1 * outward, outward, 0.03), ball(0.1)


def cropped() -> tuple[np.ndarray, Surface]:
    """A head with very short hair on a long bare neck: its hair is visible best from behind, its
    neck from all sides."""
    outward = np.random.default_rng(6).normal(size=(3000, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    x, y, z = outward.T
    outward = outward[(z > -0.45) & ~((y < -0.35) & (np.abs(x) < 0.6) & (z < 0.6))]
    skull, neck = ball(0.1), ball(0.06, (1.0, 1.0, 2.5))
    positions = [skull.positions, neck.positions + np.float32([0.0, 0.0, -0.14])]
    triangles = [skull.triangles, neck.triangles + len(skull.positions)]
    return spikes(0.1 * outward, outward, 0.004), Surface(
        np.concatenate(positions), np.concatenate(triangles)
    )


def sheet() -> tuple[np.ndarray, Surface]:
    """Hair that hangs before a wall whose back is bare."""
    places = np.random.default_rng(4).uniform(-0.5, 0.5, (900, 2))
    roots = np.stack([places[:, 0], np.zeros(900), places[:, 1]], axis=1)
    corners = np.array([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5]], np.float32)
    wall = Surface(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    return spikes(roots, np.tile([0.0, -0.5, -0.866], (900, 1)), 0.05), wall


def beast() -> tuple[np.ndarray, Surface]:
    """Fur all over a long body except for the snout at its end towards -Y."""
    outward = np.random.default_rng(5).normal(size=(3000, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    outward = outward[outward[:, 1] > -0.8]
    squeeze = (0.5, 1.6, 0.6)
    return spikes(outward * squeeze, outward, 0.04), ball(1.0, squeeze)


def coat() -> tuple[np.ndarray, Surface]:
    """Fur all over the same body, combed towards its tail at +Y."""
    outward = np.random.default_rng(5).normal(size=(3000, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    squeeze = (0.5, 1.6, 0.6)
    lies = outward + [0.0, 0.5, 0.0]
    return spikes(outward * squeeze, lies, 0.04), ball(1.0, squeeze)


def crest() -> tuple[np.ndarray, Surface]:
    """A bare upright body that faces -Y, with a crest from its brow down its back that lies
    backwards."""
    across, around = np.random.default_rng(7).uniform((-0.75, 0.2), (0.75, 2.8), (3000, 2)).T
    roots = np.stack([across, -np.cos(around + 0.6), np.sin(around + 0.6)], axis=1)
    roots *= 1.0 / np.linalg.norm(roots, axis=1, keepdims=True)
    squeeze = (0.5, 0.5, 1.0)
    return spikes(roots * squeeze, 0.4 * roots + [0.0, 1.0, 0.0], 0.3), ball(1.0, squeeze)


def side_of(grid: np.ndarray, body: Surface | None) -> GoodSide:
    count, cv_count = grid.shape[:2]
    points, offsets = grid.reshape(-1, 3), np.arange(count + 1) * cv_count
    hair = StrandSet(points, offsets, np.ones(len(points)), np.zeros(count))
    return good_side(hair, body)


def turned(strands: np.ndarray, body: Surface, degrees: float) -> tuple[np.ndarray, Surface]:
    angle = np.radians(degrees)
    rotation = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    positions = (body.positions @ rotation.T).astype(np.float32)
    return strands @ rotation.T, Surface(positions, body.triangles)


def away(direction: np.ndarray, degrees: float) -> float:
    """Angle [degrees] between a direction, seen from above, and -Y turned by `degrees`."""
    angle = np.arctan2(direction[0], -direction[1]) - np.radians(degrees)
    return abs(float(np.degrees((angle + np.pi) % (2.0 * np.pi) - np.pi)))


@pytest.mark.alike
@pytest.mark.parametrize("shape", [head, cropped, sheet, beast])
@pytest.mark.parametrize("degrees", TURNS)
def test_the_front_is_found_wherever_it_is(shape, degrees: float) -> None:
    side = side_of(*turned(*shape(), degrees))
    assert away(side.front, degrees) < 12.0
    assert 15.0 < away(side.three_quarter, degrees) < 45.0


def modelled(body: Surface) -> Surface:
    """The body with a mesh that is finer towards -Y, as models of heads are."""
    x, y, z = body.positions.T
    around = np.arctan2(x, -y)
    around = np.where(np.hypot(x, y) > 1e-6, around - 0.9 * np.sin(around), 0.0)
    radius = np.hypot(x, y)
    moved = np.stack([radius * np.sin(around), -radius * np.cos(around), z], axis=1)
    return Surface(moved.astype(np.float32), body.triangles)


def veiled() -> tuple[np.ndarray, Surface]:
    """A head with hair all over, the face included, that is swept to one side."""
    outward = np.random.default_rng(3).normal(size=(2500, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return spikes(0.1 * outward, outward + [0.87, 0.5, 0.0], 0.08), ball(0.1)


@pytest.mark.alike
@pytest.mark.parametrize("degrees", TURNS)
def test_the_front_of_a_head_with_its_face_covered_is_that_of_its_mesh(degrees: float) -> None:
    """From the hair alone, it would be 60 degrees beside it."""
    strands, body = veiled()
    assert away(side_of(strands, body).front, 0.0) > 50.0
    side = side_of(*turned(strands, modelled(body), degrees))
    assert away(side.front, degrees) < 3.0
    assert 15.0 < away(side.three_quarter, degrees) < 45.0


def test_hair_all_over_with_a_tail_at_one_side_is_seen_from_blenders_front() -> None:
    """A tail is no sign of a face."""
    outward = np.random.default_rng(3).normal(size=(2500, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    at_side = outward @ np.array([0.87, 0.5, 0.0]) > 0.9
    strands = spikes(0.1 * outward, outward, 0.01)
    strands[at_side] = spikes(0.1 * outward[at_side], outward[at_side] - [0.0, 0.0, 1.0], 0.2)
    assert away(side_of(strands, ball(0.1)).front, 0.0) < 1e-6


def test_a_wall_with_a_finer_edge_is_not_seen_from_there() -> None:
    strands, _ = sheet()
    across = np.linspace(0.0, 1.0, 21) ** 2 - 0.5
    x, z = np.meshgrid(across, [-0.5, 0.0, 0.5], indexing="ij")
    row, column = np.indices((20, 2))
    here = row * 3 + column
    triangles = np.concatenate(
        [np.stack([here, here + 3, here + 4], -1), np.stack([here, here + 4, here + 1], -1)]
    )
    wall = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3).astype(np.float32)
    assert away(side_of(strands, Surface(wall, triangles.reshape(-1, 3))).front, 0.0) < 12.0


@pytest.mark.parametrize("degrees", TURNS)
def test_a_coat_is_seen_against_its_lie(degrees: float) -> None:
    """Light leaves a strand in a cone around it, so a coat seen along its lie shows dark tips."""
    side = side_of(*turned(*coat(), degrees))
    assert away(side.front, degrees) < 12.0
    assert 15.0 < away(side.three_quarter, degrees) < 45.0


def test_a_coat_that_lies_to_no_side_has_a_front_all_the_same() -> None:
    strands, body = coat()
    outward = strands[:, 0] - strands[:, 0].mean(axis=0)
    side = side_of(spikes(strands[:, 0], outward, 0.04), body)
    assert np.linalg.norm(side.front) == pytest.approx(1.0)


@pytest.mark.parametrize("degrees", TURNS)
def test_a_crest_is_seen_from_the_side_of_the_face(degrees: float) -> None:
    """Although most of it is visible from behind, and hardly any from where a face is seen best."""
    side = side_of(*turned(*crest(), degrees))
    assert away(side.front, degrees) < 15.0
    assert 50.0 < away(side.three_quarter, degrees) < 80.0


def test_a_carpet_is_seen_from_above() -> None:
    strands, wall = sheet()
    flat = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # the wall's front turned up
    surface = Surface((wall.positions @ flat.T).astype(np.float32), wall.triangles)
    side = side_of(spikes(strands[:, 0] @ flat.T, np.tile([0, 0, 1.0], (900, 1)), 0.02), surface)
    assert side.three_quarter[2] > 0.5 > side_of(*head()).three_quarter[2]


def test_a_face_is_not_seen_from_above_wherever_the_hair_is() -> None:
    """Although hair of the crown alone is visible best from above."""
    strands, body = head()
    crown = strands[strands[:, 0, 2] > 0.06]
    assert 100 < len(crown) < len(strands) // 2
    assert side_of(crown, body).three_quarter[2] < 0.5


def test_a_sheet_without_a_body_is_not_seen_from_its_edge() -> None:
    strands, _ = sheet()
    for degrees in TURNS:
        rotated, _ = turned(strands, ball(1.0), degrees)
        seen = away(side_of(rotated, None).three_quarter, degrees)
        assert min(seen, 180.0 - seen) < 50.0


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_size_and_place_do_not_matter(scale: float) -> None:
    strands, body = head()
    place = scale * np.array([0.3, -0.2, 1.5])
    moved = Surface((body.positions * scale + place).astype(np.float32), body.triangles)
    one, other = side_of(strands, body), side_of(strands * scale + place, moved)
    np.testing.assert_allclose(one.three_quarter, other.three_quarter, atol=0.05)


def test_views_turn_to_the_side_that_is_seen() -> None:
    side = side_of(*head())
    np.testing.assert_allclose(side.turned(0.0, 0.0), side.front, atol=1e-12)
    np.testing.assert_allclose(side.turned(180.0, 0.0), -side.front, atol=1e-12)
    aside = side.turned(90.0, 0.0)
    assert aside @ side.front == pytest.approx(0.0, abs=1e-12)
    assert aside[:2] @ side.three_quarter[:2] > 0.0


@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.8])
def test_points_touch_the_frame_and_stay_within(aspect: float) -> None:
    """One axis is filled from border to border, the other is centred."""
    points = np.random.default_rng(2).normal(size=(500, 3)) * (3.0, 0.4, 1.0) + (7.0, 5.0, -2.0)
    camera = frame_points(points, (-0.4, -1.0, 0.3), 0.6, aspect, margin=1.25)
    clip = np.append(points, np.ones((500, 1)), axis=1) @ (camera.projection @ camera.view).T
    places = clip[:, :2] / clip[:, 3:]
    low, high = places.min(axis=0) * 1.25, places.max(axis=0) * 1.25
    assert (np.abs(clip[:, 2]) < clip[:, 3]).all()
    assert max(high) == pytest.approx(1.0) and min(low) == pytest.approx(-1.0)
    fills = int(np.argmax(high - low))
    assert low[fills] == pytest.approx(-1.0) and high[fills] == pytest.approx(1.0)


def test_few_points_per_strand_give_the_same_side() -> None:
    strands, body = head()
    count, cv_count = strands.shape[:2]
    counts = np.where(np.arange(count) % 2, 2, cv_count)
    pairs = zip(strands, counts, strict=True)
    kept = np.concatenate([grid[[0, -1]] if few == 2 else grid for grid, few in pairs])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    hair = StrandSet(kept, offsets, np.ones(len(kept)), np.zeros(count))
    expected = side_of(strands, body)
    assert np.abs(good_side(hair, body).three_quarter - expected.three_quarter).max() < 0.1
