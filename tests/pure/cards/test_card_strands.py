"""Cards of strands that have different numbers of points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairloom.addon import card_flow, rig_flow
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.card_strands import card_strands, row_count
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.steps import result_of
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.needed_points import with_needed_points

SETTINGS = SettingsMap(
    CardSettings(source="clusters", card_count=12),
    AtlasSettings(size="512", columns=4, rows=1, source="baked"),
    CardOcclusionSettings(rays=1),
    AmbientSettings(),
    ShadingSettings(),
    StrandSettings(),
)


def waving(count: int = 200, cv_count: int = 64) -> StrandSet:
    """A curtain of strands, straight on the left and more and more wavy to the right."""
    random = np.random.default_rng(2)
    along = np.linspace(0.0, 1.0, cv_count)
    side = np.sort(random.random(count))[:, None]
    points = np.zeros((count, cv_count, 3))
    points[..., 0] = side + 0.02 * side * np.sin(25.0 * along)
    points[..., 1] = 0.01 * random.normal(size=(count, 1))
    points[..., 2] = -0.4 * along
    offsets = np.arange(count + 1) * cv_count
    return StrandSet(points.reshape(-1, 3), offsets, np.full(count * cv_count, 1e-3), [0] * count)


def test_cards_of_sparse_strands_equal_those_of_dense_ones() -> None:
    dense = waving()
    rig = rig_flow.prepare(dense, None, GuideSettings(cv_count=64), place="test")
    uneven = with_needed_points(rig.strands, 16)
    assert not uneven.is_uniform and uneven.point_count < 0.9 * dense.point_count
    expected, found = (
        result_of(card_flow.card_build_steps(replace(rig, strands=strands), SETTINGS)).finest
        for strands in (rig.strands, uneven)
    )
    assert found.atlas == expected.atlas
    for one, other in zip(found.bounds(), expected.bounds(), strict=True):
        np.testing.assert_allclose(one, other, atol=0.02)
    assert abs(found.occlusion.mean() - expected.occlusion.mean()) < 0.03


def test_cards_have_as_many_rows_as_most_strands_need() -> None:
    assert row_count(np.full(100, 3)) == 16
    assert row_count(np.r_[np.full(95, 40), np.full(5, 256)]) == 40
    assert row_count(np.full(100_000, 200)) == 40, "not more than memory holds"
    even = waving(10)
    assert card_strands(even) is even
    assert card_strands(with_needed_points(even, 16)).grid.shape[1] >= 16
