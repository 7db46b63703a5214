"""From a groom to all levels of its cards: properties of each level, and bad input."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon import card_flow, rig_flow
from hairloom.addon.cards import build as build_module
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.bake_strands import flat_strands
from hairloom.addon.cards.build import (
    CardBuild,
    CardGroom,
    card_of_strand,
    card_steps,
    uncut_cards,
    with_nearest_occlusion,
)
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.order_check import wrong_fraction
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.steps import result_of
from hairloom.addon.cards.strip import strip_mesh
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.face import BROWS

MADE, BAKED = AtlasSettings(source="made"), AtlasSettings(columns=8, rows=2)
FEW_RAYS = CardOcclusionSettings(rays=16)
#: makes the few strands here as dense as a full groom
DENSE = AmbientSettings(extinction=100.0)


def uncut(groom: CardGroom, settings: CardSettings, atlas: AtlasSettings) -> Any:
    return uncut_cards(groom, settings, atlas, card_of_strand(groom, settings))


@pytest.mark.parametrize("way", ["clusters", "guides"])
def test_the_card_of_each_strand_is_found_once(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[str] = []
    monkeypatch.setattr(
        build_module,
        "card_of_strand",
        lambda *given: found.append(way) or card_of_strand(*given),
    )
    built(falling(300), source=way)
    assert found == [way]


def falling(count: int, *, groups: int = 2, cv_count: int = 12, seed: int = 0) -> StrandSet:
    """Strands that leave a ball along its normal and fall."""
    random = np.random.default_rng(seed)
    normal = random.normal(size=(count, 3))
    normal[:, 2] = np.abs(normal[:, 2])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, cv_count)[:, None]
    grid = normal[:, None] * (0.1 + 0.05 * np.sqrt(along)) + along**2 * [0.0, 0.0, -0.15]
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(count + 1) * cv_count,
        radius=np.full(count * cv_count, 5e-5),
        group=np.arange(count) % groups,
    )


def built(
    strands: StrandSet,
    atlas: AtlasSettings = MADE,
    alpha: np.ndarray | None = None,
    **changed: object,
) -> CardBuild:
    rig = rig_flow.prepare(strands, None, GuideSettings(guide_count=40), place="hair")
    settings = CardSettings(**{"source": "clusters", "card_count": 30, **changed})  # type: ignore[arg-type]
    chosen = SettingsMap(settings, atlas, FEW_RAYS, DENSE)
    return result_of(card_flow.card_build_steps(rig, chosen, lambda _: alpha))


@pytest.mark.parametrize("way", few_in_commits(["clusters", "guides"]))
@pytest.mark.parametrize("source", few_in_commits(["baked", "made"]))
def test_levels_share_one_atlas_and_all_card_attributes(way: str, source: str) -> None:
    build = built(falling(800), AtlasSettings(source=source, columns=8, rows=2), source=way)
    assert len(build.levels) == len(build.errors) == len(build.back_triangles) == 3
    assert (build.plan is None) == (source == "made")
    finest = build.finest
    assert set(finest.group[np.unique(finest.card)].tolist()) == {0, 1}
    for mesh, back in zip(build.levels, build.back_triangles, strict=True):
        assert mesh.atlas == finest.atlas
        np.testing.assert_array_equal(mesh.tile, finest.tile)
        np.testing.assert_array_equal(mesh.layer, finest.layer)
        assert 0.0 <= mesh.occlusion.min() < mesh.occlusion.max() <= 1.0
        same = (np.sort(triangles.ravel()) for triangles in (mesh.triangles, back))
        np.testing.assert_array_equal(*same)
    if build.plan is not None:
        assert finest.atlas == build.plan.grid
        np.testing.assert_array_equal(finest.tile, build.plan.tile)


@pytest.mark.parametrize("factor", few_in_commits([2.0**-10, 2.0**10]))
@pytest.mark.parametrize(
    ("method", "source"),
    few_in_commits([pytest.param("clusters", "baked"), pytest.param("guides", "made")]),
)
def test_cards_are_the_same_at_any_scale(method: str, source: str, factor: float) -> None:
    """Their number, shape, tiles, light and order do not depend on the unit of length."""

    def at(scale: float) -> CardBuild:
        strands = falling(300)
        points, radius = (np.float32(scale) * each for each in (strands.points, strands.radius))
        strands = replace(strands, points=points, radius=radius)
        atlas = AtlasSettings(source=source, columns=8, rows=1)
        return built(strands, atlas, source=method, card_count=16, levels=2)

    one, other = at(1.0), at(factor)
    assert other.notes == one.notes and other.wrong_fraction == one.wrong_fraction
    assert other.errors == pytest.approx([factor * error for error in one.errors], rel=1e-3)
    for mesh, same in zip(other.levels, one.levels, strict=True):
        np.testing.assert_allclose(mesh.positions / factor, same.positions, atol=1e-6)
        for name in ("uv", "along", "normal", "tangent", "occlusion"):
            found, expected = getattr(mesh, name), getattr(same, name)
            np.testing.assert_allclose(found, expected, atol=1e-3, err_msg=name)
        for name in ("triangles", "card", "group", "layer", "tile"):
            np.testing.assert_array_equal(getattr(mesh, name), getattr(same, name), err_msg=name)


def test_strands_on_cards_begin_where_they_grow() -> None:
    """Two tufts whose roots lie on slanted lines, as at a hairline, and which show the same tile:
    what is drawn on a card begins on its own line."""
    aside, slopes = np.linspace(-0.01, 0.01, 12), (1.0, -1.5)
    place = [[(y, slope * y, 0.0) for y in aside] for slope in slopes]
    roots = np.array(place)[..., [1, 0, 2]] + [[[0.0, 0.0, 0.0]], [[0.0, 0.5, 0.0]]]
    line = np.linspace(0.0, 0.2, 16)[:, None] * [1.0, 0.0, 0.0]
    grid = (roots.reshape(-1, 1, 3) + line).astype(np.float32)
    strands = StrandSet(
        grid.reshape(-1, 3), np.arange(25) * 16, np.full(24 * 16, 1e-4), np.zeros(24, np.int32)
    )
    groom = replace(_groom(strands), root_normal=np.tile((0.0, 0.0, 1.0), (24, 1)))
    settings = CardSettings(card_count=2, fly_aways=0.0, bend=0.0)
    cards, plan = uncut(groom, settings, AtlasSettings(columns=1, rows=1))
    assert plan is not None and len(cards) == 2 and len(plan.strips) == 1
    mesh = strip_mesh([(np.arange(2), cards.strips)], cards, 1, settings)
    drawn = flat_strands(plan, grid, groom.radius).place[:, 0]
    for card, middle in enumerate(cards.strips.frames.center[:, 0, 1]):
        slope = slopes[int(middle > 0.25)]
        found = _on_mesh(mesh, card, drawn)
        away = found[:, 0] - slope * (found[:, 1] - 0.5 * (middle > 0.25))
        assert np.abs(away).max() < 1e-3, "or the edge of the card is square"


def _on_mesh(mesh: CardMesh, card: int, uv: np.ndarray) -> np.ndarray:
    """Points of a card at these places in the texture, (n, 3)."""
    triangles = mesh.triangles[mesh.card == card]
    corners = np.concatenate([mesh.uv[triangles], np.ones((len(triangles), 3, 1))], axis=2)
    points = np.concatenate([uv, np.ones((len(uv), 1))], axis=1)
    weights = np.einsum("pi,tij->ptj", points, np.linalg.inv(corners))
    inside = weights.min(axis=2).argmax(axis=1)
    weight = weights[np.arange(len(uv)), inside]
    assert weight.min() > -1e-4
    return np.einsum("pj,pji->pi", weight, mesh.positions[triangles[inside]])


def test_crossed_cards_have_the_tile_and_group_of_their_pair() -> None:
    build = built(
        falling(300), AtlasSettings(columns=8, rows=2), levels=1, crossed=True, fly_aways=0.0
    )
    count = build.finest.card_count // 2
    for name in ("tile", "group"):
        value = getattr(build.finest, name)
        np.testing.assert_array_equal(value[:count], value[count:])
    assert build.plan is not None and len(build.plan.tile) == count


def test_guides_keep_their_groups() -> None:
    strands = falling(300, groups=3)
    build = built(strands, source="guides")
    rig = rig_flow.prepare(strands, None, GuideSettings(guide_count=40), place="hair")
    np.testing.assert_array_equal(build.finest.group, rig.strands.group[rig.guides])


def test_guides_show_the_strands_that_lie_along_them() -> None:
    """Each tile shows the strands of its guides. Where there are only guides, tufts are made
    instead."""
    groom, settings = _groom(falling(1500)), CardSettings(source="guides")
    grid, guides = groom.strands.grid, groom.guide_indices
    assert len(guides) < len(grid)
    baked, plan = uncut(groom, settings, BAKED)
    made, none = uncut(groom, settings, MADE)
    assert plan is not None and none is None
    ends = np.stack([baked.strips.frames.center[:, [0, -1]], grid[guides][:, [0, -1]]])
    np.testing.assert_allclose(*ends, atol=1e-6)
    widest = (each.strips.width.max(axis=1) for each in (made, baked))
    np.testing.assert_allclose(np.divide(*widest) * plan.width_factor, 1.0, rtol=1e-5)
    assert made.strand_count.max() == 1 and baked.strand_count.sum() == len(grid)
    card = card_of_strand(groom, settings)
    np.testing.assert_array_equal(card[guides], np.arange(len(guides)))
    for tile, strip in enumerate(plan.strips.frames.center):
        own = plan.strands[plan.tile_of_strand == tile]
        shown = np.abs(grid[guides][:, 0] - strip[0]).sum(axis=1).argmin()
        assert set(card[own].tolist()) == {shown}
    alone = replace(groom, strands=groom.strands.take(guides), guide_indices=np.arange(len(guides)))
    parts = {name: getattr(groom, name)[guides] for name in ("radius", "root_normal")}
    cards, plan = uncut(replace(alone, **parts), settings, BAKED)
    assert plan is None
    np.testing.assert_array_equal(cards.strips.width, made.strips.width)
    np.testing.assert_array_equal(cards.layer, made.layer)


def test_the_lowest_layer_is_wider_by_choice_and_the_outermost_is_not() -> None:
    groom = _groom(falling(1500))
    plain, _ = uncut(groom, CardSettings(source="clusters", card_count=60), MADE)
    wide, _ = uncut(groom, CardSettings(source="clusters", card_count=60, base_width=1.6), MADE)
    factor = (wide.strips.width / plain.strips.width).mean(axis=1)
    for layer, expected in enumerate((1.6, 1.3, 1.0)):
        np.testing.assert_allclose(factor[plain.layer == layer], expected, rtol=1e-5)


def test_single_strands_are_the_outermost_layer() -> None:
    settings = CardSettings(source="clusters", card_count=60, fly_aways=0.2)
    cards, _ = uncut(_groom(falling(1500)), settings, MADE)
    loose = cards.strand_count == 1
    assert loose.sum() >= 12
    np.testing.assert_array_equal(cards.layer[loose], 2)
    assert set(cards.layer[~loose].tolist()) == {0, 1, 2}


def test_brows_are_the_outermost_layer_and_not_widened() -> None:
    strands = falling(1500)
    strands = replace(strands, group=np.where(np.arange(1500) < 300, BROWS, 0).astype(np.int32))
    cards, _ = uncut(_groom(strands), CardSettings(source="clusters", card_count=60), MADE)
    np.testing.assert_array_equal(cards.layer[cards.group == BROWS], 2)
    assert set(cards.layer[cards.group == 0].tolist()) == {0, 1, 2}


def _groom(strands: StrandSet) -> CardGroom:
    rig = rig_flow.prepare(strands, None, GuideSettings(), place="hair")
    return card_flow.card_groom(rig)


def test_a_vertex_that_is_in_both_levels_has_the_same_occlusion() -> None:
    finest, coarser = built(falling(900), levels=2).levels
    shade = np.random.default_rng(0).random(len(finest.positions)).astype(np.float32)
    finest = finest.with_occlusion(shade)
    level = with_nearest_occlusion(finest, coarser)
    known = {tuple(key): value for key, value in zip(_keys(finest), shade, strict=True)}
    shared = [
        (value, known[tuple(key)])
        for key, value in zip(_keys(level), level.occlusion, strict=True)
        if tuple(key) in known
    ]
    assert len(shared) > 200
    np.testing.assert_allclose(*zip(*shared, strict=True))


def _keys(mesh):  # type: ignore[no-untyped-def]
    """Card and place in the atlas of each vertex."""
    owner = np.zeros(len(mesh.positions), int)
    owner[mesh.triangles] = mesh.card[:, None]
    return np.column_stack([owner, (mesh.uv * 1e5).round().astype(int)])


@pytest.mark.parametrize("way", ["clusters", "guides"])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_strands_give_a_few_cards(way: str, count: int) -> None:
    build = built(falling(count, groups=1), source=way, card_count=800)
    assert 1 <= build.finest.card_count <= count
    for mesh in build.levels:
        a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
        assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0.0).all()


def test_strands_that_are_all_the_same_give_one_card() -> None:
    one = falling(1, groups=1)
    grid = np.tile(one.points, (200, 1))
    strands = StrandSet(
        points=grid,
        offsets=np.arange(201) * 12,
        radius=np.full(len(grid), 5e-5),
        group=np.zeros(200, np.int32),
    )
    build = built(strands, fly_aways=0.0)
    assert build.finest.card_count == 1
    assert np.isfinite(build.finest.positions).all()


def test_an_atlas_that_is_too_small_says_by_how_much() -> None:
    small = AtlasSettings(size="512", columns=64, rows=64, padding=4)
    with pytest.raises(HairloomError, match="more"):
        built(falling(100), small)


def test_alpha_is_made_once_and_darkens_less_than_opaque_cards() -> None:
    rig = rig_flow.prepare(falling(900), None, GuideSettings(), place="hair")
    settings = CardSettings(source="clusters", card_count=30, levels=1)
    asked: list[CardBuild] = []

    def clear(build: CardBuild) -> np.ndarray:
        asked.append(build)
        return np.zeros((8, 8), np.float32)

    groom = card_flow.card_groom(rig)  # the occlusion of its strands is not known
    opaque = result_of(card_steps(groom, settings, MADE, FEW_RAYS, lambda _build: None))
    seen_through = result_of(card_steps(groom, settings, MADE, FEW_RAYS, clear))
    assert len(asked) == 1
    np.testing.assert_allclose(seen_through.finest.occlusion, 1.0, atol=1e-5)
    assert opaque.finest.occlusion.mean() < 0.9


def test_every_step_reports_its_progress() -> None:
    rig = rig_flow.prepare(falling(600), None, GuideSettings(), place="hair")
    settings = CardSettings(source="clusters", card_count=30, levels=2)
    groom = card_flow.card_groom(rig)  # so that rays find the occlusion
    steps = list(card_steps(groom, settings, MADE, FEW_RAYS, lambda _build: None))
    for name in ("Ambient occlusion", "Order of level 0", "Order of level 1"):
        first, *others = [step for step in steps if step.name == name]
        fractions = [step.fraction for step in others]
        assert first.fraction is None and len(fractions) > 1
        assert fractions[0] > 0.0 and fractions == sorted(fractions) and fractions[-1] <= 1.0
        assert first.text == name and others[0].text.startswith(f"{name}, ")


@pytest.mark.parametrize("by", ["pieces", "cards", "distance"])
def test_the_chosen_order_is_used_and_its_errors_are_measured(by: str) -> None:
    strands = falling(900)
    build = built(strands, order_by=by, levels=1)
    mesh = build.finest
    runs = 1 + np.count_nonzero(np.diff(mesh.card))
    assert (runs == mesh.card_count) == (by != "pieces")
    index = {tuple(corners): n for n, corners in enumerate(mesh.triangles.tolist())}
    back = np.array([index[tuple(corners)] for corners in build.back_triangles[0].tolist()])
    again = wrong_fraction(mesh, None, back=back, view_count=8)
    assert 0.0 < build.wrong_fraction < 1.0
    assert build.wrong_fraction == pytest.approx(again)


def test_cards_that_are_clear_stay_in_the_order_of_their_distance() -> None:
    """There the search for an order has nothing to improve."""
    clear = np.zeros((4, 4), np.float32)
    seen, unseen, by_distance = (
        built(falling(900), levels=1, order_by=by, alpha=alpha).finest.card.tolist()
        for by, alpha in (("cards", None), ("cards", clear), ("distance", None))
    )
    assert unseen == by_distance != seen


def test_notes_depend_on_the_drawn_width_of_strands() -> None:
    rig = rig_flow.prepare(falling(900), None, GuideSettings(), place="hair")
    settings = CardSettings(source="clusters", card_count=30)
    atlas = AtlasSettings(size="512", columns=8, rows=2)

    def notes(scale: float) -> str:
        groom = card_flow.card_groom(rig, StrandSettings(fullness=scale, tip_width=1.0))
        plan = uncut(groom, settings, atlas)[1]
        assert plan is not None
        return " ".join(plan.notes)

    assert "fainter lines" in notes(0.5)
    assert "fainter lines" not in notes(40.0)


@pytest.mark.slow
def test_half_a_million_strands_become_cards() -> None:
    strands = falling(500_000, cv_count=8)
    normal = np.tile(np.float32([0.0, 0.0, 1.0]), (500_000, 1))
    radius = strands.radius.reshape(500_000, -1)
    groom = CardGroom(strands, np.arange(500_000), np.arange(0, 500_000, 500), radius, normal, None)
    cards, _ = uncut(groom, CardSettings(source="clusters"), replace(MADE))
    assert len(cards) >= 800


def test_many_wrongly_blended_pixels_give_a_note_with_a_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for wrong, order_by, remedy in (
        (0.05, "distance", None),
        (0.2, "distance", "Set Order By to Pieces"),
        (0.2, "pieces", "a group of its own"),
    ):
        monkeypatch.setattr(
            "hairloom.addon.cards.build.wrong_fraction", lambda *_, wrong=wrong, **__: wrong
        )
        notes = built(falling(200), order_by=order_by, card_count=5, levels=1).order_notes
        if remedy is None:
            assert notes == ()
        else:
            assert remedy in notes[0] and notes[0].startswith("20% of the hair's pixels")
