"""Pictures of hair as a volume, drawn alike on each backend.

If HAIRLOOM_PICTURES names a folder, they are saved there under the backend's name, so that
tools/test_ui.py can compare them by FLIP.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hair_ball import ball_mesh, combed_strands

from hairloom.addon.exchange.textures.srgb import srgb_encoded
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.portable

SIZE = 96
VOLUMES = {
    "none": VolumeSettings(extinction=0.0, shadows="slices", scattering=False),
    "slices": VolumeSettings(shadows="slices", scattering=False),
    "many_slices": VolumeSettings(shadows="slices", slices=64, resolution=256, scattering=False),
    "deep": VolumeSettings(shadows="deep", scattering=False),
    "scattering": VolumeSettings(shadows="deep", scattering=True),
}


def picture(volume: VolumeSettings) -> np.ndarray:
    """A ball of blond hair under a sun and a lamp, in display values, (SIZE, SIZE, 3)."""
    from hairloom.addon.render.camera import Camera, look_at, perspective
    from hairloom.addon.render.frame import render_image
    from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot

    strands = combed_strands(1000)
    snapshot = Snapshot(
        strands,
        np.full(strands.shape[:2], 0.004, np.float32),
        meshes=(MeshSnapshot.of(Surface(*ball_mesh(rings=24))),),
        lights=(
            Light.sun((-0.45, -0.5, -0.8), (1.0, 0.95, 0.9), 3.0),
            Light.point((-1.5, 2.0, 1.5), (0.6, 0.8, 1.0), 150.0),
        ),
        shading=ShadingSettings(model="marschner"),
        volume=volume,
        volume_center=np.zeros(3, np.float32),
    )
    view = look_at((0.0, 0.5, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = Camera(view, perspective(np.radians(30.0), 1.0, 0.1, 20.0))
    drawn = render_image(snapshot, camera, SIZE, SIZE, 2, background=(0.1, 0.1, 0.1, 1.0))
    return np.asarray(srgb_encoded(np.clip(drawn[..., :3], 0.0, 1.0)), np.float32)


def test_shadows_darken_hair_and_are_kept_for_the_comparison(gpu_context: Any) -> None:
    pictures = {name: picture(volume) for name, volume in VOLUMES.items()}
    light = {name: float(shown.mean()) for name, shown in pictures.items()}
    assert all(np.isfinite(shown).all() for shown in pictures.values())
    assert light["deep"] < light["none"] and light["slices"] < light["none"]
    assert light["scattering"] > light["deep"]
    assert light["many_slices"] == pytest.approx(light["deep"], rel=0.1)
    folder = os.environ.get("HAIRLOOM_PICTURES")
    if folder:
        backend = gpu_context.platform.backend_type_get().lower()
        np.savez(Path(folder) / f"{backend}.npz", **pictures)
