"""How long the bake of the atlas of Sintel's cards takes. _cards_strands compares cards that use it
with strands."""

from __future__ import annotations

import time

import numpy as np
from _cards_groom import SETTINGS, sintel_rig

from hairloom.addon.blender.cards.build import baked_atlas
from hairloom.addon.card_flow import card_build_steps
from hairloom.addon.cards.build import CardBuild
from hairloom.addon.cards.steps import result_of
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings

ROUNDS = 3
#: wide, because 11,400 strands represent many more
STRANDS = StrandSettings(fullness=2.0)


def atlas_figures() -> dict[str, float]:
    """atlas_seconds: of the bake, the minimum over ROUNDS; atlas_cpu_seconds: on all processors."""
    rig = sintel_rig()
    seconds: list[tuple[float, float]] = []

    def alpha_of(build: CardBuild) -> np.ndarray:
        assert build.plan is not None
        for _ in range(ROUNDS):
            begin = time.perf_counter(), time.process_time()
            maps = baked_atlas(rig, build.plan, ShadingSettings(), STRANDS)
            seconds.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
        return maps.alpha

    result_of(card_build_steps(rig, SettingsMap(*SETTINGS, STRANDS), alpha_of))
    wall, cpu = np.min(seconds, axis=0)
    return {"atlas_seconds": float(wall), "atlas_cpu_seconds": float(cpu)}
