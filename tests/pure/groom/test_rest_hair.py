"""Hair that is stored on the undeformed surface, and transferred to the posed one."""

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.groom.rest_hair import RestHair, carry_with_surface
from hairloom.addon.groom.roots import bind_roots
from hairloom.addon.strands import StrandSet, Surface


def turned(points, angle=0.7, shift=(0.0, 0.0, 0.0)):
    """Points turned by an angle around y."""
    c, s = np.cos(angle), np.sin(angle)
    return (points @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) + shift).astype(
        np.float32
    )


@pytest.fixture
def ball():
    """A unit ball of quads, with UVs from longitude and latitude."""
    v, u = (each.ravel() for each in np.meshgrid(np.linspace(0.1, 3.0, 20), np.arange(30) * 0.2))
    points = np.column_stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)])
    column, row = (each.ravel() for each in np.meshgrid(np.arange(29), np.arange(19)))
    a = column * 20 + row
    triangles = np.concatenate(
        [np.column_stack([a, a + 1, a + 20]), np.column_stack([a + 1, a + 21, a + 20])]
    )
    uv = np.column_stack([u, v]).astype(np.float32) / 6.0
    return Surface(points, triangles, uv[triangles])


@pytest.fixture
def hair(ball):
    """Curved strands on some of the ball's faces, with their root UVs."""
    faces = np.arange(0, len(ball.triangles), 7)
    roots = ball.corners[faces].mean(axis=1)
    along = np.linspace(0.0, 0.4, 5)[None, :, None]
    points = roots[:, None] * (1.0 + along) + (0.0, 0.2, 0.0) * along**2
    offsets = np.arange(len(faces) + 1) * 5
    strands = StrandSet(
        points.reshape(-1, 3), offsets, np.full(len(faces) * 5, 1e-3), np.zeros(len(faces))
    )
    return replace(strands, root_uv=ball.corner_uv[faces].mean(axis=1))


def test_a_turn_in_place_turns_the_hair(ball, hair):
    """All roots lie on the turned ball as well, so that only UVs show the turn."""
    posed = replace(ball, positions=turned(ball.positions))
    found = RestHair.find(hair, [ball], posed)
    assert found is not None and found.surface is ball and found.strands is hair
    assert found.on(posed).points == pytest.approx(turned(hair.points), abs=1e-5)


def test_far_away_it_is_reported_without_uvs(ball, hair):
    shift = (5.0, 0.0, 1.0)
    posed = replace(ball, positions=turned(ball.positions, 0.7, shift))
    found = RestHair.find(replace(hair, root_uv=None), [ball], posed)
    assert found is not None
    assert found.on(posed).points == pytest.approx(turned(hair.points, 0.7, shift), abs=1e-5)


def test_hair_that_stands_on_the_posed_surface_stays(ball, hair):
    """A modifier of Blender has moved it there, or it has grown there."""
    posed = replace(ball, positions=turned(ball.positions))
    there = hair.with_points(turned(hair.points))
    assert RestHair.find(there, [ball], posed) is None
    assert RestHair.find(replace(there, root_uv=None), [ball], posed) is None


def test_what_is_not_posed_is_left_alone(ball, hair):
    assert RestHair.find(hair, [ball], ball) is None
    bit = replace(ball, positions=ball.positions * np.float32(1.00001))
    assert RestHair.find(hair, [ball], bit) is None
    large = replace(ball, positions=ball.positions * np.float32(1.01))
    assert RestHair.find(hair, [ball], large) is not None
    assert RestHair.find(hair, [ball], large, min_deformation=0.1) is None


def test_a_surface_that_swells_lifts_its_hair(ball, hair):
    """The UVs of the nearest points stay the same, so that only the distance shows it."""
    posed = replace(ball, positions=ball.positions * np.float32(1.1))
    found = RestHair.find(hair, [ball], posed)
    assert found is not None
    assert bind_roots(found.on(posed), posed, place="").distance.max() < 1e-5


def test_a_part_that_is_posed_elsewhere_moves_no_hair(ball, hair):
    below = ball.positions[:, 2] < -0.5
    posed = replace(ball, positions=ball.positions - np.float32(0.5) * below[:, None])
    on_top = hair.take(np.flatnonzero(hair.roots[:, 2] > 0.0))
    assert RestHair.find(on_top, [ball], posed) is None


def test_other_triangles_and_no_strands_are_none(ball, hair):
    posed = replace(ball, positions=turned(ball.positions))
    fewer = replace(posed, triangles=posed.triangles[1:], corner_uv=posed.corner_uv[1:])
    assert RestHair.find(hair, [ball], fewer) is None
    assert RestHair.find(hair.take(np.zeros(0, int)), [ball], posed) is None


def test_of_several_that_one_counts_on_which_the_roots_stand(ball, hair):
    """A face that is deformed by a shape key and turned by an armature."""
    formed = replace(ball, positions=ball.positions * np.float32([1.3, 1.0, 0.9]))
    posed = replace(ball, positions=turned(formed.positions))
    there = carry_with_surface(hair, ball, formed)
    for strands in (there, replace(there, root_uv=None)):
        found = RestHair.find(strands, [ball, formed], posed)
        assert found is not None and found.surface is formed
    assert RestHair.find(there, [ball, formed], formed) is None


def test_there_and_back_is_the_same(ball, hair):
    """Bound strands follow their triangles there and back."""
    posed = replace(ball, positions=turned(ball.positions, 1.9, (0.3, 0.0, 0.0)))
    bound = bind_roots(carry_with_surface(hair, ball, posed), posed, place="").strands
    assert carry_with_surface(bound, posed, ball).points == pytest.approx(hair.points, abs=1e-5)
