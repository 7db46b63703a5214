"""Detail factors on the GPU against numpy, and the pictures drawn with them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refinement_probes import adaptive_points, point_textures, read_factors
from tiers import few_in_commits

from hairloom.addon.refine.culling import are_facing_away, are_hidden, hidden_regions
from hairloom.addon.refine.detail import PictureView, detail_factors
from hairloom.addon.refine.detail import stations as stations_of
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.refine.thinning import even_ranks
from hairloom.addon.render.camera import Camera, frame_camera, look_at, orthographic, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

WIDTH, HEIGHT = 320, 240
#: every strand in its own pieces, none culled
BARE = DetailSettings(culling="none", lod_size=0.0)
#: balls inside the ball of `curly`
OCCLUDER_SPHERES = np.array([[0.0, 0.0, 0.0, 0.095], [0.02, 0.0, 0.03, 0.06]], np.float32)
FIXED_64 = dataclasses.replace(BARE, mode="fixed", subdivisions=64)


def curly(strand_count: int, cv_count: int) -> np.ndarray:
    """Strands of 20 cm from a ball of 10 cm, from nearly straight to tightly curled."""
    random = np.random.default_rng(cv_count)
    out = random.normal(size=(strand_count, 1, 3))
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    fraction = np.linspace(0.0, 1.0, cv_count)[None, :, None]
    curl = random.random((strand_count, 1, 1)) * 0.04
    phase = random.random((strand_count, 1, 3)) * 7.0
    waves = (
        fraction
        * curl
        * np.sin(fraction * cv_count * random.uniform(0.3, 2.0, phase.shape) + phase)
    )
    return (out * (0.1 + 0.2 * fraction) + waves).astype(np.float32)


def snapshot_of(strands: np.ndarray, detail: DetailSettings, **more: Any) -> Any:
    """A snapshot of opaque strands, whose coverage shows their places."""
    radius = np.full(strands.shape[:2], 5e-4, np.float32)
    settings = {"strand_settings": StrandSettings(transparency="none"), **more}
    return Snapshot(strands, radius, detail=detail, **settings)


def cameras() -> dict[str, Any]:
    """Cameras far away, so near that strands pass the eye, and without perspective."""
    aspect = WIDTH / HEIGHT
    return {
        "whole": Camera(look_at((0.3, -1.0, 0.2), (0, 0, 0)), perspective(0.6, aspect, 0.1, 5.0)),
        "inside": Camera(
            look_at((0.05, -0.2, 0.05), (0, 0, 0)), perspective(0.9, aspect, 0.01, 5.0)
        ),
        "orthographic": Camera(
            look_at((0.3, -1.0, 0.2), (0, 0, 0)), orthographic(0.4, aspect, 0.1, 5.0)
        ),
    }


def computed(
    strands: np.ndarray, camera: Any, detail: DetailSettings, **more: Any
) -> tuple[np.ndarray, Any]:
    """The GPU's factors (strand_count, cv_count - 1) and its order of strands."""
    from hairloom.addon.render.detail_pass import DetailPass

    snapshot = snapshot_of(strands, detail, **more)
    order = DetailPass().order(snapshot, point_textures(snapshot), 1, camera, (WIDTH, HEIGHT))
    return read_factors(order, *strands.shape[:2]), order


@pytest.mark.parametrize("cv_count", [2, 3, 16, 17, 18, 64])
@pytest.mark.parametrize("seen", ["whole", "inside", "orthographic"])
@pytest.mark.parametrize("mode", ["adaptive", "heuristic", "fixed"])
def test_factors_and_culling_are_those_of_numpy(
    gpu_context: Any, mode: str, seen: str, cv_count: int
) -> None:
    """Except for values exactly between two factors, where rounding decides.

    The curvature of a straight segment that passes within 2 cm of the eye's plane is only rounding.
    """
    strands, camera = curly(700, cv_count), cameras()[seen]
    most = 5 if mode == "fixed" else 60  # a setting that the mode "fixed" ignores
    detail = DetailSettings(
        mode=mode, error=0.05, piece_length=2.0, subdivisions=7, max_subdivisions=most
    )
    found, order = computed(strands, camera, detail, occluder_spheres=OCCLUDER_SPHERES)
    view = PictureView(camera.view, camera.projection, WIDTH, HEIGHT)
    apart = np.abs(found - detail_factors(strands, view, detail))
    depth = strands @ view.view_projection[3, :3] + view.view_projection[3, 3]
    is_near = np.minimum(depth[:, :-1], depth[:, 1:]) < 0.02
    assert apart.max() <= 1 and (apart[~is_near] > 0).mean() < 0.001 and is_near.mean() < 0.5
    if cv_count > 2 and mode != "fixed":
        assert len(np.unique(found)) > 10, "the grooms have all kinds of segments"
    is_hidden = are_hidden(strands, hidden_regions(OCCLUDER_SPHERES, view, 0.75, 5e-4))
    assert is_hidden.any(), "some are behind the balls"
    drawn = drawn_of(order)
    assert len(np.setxor1d(drawn, np.flatnonzero(~is_hidden))) <= 1
    assert order.pieces == found[drawn].sum()


@pytest.mark.parametrize("seen", ["whole", "inside", "orthographic"])
def test_strands_that_face_away_are_those_of_numpy(gpu_context: Any, seen: str) -> None:
    strands, camera = curly(2000, 5) + np.float32(0.3), cameras()[seen]
    detail = dataclasses.replace(BARE, culling="away")
    _, order = computed(strands, camera, detail)
    roots = strands[:, 0]
    expected = ~are_facing_away(roots, roots.mean(axis=0, dtype=np.float64), camera.eye)
    assert 200 < expected.sum() < 1800
    assert len(np.setxor1d(drawn_of(order), np.flatnonzero(expected))) <= 2


def drawn_of(order: Any) -> np.ndarray:
    """The drawn strands in ascending order; within each class of the order they ascend too."""
    from hairloom.addon.render.textures import texture_to_array

    count = sum(drawn.count for drawn in order.classes)
    strands, pieces = texture_to_array(order.order).reshape(-1, 4)[:count, :2].T.astype(int)
    for drawn in order.classes:
        own = slice(drawn.first, drawn.first + drawn.count)
        assert (pieces[own] <= drawn.capacity).all() and (np.diff(strands[own]) > 0).all()
    return np.sort(strands)


def test_factors_of_more_strands_than_a_texture_has_rows(gpu_context: Any) -> None:
    strands = curly(20_000, 19)
    camera = cameras()["whole"]
    found, order = computed(strands, camera, BARE)
    expected = detail_factors(
        strands, PictureView(camera.view, camera.projection, WIDTH, HEIGHT), BARE
    )
    assert (found != expected).mean() < 0.001
    assert sum(drawn.count for drawn in order.classes) == 20_000


@pytest.mark.parametrize("cv_count", [2, 16, 40, 130])
def test_stations_are_those_of_the_cpu(
    gpu_context: Any, compute: Callable[..., np.ndarray], cv_count: int
) -> None:
    """To 1e-5 of the hair's length; stations beyond the tip are at the tip."""
    strands = curly(200, cv_count)
    camera = cameras()["inside"]
    view = PictureView(camera.view, camera.projection, WIDTH, HEIGHT)
    factors = detail_factors(strands, view, BARE)
    totals = stations_of(factors)[:, -1]
    texels = -(-(cv_count - 1) // 16)
    packed = np.ones((200, texels * 16), np.uint8)
    packed[:, : cv_count - 1] = factors
    found = compute(
        "station_points.glsl",
        (int(totals.max()) + 3, 200),
        textures={
            "cv_points": np.concatenate([strands, strands[..., :1]], axis=-1),
            "factors": packed.view(np.float32).reshape(200, texels, 4),
            "totals": np.broadcast_to(totals[:, None, None], (200, 1, 4)),
        },
        structs=("struct_view.glsl",),
    )
    corners, offsets = adaptive_points(strands, factors)
    length = np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)
    for strand, total in enumerate(totals):
        own = corners[offsets[strand] : offsets[strand + 1]]
        apart = np.linalg.norm(found[strand, : total + 1, :3] - own, axis=1)
        assert apart.max() <= 1e-5 * length[strand]
        beyond = found[strand, total + 1 :, :3] - strands[strand, -1]
        assert np.abs(beyond).max() <= 1e-5 * length[strand]


@pytest.mark.slow(instead="test_factors_and_culling_are_those_of_numpy")
@pytest.mark.parametrize("seen", few_in_commits(["whole", "inside"]))
def test_the_picture_is_that_of_sixty_four_pieces(frame: Any, seen: str) -> None:
    """Strands are within half a pixel of their places, and none is broken.

    Chords are shorter than their curves, and a ribbon narrows a little where they join: the tight
    curls of this groom lose 2.5 % of their coverage, Sintel's hair 0.1 %.
    """
    strands, camera = curly(150, 16), cameras()[seen]
    fine, adaptive, finer = (
        frame.render_image(snapshot_of(strands, detail), camera, WIDTH, HEIGHT, 4)[..., 3]
        for detail in (FIXED_64, BARE, dataclasses.replace(BARE, error=0.02))
    )
    assert fine.mean() > 0.05
    assert (fine[~around(adaptive > 0.0)] == 0.0).all()
    assert (adaptive[~around(fine > 0.0)] == 0.0).all()
    assert adaptive.mean() == pytest.approx(fine.mean(), rel=0.03)
    assert np.abs(finer - fine).mean() < 0.01 * fine.mean()


def around(pixels: np.ndarray) -> np.ndarray:
    """A mask of these pixels and their neighbours."""
    wide = np.pad(pixels, 1)
    wide = wide[:-2] | wide[1:-1] | wide[2:]
    return wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:]


def test_a_bent_ribbon_has_no_hole(frame: Any) -> None:
    """On a broad S-shaped strand, adaptive pieces cover every pixel that 64 pieces cover fully."""
    angle = np.linspace(0.0, 2.0 * np.pi, 12)
    strand = np.stack([np.sin(angle) * 0.3, 0.0 * angle, angle / 2.0 / np.pi - 0.5], axis=-1)
    strands = strand[None].astype(np.float32)
    settings = StrandSettings(fullness=40.0, tip_width=1.0, transparency="none")
    camera = Camera(look_at((0, -1, 0), (0, 0, 0)), orthographic(1.2, WIDTH / HEIGHT, 0.1, 3.0))
    fine, adaptive = (
        frame.render_image(
            snapshot_of(strands, detail, strand_settings=settings), camera, WIDTH, HEIGHT, 4
        )[..., 3]
        for detail in (FIXED_64, BARE)
    )
    assert fine.sum() > 2000.0
    inner = ~around(fine < 1.0)
    assert (adaptive[inner] == 1.0).all()
    assert (adaptive[~around(fine > 0.0)] == 0.0).all()


def test_two_views_in_turn_and_nothing_computed_twice(frame: Any, monkeypatch: Any) -> None:
    from hairloom.addon.render import detail_pass

    computations, size = [], (WIDTH // 2, HEIGHT // 2)
    classes = detail_pass.detail_classes
    monkeypatch.setattr(
        detail_pass, "detail_classes", lambda *found: computations.append(1) or classes(*found)
    )
    snapshot = snapshot_of(curly(300, 16), BARE)
    one, other = cameras()["whole"], cameras()["inside"]
    alone = [frame.render_image(snapshot, camera, *size, 1) for camera in (one, other)]
    passes = frame.MeshPass(), frame.StrandPass()

    def shown(snapshot: Any, camera: Any, samples: int = 1) -> tuple[np.ndarray, int]:
        computations.clear()
        picture = frame.render_image(snapshot, camera, *size, samples, passes=passes)
        return picture, len(computations)

    for _ in range(2):
        for camera, expected in zip((one, other), alone, strict=True):
            picture, count = shown(snapshot, camera)
            assert (picture == expected).all() and count == 1
    assert shown(snapshot, other)[1] == 0
    relit = dataclasses.replace(snapshot, ambient=(1.0, 1.0, 1.0))
    assert shown(relit, other)[1] == 0, "light changes no detail"
    assert shown(snapshot, other, samples=2)[1] == 0, "nor do samples"
    finer = dataclasses.replace(snapshot, detail=dataclasses.replace(BARE, error=0.1))
    assert shown(finer, other)[1] == 1
    moved = dataclasses.replace(finer, points=finer.points + np.float32(0.01))
    assert shown(moved, other)[1] == 1
    detail = DetailSettings(lod_size=1e4)
    culled = dataclasses.replace(moved, detail=detail, occluder_spheres=OCCLUDER_SPHERES[:0])
    assert shown(culled, one)[1] == 1
    for spheres in (OCCLUDER_SPHERES, OCCLUDER_SPHERES[::-1]):
        culled = dataclasses.replace(culled, occluder_spheres=spheres)
        assert shown(culled, one)[1] == 1 and shown(culled, one)[1] == 0
    for rank in (np.arange(300) / 300.0, np.arange(300)[::-1] / 300.0):
        culled = dataclasses.replace(culled, rank=rank)
        assert shown(culled, one)[1] == 1 and shown(culled, one)[1] == 0


def test_points_that_the_gpu_moves_get_new_detail(frame: Any) -> None:
    """A groom whose points come nearer in the same texture gets more pieces."""
    from hairloom.addon.groom.weights import GuideWeights
    from hairloom.addon.refine.ride import Riders
    from hairloom.addon.render.ride_pass import RidePass
    from hairloom.addon.strands import StrandSet

    grid = curly(200, 16)
    strands = StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(201) * 16,
        radius=np.full(3200, 5e-4, np.float32),
        group=np.zeros(200, np.int32),
    )
    no_guide = GuideWeights(np.zeros((200, 3), np.int32), np.zeros((200, 3), np.float32))
    riders = Riders.of(strands, strands.grid[:1], no_guide)
    ride = RidePass(strands, None, np.zeros(1, np.int32), strands.grid[:1], riders)
    snapshot = snapshot_of(grid, BARE, device_points=ride.points)
    passes, counts = (frame.MeshPass(), frame.StrandPass()), []
    for distance in (3.0, 0.0, 0.0, 3.0):
        matrix = np.eye(4)
        matrix[1, 3] = distance
        before = ride.points.serial
        ride.carry(None, matrix)
        assert ride.points.serial > before
        frame.render_image(snapshot, cameras()["whole"], WIDTH, HEIGHT, 1, passes=passes)
        counts.append(passes[1].statistics.pieces)
    assert counts[0] == counts[3] < counts[1] == counts[2]


def test_statistics_are_what_was_drawn(frame: Any) -> None:
    """Three straight strands of four segments and a bent one; two vertices per station."""
    from hairloom.addon.render.strand_pass import Statistics

    strands = np.zeros((4, 5, 3), np.float32)
    strands[..., 0] = np.arange(4)[:, None] * 0.02
    strands[..., 2] = np.linspace(0.0, 0.1, 5)
    strands[3, 2, 1] = 0.02
    camera = cameras()["whole"]

    def statistics(detail: DetailSettings, strands: np.ndarray = strands) -> Statistics:
        passes = frame.MeshPass(), frame.StrandPass()
        snapshot = snapshot_of(strands, detail)
        frame.render_image(snapshot, camera, WIDTH, HEIGHT, 1, passes=passes)
        return passes[1].statistics

    fixed = dataclasses.replace(BARE, mode="fixed", subdivisions=3, max_subdivisions=2)
    assert statistics(fixed) == Statistics(strands=4, pieces=48, vertices=4 * 26)
    bent = int(
        detail_factors(strands, PictureView(camera.view, camera.projection, WIDTH, HEIGHT), BARE)[
            3
        ].sum()
    )
    assert 4 < bent <= 32
    expected = Statistics(strands=4, pieces=12 + bent, vertices=3 * 10 + 2 * (bent + 1))
    assert statistics(BARE) == expected
    assert statistics(BARE, strands[:0]) == Statistics()


def test_detail_is_counted_in_pixels_of_the_final_picture(frame: Any) -> None:
    snapshot, camera = snapshot_of(curly(100, 16), BARE), cameras()["whole"]
    passes = frame.MeshPass(), frame.StrandPass()
    pieces = []
    for samples in (1, 3):
        frame.render_image(snapshot, camera, WIDTH, HEIGHT, samples, passes=passes)
        pieces.append(passes[1].statistics.pieces)
    assert pieces[0] == pieces[1]
    frame.render_image(snapshot, camera, WIDTH * 3, HEIGHT * 3, 1, passes=passes)
    assert passes[1].statistics.pieces > pieces[0]


@pytest.mark.slow(
    instead="tests/pure/refine/test_thinning.py::test_the_groom_covers_as_much_when_it_is_thinned"
)
def test_an_eighth_of_the_strands_covers_as_much_as_all(frame: Any, shared_data: Path) -> None:
    """For Sintel's hair, from near to far."""
    from hairloom.addon.exchange.tressfx import read_tfx

    groom = read_tfx(shared_data / "sintel" / "SintelHairOriginal-sintel_hair.16points.tfx")
    strands = groom.strands.grid
    rank = even_ranks(strands[:, 0])
    camera = frame_camera(groom.strands.bounds(), (-0.55, -1, 0.18), np.radians(30), 4 / 3)
    thinned = dataclasses.replace(BARE, lod_size=1e5, min_density=0.125)
    for height in (144, 72, 45):
        passes, covered = (frame.MeshPass(), frame.StrandPass()), []
        for detail in (BARE, thinned):
            snapshot = snapshot_of(strands, detail, rank=rank)
            picture = frame.render_image(
                snapshot, camera, height * 4 // 3, height, 4, passes=passes
            )
            covered.append(picture[..., 3].mean())
        assert passes[1].statistics.strands == len(strands) // 8
        assert 0.05 < covered[0] < 0.9
        assert covered[1] == pytest.approx(covered[0], rel=0.03)


def test_thinned_strands_are_those_of_low_rank_and_fade(gpu_context: Any) -> None:
    """As the groom gets smaller, each strand gets thinner before it disappears."""
    strands = curly(400, 5)
    rank = np.random.default_rng(7).permutation(400) / 400.0
    camera, fractions = cameras()["whole"], []
    for lod_size in (100.0, 250.0, 400.0, 1000.0):
        detail = dataclasses.replace(BARE, lod_size=lod_size)
        _, order = computed(strands, camera, detail, rank=rank)
        drawn = drawn_of(order)
        assert rank[drawn].max() < np.delete(rank, drawn).min(initial=1.0)
        fractions.append(len(drawn) / len(strands))
    assert (
        fractions[0] == 1.0 and (np.diff(fractions) <= 0.0).all() and 0.125 <= fractions[-1] < 0.5
    )


def test_an_instance_that_is_scaled_is_thinned_as_large_as_it_is(frame: Any) -> None:
    """A scaled instance, as the render engine places it, keeps the same ranks as a groom of that
    size."""
    strands, rank = curly(400, 5), np.random.default_rng(7).permutation(400) / 400.0
    detail, camera = dataclasses.replace(BARE, lod_size=1000.0), cameras()["whole"]
    small = snapshot_of(strands * np.float32(0.2), detail, rank=rank)
    small = dataclasses.replace(small, radius=small.radius * np.float32(0.2))
    large = snapshot_of(strands, detail, rank=rank)

    def drawn(passes: Any, snapshot: Any) -> int:
        frame.render_image(snapshot, camera, WIDTH, HEIGHT, 1, passes=passes)
        return int(passes[1].statistics.strands)

    fresh = [drawn((frame.MeshPass(), frame.StrandPass()), each) for each in (small, large)]
    assert fresh[0] < fresh[1]
    passes = frame.MeshPass(), frame.StrandPass()
    assert [drawn(passes, each) for each in (small, large, small)] == [*fresh, fresh[0]]


def head_of_hair(detail: DetailSettings) -> Any:
    """A ball with short and long curly hair all around, and the occluder spheres inside it."""
    around, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 49), np.linspace(0.0, np.pi, 25))
    positions = 0.1 * np.stack(
        [np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1
    )
    corner = (np.arange(24)[:, None] * 49 + np.arange(48)).ravel()
    quads = corner[:, None] + np.array([0, 49, 50, 1])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    ball = Surface(positions.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32))
    strands = curly(1000, 8)
    strands[::2] = strands[::2, :1] + (strands[::2] - strands[::2, :1]) * np.float32(0.3)
    return snapshot_of(
        strands,
        detail,
        meshes=(MeshSnapshot.of(ball),),
        lights=three_point_lights(cameras()["whole"].view),
        occluder_spheres=np.array([[0.0, 0.0, 0.0, 0.098]], np.float32),
    )


@pytest.mark.parametrize("seen", few_in_commits(["inside", "whole", "orthographic"]))
@pytest.mark.parametrize("mode", few_in_commits(["adaptive", "fixed"]))
def test_hidden_strands_change_no_pixel(frame: Any, mode: str, seen: str) -> None:
    camera, pictures, strands = cameras()[seen], [], []
    for culling in ("none", "hidden"):
        passes = frame.MeshPass(), frame.StrandPass()
        snapshot = head_of_hair(dataclasses.replace(BARE, mode=mode, culling=culling))
        pictures.append(frame.render_image(snapshot, camera, 160, 120, 1, passes=passes))
        strands.append(passes[1].statistics.strands)
    assert (pictures[0] == pictures[1]).all()
    assert strands[0] == 1000 and strands[1] < 950


def test_all_strands_may_be_hidden(frame: Any) -> None:
    """Then the picture is empty, without an error."""
    strands = np.zeros((5, 3, 3), np.float32)
    strands[:, :, 1] = [0.5, 0.6, 0.7]
    passes = frame.MeshPass(), frame.StrandPass()
    snapshot = snapshot_of(
        strands,
        DetailSettings(),
        occluder_spheres=np.array([[0.0, 0.0, 0.0, 0.3]], np.float32),
    )
    camera = Camera(look_at((0.0, -1.0, 0.0), (0, 0, 0)), perspective(0.6, 1.0, 0.1, 5.0))
    assert not frame.render_image(snapshot, camera, 30, 30, 1, passes=passes).any()
    assert passes[1].statistics.strands == 0


def test_snapshots_refuse_detail_that_does_not_fit() -> None:
    strands = curly(3, 4)
    for name, value in (
        ("guide", np.zeros(2, int)),
        ("group", np.zeros((3, 1), int)),
        ("rank", np.zeros(4)),
        ("occluder_spheres", np.zeros((1, 3))),
        ("occluder_spheres", np.zeros(4)),
        ("debug_view", "pieces"),
    ):
        with pytest.raises(ValueError, match=name):
            snapshot_of(strands, BARE, **{name: value})
