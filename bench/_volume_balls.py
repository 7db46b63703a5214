"""Balls of combed hair with shadows and multiple scattering, beside Cycles' path tracing.

The sheet out/volume_sheet.png. Columns: Cycles with all bounces and shadows, denoised; ours with
approximations of both; ours with shadows alone; ours with shadows and multiple scattering.
Rows: black, brown, blond, white, lit from the front; blond lit from a side.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import _shading_ball as ball
import numpy as np
from _shading_cycles import BLOND
from _shading_room import CyclesRoom
from hair_ball import ball_mesh, combed_strands

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

SHEET = Path(__file__).resolve().parents[1] / "out" / "volume_sheet.png"
FRONT = (0.45, 0.5, 0.8)
ROWS = {
    "black": (ball.BLACK, FRONT),
    "brown": ((0.63, 1.12, 2.4), FRONT),
    "blond": (BLOND, FRONT),
    "white": ((0.01, 0.01, 0.01), FRONT),
    "blond_side": (BLOND, (-1.0, 0.3, 0.1)),
}
#: each column's strength of the approximations, and its shadows
COLUMNS = {
    "stand_ins": (1.0, VolumeSettings(shadows="none")),
    "single": (0.0, VolumeSettings(shadows="deep", strand_fraction=1.0, scattering=False)),
    "dual": (0.0, VolumeSettings(shadows="deep", strand_fraction=1.0)),
}


def ball_figures() -> dict[str, float]:
    """Write the sheet; for each row and column the smallest and largest ratio of a channel's light
    to Cycles', and the mean difference of blocks relative to Cycles' mean.
    """
    strands, core = combed_strands(ball.STRANDS), Surface(*ball_mesh())
    room = CyclesRoom()
    room.body(core.positions, core.triangles)
    found, pictures = {}, []
    for name, (absorption, towards) in ROWS.items():
        room.sun(np.array(towards))
        hair = ball.HAIR
        room.hair(
            absorption,
            Roughness=hair.roughness,
            Radial_Roughness=hair.around,
            Offset=hair.offset,
        )
        truth = ball.of_cycles(room, strands, bounces=64, casts_shadow=True)
        row = [truth]
        for column, (stand_ins, volume) in COLUMNS.items():
            snapshot = ball.snapshot_of(strands, core, absorption, towards, stand_ins)
            picture = ball.drawn(replace(snapshot, volume=volume))
            ratio = picture[..., :3].mean(axis=(0, 1)) / truth[..., :3].mean(axis=(0, 1))
            found[f"ball_{name}_{column}_least"] = float(ratio.min())
            found[f"ball_{name}_{column}_most"] = float(ratio.max())
            found[f"ball_{name}_{column}_difference"] = ball.difference(picture, truth)
            row.append(picture)
        scale = 0.35 / np.percentile(ball.blocks(truth), 95.0)
        pictures += [ball.shown(picture, scale) for picture in row]
    SHEET.parent.mkdir(exist_ok=True)
    write_png(SHEET, contact_sheet(pictures, len(COLUMNS) + 1))
    return found
