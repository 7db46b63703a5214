"""Cards leave out baby hair, in a groom and in its bake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from baby_hair import short_strands, wig

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon.blender.bakes.baked_rig import RestMatrices, baked_rig_of, rig_arrays  # noqa: E402
from hairloom.addon.blender.cards.build import baked_atlas  # noqa: E402
from hairloom.addon.card_flow import card_groom  # noqa: E402
from hairloom.addon.cards.atlas_settings import AtlasSettings  # noqa: E402
from hairloom.addon.cards.build import card_of_strand, uncut_cards  # noqa: E402
from hairloom.addon.cards.settings import CardSettings  # noqa: E402
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings  # noqa: E402


def test_a_bake_stores_which_strands_are_baby_hair() -> None:
    rig = wig()
    found = baked_rig_of(rig_arrays(rig, RestMatrices(np.eye(4), np.eye(4))), "here").rig
    np.testing.assert_array_equal(found.baby_hair, np.flatnonzero(short_strands(rig)))


@pytest.mark.draws
def test_the_atlas_shows_the_strands_that_its_plan_names() -> None:
    """The atlas equals that of the same groom without its baby hair."""
    rig, look, drawn = wig(), ShadingSettings(color_variation=0.0), StrandSettings()
    settings = CardSettings(source="clusters", card_count=12)
    groom = card_groom(rig)
    card = card_of_strand(groom, settings)
    _, plan = uncut_cards(groom, settings, AtlasSettings(size="256"), card)
    assert plan is not None
    without = replace(
        rig, strands=rig.strands.take(np.flatnonzero(~short_strands(rig))), grown_children=None
    )
    found, expected = (baked_atlas(each, plan, look, drawn) for each in (rig, without))
    assert (expected.alpha > 0.0).mean() > 0.05
    for name, values in expected.by_name.items():
        np.testing.assert_array_equal(found.by_name[name], values, name)
