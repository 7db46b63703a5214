"""Strands as cards that only shade others: for grooms of which no cards were made."""

from __future__ import annotations

import numpy as np

from .atlas_grid import AtlasGrid
from .build import CardGroom
from .fit import cluster_of_strands, fit_strips
from .occlusion import CardShade
from .settings import CardSettings
from .strip import UncutCards, strip_mesh

#: Cards are enough that stand for so many strands each; so many there are at most.
_STRANDS_PER_CARD, _MOST_CARDS = 12, 600


def strand_shade(groom: CardGroom) -> CardShade:
    """Cards along clusters of the strands, each row as dense as the strands in it.

    Strands take pi / 4 of their area of light from everywhere, cards half of theirs times tau
    (Cauchy, see shading/volume/card_opacity.py). So a row that is w wide and holds strands of
    radius r has  tau = pi / 2 sum 2 r / w.  Nothing is baked, sorted or shaded: it takes a second
    where cards take a minute. A row of texels is a row of all cards, and a column a card.
    """
    strands, radius = groom.strands, groom.radius
    count = min(max(strands.strand_count // _STRANDS_PER_CARD, 1), _MOST_CARDS)
    settings = CardSettings(way="clusters", card_count=count, fly_aways=0.0)
    cluster = cluster_of_strands(strands.grid, strands.group, settings)
    strips = fit_strips(strands.grid, radius, cluster, groom.root_normal, settings)
    covered = np.zeros(strips.width.shape)
    np.add.at(covered, cluster, 2.0 * radius)
    tau = 0.5 * np.pi * covered / np.maximum(strips.width, 1.0e-9)
    numbers = np.arange(len(strips), dtype=np.int32)
    same = np.zeros_like(numbers)
    cards = UncutCards(strips, same, same, same, numbers, AtlasGrid(columns=len(strips)))
    mesh = strip_mesh([(numbers, strips)], cards, 1, settings)
    return CardShade(mesh, (1.0 - np.exp(-tau)).T.astype(np.float32))
