"""Cards along a few guides, for tests in which any cards do."""

from __future__ import annotations

import numpy as np

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.strip import UncutCards, guide_strips, random_tiles, strip_mesh


def build_cards(guides: np.ndarray, root_normal: np.ndarray, settings: CardSettings) -> CardMesh:
    """One card for each guide, as a mesh of one group and layer; see `guide_strips`."""
    strips = guide_strips(guides, root_normal, settings)
    atlas, none = AtlasGrid(columns=settings.atlas_columns), np.zeros(len(strips), np.int32)
    tile = random_tiles(len(strips), atlas, settings.seed)
    cards = UncutCards(strips, none + 1, none, none, tile, atlas)
    return strip_mesh([(np.arange(len(strips)), strips)], cards, settings.column_count, settings)
