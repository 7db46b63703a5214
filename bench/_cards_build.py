"""How long building Sintel's cards takes: clusters, strips, levels of detail, occlusion, order."""

from __future__ import annotations

import time
from dataclasses import replace

from _cards_groom import SETTINGS, sintel_rig

from hairloom.addon import card_flow
from hairloom.addon.cards.steps import result_of
from hairloom.addon.params import SettingsMap


def build_figures() -> dict[str, float]:
    """build_seconds: without the atlas; build_cpu_seconds: of all processors together."""
    rig = sintel_rig()
    cards, atlas, occlusion = SETTINGS
    begin = time.perf_counter(), time.process_time()
    settings = SettingsMap(cards, replace(atlas, source="made"), occlusion)
    result_of(card_flow.card_build_steps(rig, settings))
    return {
        "build_seconds": time.perf_counter() - begin[0],
        "build_cpu_seconds": time.process_time() - begin[1],
    }
