"""Sintel's cards with springs, moved by three-vrm through the shake that they were fitted to,
beside the simulation."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from _cards_groom import SETTINGS, sintel_rig
from _exchange_motion import RATE, shaken
from three_springs import play_in_three

from hairloom.addon.blender.cards.build import CardInputs
from hairloom.addon.blender.cards.files import CardOutput, write_cards
from hairloom.addon.card_flow import bound_cards, cards_at
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.params import SettingsMap

SECONDS = 2.0


def spring_figures() -> dict[str, Any]:
    """spring_error_percent: 99th percentile of the errors of all corners of triangles, relative to
    the hair's mean length. spring_rigid_percent: the same of hair that is fixed to the head.
    spring_reported_percent: the error that the sidecar reports."""
    rig = sintel_rig()
    motion = shaken(rig, SECONDS)
    cards, atlas, occlusion = SETTINGS
    settings = SettingsMap(cards, replace(atlas, source="made"), replace(occlusion, rays=8))
    output = CardOutput(settings=CardExportSettings(motion="springs"))
    frames = len(motion.frames)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hair.glb"
        written = write_cards(path, CardInputs(rig, settings), output, motion=motion)
        springs = written.motion
        head = np.stack([motion.at(frame)[0].matrix for frame in motion.frames])
        moved = play_in_three(path, head, RATE, springs["chains"])
        levels = moved.levels(frames, RATE)
    wrong, rigid = [], []
    for mesh, played in zip(written.levels, levels, strict=True):
        bound = bound_cards(rig, mesh)
        rest = mesh.positions[mesh.triangles]
        for frame in range(0, frames, 2):
            now = cards_at(rig, bound, *motion.at(frame)).positions[mesh.triangles]
            now = (now - head[frame, :3, 3]) @ head[frame, :3, :3]
            wrong.append(np.linalg.norm(played[..., frame, :] - now, axis=-1).ravel())
            rigid.append(np.linalg.norm(rest - now, axis=-1).ravel())
    percent = 100.0 / springs["error"]["hair_length"]
    every = np.concatenate(wrong)
    return {
        "spring_error_percent": percent * float(np.quantile(every, 0.99)),
        "spring_error_percent_rms": percent * float(np.sqrt(np.mean(every * every))),
        "spring_error_percent_worst": percent * float(every.max()),
        "spring_reported_percent": percent * springs["error"]["percentile_99"],
        "spring_rigid_percent": percent * float(np.quantile(np.concatenate(rigid), 0.99)),
        "spring_joints": springs["joints"],
        "spring_chains": springs["chains"],
    }
