"""A view's cached picture is shown again without other work for the GPU."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_calls import gpu_calls
from gpu_rounding import is_same

from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 48
BACKGROUND = (0.2, 0.1, 0.0, 0.3)


@pytest.fixture(scope="module")
def scene() -> Any:
    """Two grooms of random strands before and behind a mesh."""
    random = np.random.default_rng(3)
    ends = random.uniform(-0.5, 0.5, (2, 400, 2, 3)).astype(np.float32)
    square = np.array([[-0.3, 0, -0.3], [0.3, 0, -0.3], [0.3, 0.1, 0.4]], np.float32)
    mesh = MeshSnapshot.of(Surface(square, np.array([[0, 1, 2]])))
    grooms = [Snapshot(each, np.full((400, 2), 4e-3), meshes=(mesh,)) for each in ends]
    camera = Camera(look_at((0.3, -2.0, 0.2), (0, 0, 0)), perspective(0.6, 1.0, 0.1, 5.0))
    return grooms, camera


def drawn(grooms: Any, camera: Any, draw_hair: Any) -> np.ndarray:
    """Colours and depths of a view with a mesh and then hair, (SIZE, SIZE, 5)."""
    import gpu

    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.textures import drawing_into

    color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    with drawing_into(target):
        target.clear(color=BACKGROUND, depth=1.0)
        MeshPass().draw(grooms[0], camera, SIZE, SIZE)
        draw_hair()
    pixels = np.asarray(color.read()).reshape(SIZE, SIZE, 4)
    return np.dstack([pixels, np.array(depth.read()).reshape(SIZE, SIZE, 1)])


def test_a_cached_picture_is_shown_as_it_was_drawn(frame: Any, scene: Any) -> None:
    """For two grooms with a mesh that hides some of their hair."""
    from hairloom.addon.render.cached_picture import CachedPicture
    from hairloom.addon.render.strand_pass import ViewState

    (grooms, camera), cached = scene, CachedPicture()
    passes = [frame.StrandPass() for _ in grooms]

    def draw_hair(picture: Any) -> None:
        for own, groom in zip(passes, grooms, strict=True):
            own.draw(groom, camera, SIZE, SIZE, output="viewport", view=ViewState(picture=picture))

    plain = drawn(grooms, camera, lambda: draw_hair(None))

    def draw_and_keep() -> None:
        cached.begin()
        draw_hair(cached)

    assert is_same(drawn(grooms, camera, draw_and_keep), plain), "keeping changes nothing"
    again = drawn(grooms, camera, cached.show)
    assert (again[..., 4] == plain[..., 4]).all()
    assert np.abs(again - plain).max() < 1.0 / 510.0
    empty = drawn(grooms, camera, lambda: None)
    changed = (plain != empty).any(axis=-1)
    assert changed.mean() > 0.3
    assert (again[~changed] == empty[~changed]).all()
    assert (plain[..., 4] < empty[..., 4]).any(), "hair has depths"


def test_showing_a_cached_picture_reads_nothing_and_draws_two_triangles(
    frame: Any, scene: Any
) -> None:
    from hairloom.addon.render.cached_picture import CachedPicture
    from hairloom.addon.render.strand_pass import ViewState

    (grooms, camera), cached = scene, CachedPicture()

    def keep() -> None:
        cached.begin()
        shown = ViewState(picture=cached)
        frame.StrandPass().draw(grooms[0], camera, SIZE, SIZE, output="viewport", view=shown)

    drawn(grooms, camera, keep)
    calls: list[Any] = []
    drawn(grooms, camera, lambda: calls.append(gpu_calls(cached.show)))
    assert calls == [{"draws": 2}]


def test_a_picture_matches_only_its_own_marks() -> None:
    from hairloom.addon.render.cached_picture import CachedPicture

    cached, thing = CachedPicture(), object()
    assert not cached.matches(()), "nothing is kept yet"
    cached.key = (thing, 1, (2.0, "a"))
    assert cached.matches((thing, 1, (2.0, "a")))
    for other in ((object(), 1, (2.0, "a")), (thing, 2, (2.0, "a")), (thing, 1)):
        assert not cached.matches(other)
    cached.forget()
    assert not cached.matches((thing, 1, (2.0, "a")))


def test_a_groom_in_many_lengths_takes_few_draws(frame: Any, scene: Any) -> None:
    """With three lights' maps, strands of 1 to 60 segments take at most 40 draws."""
    from hairloom.addon.render.cached_picture import CachedPicture
    from hairloom.addon.render.strand_layout import StrandLayout
    from hairloom.addon.render.strand_pass import ViewState

    grooms, camera = scene
    random = np.random.default_rng(1)
    counts = random.integers(2, 61, 300)
    points = np.cumsum(random.normal(0.0, 0.02, (counts.sum(), 3)), axis=0).astype(np.float32)
    layout = StrandLayout(np.concatenate([[0], np.cumsum(counts)]))
    groom = replace(
        grooms[0],
        points=points - points.mean(axis=0),
        radius=np.full(len(points), 2e-3, np.float32),
        layout=layout,
        along=np.concatenate([np.linspace(0.0, 1.0, count) for count in counts]).astype(np.float32),
        occlusion=None,
        lights=studio(camera),
    )
    own, cached, calls = frame.StrandPass(), CachedPicture(), []

    def draw() -> None:
        cached.begin()
        own.draw(groom, camera, SIZE, SIZE, output="viewport", view=ViewState(picture=cached))

    drawn([groom], camera, lambda: calls.append(gpu_calls(draw)))
    assert own.statistics.strands == 300 and 10 < calls[0]["draws"] <= 40


def studio(camera: Any) -> Any:
    from hairloom.addon.shading.lights import three_point_lights

    return three_point_lights(camera.view)


def turned(degrees: float) -> Any:
    angle = np.radians(degrees)
    eye = 2.0 * np.sin(angle), -2.0 * np.cos(angle), 0.2
    return Camera(look_at(eye, (0, 0, 0)), perspective(0.6, 1.0, 0.1, 5.0))


def test_shadows_lag_while_a_view_turns_and_are_exact_once_it_rests(frame: Any, scene: Any) -> None:
    grooms, _ = scene
    own, alone = frame.StrandPass(), frame.StrandPass()

    def dispatches(degrees: float, *, is_turning: bool) -> tuple[int, float]:
        groom, maps = replace(grooms[0], lights=studio(turned(degrees))), []
        calls = gpu_calls(lambda: maps.append(own.opacity(groom, view=1, is_turning=is_turning)))
        lag = np.abs(maps[0].values - alone.opacity(groom).values).max()
        return calls["dispatches"] // 3, float(lag)

    assert dispatches(0.0, is_turning=True)[0] == 3, "all maps at first"
    for degrees, count in ((1.0, 0), (5.0, 0), (12.0, 1), (13.0, 1), (13.5, 1)):
        assert dispatches(degrees, is_turning=True)[0] == count and own.needs_redraw(1)
    assert dispatches(40.0, is_turning=True) == (3, 0.0), "nor does any lag far behind"
    assert not own.needs_redraw(1)
    assert dispatches(41.0, is_turning=True)[0] == 0 and own.needs_redraw(1)
    assert dispatches(41.0, is_turning=False) == (3, 0.0)
    assert not own.needs_redraw(1)
    assert dispatches(41.0, is_turning=False)[0] == 0


def test_views_side_by_side_keep_their_own_data(frame: Any, scene: Any) -> None:
    """Two views in turn do not compute detail or draw maps again, and look as each does alone."""
    from hairloom.addon.render.strand_pass import ViewState

    grooms, _ = scene
    cameras = {name: turned(degrees) for name, degrees in (("a", 0.0), ("b", 120.0))}
    own = frame.StrandPass()

    def picture(by: Any, name: str) -> tuple[np.ndarray, Any]:
        camera, calls = cameras[name], []
        groom = replace(grooms[0], lights=studio(camera))

        def draw() -> None:
            by.draw(groom, camera, SIZE, SIZE, output="viewport", view=ViewState(name))

        found = drawn([groom], camera, lambda: calls.append(gpu_calls(draw)))
        return found, calls[0]

    alone = {name: picture(frame.StrandPass(), name)[0] for name in cameras}
    for turn in range(3):
        for name in cameras:
            found, calls = picture(own, name)
            difference = np.abs(found - alone[name]).max()
            assert difference < 1.0 / 510.0, difference
            # a barrier, the order and the shading
            assert turn == 0 or calls["dispatches"] == 3
    own.forget_views({"a"})
    assert picture(own, "a")[1]["dispatches"] == 3
    assert picture(own, "b")[1]["dispatches"] > 3


def test_views_in_the_same_light_share_its_maps(frame: Any, scene: Any) -> None:
    """Until one of them turns, and its studio lights with it."""
    grooms, camera = scene
    groom, own = replace(grooms[0], lights=studio(camera)), frame.StrandPass()
    first = own.opacity(groom, view="a")
    assert own.opacity(groom, view="b") is first
    other = replace(groom, lights=studio(turned(90.0)))
    in_turn = [(own.opacity(other, view="b"), own.opacity(groom, view="a")) for _ in range(3)]
    assert all(maps is in_turn[0][0] and cached is in_turn[0][1] for maps, cached in in_turn)
    assert (in_turn[0][1].values == first.values).all()
    assert (in_turn[0][0].values != first.values).any()
