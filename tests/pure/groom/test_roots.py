"""Binding and following: rest is exact, rigid motion is kept, wrong scales are reported."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.roots import (
    RootFrames,
    bind_roots,
    carry_with_roots,
    root_frames,
    root_motions,
)
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.closest_point import closest_point


def hair_on(surface: Surface, count: int, offset: float = 0.0) -> StrandSet:
    """Strands of 8 points that leave the middle of triangles along their normals."""
    random = np.random.default_rng(1)
    triangle = random.integers(len(surface.triangles), size=count)
    weights = random.dirichlet([1, 1, 1], count)
    root = np.einsum("nk,nkj->nj", weights, surface.corners[triangle])
    normal = surface.triangle_normals()[triangle]
    along = offset + np.linspace(0.0, 0.1, 8)
    wild = random.normal(0.0, 0.005, (count, 8, 3))
    wild[:, 0] = 0.0
    grid = root[:, None] + along[None, :, None] * normal[:, None] + wild
    return StrandSet(
        grid.reshape(-1, 3), np.arange(count + 1) * 8, np.full(count * 8, 4e-5), np.zeros(count)
    )


def frames_of(strands: StrandSet, positions: Floats, surface: Surface) -> RootFrames:
    assert strands.root_triangle is not None
    assert strands.root_barycentric is not None
    return root_frames(
        positions, surface.triangles, strands.root_triangle, strands.root_barycentric
    )


def rotation(axis: tuple[float, float, float], angle: float) -> Floats:
    """A rotation matrix, by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def test_binding_finds_the_roots_and_leaves_the_points(egg: Surface) -> None:
    strands = hair_on(egg, 200, offset=0.004)
    bound = bind_roots(strands, egg, place="test")
    assert (bound.strands.points == strands.points).all()
    assert bound.distance == pytest.approx(np.full(200, 0.004), abs=2e-6)
    origin = frames_of(bound.strands, egg.positions, egg).origin
    assert np.linalg.norm(origin - strands.roots, axis=1) == pytest.approx(bound.distance, abs=1e-7)


def test_missing_root_uvs_come_from_the_surface_and_own_ones_stay(egg: Surface) -> None:
    strands = hair_on(egg, 200)
    found = bind_roots(strands, egg, place="test").strands.root_uv
    assert found is not None
    up = np.arccos(np.clip(strands.roots[:, 2] / 0.12, -1.0, 1.0))
    assert found[:, 1] == pytest.approx(1.0 - up / np.pi, abs=0.02)

    own = np.full((200, 2), 0.25)
    with_uv = StrandSet(strands.points, strands.offsets, strands.radius, strands.group, own)
    kept = bind_roots(with_uv, egg, place="test").strands.root_uv
    assert kept is not None
    assert (kept == 0.25).all()
    bare = Surface(egg.positions, egg.triangles)
    assert bind_roots(strands, bare, place="test").strands.root_uv is None


def followed(strands: StrandSet, rest: RootFrames, now: RootFrames) -> Floats:
    points = carry_with_roots(strands.points, strands.offsets, root_motions(rest, now))
    return points.reshape(strands.grid.shape)


def test_strands_of_any_point_counts_go_each_with_its_own_root(egg: Surface) -> None:
    even = bind_roots(hair_on(egg, 1300, offset=0.003), egg, place="test").strands
    rest, now = frames_of(even, egg.positions, egg), frames_of(even, 1.5 * egg.positions, egg)
    whole, counts = followed(even, rest, now), np.random.default_rng(1).integers(2, 9, 1300)
    parts = [points[:count] for points, count in zip(even.grid, counts, strict=True)]
    expected = [points[:count] for points, count in zip(whole, counts, strict=True)]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    found = carry_with_roots(np.concatenate(parts), offsets, root_motions(rest, now))
    assert np.array_equal(found, np.concatenate(expected))


def test_at_rest_every_bit_stays(egg: Surface) -> None:
    strands = bind_roots(hair_on(egg, 300, offset=0.003), egg, place="test").strands
    frames = frames_of(strands, egg.positions, egg)
    assert (followed(strands, frames, frames) == strands.grid).all()


def test_rigid_motion_passes_through(egg: Surface) -> None:
    strands = bind_roots(hair_on(egg, 300, offset=0.003), egg, place="test").strands
    turn, shift = rotation((1.0, 2.0, -0.5), 2.2), np.array([0.3, -0.1, 0.2])
    rest = frames_of(strands, egg.positions, egg)
    # in float64, to see the errors of `carry_with_roots` alone
    now = frames_of(strands, egg.positions.astype(np.float64) @ turn.T + shift, egg)
    expected = strands.grid.astype(np.float64) @ turn.T + shift
    assert np.abs(followed(strands, rest, now) - expected).max() < 1e-7


def test_each_strand_goes_rigidly_when_the_surface_bends(egg: Surface) -> None:
    strands = bind_roots(hair_on(egg, 300), egg, place="test").strands
    bent = egg.positions.astype(np.float64)
    bent = bent * (1.0 + 0.3 * np.sin(20.0 * bent[:, [2, 0, 1]]))
    rest, now = frames_of(strands, egg.positions, egg), frames_of(strands, bent, egg)
    moved = followed(strands, rest, now)

    def distances(grid: Floats) -> Floats:
        return np.linalg.norm(grid[:, :, None] - grid[:, None], axis=3)

    assert np.abs(moved - strands.grid).max() > 0.01
    assert np.abs(distances(moved) - distances(strands.grid)).max() < 1e-6
    assert moved[:, 0] == pytest.approx(now.origin, abs=1e-6)


def test_frames_are_right_handed_rotations_even_on_broken_triangles() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [0.5, 1e-12, 0]], float)
    triangles = np.array([[0, 1, 2], [0, 1, 3], [0, 0, 2], [1, 1, 1], [0, 1, 4], [0, 2, 0]])
    found = root_frames(positions, triangles, np.arange(6), np.full((6, 3), 1 / 3))
    unit = np.einsum("sij,sik->sjk", found.rotation, found.rotation)
    assert unit == pytest.approx(np.tile(np.eye(3), (6, 1, 1)), abs=1e-12)
    assert np.linalg.det(found.rotation) == pytest.approx(np.ones(6))
    assert found.rotation[0] == pytest.approx(np.eye(3))
    assert found.origin[0] == pytest.approx([1 / 3, 1 / 3, 0])


@pytest.mark.parametrize("unit", [100.0, 1000.0, 0.01, 1 / 0.0254, 1 / 0.3048])
def test_a_groom_in_another_unit_is_reported_with_the_factor_back(
    egg: Surface, unit: float
) -> None:
    strands = hair_on(egg, 200).transformed(np.diag([unit, unit, unit, 1.0]))
    with pytest.raises(HairloomError) as caught:
        bind_roots(strands, egg, place="hair.tfx")
    error = caught.value
    assert error.place == "hair.tfx"
    roots_size = np.linalg.norm(np.ptp(strands.roots, axis=0))
    head_size = np.linalg.norm(np.ptp(egg.positions, axis=0))
    assert f"{roots_size:.3g} m" in error.problem
    assert f"{head_size:.3g} m" in error.problem
    assert f"(pass --groom-scale {1.0 / unit:.4g})" in error.remedy
    assert error.remedy.endswith(f"(pass --head-scale {unit:.4g})")


def test_hair_of_a_head_between_the_legs_of_a_larger_body_is_of_another_scale(
    egg: Surface,
) -> None:
    """A groom of a tenth of the size lies at the feet of a standing body, nearer to it than 0.15 of
    the body's size."""
    low, _ = egg.bounds()
    body = Surface(egg.positions - low * [0.0, 0.0, 1.0], egg.triangles)
    whole = hair_on(body, 200)
    small = whole.transformed(np.diag([0.1, 0.1, 0.1, 1.0]))
    away = np.median(closest_point(small.roots, body).distance)
    assert away < 0.15 * np.linalg.norm(np.ptp(body.positions, axis=0))
    with pytest.raises(HairloomError, match="different scale") as caught:
        bind_roots(small, body, place="hair.tfx")
    assert "(pass --head-scale 0.1)" in caught.value.remedy


def test_roots_beside_the_surface_are_loose_and_by_how_much(egg: Surface) -> None:
    """Roots moved along z by a tenth of the surface's size are no farther than that from it, and
    their looseness is more than a fifth of that."""
    strands = hair_on(egg, 200)
    assert bind_roots(strands, egg, place="hair.tfx").looseness(egg) == 0.0
    step = 0.1 * float(np.linalg.norm(np.ptp(egg.positions, axis=0)))
    matrix = np.eye(4)
    matrix[2, 3] = step
    loose = bind_roots(strands.transformed(matrix), egg, place="hair.tfx").looseness(egg)
    assert 0.2 * step < loose < step


def test_a_groom_in_another_place_is_not_called_another_scale(egg: Surface) -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = (3.0, 0.0, 0.0)
    strands = hair_on(egg, 200).transformed(matrix)
    with pytest.raises(HairloomError, match="no common unit makes them meet"):
        bind_roots(strands, egg, place="hair.tfx")


def test_few_stray_roots_and_loose_fits_are_no_scale_error(egg: Surface) -> None:
    strands = hair_on(egg, 200, offset=0.01)
    points = strands.points.copy()
    points[: 8 * 80] += 5.0
    assert bind_roots(strands.with_points(points), egg, place="test").strands.is_bound


def test_no_strands_bind_and_no_faces_are_reported(egg: Surface) -> None:
    strands = hair_on(egg, 3)
    none = bind_roots(strands.take(np.zeros(0, np.int64)), egg, place="test").strands
    assert none.is_bound
    frames = frames_of(none, egg.positions, egg)
    assert followed(none, frames, frames).shape[0] == 0
    with pytest.raises(HairloomError, match="no faces"):
        bind_roots(strands, Surface(egg.positions, np.zeros((0, 3))), place="test")


def test_sintel_binds_as_its_readme_says(shared_data: Path) -> None:
    """Roots lie 0.37 mm (median) to 6.2 mm (maximum) from the head."""
    data = (shared_data / "sintel/SintelHairOriginal-sintel_hair.16points.tfx").read_bytes()
    start = int(np.frombuffer(data, np.uint32, 1, 12)[0])
    points = np.frombuffer(data, np.float32, 11400 * 16 * 4, start).reshape(-1, 4)[:, :3]
    strands = StrandSet(points, np.arange(11401) * 16, np.full(182400, 4e-5), np.zeros(11400))
    positions, triangles = [], []
    for line in (shared_data / "sintel/sintel.obj").read_text().splitlines():
        if line.startswith("v "):
            positions.append([float(word) for word in line.split()[1:4]])
        elif line.startswith("f "):
            face = [int(word.split("/")[0]) - 1 for word in line.split()[1:]]
            triangles += [(face[0], b, c) for b, c in pairwise(face[1:])]
    bound = bind_roots(strands, Surface(positions, triangles), place="sintel")
    assert np.median(bound.distance) == pytest.approx(0.37e-3, abs=0.01e-3)
    assert bound.distance.max() == pytest.approx(6.2e-3, abs=0.1e-3)
