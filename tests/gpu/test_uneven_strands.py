"""Strands of few and of many points drawn together, against the same strands drawn alone, and
against the same curves with many points."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.refine.detail import PictureView, detail_factors
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.refine.smooth import points_at
from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.strand_layout import StrandLayout
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands.arc_length import uneven_length_fractions

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE, FEW, MANY = 96, 4, 128
LIGHTS = (Light.sun((0.3, 0.9, -0.4), (1.0, 0.95, 0.9), 3.0),)
TINTED = ShadingSettings(tip_tint=1.0, tip_color=(0.9, 0.1, 0.0), tint_start=0.0, tint_end=1.0)
DETAIL = DetailSettings(culling="none", lod_size=0.0)


def straight(count: int, cv_count: int, start: float = -0.4, end: float = 0.4) -> np.ndarray:
    """Upright strands side by side."""
    strands = np.zeros((count, cv_count, 3), np.float32)
    strands[..., 0] = np.linspace(start, end, count)[:, None]
    strands[..., 2] = np.linspace(-0.4, 0.4, cv_count)
    return strands


def coils(count: int, cv_count: int = MANY, turns: float = 12.0) -> np.ndarray:
    """Upright coils a little before the straight strands."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, cv_count)
    strands = straight(count, cv_count, -0.35, 0.42)
    strands[..., 0] += 0.03 * np.cos(angle)
    strands[..., 1] += 0.03 * np.sin(angle) - 0.1
    return strands


def of_grids(*grids: np.ndarray) -> dict[str, Any]:
    """A snapshot's arguments for these strands in sequence, each with its own noise and
    occlusion."""
    counts = np.concatenate([np.full(len(grid), grid.shape[1]) for grid in grids])
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    points = np.concatenate([grid.reshape(-1, 3) for grid in grids])
    return {
        "points": points,
        "radius": np.full(len(points), 4e-3, np.float32),
        "layout": StrandLayout(offsets),
        "occlusion": (0.6 + points[:, 2]).astype(np.float32),
        "seed": np.concatenate([np.arange(len(grid)) for grid in grids]),
        "color": np.abs(np.sin(40.0 * points)).astype(np.float32),
    }


def drawn(frame: Any, parts: dict[str, Any], transparency: str = "none", **more: Any) -> np.ndarray:
    camera = Camera(look_at((0.0, -2.0, 0.0), (0.0, 0.0, 0.0)), orthographic(1.0, 1.0, 0.1, 5.0))
    settings: dict[str, Any] = {
        "lights": LIGHTS,
        "ambient": (0.3, 0.3, 0.3),
        "detail": DETAIL,
        "volume": VolumeSettings(shadows="none"),
        "strand_settings": StrandSettings(transparency=transparency),
        "volume_center": np.array([0.0, 3.0, 0.0], np.float32),
        "table_size": PREVIEW_SIZE,
    }
    snapshot = Snapshot(**parts, **(settings | more))
    return np.asarray(frame.render_image(snapshot, camera, SIZE, SIZE, 2))


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The largest difference of channels in each pixel."""
    return np.asarray(np.abs(one - other).max(axis=2))


@pytest.mark.parametrize("mode", ["adaptive", "heuristic", "fixed"])
@pytest.mark.parametrize("transparency", ["none", "layers"])
def test_both_at_once_are_both_alone(frame: Any, transparency: str, mode: str) -> None:
    """For strands that do not overlap in the picture."""
    few, many = straight(9, FEW, -0.45, -0.1), coils(5) * [0.5, 1.0, 1.0] + [0.25, 0.0, 0.0]
    look = {
        "shading": replace(TINTED, color_source="own", color_variation=0.3),
        "detail": replace(DETAIL, mode=mode),
    }
    both = drawn(frame, of_grids(few, many.astype(np.float32)), transparency, **look)
    alone = [
        drawn(frame, of_grids(grid.astype(np.float32)), transparency, **look)
        for grid in (few, many)
    ]
    assert min(picture[..., 3].mean() for picture in alone) > 0.03
    assert apart(both, alone[0] + alone[1]).max() < 1.0 / 255.0


@pytest.mark.parametrize("shadows", few_in_commits(["deep", "slices"]))
@pytest.mark.parametrize("model", few_in_commits(["marschner", "kajiya_kay"]))
def test_few_points_are_the_same_curves_as_many(frame: Any, model: str, shadows: str) -> None:
    """Also in shadows of their own and of others, and with all effects that vary along strands."""
    curves = [straight(40, FEW), coils(12, turns=6.0)]
    dense = [_refined(grid, 2 * MANY - 1) for grid in curves]
    look: dict[str, Any] = {
        "shading": replace(TINTED, model=model, sparkle=0.5),
        "volume": VolumeSettings(shadows=shadows, resolution=1024, strand_fraction=1.0),
        "transparency": "layers",
        "detail": replace(DETAIL, error=0.02),
    }
    few, many = (drawn(frame, _uncolored(*grids), **look) for grids in (curves, dense))
    assert many[..., 3].mean() > 0.2
    # shadows of curls are straight between points, so their edges move a little
    assert apart(few, many).mean() < 0.01
    assert apart(_coarse(few), _coarse(many)).max() < 0.02


def _coarse(picture: np.ndarray) -> np.ndarray:
    """Means of 8 x 8 pixels."""
    return picture.reshape(SIZE // 8, 8, SIZE // 8, 8, 4).mean(axis=(1, 3))


def _refined(grid: np.ndarray, cv_count: int) -> np.ndarray:
    """The drawn curves, sampled at `cv_count` points."""
    place = np.linspace(0.0, grid.shape[1] - 1, cv_count)
    segment = np.minimum(place.astype(int), grid.shape[1] - 2)
    made = [
        points_at(grid, np.full(cv_count, strand), segment, place - segment)
        for strand in range(len(grid))
    ]
    return np.stack(made).astype(np.float32)


def _uncolored(*grids: np.ndarray) -> dict[str, Any]:
    return of_grids(*grids) | {"color": None}


@pytest.mark.parametrize("transparency", few_in_commits(["layers", "none"]))
def test_tint_and_taper_go_by_length_however_points_are_spaced(
    frame: Any, transparency: str
) -> None:
    even, uneven = straight(30, 64), straight(30, 64)
    uneven[..., 2] = 0.8 * np.linspace(0.0, 1.0, 64) ** 3 - 0.4
    look: dict[str, Any] = {"shading": TINTED, "transparency": transparency}
    look["volume"] = VolumeSettings(shadows="deep", resolution=256)
    expected = drawn(frame, _uncolored(even), **look)
    parts = _uncolored(uneven)
    assert apart(drawn(frame, parts, **look), expected).max() > 0.05, "by numbers it is another"
    along = uneven_length_fractions(parts["points"], parts["layout"].offsets)
    assert along is not None
    found = drawn(frame, parts | {"along": along}, **look)
    assert (apart(found, expected) > 0.02).mean() < 0.01


def test_uneven_pieces_are_those_of_numpy(gpu_context: Any) -> None:
    from refinement_probes import point_textures

    from hairloom.addon.render.detail_pass import DetailPass
    from hairloom.addon.render.textures import texture_to_array

    grids = [straight(50, FEW) + np.float32(0.01) * coils(50, FEW), coils(30), coils(20, 33, 3.0)]
    snapshot = Snapshot(**of_grids(*grids), detail=DETAIL)
    camera = Camera(look_at((0.3, -1.5, 0.2), (0.0, 0.0, 0.0)), perspective(0.6, 1.0, 0.1, 5.0))
    order = DetailPass().order(snapshot, point_textures(snapshot), 1, camera, (SIZE, SIZE))
    view = PictureView(camera.view, camera.projection, SIZE, SIZE)
    words = np.ascontiguousarray(texture_to_array(order.factors).reshape(-1, 4)).view(np.uint8)
    strand = wrong = 0
    for grid in grids:
        for expected in detail_factors(grid, view, DETAIL):
            first = 16 * int(snapshot.layout.spans[strand, 3])
            wrong += int((words.ravel()[first : first + len(expected)] != expected).sum())
            strand += 1
    assert wrong < 10, "but for values on the edge between two factors"
    assert sum(drawn.count for drawn in order.classes) == strand


@pytest.mark.parametrize("debug_view", ["detail", "group", "occlusion"])
def test_debug_views_know_each_strand(frame: Any, debug_view: str) -> None:
    few, many = straight(9, FEW, -0.45, -0.1), coils(4) * [0.4, 1.0, 1.0] + [0.25, 0.0, 0.0]
    grids = few, many.astype(np.float32)
    alone = [
        drawn(frame, of_grids(grid), debug_view=debug_view, group=np.arange(len(grid)))
        for grid in grids
    ]
    numbers = np.concatenate([np.arange(len(grid)) for grid in grids])
    both = drawn(frame, of_grids(*grids), debug_view=debug_view, group=numbers)
    assert apart(both, alone[0] + alone[1]).max() < 1.0 / 255.0


def test_points_and_layout_must_fit(gpu_context: Any) -> None:
    parts = of_grids(straight(3, FEW), coils(2))
    with pytest.raises(ValueError, match="radius has shape"):
        Snapshot(**(parts | {"radius": np.ones(7, np.float32)}))
    with pytest.raises(ValueError, match="points has shape"):
        Snapshot(**(parts | {"layout": StrandLayout.uniform(2, 4)}))
    with pytest.raises(ValueError, match="seed has shape"):
        Snapshot(**(parts | {"seed": np.arange(7)}))
