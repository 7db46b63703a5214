"""Drawn pictures against brute force, the Python reference, and each other."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from gpu_rounding import is_same, tolerance
from tiers import few_in_commits

from hairloom.addon.render.camera import Camera, frame_camera, look_at, orthographic, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.strand_layout import StrandLayout
from hairloom.addon.shading.kajiya_kay import kajiya_kay, strand_base, strand_normal
from hairloom.addon.shading.lights import Light, light_at, light_irradiance
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

PLAIN = ShadingSettings(
    model="kajiya_kay",
    base_color=(1.0, 1.0, 1.0),
    primary_strength=0.0,
    secondary_strength=0.0,
    shift_noise=0.0,
    color_variation=0.0,
)
RIBBON = StrandSettings(fullness=1.0, tip_width=1.0, minimum_width=0.0)


@pytest.fixture(scope="module")
def front() -> Any:
    """An orthographic camera that shows x and z from 0 to 1 and looks along +y."""
    return Camera(look_at((0.5, -1.0, 0.5), (0.5, 0.0, 0.5)), orthographic(1.0, 1.0, 0.0, 3.0))


def uprights(x: np.ndarray, radius: float, y: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertical strands of two points from z = 0 to 1 at these x."""
    strands = np.zeros((len(x), 2, 3), np.float32)
    strands[..., 0], strands[..., 1], strands[:, 1, 2] = x[:, None], y, 1.0
    return strands, np.full((len(x), 2), radius, np.float32)


def test_a_pixel_has_the_colour_of_the_reference(frame: Any) -> None:
    """One broad ribbon: positions, tangents, noise, lights and settings in the shader are right."""
    strand = np.array([[[-0.1, 0.0, 0.0], [0.1, 0.0, 0.02]]], np.float32)
    radius, occlusion = np.full((1, 2), 0.05, np.float32), np.array([[0.4, 0.8]], np.float32)
    shading = ShadingSettings(model="kajiya_kay", noise_cells=7.0)
    lights = (
        Light.sun((0.2, 0.7, -1.0), (1.0, 0.9, 0.8), 3.0),
        Light.point((0.3, -0.4, 0.5), (0.5, 0.7, 1.0), 8.0),
    )
    center, ambient = np.array([0.0, 0.5, -0.3], np.float32), (0.1, 0.2, 0.3)
    snapshot = Snapshot(
        strand,
        radius,
        occlusion,
        seed=np.array([4711]),
        lights=lights,
        ambient=ambient,
        shading=shading,
        strand_settings=RIBBON,
        volume=VolumeSettings(shadows="none"),
        volume_center=center,
    )
    eye = np.array([0.05, -0.6, 0.2])
    camera = Camera(look_at(eye, (0, 0, 0)), perspective(0.6, 1.0, 0.1, 5.0))
    picture = frame.render_image(snapshot, camera, 301, 301, 1)

    from hairloom.addon.shading.strand_noise import strand_noise

    for along in (0.2, 0.5, 0.77):
        point = strand[0, 0] + along * (strand[0, 1] - strand[0, 0]).astype(np.float64)
        clip = camera.projection @ camera.view @ [*point, 1.0]
        column, row = ((clip[:2] / clip[3] + 1.0) / 2.0 * 301).astype(int)
        tangent = (strand[0, 1] - strand[0, 0]) / np.linalg.norm(strand[0, 1] - strand[0, 0])
        normal = strand_normal(point, tangent.astype(np.float64), center)
        to_eye = (eye - point) / np.linalg.norm(eye - point)
        seed = np.array(4711)
        noises = [strand_noise(seed, c, np.array(along * 7.0)) for c in range(2)]
        light = np.array(ambient)
        for lamp in lights:
            lit = kajiya_kay(tangent, normal, light_at(lamp, point)[0], to_eye, *noises, shading)
            light = light + light_irradiance(lamp, point) / np.pi * lit
        own = [strand_noise(seed, c, np.array(0.0)) for c in (2, 3)]
        base = strand_base(np.array(along), *own, shading)
        expected = light * base * (0.4 + along * 0.4)
        assert picture[row, column, :3] == pytest.approx(expected, rel=0.02)
        assert picture[row, column, 3] == 1.0


def hairy_sphere(**shading: float) -> Any:
    """A unit sphere with hair down its meridians, and a sun behind the eye at the same height."""
    around = np.radians(np.arange(0.0, 360.0, 0.6))[:, None]
    polar = np.radians(np.linspace(20.0, 160.0, 24))[None, :]
    strands = np.stack(
        [
            np.sin(polar) * np.cos(around),
            np.sin(polar) * np.sin(around),
            np.cos(polar) + 0 * around,
        ],
        axis=-1,
    ).astype(np.float32)
    values = PLAIN.as_dict() | {"primary_color": (1.0, 1.0, 1.0), "primary_exponent": 120.0}
    return Snapshot(
        strands,
        np.full(strands.shape[:2], 0.012, np.float32),
        lights=(Light.sun((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 3.0),),
        ambient=(0.0, 0.0, 0.0),
        shading=ShadingSettings(**(values | shading)),
        strand_settings=RIBBON,
        volume=VolumeSettings(shadows="none"),
        volume_center=np.zeros(3, np.float32),
    )


@pytest.mark.parametrize("shift", few_in_commits([0.3, 0.15, 0.0, -0.15, -0.3]))
def test_positive_shift_moves_the_highlight_to_the_tips(frame: Any, shift: float) -> None:
    """With roots at the top and tips at the bottom, the band moves down by atan(shift)."""
    camera = Camera(look_at((0.0, -5.0, 0.0), (0.0, 0.0, 0.0)), orthographic(2.2, 1.0, 1.0, 9.0))
    rows = (np.arange(150) + 0.5) / 150 * 2.2 - 1.1
    lit = hairy_sphere(primary_strength=4.0, primary_shift=shift)
    matt = hairy_sphere()
    middle = slice(70, 80)
    band = frame.render_image(lit, camera, 150, 150, 2)[:, middle, 1].mean(axis=1)
    band -= frame.render_image(matt, camera, 150, 150, 2)[:, middle, 1].mean(axis=1)
    # The diffuse term dims the highlight towards the shadow and moves its peak a little.
    height = np.arcsin(rows[band.argmax()])
    assert height == pytest.approx(-np.arctan(shift), abs=0.03)


def test_a_mesh_hides_what_is_behind_it_only(frame: Any, front: Any) -> None:
    """Strands before and behind a square over the left half."""
    square = np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0, 1], [0, 0, 1]], np.float32)
    blue = MeshSnapshot.of(Surface(square, np.array([[0, 1, 2], [0, 2, 3]])), color=(0.0, 0.0, 1.0))
    mesh = dataclasses.replace(blue, specular=0.0)
    x = np.array([0.1, 0.3, 0.6, 0.8])
    strands, radius = uprights(x, 0.02)
    strands[[0, 2], :, 1], strands[[1, 3], :, 1] = -0.5, 0.5
    snapshot = Snapshot(
        strands,
        radius,
        meshes=(mesh,),
        ambient=(1.0, 1.0, 1.0),
        shading=dataclasses.replace(PLAIN, base_color=(1.0, 0.0, 0.0)),
        strand_settings=RIBBON,
    )
    picture = frame.render_image(snapshot, front, 100, 100, 1)
    middle = picture[50]
    assert middle[10].tolist() == [1.0, 0.0, 0.0, 1.0], "before the square"
    assert middle[30].tolist() == [0.0, 0.0, 1.0, 1.0], "behind the square"
    assert middle[60].tolist() == [1.0, 0.0, 0.0, 1.0] == middle[80].tolist(), "beside it"
    assert middle[70].tolist() == [0.0, 0.0, 0.0, 0.0], "nothing"


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_both_sides_of_a_mesh_are_lit_alike(frame: Any, front: Any, side: float) -> None:
    """A square at 45 degrees whose normal points away from or to the eye, lit from the front."""
    corners = np.array([[0, -0.5, 0], [1, -0.5, 0], [1, 0.5, 1], [0, 0.5, 1]], np.float32)
    square = Surface(corners, np.array([[0, 1, 2], [0, 2, 3]])[:, :: int(side)])
    normals = square.vertex_normals()
    assert np.sign(normals[0, 1]) == -side
    snapshot = Snapshot(
        np.zeros((0, 2, 3), np.float32),
        np.zeros((0, 2), np.float32),
        meshes=(MeshSnapshot(square, normals, (0.8, 0.5, 0.2), specular=0.0),),
        lights=(Light.sun((0.0, 1.0, -1.0), (1.0, 1.0, 1.0), 3.0),),
        ambient=(0.0, 0.0, 0.0),
    )
    seen = frame.render_image(snapshot, front, 16, 16, 1)[8, 8, :3]
    np.testing.assert_allclose(seen, np.array([0.8, 0.5, 0.2]) * 3.0 / np.pi, rtol=1e-3)


def test_more_strands_than_a_texture_has_rows(frame: Any) -> None:
    """20,000 strands, each in its own cell and with a brightness that identifies it."""
    columns, rows = 200, 100
    x, z = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    strands = np.zeros((columns * rows, 3, 3), np.float32)
    strands[..., 0] = x.reshape(-1, 1)
    strands[..., 2] = z.reshape(-1, 1) + np.array([-0.004, 0.0, 0.004])
    occlusion = np.repeat(((np.arange(len(strands)) % 977) / 977)[:, None], 3, axis=1)
    snapshot = Snapshot(
        strands,
        np.full(strands.shape[:2], 0.0015, np.float32),
        occlusion.astype(np.float32),
        ambient=(1.0, 1.0, 1.0),
        shading=PLAIN,
        strand_settings=RIBBON,
    )
    camera = Camera(look_at((0.5, -1.0, 0.5), (0.5, 0.0, 0.5)), orthographic(1.0, 1.0, 0.0, 3.0))
    picture = frame.render_image(snapshot, camera, columns * 5, rows * 5, 1)
    middle = picture[2::5, 2::5]
    assert (middle[..., 3] == 1.0).all()
    assert np.abs(middle[..., 0].ravel() - occlusion[:, 0]).max() < 1e-5
    assert (picture[:, 0::5, 3] == 0.0).all(), "the gaps between the cells stay empty"


def test_more_strands_than_a_texture_can_hold() -> None:
    from hairloom.addon.render.strand_layout import strand_rows

    too_many = np.broadcast_to(np.float32(0.0), (16384 * 600, 30, 4))
    with pytest.raises(ValueError, match="do not fit"):
        strand_rows(too_many)


def test_no_strands_leave_the_background(frame: Any, front: Any) -> None:
    none = Snapshot(np.zeros((0, 4, 3), np.float32), np.zeros((0, 4), np.float32))
    background = (0.25, 0.5, 0.75, 1.0)
    picture = frame.render_image(none, front, 8, 6, 2, background=background)
    assert picture.shape == (6, 8, 4) and picture.dtype == np.float32
    assert (picture == np.array(background, np.float32)).all()


def test_two_frames_are_identical_and_passes_may_be_kept(frame: Any) -> None:
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass

    snapshot = hairy_sphere(primary_strength=2.0)
    moved = dataclasses.replace(snapshot, points=snapshot.points * np.float32(0.5))
    camera = frame_camera((np.full(3, -1.0), np.full(3, 1.0)), (0.2, -1, 0.3), np.radians(30), 1.0)
    first = frame.render_image(snapshot, camera, 120, 120)
    assert is_same(frame.render_image(snapshot, camera, 120, 120), first)
    passes = MeshPass(), StrandPass()
    for shown in (moved, snapshot):
        kept = frame.render_image(shown, camera, 120, 120, passes=passes)
    assert is_same(kept, first), "the points that moved were uploaded again"
    small = frame.render_image(moved, camera, 120, 120, passes=passes)
    assert 0.1 < (small[..., 3].sum() / first[..., 3].sum()) < 0.5


def test_points_on_the_gpu_look_like_uploaded_ones(frame: Any) -> None:
    """Bit for bit at rest; in nearly all pixels when turned, since rounding moves edges by 1e-7
    m."""
    from hairloom.addon.groom.weights import GuideWeights
    from hairloom.addon.refine.ride import Riders
    from hairloom.addon.render.ride_pass import RidePass
    from hairloom.addon.render.strand_pass import StrandPass
    from hairloom.addon.strands import StrandSet

    sphere = hairy_sphere(primary_strength=2.0)
    count, cv_count = sphere.strand_count, sphere.layout.cv_count
    strands = StrandSet(
        points=sphere.points,
        offsets=np.arange(count + 1) * cv_count,
        radius=sphere.radius.ravel(),
        group=np.zeros(count, np.int32),
    )
    no_guide = GuideWeights(np.zeros((count, 3), np.int32), np.zeros((count, 3), np.float32))
    riders = Riders.of(strands, strands.grid[:1], no_guide)
    ride = RidePass(strands, None, np.zeros(1, np.int32), strands.grid[:1], riders)
    turn = np.eye(4)
    turn[:3, :3] = [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]
    camera = frame_camera((np.full(3, -1.0), np.full(3, 1.0)), (0.2, -1, 0.3), np.radians(30), 1.0)
    passes = frame.MeshPass(), StrandPass()
    for matrix, largest, share in (
        (np.eye(4), tolerance(0.0, 1.0e-6), 0.0),
        (turn, 1.0e-3, 1.0e-3),
    ):
        ride.carry(None, matrix)
        moved = (sphere.points @ matrix[:3, :3].T).astype(np.float32)
        on_gpu = dataclasses.replace(sphere, device_points=ride.points)
        uploaded = dataclasses.replace(sphere, points=moved)
        pictures = [
            frame.render_image(shown, camera, 200, 200, 1, passes=passes)
            for shown in (uploaded, on_gpu, uploaded)
        ]
        assert is_same(pictures[0], pictures[2]), "the array is uploaded again after the texture"
        apart = np.abs(pictures[1] - pictures[0]).max(axis=-1)
        assert (apart > largest).mean() <= share
    assert np.abs(on_gpu.center - uploaded.center).max() < 1e-6
    assert pictures[0][..., 3].mean() > 0.3


def test_points_on_the_gpu_that_do_not_fit_or_are_gone_are_refused(frame: Any, front: Any) -> None:
    from hairloom.addon.render.shader_source import ShaderError
    from hairloom.addon.render.snapshot import DevicePoints

    strands, radius = uprights(np.array([0.5, 0.6]), 0.1)
    with pytest.raises(ValueError, match="device_points"):
        Snapshot(strands, radius, device_points=DevicePoints(StrandLayout.uniform(3, 2)))
    gone = Snapshot(strands, radius, device_points=DevicePoints(StrandLayout.uniform(2, 2)))
    with pytest.raises(ShaderError, match="released"):
        frame.render_image(gone, front, 8, 8)


def test_thin_opaque_strands_get_the_minimum_width(frame: Any, front: Any) -> None:
    """Widths are in pixels of the final picture, whatever the number of samples."""
    strands, radius = uprights(np.array([0.25, 0.75]), 1e-6)
    for samples, width in ((1, 2.0), (4, 0.5), (4, 1.0)):
        settings = dataclasses.replace(RIBBON, minimum_width=width, transparency="none")
        snapshot = Snapshot(strands, radius, strand_settings=settings)
        drawn = frame.render_image(snapshot, front, 40, 40, samples)[..., 3]
        assert drawn.sum(axis=1) == pytest.approx(np.full(40, 2.0 * width))


@pytest.mark.parametrize("transparency", ["none", "layers"])
def test_strands_are_as_wide_where_pixels_are_not_square(
    frame: Any, front: Any, transparency: str
) -> None:
    """Upright, lying and oblique strands cover the same fraction of a picture with half the
    columns."""
    settings = dataclasses.replace(RIBBON, transparency=transparency)
    for direction in ((0.0, 0.0, 0.6), (0.6, 0.0, 0.0), (0.4, 0.0, 0.4)):
        strand = np.array([0.2, 0.0, 0.2]) + np.array([[0.0], [1.0]]) * direction
        snapshot = Snapshot(
            strand[None].astype(np.float32),
            np.full((1, 2), 0.06, np.float32),
            strand_settings=settings,
        )
        square, wide = (
            frame.render_image(snapshot, front, columns, 64, 4)[..., 3].mean()
            for columns in (64, 32)
        )
        expected = 0.12 * np.linalg.norm(direction)
        assert square == pytest.approx(expected, rel=0.05)
        assert wide == pytest.approx(expected, rel=0.05)


def test_radius_scale_and_taper(frame: Any, front: Any) -> None:
    strands, radius = uprights(np.array([0.5]), 0.05)
    settings = dataclasses.replace(RIBBON, fullness=2.0, tip_width=0.25)
    drawn = frame.render_image(
        Snapshot(strands, radius, strand_settings=settings), front, 100, 100, 4
    )[..., 3]
    width = drawn.sum(axis=1) / 100.0
    height = (np.arange(100) + 0.5) / 100.0
    assert width == pytest.approx(0.2 * (1.0 - 0.75 * height), abs=0.003)


def test_samples_are_averaged_premultiplied(frame: Any, front: Any) -> None:
    """A half-covered white pixel is half white with an alpha of 0.5, over any background."""
    strands, radius = uprights(np.array([0.25]), 0.1250)
    snapshot = Snapshot(
        strands, radius, ambient=(1.0, 1.0, 1.0), shading=PLAIN, strand_settings=RIBBON
    )
    picture = frame.render_image(snapshot, front, 4, 4, 4)
    assert picture[1, :, 3].tolist() == [0.5, 0.5, 0.0, 0.0]
    assert picture[1, :, 0].tolist() == [0.5, 0.5, 0.0, 0.0]
    over = frame.render_image(snapshot, front, 4, 4, 4, background=(0.0, 0.0, 1.0, 1.0))
    assert over[1, 0].tolist() == [0.5, 0.5, 1.0, 1.0]


def test_impossible_sizes_are_refused(frame: Any, front: Any) -> None:
    strands, radius = uprights(np.array([0.5]), 0.1)
    for width, height, samples in ((0, 4, 1), (4, 4, 0), (9000, 4, 2)):
        with pytest.raises(ValueError, match="picture"):
            frame.render_image(Snapshot(strands, radius), front, width, height, samples)


def test_snapshots_refuse_arrays_that_do_not_fit() -> None:
    strands, radius = uprights(np.array([0.5, 0.6]), 0.1)
    with pytest.raises(ValueError, match="occlusion"):
        Snapshot(strands, radius, np.ones((2, 3)))
    with pytest.raises(ValueError, match="strands"):
        Snapshot(strands[:, :1], radius[:, :1])


def test_strands_around_and_behind_the_eye(frame: Any) -> None:
    """No strand fills the picture when hair passes through the camera."""
    strands, radius = uprights(np.array([0.0]), 0.001)
    strands[0] = [[0.02, -1.0, 0.0], [0.02, 1.0, 0.0]]
    snapshot = Snapshot(strands, radius, strand_settings=RIBBON)
    camera = Camera(look_at((0, 0, 0), (0, 1, 0)), perspective(1.0, 1.0, 0.01, 10))
    drawn = frame.render_image(snapshot, camera, 100, 100, 1)[..., 3]
    assert drawn.any() and drawn[:, :49].sum() == 0.0
    assert drawn[:44].sum() == 0.0 and drawn[56:].sum() == 0.0
