"""Hair that layered transparency misses: grown strands drawn as layers, and hashed, without lists.

White hair in white light around a black head, so that a pixel's red is the coverage of hair.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.mesh_pass import MeshPass
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

CV_COUNT, SAMPLES = 16, 8
VIEW, FIELD_OF_VIEW = (-0.55, -1.0, 0.18), np.radians(30.0)
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
#: A pixel has hair above COVERED, by the mean of all samples, and none below EMPTY, by layers. The
#: gap between them allows for the noise of samples.
COVERED, EMPTY = 0.5, 0.05


def missing_percent(strand_count: int, width: int, height: int, width_factor: float = 1.0) -> float:
    """The percentage of pixels covered by hashed strands in which layers draw none.

    Args:
        width, height: of the picture [pixels].
        width_factor: factor on the widths with which strands grow.
    """
    layers, hashed = coverages(strand_count, width, height, width_factor)
    is_covered = hashed > COVERED
    return float(100.0 * (layers[is_covered] < EMPTY).mean())


def coverages(
    strand_count: int, width: int, height: int, width_factor: float
) -> tuple[np.ndarray, np.ndarray]:
    """Coverage of each pixel (height, width): as layers, and as the mean of all hashed samples."""
    shown, camera = grown_hair(strand_count, width / height, width_factor)
    passes = MeshPass(), StrandPass()

    def drawn(transparency: str, sample: int) -> np.ndarray:
        settings = replace(shown.strand_settings, transparency=transparency)
        own, eye = replace(shown, strand_settings=settings), replace(camera, sample=sample)
        return render_image(own, eye, width, height, 1, passes=passes)[..., 0]

    layers, hashed = drawn("layers", 0).copy(), np.zeros((height, width), np.float32)
    for sample in range(SAMPLES):
        hashed += drawn("hashed", sample) / SAMPLES
    return layers, hashed


def grown_hair(strand_count: int, aspect: float, width_factor: float) -> tuple[Snapshot, Camera]:
    """A groom on the built-in head, and a camera that frames it."""
    head = built_in_head().surface
    settings = GrowSettings(strand_count=strand_count, cv_count=CV_COUNT)
    strands = grow(head, settings, scalp_density(head))
    shown = Snapshot(
        strands.grid,
        width_factor * strands.radius.reshape(strands.strand_count, -1),
        meshes=(MeshSnapshot.of(head, BLACK),),
        ambient=WHITE,
        shading=ShadingSettings(base_color=WHITE, color_variation=0.0),
        strand_settings=StrandSettings(),
        volume=VolumeSettings(shadows="none"),
    )
    low, high = strands.points.min(axis=0), strands.points.max(axis=0)
    return shown, frame_camera((low, high), VIEW, FIELD_OF_VIEW, aspect)
