"""Culling: rays prove that culled strands are invisible; balls lie inside a real head."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.refine.culling import (
    are_facing_away,
    are_hidden,
    hidden_regions,
    occluder_spheres_of,
    transform_spheres,
)
from hairloom.addon.refine.detail import PictureView
from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import closest_point

WIDTH, HEIGHT = 800, 600
PROJECTIONS = {
    "perspective": perspective(0.8, WIDTH / HEIGHT, 0.05, 100.0),
    "wide": perspective(2.4, WIDTH / HEIGHT, 0.05, 100.0),
    "orthographic": orthographic(2.0, WIDTH / HEIGHT, 0.05, 100.0),
}
BALLS = np.array([[0.0, 0.0, 0.0, 0.5], [0.3, 0.2, 0.4, 0.3], [-0.2, 0.5, -0.3, 0.35]])
HALF_WIDTH, RADIUS = 2.0, 1e-3


def seen_past(points: Floats, ball: Floats, eye: Floats) -> np.ndarray:
    """Whether no part of the line from each point (n, 3) to the eye (4,) meets the ball, (n,)."""
    to_eye = eye[:3] - eye[3] * points
    reach = np.where(eye[3] == 1.0, np.linalg.norm(to_eye, axis=1), np.inf)
    way = to_eye / np.linalg.norm(to_eye, axis=1, keepdims=True)
    to_center = ball[:3] - points
    along = np.clip((to_center * way).sum(axis=1), 0.0, reach)
    return np.linalg.norm(to_center - along[:, None] * way, axis=1) > ball[3]


@pytest.mark.alike
@pytest.mark.parametrize("name", PROJECTIONS)
@pytest.mark.parametrize("eye", [(0.0, -3.0, 0.4), (2.0, 0.5, -0.3), (0.0, -0.75, 0.1)])
def test_nothing_of_a_hidden_strand_is_seen(
    exact: Any, name: str, eye: tuple[float, float, float]
) -> None:
    """Rays to the eye meet a ball, from many points of each exact curve and of the drawn line's
    edges."""
    view = look_at(eye, (0.0, 0.1, 0.0))
    picture = PictureView(view, PROJECTIONS[name], WIDTH, HEIGHT)
    random = np.random.default_rng(len(name))
    behind = -np.asarray(eye) / np.linalg.norm(eye)
    start = behind * random.uniform(-1.0, 2.0, (4000, 1)) + random.normal(0.0, 0.4, (4000, 3))
    step = random.normal(size=(4000, 4, 3)) * random.uniform(0.01, 0.2, (4000, 1, 1))
    points = (start[:, None] + np.cumsum(step, axis=1)).astype(np.float32)
    regions = hidden_regions(BALLS, picture, HALF_WIDTH, RADIUS)
    is_hidden = are_hidden(points, regions)
    assert 40 < is_hidden.sum() < 3500
    # those that slightly smaller balls would not hide
    is_close = is_hidden & ~are_hidden(
        points, hidden_regions(BALLS, picture, 5.0 * HALF_WIDTH, RADIUS)
    )
    assert is_close.sum() > 20
    homogeneous = Camera(view, picture.projection).eye
    pixel = np.linalg.inv(view)[:3, :2] / np.diag(picture.projection)[:2] / picture.half_size
    for strand in points[is_close][:40]:
        is_past = np.ones((4, 3 * exact.SAMPLES), bool)
        t = np.linspace(0.0, 1.0, exact.SAMPLES)
        curve = np.vstack([exact.curve(part, t) for part in exact.power_basis(strand)])
        depth = -(curve @ view[:3, :3].T + view[:3, 3])[:, 2:]
        depth = depth if homogeneous[3] == 1.0 else np.ones_like(depth)
        sides = [s * HALF_WIDTH * depth * pixel[:, axis] for s in (-1, 1) for axis in (0, 1)]
        for edge, side in enumerate(sides):
            for ball in BALLS:
                is_past[edge] &= seen_past(curve + side, ball, homogeneous)
        assert not is_past.any()


@pytest.mark.parametrize("name", PROJECTIONS)
def test_what_is_behind_a_ball_is_found(name: str) -> None:
    """Short strands just inside the hidden region are hidden, those just outside or before it are
    not."""
    picture = PictureView(look_at((0, -3, 0), (0, 0, 0)), PROJECTIONS[name], WIDTH, HEIGHT)
    regions = hidden_regions(BALLS[:1], picture, 0.5, 0.0)
    places = np.array([[0, 0.6, 0], [0.4, 0.5, 0], [0, -0.6, 0], [0.9, 0.6, 0], [0, -4.0, 0]])
    points = places[:, None] + np.linspace(0.0, 0.02, 4)[:, None] * [0.0, 1.0, 0.0]
    assert are_hidden(points, regions).tolist() == [True, True, False, False, False]
    # one visible CV is enough for a strand to be drawn
    out = points[:1].copy()
    out[0, 3] = [1.5, 0.7, 0.0]
    assert not are_hidden(out, regions).any()


def test_no_ball_hides_that_is_too_small_too_near_or_clipped() -> None:
    lens = PROJECTIONS["perspective"]
    points = np.array([[[0.0, 0.8, 0.0], [0.0, 0.9, 0.0]]], np.float32)

    def count(eye: tuple[float, float, float], half_width: float = 1.0) -> int:
        picture = PictureView(look_at(eye, (0, 9, 0)), lens, WIDTH, HEIGHT)
        regions = hidden_regions(BALLS[:1], picture, half_width, 1e-4)
        assert are_hidden(points, regions).any() == (len(regions.axis) > 0)
        return len(regions.axis)

    assert count((0, -3, 0)) == 1
    assert count((0, -3, 0), half_width=1000.0) == 0
    assert count((0, -0.4, 0)) == 0  # within the ball
    assert count((0, -0.53, 0)) == 0  # before the near plane
    none = PictureView(look_at((0, -3, 0), (0, 0, 0)), lens, WIDTH, HEIGHT)
    assert not are_hidden(points, hidden_regions(np.zeros((0, 4)), none, 1.0, 1e-4)).any()
    assert are_hidden(points[:0], hidden_regions(BALLS, none, 1.0, 1e-4)).shape == (0,)


def test_roots_on_the_far_side_face_away() -> None:
    roots = np.array([[0, -1, 0], [0, 1, 0], [1, 0.1, 0], [1, -0.4, 0]], float)
    center = np.zeros(3)
    assert are_facing_away(roots, center, np.array([0, -1.0, 0, 0])).tolist() == [0, 1, 1, 0]
    # from near, less of a ball is visible
    assert are_facing_away(roots, center, np.array([0, -2.0, 0, 1])).tolist() == [0, 1, 1, 1]


@pytest.fixture(scope="module")
def sintel(shared_data: Path) -> tuple[Surface, Floats]:
    """The body, which has holes, Z up, and the roots of its hair."""
    folder = shared_data / "sintel"
    vertices, triangles = [], []
    for line in (folder / "sintel.obj").read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            x, y, z = map(float, words[:3])
            vertices.append((x, -z, y))
        elif kind == "f":
            first, *rest = (int(word.split("/")[0]) - 1 for word in words)
            triangles += [(first, *pair) for pair in pairwise(rest)]
    surface = Surface(np.array(vertices, np.float32), np.array(triangles))
    groom = read_tfx(folder / "SintelHairOriginal-sintel_hair.16points.tfx").strands
    return surface, groom.grid[:, 0]


@pytest.mark.parametrize("by_roots", [True, False])
def test_balls_lie_inside_a_real_head_that_has_holes(
    sintel: tuple[Surface, Floats], by_roots: bool
) -> None:
    surface, roots = sintel
    balls = occluder_spheres_of(surface, 8, roots if by_roots else None)
    assert balls.dtype == np.float32
    assert 2 <= len(balls) <= 8
    assert balls[0, 3] > 0.07  # the skull; its largest ball is 0.078
    if by_roots:
        low, high = roots.min(axis=0), roots.max(axis=0)
        assert (balls[:, 2] > low[2] - (high - low).max()).all(), "none in the chest"
    distance = closest_point(balls[:, :3], surface).distance
    assert (balls[:, 3] <= 0.96 * distance).all()
    way = np.random.default_rng(1).normal(size=(500, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for ball in balls:
        assert (winding_number(ball[:3] + ball[3] * way, surface) > 0.5).all()


def test_a_cup_hides_no_more_than_when_it_is_closed() -> None:
    """The balls of an open half ball do not stick out of its opening."""
    theta, phi = np.meshgrid(np.linspace(0.0, np.pi / 2, 9), np.arange(24) * np.pi / 12)
    rings = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
    index = np.arange(9 * 24).reshape(24, 9)
    a, b = index[:, :-1], np.roll(index, -1, axis=0)[:, :-1]
    quads = np.stack([a, a + 1, b + 1, a, b + 1, b], axis=-1).reshape(-1, 3)
    cup = Surface(rings.reshape(-1, 3), quads)
    balls = occluder_spheres_of(cup, 4)
    assert 0.4 < balls[0, 3] < 0.5
    assert (balls[:, 2] - balls[:, 3] > 0.0).all()
    assert (np.linalg.norm(balls[:, :3], axis=1) + balls[:, 3] < 1.0).all()


def test_what_has_no_inside_gives_no_balls() -> None:
    nothing = Surface(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert occluder_spheres_of(nothing).shape == (0, 4)
    flat = Surface(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), np.array([[0, 1, 2], [2, 1, 3]])
    )
    assert len(occluder_spheres_of(flat)) == 0
    point = Surface(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert len(occluder_spheres_of(point)) == 0


def test_balls_move_with_the_head_and_never_get_too_large() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = [[0.0, -2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 3.0]]
    matrix[:3, 3] = [1.0, 2.0, 3.0]
    moved = transform_spheres(np.array([[1.0, 0.0, 1.0, 0.5]], np.float32), matrix)
    assert moved == pytest.approx(np.array([[1.0, 3.0, 6.0, 0.5]]))
