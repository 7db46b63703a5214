"""Cards take over the occlusion and the normals of their strands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon import card_flow, light_flow, rig_flow
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.build import CardBuild, CardGroom, card_of_strand, card_steps
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.occlusion import CardOccluder, vertex_occlusion
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import card_of_vertex
from hairloom.addon.cards.steps import result_of
from hairloom.addon.cards.strand_shading import StrandShading, shading_from_strands
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.kajiya_kay import strand_normal
from tests.pure.cards.test_build import falling

MADE = AtlasSettings(source="made")
FEW_RAYS = CardOcclusionSettings(rays=32)
CLUSTERS = CardSettings(source="clusters", card_count=40, levels=1, error=0.012)


def rig_of(count: int) -> Rig:
    return rig_flow.prepare(falling(count), None, GuideSettings(guide_count=40), place="hair")


def built(groom: CardGroom, settings: CardSettings, *others: CardOccluder) -> CardBuild:
    return result_of(card_steps(groom, settings, MADE, FEW_RAYS, lambda _build: None, others))


def ladder() -> CardMesh:
    """A flat card 0.02 m wide, upright, of one column and two segments; its normal is -y."""
    along = np.repeat([0.0, 0.5, 1.0], 2)
    across = np.tile([0.0, 1.0], 3)
    zero = np.zeros(6)
    return CardMesh(
        positions=np.column_stack([0.02 * across - 0.01, zero, along]),
        triangles=[[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]],
        uv=np.column_stack([across, along]),
        normal=np.tile([0.0, -1.0, 0.0], (6, 1)),
        tangent=np.tile([0.0, 0.0, 1.0], (6, 1)),
        occlusion=zero,
        card=np.zeros(4, np.int32),
        along=along,
    )


def of_two(grid: np.ndarray, light: np.ndarray | None = None) -> StrandShading:
    """A card of two strands."""
    occlusion = np.repeat([[0.2], [0.8]], 5, 1)
    return shading_from_strands(ladder(), grid, occlusion, light, np.array([0, 0]))


def upright(x: float, y: float = 0.0) -> np.ndarray:
    return np.column_stack([np.full(5, x), np.full(5, y), np.linspace(0.0, 1.0, 5)])


@pytest.mark.parametrize("turn", [0.0, 0.9])
def test_each_edge_has_the_occlusion_of_the_strand_that_runs_along_it(turn: float) -> None:
    """For strands at any depth and for any vertex normals."""
    grid = np.stack([upright(-0.01, 0.03), upright(0.01, -0.05), upright(0.0)])
    occlusion = np.array([np.linspace(0.1, 0.3, 5), np.linspace(0.5, 0.9, 5), np.full(5, 7.0)])
    normal = np.tile([np.sin(turn), -np.cos(turn), 0.0], (6, 1))
    mesh = replace(ladder(), normal=normal)
    found = shading_from_strands(mesh, grid, occlusion, None, np.array([0, 0, -1])).occlusion
    np.testing.assert_allclose(found, [0.1, 0.5, 0.2, 0.7, 0.3, 0.9], rtol=1e-5)


def test_strands_between_count_by_hat_functions() -> None:
    grid = np.stack([upright(-0.01), upright(0.005)])
    found = of_two(grid).occlusion
    left = (1.0 * 0.2 + 0.25 * 0.8) / 1.25
    np.testing.assert_allclose(found, np.tile([left, 0.8], 3), rtol=1e-5)


def test_a_card_whose_strands_are_all_elsewhere_has_their_mean() -> None:
    grid = np.stack([upright(-0.5), upright(0.7)])
    found = of_two(grid).occlusion
    np.testing.assert_allclose(found, 0.5, rtol=1e-5)


def test_light_is_the_mean_weighted_by_visibility() -> None:
    """The mean is weighted by openness: a strand that sees three times as much of the sky is seen
    three times as often."""
    grid = np.stack([upright(-0.5), upright(0.7)])
    light = np.repeat([[[0.2, 1.0, -4.0]], [[0.6, 5.0, 4.0]]], 5, 1)
    found = of_two(grid, light).light
    np.testing.assert_allclose(found, np.tile([0.5, 4.0, 2.0], (6, 1)), rtol=1e-5)
    hidden = of_two(grid, light * [0.0, 1.0, 1.0]).light
    np.testing.assert_allclose(hidden, np.tile([0.0, 3.0, 0.0], (6, 1)), atol=1e-5)


def test_depth_is_the_extent_of_evenly_spread_strands() -> None:
    """Strands uniformly distributed over 0.04 m along the normal -y have this depth."""
    heights = np.random.default_rng(3).uniform(-0.03, 0.01, 4000)
    grid = np.stack([upright(0.0, y) for y in heights])
    card = np.zeros(len(grid), int)
    turned = replace(ladder(), normal=np.tile([0.0, -0.6, 0.8], (6, 1)))  # out of the plane
    found = shading_from_strands(turned, grid, np.ones(grid.shape[:2]), None, card)
    np.testing.assert_allclose(found.depth, 0.04, rtol=0.02)
    assert found.light is None
    short = shading_from_strands(
        ladder(), grid * [1.0, 6.0, 1.0], np.ones(grid.shape[:2]), None, card
    )
    assert not short.depth.any()
    flat = of_two(np.stack([upright(-0.01), upright(0.01)]))
    np.testing.assert_allclose(flat.depth, 0.0, atol=1e-6)


@pytest.mark.parametrize("settings", few_in_commits([CLUSTERS, replace(CLUSTERS, crossed=True)]))
def test_each_card_is_as_open_as_its_own_strands(settings: CardSettings) -> None:
    """Against a loop over cards."""
    rig = rig_of(900)
    dense = AmbientSettings(extinction=100.0)
    shade = light_flow.rest_light(rig, dense).occlusion
    groom = replace(
        card_flow.card_groom(rig), occlusion=shade.reshape(rig.strands.strand_count, -1)
    )
    assert groom.occlusion is not None
    mesh = built(groom, settings).finest
    owner, cards = card_of_vertex(mesh), card_of_strand(groom, settings)
    stations = np.linspace(0.0, 1.0, groom.occlusion.shape[1])
    found, expected = [], []
    for card in range(int(owner.max()) + 1):
        own = groom.occlusion[cards == card % (cards.max() + 1)].mean(axis=0)
        is_own = owner == card
        found.append(mesh.occlusion[is_own].mean())
        expected.append(np.interp(mesh.along[is_own], stations, own).mean())
    assert len(found) == mesh.card_count
    assert np.ptp(expected) > 0.2
    assert np.abs(np.subtract(found, expected)).mean() < 0.02
    assert np.corrcoef(found, expected)[0, 1] > 0.97


def test_guide_cards_have_the_occlusion_of_the_strands_along_their_guides() -> None:
    rig = rig_of(300)
    groom = card_flow.card_groom(rig)
    settings = replace(CLUSTERS, source="guides")
    cards = card_of_strand(groom, settings)
    assert np.bincount(cards).max() > 1
    shade = np.random.default_rng(1).random(len(groom.guide_indices))
    own = np.tile(shade[cards, None], groom.strands.grid.shape[1])
    mesh = built(replace(groom, occlusion=own.astype(np.float32)), settings).finest
    np.testing.assert_allclose(mesh.occlusion, shade[card_of_vertex(mesh)], rtol=1e-5)


def test_other_grooms_occlude_too() -> None:
    rig = rig_of(300)
    groom = card_flow.card_groom(rig)
    even = np.full(rig.strands.grid.shape[:2], 0.6, np.float32)
    wall = ladder()
    wall = replace(wall, positions=wall.positions * [100.0, 1.0, 2.0] + [0.0, -0.4, -0.8])
    lit = built(replace(groom, occlusion=even), CLUSTERS).finest
    shaded = built(replace(groom, occlusion=even), CLUSTERS, CardOccluder(wall)).finest
    np.testing.assert_allclose(lit.occlusion, 0.6, rtol=1e-5)
    rays = vertex_occlusion(lit, [CardOccluder(wall)], [], FEW_RAYS)
    assert rays.min() < 0.3 < 0.9 < rays.max()
    np.testing.assert_allclose(shaded.occlusion, 0.6 * rays, rtol=1e-5)


@pytest.mark.parametrize("way", few_in_commits(["guides", "clusters"]))
def test_normals_are_those_of_strands_across_the_tangents_and_on_the_front(way: str) -> None:
    rig = rig_of(300)
    settings = SettingsMap(replace(CLUSTERS, source=way, levels=2), MADE, FEW_RAYS)
    build = result_of(card_flow.card_build_steps(rig, settings))
    center = rig.strands.roots.mean(axis=0)
    for mesh in build.levels:
        expected = strand_normal(mesh.positions, mesh.tangent, center)
        is_same = np.abs(mesh.normal - expected).max(axis=1) < 1e-5
        is_lying = mesh.along > 0.1  # at upright roots any normal will do
        assert is_same[is_lying].mean() > 0.8
        lean = np.einsum("vi,vi->v", mesh.normal, mesh.tangent)
        np.testing.assert_allclose(lean, 0.0, atol=1e-5)
        a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
        mean = mesh.normal[mesh.triangles].mean(axis=1)
        facing = np.einsum("ti,ti->t", np.cross(b - a, c - a), mean)
        assert (facing[is_lying[mesh.triangles].all(axis=1)] > 0.0).mean() > 0.95
