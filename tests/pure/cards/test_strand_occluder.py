"""Strands that shade other hair's cards: quick cards for them block as much light as they do."""

from __future__ import annotations

import numpy as np

from hairloom.addon import card_flow, rig_flow
from hairloom.addon.cards.occlusion import CardOccluder
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.volume.card_opacity import StrandArea
from hairloom.addon.strands import StrandSet


def curtain(count: int, radius: float = 2.0e-4) -> Rig:
    """Upright strands at random in a slab 0.4 m wide and 0.05 m deep, 0.3 m high."""
    random = np.random.default_rng(3)
    roots = random.uniform((-0.2, -0.025, 0.0), (0.2, 0.025, 0.0), (count, 3))
    grid = roots[:, None] + np.linspace(0.0, 0.3, 8)[:, None] * [0.0, 0.0, -1.0]
    strands = StrandSet(
        points=grid.reshape(-1, 3).astype(np.float32),
        offsets=np.arange(count + 1) * 8,
        radius=np.full(count * 8, radius),
        group=np.zeros(count, np.int64),
    )
    return rig_flow.prepare(strands, None, GuideSettings(guide_count=20), place="curtain")


def taken(occluder: CardOccluder) -> float:
    """The area that cards block of light from all directions [m^2]: half of their area times tau
    (Cauchy's formula)."""
    mesh = occluder.mesh
    assert occluder.alpha is not None
    a, b, c = (mesh.positions[mesh.triangles[:, corner]] for corner in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    at = mesh.uv[mesh.triangles].mean(axis=1) * occluder.alpha.shape[::-1]
    column, row = at.astype(int).T
    return 0.5 * float((area * -np.log1p(-occluder.alpha[row, column])).sum())


def test_occluding_cards_block_as_much_light_as_the_strands() -> None:
    for count, radius in ((3000, 1.0e-4), (300, 3.0e-4)):
        rig = curtain(count, radius)
        strands = rig.strands
        area = StrandArea.of(strands)
        drawn = StrandSettings(fullness=2.0, tip_width=1.0)
        found = taken(card_flow.occluder_of(rig, drawn))
        # cards are a little longer than the mean of their strands
        assert np.isclose(found, area.shadow_area(drawn), rtol=0.06)


def test_one_strand_and_short_strands_shade_too() -> None:
    for count in (1, 2):
        occluder = card_flow.occluder_of(curtain(count))
        assert len(np.unique(occluder.mesh.card)) == 1
        assert occluder.alpha is not None and (occluder.alpha > 0.0).all()
