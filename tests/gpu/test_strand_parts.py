"""Layers of strands with little memory: drawn in parts, the picture is the same and complete."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import is_same

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.strand_layout import StrandLayout
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.shading.volume.transparency import layer_fractions
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 64
#: rows of memory for few of a picture's fragments, and for all of them
FEW, MANY = 2, 3072


@pytest.fixture(scope="module")
def front(square_camera: Any) -> Any:
    """A camera along +y for x and z from 0 to SIZE, with pixels of a metre."""
    return square_camera(SIZE)


@pytest.fixture
def with_rows(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A function that makes a pass with at most this many rows of memory for lists."""
    from hairloom.addon.render import strand_pass
    from hairloom.addon.render.strand_layers import StrandLayers

    def passes(rows: int) -> Any:
        monkeypatch.setattr(strand_pass, "LAYERS_OF_PIXELS", StrandLayers(rows))
        return strand_pass.StrandPass()

    return passes


def hair(ends: np.ndarray, brightness: np.ndarray, **more: Any) -> Any:
    """Straight strands whose colour is their brightness."""
    settings = {
        "ambient": (1.0, 1.0, 1.0),
        "shading": ShadingSettings(
            model="kajiya_kay", base_color=(1.0, 1.0, 1.0), color_variation=0.0
        ),
        "strand_settings": StrandSettings(tip_width=1.0, opacity=0.6),
        "detail": DetailSettings(lod_size=0.0),
        "volume": VolumeSettings(shadows="none"),
    }
    return Snapshot(
        ends.astype(np.float32),
        np.full(ends.shape[:2], 0.4, np.float32),
        np.repeat(brightness[:, None], 2, axis=1).astype(np.float32),
        **(settings | more),
    )


def crossing(seed: int, count: int = 1500, **more: Any) -> Any:
    """Strands through the picture at all depths and angles."""
    random = np.random.default_rng(seed)
    ends = random.uniform(0.0, SIZE, (count, 2, 3))
    ends[..., 1] = random.uniform(-40.0, 40.0, (count, 2))
    return hair(ends, random.random(count), **more)


def sheets(depths: np.ndarray, opacity: float) -> Any:
    """Strands that each cover the whole picture, darker with distance."""
    ends = np.zeros((len(depths), 2, 3))
    ends[..., 0], ends[..., 1] = SIZE / 2, depths[:, None]
    ends[..., 2] = -SIZE, 2 * SIZE
    settings = StrandSettings(tip_width=1.0, opacity=opacity, fullness=500.0)
    return hair(ends, brightness_of(depths), strand_settings=settings)


def brightness_of(depths: np.ndarray) -> np.ndarray:
    return 0.9 - (depths + 40.0) / 100.0


def test_grooms_and_a_mesh_in_parts_are_the_same_picture(
    gpu_context: Any, front: Any, with_rows: Any
) -> None:
    """In a viewport of a target with existing content, where the mesh hides strands."""
    import gpu

    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.textures import drawing_into

    square = np.array([[0, 0, 0], [48, 0, 9], [48, 0, 50], [0, 0, 40]], np.float32)
    mesh = MeshSnapshot.of(Surface(square, np.array([[0, 1, 2], [0, 2, 3]])))
    grooms = [crossing(seed, meshes=(mesh,)) for seed in (1, 2)]

    def picture(rows: int) -> tuple[np.ndarray, list[int]]:
        color = gpu.types.GPUTexture((SIZE + 20, SIZE + 9), format="RGBA32F")
        depth = gpu.types.GPUTexture((SIZE + 20, SIZE + 9), format="DEPTH_COMPONENT32F")
        target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
        passes = [with_rows(rows) for _ in grooms]
        with drawing_into(target):
            target.clear(color=(0.2, 0.1, 0.0, 0.3), depth=1.0)
            gpu.state.viewport_set(13, 7, SIZE, SIZE)
            MeshPass().draw(grooms[0], front, SIZE, SIZE)
            for hair_pass, groom in zip(passes, grooms, strict=True):
                hair_pass.draw(groom, front, SIZE, SIZE)
        pixels = np.asarray(color.read()).reshape(color.height, color.width, 4)
        depths = np.array(depth.read()).reshape(color.height, color.width, 1)
        return np.dstack([pixels, depths]), [
            hair_pass.statistics.layers.parts for hair_pass in passes
        ]

    whole, at_once = picture(MANY)
    in_parts, parts = picture(FEW)
    assert at_once == [1, 1] and parts[0] > 5 and parts[1] > 1
    assert is_same(in_parts, whole)
    assert (whole[7:-2, 13:-7, 3] > 0.5).mean() > 0.9, "where the viewport is"
    assert (whole[..., :4] == np.float32([0.2, 0.1, 0.0, 0.3])).all(axis=-1).any(), "and only there"


@pytest.mark.parametrize("output", ["scene_linear", "viewport"])
def test_each_draw_is_complete_and_starts_with_the_part_count_of_the_last_one(
    gpu_context: Any, front: Any, with_rows: Any, output: str
) -> None:
    import gpu

    from hairloom.addon.render.textures import drawing_into

    shown = crossing(3)
    cvs = shown.layout.cv_count
    few = replace(
        shown,
        points=shown.points[: 40 * cvs],
        radius=shown.radius[: 40 * cvs],
        occlusion=shown.occlusion[: 40 * cvs],
        layout=StrandLayout.uniform(40, cvs),
    )
    color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))

    def picture(hair_pass: Any, groom: Any) -> np.ndarray:
        with drawing_into(target):
            target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            hair_pass.draw(groom, front, SIZE, SIZE, output=output)
        return np.array(color.read())

    hair_pass = with_rows(MANY)
    expected = [picture(hair_pass, groom) for groom in (shown, few)]
    hair_pass, parts = with_rows(FEW), []
    for number in (0, 0, 1, 1, 0):
        assert is_same(picture(hair_pass, (shown, few)[number]), expected[number])
        parts.append(hair_pass.statistics.layers.parts)
    assert parts[0] > 5 and parts == [parts[0], parts[0], 1, 1, parts[0]]


def test_no_pixel_is_without_hair_that_hashed_strands_cover(
    frame: Any, front: Any, with_rows: Any
) -> None:
    shown = crossing(4)
    layers = frame.render_image(
        shown, front, SIZE, SIZE, 1, passes=(frame.MeshPass(), with_rows(FEW))
    )
    settings = replace(shown.strand_settings, transparency="hashed")
    hashed = replace(shown, strand_settings=settings)
    samples = [
        frame.render_image(hashed, replace(front, sample=sample), SIZE, SIZE, 1)[..., 3]
        for sample in range(16)
    ]
    is_covered = np.mean(samples, axis=0) > 0.5
    assert is_covered.mean() > 0.9
    assert layers[is_covered, 3].min() > 0.1


def test_pixels_that_do_not_fit_are_drawn_by_depth(frame: Any, front: Any, with_rows: Any) -> None:
    """Against the theoretical composite of thousands of sheets, nearest first."""
    random = np.random.default_rng(5)
    depths, opacity = random.uniform(-40.0, 40.0, 5000), 4.0 / 4095.0
    hair_pass = with_rows(1)
    picture = frame.render_image(
        sheets(depths, opacity), front, 2, 1, 1, passes=(frame.MeshPass(), hair_pass)
    )
    assert hair_pass.statistics.layers.parts >= 2 * 2 and not hair_pass.statistics.notes
    through = (1.0 - opacity) ** np.arange(len(depths) + 1)
    exact = (opacity * through[:-1] * brightness_of(np.sort(depths))).sum()
    assert picture[..., 3] == pytest.approx(np.full((1, 2), 1.0 - through[-1]), abs=1e-3)
    assert picture[..., 0] == pytest.approx(np.full((1, 2), exact), abs=0.02)


def test_nearest_strands_hide_all_others_wherever_a_pixel_does_not_fit(
    frame: Any, front: Any, with_rows: Any
) -> None:
    depths = np.random.default_rng(6).permutation(np.linspace(-40.0, 40.0, 5000))
    shown = sheets(depths, 1.0)
    pictures = [
        frame.render_image(shown, front, 2, 1, 1, passes=(frame.MeshPass(), with_rows(rows)))
        for rows in (1, MANY)
    ]
    assert is_same(*pictures)
    assert pictures[0][..., 0] == pytest.approx(np.full((1, 2), 0.9), abs=2e-3)


def test_missing_fragments_are_reported(frame: Any, front: Any, with_rows: Any) -> None:
    """More fragments at one depth of one pixel than there is memory for, or than a driver can
    order."""
    from hairloom.addon.render.strand_layers import MAX_LIST_LENGTH_IN_SOFTWARE, is_software

    opacity = 4.0 / 4095.0
    for rows, room in ((1, 4096), (MANY, MAX_LIST_LENGTH_IN_SOFTWARE)):
        hair_pass, shown = with_rows(rows), sheets(np.zeros(room + 904), opacity)
        picture = frame.render_image(shown, front, 1, 1, 1, passes=(frame.MeshPass(), hair_pass))
        assert picture[0, 0, 3] == pytest.approx(1.0 - (1.0 - opacity) ** room, abs=1e-3)
        if rows == 1 or is_software():
            assert hair_pass.statistics.layers.missing == 904
            (note,) = hair_pass.statistics.notes
            assert "904" in note


def test_little_memory_makes_more_parts_and_not_a_crash(
    frame: Any, front: Any, with_rows: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    import gpu

    from hairloom.addon.render import strand_layers

    shown = crossing(7)
    expected = frame.render_image(shown, front, SIZE, SIZE, 1)
    make = gpu.types.GPUTexture

    def failing_texture(size: Any, **more: Any) -> Any:
        if more["format"] == "RGBA32UI" and size[1] > 3:
            raise RuntimeError("no memory")
        return make(size, **more)

    monkeypatch.setattr(strand_layers.gpu.types, "GPUTexture", failing_texture)
    hair_pass = with_rows(MANY)
    picture = frame.render_image(shown, front, SIZE, SIZE, 1, passes=(frame.MeshPass(), hair_pass))
    assert hair_pass.statistics.layers.parts > 3
    assert is_same(picture, expected)


@pytest.mark.parametrize("opacity", [0.003, 0.02])
def test_thousands_of_layers_in_a_pixel_are_drawn_at_once(
    frame: Any, front: Any, with_rows: Any, opacity: float
) -> None:
    """Against theory, also with a software driver, which limits a shader's iterations."""
    count = 12_000
    depths = np.linspace(-40.0, 40.0, count)
    alpha = round(opacity * 4095.0) / 4095.0  # as lists hold it
    fractions = layer_fractions(depths[None], np.full((1, count), alpha))[0]
    hair_pass = with_rows(MANY)
    shown = sheets(np.random.default_rng(9).permutation(depths), opacity)
    picture = frame.render_image(shown, front, 2, 1, 1, passes=(frame.MeshPass(), hair_pass))
    assert hair_pass.statistics.layers.parts == 1
    assert picture[..., 3] == pytest.approx(np.ones((1, 2)), abs=1e-3)
    assert picture[..., 0] == pytest.approx(
        np.full((1, 2), fractions @ brightness_of(depths)), abs=1e-3
    )


def test_long_lists_leave_nothing_unshaded(frame: Any, front: Any, with_rows: Any) -> None:
    """Thousands of white strands in a pixel are white, although drivers may abort long loops."""
    random = np.random.default_rng(8)
    depths = random.uniform(-40.0, 40.0, 20000)
    shown = replace(sheets(depths, 4.0 / 4095.0), occlusion=None)
    passes = frame.MeshPass(), with_rows(MANY)
    picture = frame.render_image(shown, front, 2, 2, 1, passes=passes)
    assert picture == pytest.approx(np.ones((2, 2, 4)), abs=2e-3)


def test_more_layers_in_a_pixel_than_a_software_driver_can_count(
    frame: Any, front: Any, with_rows: Any
) -> None:
    """20,000 very faint strands cover everything, against the theoretical composite."""
    from hairloom.addon.render.mesh_pass import MeshPass

    count, opacity = 20_000, 0.003
    depths = np.linspace(-40.0, 40.0, count)
    alpha = round(opacity * 4095.0) / 4095.0  # as lists hold it
    passes = MeshPass(), with_rows(MANY)
    picture = frame.render_image(sheets(depths, opacity), front, 1, 1, 1, passes=passes)[0, 0]
    fraction = alpha * (1.0 - alpha) ** np.arange(count)
    assert picture[3] == pytest.approx(1.0, abs=1e-3)
    # each of the eight shaded layers can represent an eighth of the light
    assert picture[:3] == pytest.approx(float(fraction @ brightness_of(depths)), abs=0.125 * 0.8)
    assert passes[1].statistics.layers.missing == 0


def test_strands_that_no_driver_orders_at_once_are_drawn_a_few_times(
    frame: Any, with_rows: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bisecting the whole depth range, most of which is empty, would need many draws."""
    from hairloom.addon.render.strand_drawing import StrandDrawing
    from hairloom.addon.render.strand_layers import is_software

    gather, draws = StrandDrawing.gather, []

    def counted(*given: Any) -> None:
        draws.append(given)
        gather(*given)

    monkeypatch.setattr(StrandDrawing, "gather", counted)
    middle = SIZE / 2
    view = look_at((middle, -2.0e4, middle), (middle, 0.0, middle))
    far_away = Camera(view, perspective(0.5 / 2.0e4, 1.0, 10.0, 1.0e5))
    passes = frame.MeshPass(), with_rows(MANY)
    shown = sheets(np.linspace(-40.0, 40.0, 20_000), 0.003)
    for at_most in (3, 2):
        draws.clear()
        picture = frame.render_image(shown, far_away, 1, 1, 1, passes=passes)
        assert len(draws) <= at_most, "of a view that is known, nothing is tried in vain"
        assert passes[1].statistics.layers.parts == (2 if is_software() else 1)
    assert picture[0, 0, 3] == pytest.approx(1.0, abs=1e-3)
    assert passes[1].statistics.layers.missing == 0
