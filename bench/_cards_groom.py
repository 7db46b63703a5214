"""Sintel's hair and head, and the settings of her cards, for all card benches."""

from __future__ import annotations

import os
from pathlib import Path

from extension_loader import REPOSITORY

from hairloom.addon import rig_flow
from hairloom.addon.blender.scene.mesh_files import read_mesh_file
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.rig_flow import Rig

#: 800 cards of clusters, an atlas of 2048 baked from the strands, 256 rays per vertex
SETTINGS = (CardSettings(source="clusters"), AtlasSettings(), CardOcclusionSettings())


def sintel_rig() -> Rig:
    """11,400 strands."""
    folder = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data")) / "sintel"
    strands = read_tfx(folder / "SintelHairOriginal-sintel_hair.16points.tfx").strands
    head = read_mesh_file(folder / "sintel.obj", need_uv=False)[0]
    return rig_flow.prepare(strands, head, GuideSettings(), place="Sintel")
