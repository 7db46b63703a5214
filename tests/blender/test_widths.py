"""Widths of strands are the same in the preview, the engine, cards, bakes and every file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.cards.build import read_inputs
from hairloom.addon.blender.engine.engine_hair import read_groom
from hairloom.addon.blender.preview import previews
from hairloom.addon.card_flow import card_groom
from hairloom.addon.exchange.strand_formats import STRAND_FORMATS, StrandFormat
from hairloom.addon.exchange.strand_reading import read_strands
from hairloom.addon.shading.drawn_strands import drawn_radius
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.strands import StrandSet

COUNT, POINTS = 60, 40


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: bpy.types.Object) -> bpy.types.Object:
    """Waves with more points than are simulated, too thin for hair, so that widths are found."""
    outward = np.random.default_rng(1).normal(size=(COUNT, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, POINTS)[:, None]
    wave = 0.01 * along * np.sin(20.0 * along) * [1.0, 0.5, 0.2]
    lengths = np.linspace(0.05, 0.12, COUNT)[:, None, None]
    strands = StrandSet(
        points=(outward[:, None] * (0.1 + lengths * along) + wave).reshape(-1, 3),
        offsets=np.arange(COUNT + 1) * POINTS,
        radius=np.full(COUNT * POINTS, 1.0e-7),
        group=np.zeros(COUNT, int),
    )
    made: bpy.types.Object = new_hair(sphere, strands)
    made.data.hairloom.widths.method = "auto"
    return made


@pytest.fixture
def shown(hair: bpy.types.Object, get_depsgraph: Callable[[], Any]) -> np.ndarray:
    """The radius of each strand in the preview, the same at all its points, (COUNT,) [m]."""
    session = previews.start(hair, get_depsgraph())
    assert session.rig.widths.is_found
    radius: np.ndarray = session.rig.strands.radius.reshape(COUNT, -1)
    assert np.ptp(radius[:, 0]) > 0.0 and (radius == radius[:, :1]).all()
    return radius[:, 0].copy()


@pytest.mark.parametrize("kind", STRAND_FORMATS, ids=[each.name for each in STRAND_FORMATS])
def test_every_file_has_the_widths_of_the_preview(
    hair: bpy.types.Object, shown: np.ndarray, tmp_path: Path, kind: StrandFormat
) -> None:
    """At all points of the curves, in each engine's unit."""
    if kind.name == "usd":
        pytest.importorskip("pxr", reason="this Python has no OpenUSD")
    export = getattr(bpy.ops.hairloom, f"export_{kind.name}")
    for layout in kind.layouts:
        path = tmp_path / f"{layout.name}{kind.suffixes[0]}"
        engine = {"engine": layout.name} if "engine" in kind.options else {}
        assert export(filepath=str(path), parts="strands", **engine) == {"FINISHED"}
        read = read_strands(
            path, scale=1.0 if engine else 1.0 / layout.space.units_per_metre
        ).strands
        assert read.has_widths
        np.testing.assert_allclose(
            read.radius, np.repeat(shown, read.point_counts), rtol=1e-5, err_msg=layout.name
        )


def test_cards_are_made_of_strands_as_wide_as_the_preview_draws_them(
    hair: bpy.types.Object, shown: np.ndarray, get_depsgraph: Callable[[], Any]
) -> None:
    inputs, _, _ = read_inputs(hair, get_depsgraph())
    look = StrandSettings(fullness=1.5)
    groom = card_groom(inputs.rig, look)
    own = np.repeat(shown[:, None], groom.radius.shape[1], axis=1)
    np.testing.assert_allclose(groom.radius, drawn_radius(own, look), rtol=1e-6)
    np.testing.assert_allclose(groom.radius[:, 0], 1.5 * shown, rtol=1e-6)


def test_the_engine_draws_the_widths_of_the_preview(
    hair: bpy.types.Object, shown: np.ndarray, get_depsgraph: Callable[[], Any]
) -> None:
    snapshot = read_groom(hair, get_depsgraph())
    np.testing.assert_array_equal(snapshot.radius, np.repeat(shown, POINTS))
    inputs, _, _ = read_inputs(hair, get_depsgraph())
    assert snapshot.extinction == inputs.rig.widths.extinction > 1.0


def test_own_widths_are_written_as_they_are(hair: bpy.types.Object, tmp_path: Path) -> None:
    """They taper as drawn by the artist, whatever the number of simulated points."""
    taper = np.tile(np.linspace(2.0e-4, 5.0e-5, POINTS), COUNT)
    hair.data.attributes["radius"].data.foreach_set("value", taper.astype(np.float32))
    hair.data.hairloom.widths.method = "own"
    path = tmp_path / "hair.abc"
    assert bpy.ops.hairloom.export_alembic(filepath=str(path), parts="strands") == {"FINISHED"}
    np.testing.assert_allclose(read_strands(path).strands.radius, taper, rtol=1e-5)
