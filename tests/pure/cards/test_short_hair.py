"""Cards of fur on a square of skin, whose right width and spacing are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon import card_flow, rig_flow
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.build import CardBuild
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.short_hair import fitted_to_length
from hairloom.addon.cards.steps import result_of
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.strands import StrandSet

SIDE, COUNT = 0.3, 4000
FUR = CardSettings(source="clusters", card_count=100)
ATLAS = AtlasSettings()


def fur(length: float) -> StrandSet:
    """Strands at random places of a square, which rise and bend over."""
    random = np.random.default_rng(2)
    root = np.concatenate([random.uniform(0.0, SIDE, (COUNT, 2)), np.zeros((COUNT, 1))], axis=1)
    along = np.linspace(0.0, 1.0, 12)[:, None]
    bend = np.concatenate([along**2, 0.3 * along**3, along], axis=1) / np.sqrt(2.1)
    grid = root[:, None] + length * bend
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(COUNT + 1) * 12,
        radius=np.full(COUNT * 12, 1e-4),
        group=np.zeros(COUNT, np.int32),
    )


def built(strands: StrandSet, settings: CardSettings) -> CardBuild:
    rig = rig_flow.prepare(strands, None, GuideSettings(guide_count=40), place="fur")
    chosen = SettingsMap(settings, AtlasSettings(source="made"), CardOcclusionSettings(rays=16))
    return result_of(card_flow.card_build_steps(rig, chosen))


def test_fur_gets_more_cards_of_eight_triangles_at_most() -> None:
    strands = fur(0.01)
    build = built(strands, replace(FUR, error=0.0))
    mesh = build.finest
    assert mesh.card_count == 300
    assert np.bincount(mesh.card).max() == 8
    assert build.notes[0] == (
        "the hair is too short for 100 cards, so there are 300 of 8 triangles or fewer"
    )


@pytest.mark.parametrize("length", [0.05, 0.3])
def test_longer_hair_has_the_wanted_number_of_cards(length: float) -> None:
    assert fitted_to_length(FUR, ATLAS, fur(length)) == (FUR, ATLAS, ())


def test_there_are_no_more_cards_than_needed() -> None:
    """The roots of a card fill a square with a side of a quarter of the hair's length."""
    strands = fur(0.03)
    fitted, _, _ = fitted_to_length(replace(FUR, card_count=1000), ATLAS, strands)
    square = 0.25 * float(np.median(strands.lengths()))
    assert fitted.card_count == pytest.approx((SIDE / square) ** 2, rel=0.05)


def test_no_card_is_without_strands_and_guides_are_left_as_they_are() -> None:
    fitted, _, _ = fitted_to_length(replace(FUR, card_count=3000), ATLAS, fur(0.003))
    assert fitted.card_count == COUNT
    guides = replace(FUR, source="guides")
    assert fitted_to_length(guides, ATLAS, fur(0.003)) == (guides, ATLAS, ())


def test_strands_on_cards_that_lie_flat_are_about_as_wide_as_they_are() -> None:
    """Without the factor pi / 2 that otherwise averages over all orientations of a card."""
    _, atlas, _ = fitted_to_length(FUR, ATLAS, fur(0.01))
    assert atlas.strand_width == pytest.approx(0.7 * np.pi / 2.0, rel=1e-3)


def test_fewer_segments_stay_as_they_are() -> None:
    fitted, _, _ = fitted_to_length(replace(FUR, segment_count=2), ATLAS, fur(0.003))
    assert (fitted.segment_count, fitted.column_count) == (2, 1)
