"""Moving hair is drawn without read-backs, and completely."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_calls import gpu_calls

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 128
#: the name of a view, as in the overlay
VIEW = "a view"


def curls(*, outward: float = 1.0, **more: Any) -> Any:
    """A ball with curly hair of 5 to 20 cm, only on the side of +y if `outward` is 0."""
    random = np.random.default_rng(5)
    out = random.normal(size=(1500, 1, 3))
    out[..., 1] = np.where(outward > 0.0, out[..., 1], np.abs(out[..., 1]) + 1.0)
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    along = np.linspace(0.0, 1.0, 9)[None, :, None]
    length = random.uniform(0.05, 0.2, (1500, 1, 1))
    turn = along * random.uniform(2.0, 14.0, (1500, 1, 1)) + random.uniform(0, 7, (1500, 1, 3))
    strands = out * (0.1 + length * along) + 0.02 * along * np.sin(turn)
    ball = np.array([[-0.09, 0.0, -0.09], [0.09, 0.0, -0.09], [0.0, 0.0, 0.09]], np.float32)
    settings = {
        "meshes": (MeshSnapshot.of(Surface(ball, np.array([[0, 1, 2]]))),),
        "ambient": (1.0, 1.0, 1.0),
        "shading": ShadingSettings(
            model="kajiya_kay", base_color=(1.0, 1.0, 1.0), color_variation=0.5
        ),
        "detail": DetailSettings(lod_size=0.0),
        "volume": VolumeSettings(shadows="none"),
    }
    radius = np.full(strands.shape[:2], 3e-4, np.float32)
    return Snapshot(strands.astype(np.float32), radius, **(settings | more))


def seen_from(degrees: float = 0.0, distance: float = 1.0) -> Any:
    angle = np.radians(degrees)
    eye = distance * np.sin(angle), -distance * np.cos(angle), 0.2 * distance
    return Camera(look_at(eye, (0, 0, 0)), perspective(0.6, 1.0, 0.01, 5.0))


def drawn(hair_pass: Any, groom: Any, camera: Any, **options: Any) -> Any:
    """The picture over a mesh, (SIZE, SIZE, 4), and the number of GPU calls for the hair."""
    import gpu

    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import ViewState
    from hairloom.addon.render.textures import drawing_into

    color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))

    def draw_hair() -> None:
        hair_pass.draw(
            groom, camera, SIZE, SIZE, output="viewport", view=ViewState(VIEW, **options)
        )

    with drawing_into(target):
        target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        MeshPass().draw(groom, camera, SIZE, SIZE)
        calls = gpu_calls(draw_hair)
    return np.asarray(color.read()).reshape(SIZE, SIZE, 4), calls


def moved(groom: Any, number: int) -> Any:
    return replace(groom, points=groom.points + np.float32(0.002 * number))


def test_moving_hair_does_not_wait_for_the_gpu_and_looks_as_at_rest(frame: Any) -> None:
    """While hair plays and the view turns, with or without its lights; then both rest."""
    lit = curls(lights=three_point_lights(seen_from().view), volume=VolumeSettings())
    for groom in (curls(), lit):
        hair_pass = frame.StrandPass()
        assert drawn(hair_pass, groom, seen_from(), is_moving=True)[1]["reads"] > 0
        assert not hair_pass.needs_redraw(VIEW), "nothing is known of a view before its first draw"
        for number in range(1, 4):
            now, camera = moved(groom, number), seen_from(degrees=5.0 * number)
            picture, calls = drawn(hair_pass, now, camera, is_moving=True)
            assert calls["reads"] == 0 and calls["draws"] > 0 and hair_pass.needs_redraw(VIEW)
            expected, _ = drawn(frame.StrandPass(), now, camera)
            assert np.abs(picture - expected).max() < 1e-5 and expected[..., 3].mean() > 0.1
        picture, calls = drawn(hair_pass, now, camera)
        assert np.abs(picture - expected).max() < 1e-5 and calls["reads"] > 0
        assert not hair_pass.needs_redraw(VIEW)
    away = Camera(look_at((0, -1, 0), (0, -2, 0)), seen_from().projection)
    assert not drawn(hair_pass, groom, away, is_moving=True)[0].any(), "and behind the eye"


def test_a_view_that_turns_is_as_bright_and_covers_as_much(frame: Any) -> None:
    """With three layers instead of eight, at other places in each pixel."""
    from hairloom.addon.render.strand_layers import LAYERS_OF_PIXELS

    hair_pass, groom = frame.StrandPass(), curls()
    drawn(hair_pass, groom, seen_from())
    camera, seen = seen_from(degrees=3.0), []
    picture, calls = drawn(hair_pass, groom, camera, is_moving=True, is_turning=True)
    seen.append(int(np.asarray(LAYERS_OF_PIXELS._count.read()).ravel()[2]))
    expected, _ = drawn(hair_pass, groom, camera)
    seen.append(int(np.asarray(LAYERS_OF_PIXELS._count.read()).ravel()[2]))
    assert calls["reads"] == 0 and 0 < seen[0] < 0.8 * seen[1]
    assert np.abs(picture - expected)[..., 3].max() < 1e-5
    assert picture[..., 1].mean() == pytest.approx(expected[..., 1].mean(), rel=0.02)
    assert np.abs(blurred(picture - expected)).max() < 0.05


def test_other_strands_are_counted_first(frame: Any) -> None:
    """Other strands, or more pieces: counts from before do not apply."""
    hair_pass, groom = frame.StrandPass(), curls()
    drawn(hair_pass, groom, seen_from())
    fewer = Snapshot(groom.points[:900].reshape(100, 9, 3), np.full((100, 9), 3e-4))
    finer = replace(groom, detail=replace(groom.detail, error=0.05))
    for other in (fewer, finer):
        assert drawn(hair_pass, other, seen_from(), is_moving=True)[1]["reads"] > 0


def test_a_jump_coarsens_strands_and_loses_none(frame: Any, monkeypatch: Any) -> None:
    """All were hidden by the head, and the view jumps to their side and much nearer."""
    from hairloom.addon.render.rest_counts import RestCounts

    spheres = np.array([[0.0, 0.0, 0.0, 0.098]], np.float32)
    detail = DetailSettings(lod_size=0.0, culling="hidden")
    groom = curls(outward=0.0, detail=detail, occluder_spheres=spheres)
    hair_pass = frame.StrandPass()
    drawn(hair_pass, groom, seen_from(distance=3.0))
    before = hair_pass.statistics
    camera = seen_from(degrees=180.0, distance=0.7)
    # the number of slots does not adapt to the distance either
    monkeypatch.setattr(RestCounts, "slots_at", lambda self, _: len(groom.roots))
    picture, calls = drawn(hair_pass, groom, camera, is_moving=True)
    still = frame.StrandPass()
    expected, _ = drawn(still, groom, camera)
    assert calls["reads"] == 0
    assert still.statistics.strands > 1.3 * before.strands
    assert still.statistics.pieces > 2 * before.pieces
    counts = hair_pass._views[VIEW].detail._rest_counts
    assert still.statistics.pieces > len(groom.roots) * counts.slot_pieces
    assert np.abs(picture - expected).max() > 0.01, "it is coarser"
    assert picture[..., 3].sum() == pytest.approx(expected[..., 3].sum(), rel=0.05)
    assert np.abs(blurred(picture - expected)).max() < 0.1


def blurred(picture: np.ndarray) -> np.ndarray:
    """Means of 8 x 8 pixels."""
    return picture.reshape(SIZE // 8, 8, SIZE // 8, 8, -1).mean(axis=(1, 3))


@pytest.mark.parametrize("radius, rows", [(1e-4, 14), (2e-3, 25)])
def test_fragments_that_do_not_fit_are_compensated_by_width(
    frame: Any, monkeypatch: Any, radius: float, rows: int
) -> None:
    """With memory for two thirds of the expected fragments, fewer but wider strands are drawn."""
    from hairloom.addon.render import strand_pass
    from hairloom.addon.render.strand_layers import StrandLayers

    layers, room = StrandLayers(rows), rows * 4096
    monkeypatch.setattr(strand_pass, "LAYERS_OF_PIXELS", layers)
    groom = curls()
    groom = replace(groom, radius=np.full_like(groom.radius, radius))
    far, near = seen_from(distance=8.0), seen_from(distance=0.7)
    hair_pass = frame.StrandPass()
    drawn(hair_pass, groom, far)
    picture, calls = drawn(hair_pass, groom, near, is_moving=True)
    counted = int(np.asarray(layers._count.read()).ravel()[0])
    assert calls["reads"] == 0 and 0.5 * room < counted <= room
    expected, _ = drawn(hair_pass, groom, near)
    assert hair_pass._views[VIEW].part_count > 1, "at rest it is drawn in parts"
    assert picture[..., 3].mean() == pytest.approx(expected[..., 3].mean(), rel=0.05)
    picture, expected = blurred(picture)[..., 3], blurred(expected)[..., 3]
    assert np.abs(picture - expected).mean() < 0.1
    assert picture[expected > 0.5].min() > 0.15, "no place is bald"


@pytest.mark.parametrize("fullness", [0.2, 1.0, 20.0])
def test_no_more_fragments_come_than_were_expected(frame: Any, fullness: float) -> None:
    """From far away and so near that strands pass the eye; the estimate is not much too high."""
    from hairloom.addon.render.strand_layers import LAYERS_OF_PIXELS

    groom = replace(
        curls(), meshes=(), strand_settings=StrandSettings(fullness=fullness, tip_width=1.0)
    )
    for distance, max_ratio in ((5.0, 1.6), (1.0, 1.6), (0.3, 4.0)):
        hair_pass = frame.StrandPass()
        drawn(hair_pass, groom, seen_from(distance=distance))
        fragments = int(np.asarray(LAYERS_OF_PIXELS._count.read()).ravel()[0])
        expected = hair_pass._views[VIEW].detail._rest_counts.fragments
        assert fragments <= expected <= max_ratio * fragments, (distance, fragments, expected)
