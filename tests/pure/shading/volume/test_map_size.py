"""Opacity maps stay within the limits of GPU and memory."""

from __future__ import annotations

import pytest

from hairloom.addon.shading.volume.map_size import (
    START_TEXELS,
    fitted_size,
    requested_size,
    size_for_spacing,
    size_note,
)
from hairloom.addon.shading.volume.settings import VolumeSettings

ROOM = 512 * 2**20


def test_what_fits_is_drawn_as_asked() -> None:
    for shadows in ("slices", "deep"):
        settings = VolumeSettings(shadows=shadows)
        assert fitted_size(settings, 2, ROOM) == requested_size(settings, 2)
        assert requested_size(settings, 2).side == 512
        assert size_note(settings, 2, ROOM, fitted_size(settings, 2, ROOM)) == ""


@pytest.mark.parametrize("shadows", ["slices", "deep"])
@pytest.mark.parametrize("map_count", [1, 2, 8])
def test_too_large_maps_get_fewer_texels_and_a_note(shadows: str, map_count: int) -> None:
    """The most that fit, with all lights and layers."""
    settings = VolumeSettings(shadows=shadows, slices=64, layers=64, resolution=2048)
    asked, drawn = requested_size(settings, map_count), fitted_size(settings, map_count, ROOM)
    assert asked.bytes > ROOM >= drawn.bytes
    assert (drawn.slots, drawn.passes, drawn.map_count) == (6, 3, map_count)
    assert drawn.side % START_TEXELS == 0
    step = START_TEXELS / drawn.side
    assert drawn.bytes * (1.0 + step) ** 2 > ROOM
    note = size_note(settings, map_count, ROOM, drawn)
    assert f"they have {drawn.side} x {drawn.side}" in note and "maps of 2048 x 2048" in note
    assert "may take 512" in note and "GPU Memory" in note


def test_a_small_gpu_sets_the_side() -> None:
    settings = VolumeSettings(shadows="deep", layers=8, resolution=2048)
    small = fitted_size(settings, 1, ROOM, largest_side=1024)
    assert small.side == 1024
    note = size_note(settings, 1, ROOM, small)
    assert "larger than this GPU's textures" in note and "GPU Memory" not in note
    # `starts` of eight maps are stacked in one texture
    assert fitted_size(settings, 8, ROOM, largest_side=256).side == 4 * 256 // 8


def test_bytes_are_those_of_the_textures() -> None:
    size = requested_size(VolumeSettings(shadows="deep", layers=8, resolution=512), 2)
    starts, spans = 256 * 256 * 4, 256 * 256 * 16
    assert size.bytes == 512**2 * 2 * (2 * 16 + 4) + starts + spans


def test_strands_that_stand_for_many_get_texels_of_half_their_spacing() -> None:
    full = requested_size(VolumeSettings(), 1)
    assert size_for_spacing(full, 0.0, 0.3) == full  # each strand represents only itself
    assert size_for_spacing(full, 0.6 / 1024, 0.3) == full
    sparse = size_for_spacing(full, 0.6 / 100, 0.3)
    assert (sparse.side, sparse.mesh_side) == (200, 512)
    assert size_for_spacing(full, 0.6 / 100 * 1e3, 0.3 * 1e3) == sparse
    assert size_for_spacing(full, 1e3, 0.3).side == 16
