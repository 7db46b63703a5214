"""An asset for engines with Hairloom's picture of it, and the comparison of an engine's picture."""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from extension_loader import REPOSITORY

from hairloom.addon import rig_flow
from hairloom.addon.blender.cards.build import CardInputs
from hairloom.addon.blender.cards.files import CardOutput, WrittenCards, write_cards
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.exchange.textures.texture_files import read_texture
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import StrandSet

#: in the repository: the engines run in a sandbox that sees nothing else
OUTPUT = REPOSITORY / "out" / "engines"

SIZE, FIELD_OF_VIEW = 480, 30.0
EYE, TARGET = (0.25, -0.45, 0.1), (0.0, 0.0, -0.01)
TO_SUN = tuple(np.array([0.5, -0.7, 0.5]) / np.linalg.norm([0.5, -0.7, 0.5]))
IRRADIANCE = 4.0
#: Ambient radiance. None for Marschner: engines have a fit to Hairloom's, see
#: gpu/test_engine_light.py.
AMBIENT = {"kajiya_kay": 0.3, "marschner": 0.0}
NEAR, FAR = 0.05, 5.0

MAX_MEAN_DIFFERENCE = 1.0 / 255.0
#: Largest fraction of pixels that may differ by more than 8 / 255: engines make mip maps in another
#: way, which sharp highlights show, and thin cards that are nearly edge-on cover other pixels.
#: Without denser alpha at grazing angles, baked cards would reach 0.034.
MAX_DIFFERENT_FRACTION = {"kajiya_kay": 0.03, "marschner": 0.005, "baked": 0.022}


@dataclass(frozen=True)
class Asset:
    """A folder with all files that an engine reads, and Hairloom's picture of it, row 0 on top."""

    folder: Path
    picture: np.ndarray


def curtain_strands() -> StrandSet:
    """Strands that hang around a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(40)], axis=-1)
    fall = np.linspace([0.0, 0.0, 0.1], [0.0, 0.0, -0.1], 8)
    points = out[:, None] * 0.1 + fall + out[:, None] * np.linspace(0.0, 0.05, 8)[:, None] ** 2
    return StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(41) * 8,
        radius=np.full(320, 2.0e-3),
        group=np.zeros(40, np.int32),
    )


def glb_axes(vector: Any) -> list[float]:
    return [float(vector[0]), float(vector[2]), -float(vector[1])]


def write_asset(
    folder_name: str,
    look_name: str,
    export: CardExportSettings,
    name: str | None = None,
    file: str = "cards.glb",
) -> Asset:
    is_baked = look_name == "baked"
    model = "marschner" if is_baked else look_name
    folder = OUTPUT / folder_name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    look = ShadingSettings(
        model=model,
        base_color=(0.5, 0.3, 0.15),
        tip_color=(0.3, 0.1, 0.05),
        tip_tint=0.6,
        grey_fraction=0.1,
    )
    texture = TextureSettings(
        variant_width=16,
        height=64,
        strand_count=6,
        highlights="shift" if model == "kajiya_kay" else "tangent",
    )
    rig = rig_flow.prepare(curtain_strands(), None, GuideSettings(), place="curtain")
    settings = SettingsMap(
        CardSettings(source="clusters" if is_baked else "guides", width_factor=1.5, card_count=40),
        AtlasSettings(source="baked" if is_baked else "made", size="512", columns=8),
        texture,
        look,
    )
    output = CardOutput(name=name, settings=export)
    written = write_cards(folder / file, CardInputs(rig, settings), output)
    view = {
        "eye": glb_axes(EYE),
        "target": glb_axes(TARGET),
        "to_sun": glb_axes(TO_SUN),
        "irradiance": IRRADIANCE,
        "ambient": AMBIENT[model],
        "size": SIZE,
        "field_of_view": FIELD_OF_VIEW,
        "near": NEAR,
        "far": FAR,
    }
    (folder / "view.json").write_text(json.dumps(view), encoding="utf-8")
    return Asset(folder, render_with_hairloom(written, look))


def render_with_hairloom(written: WrittenCards, look: ShadingSettings) -> np.ndarray:
    from hairloom.addon.render.camera import Camera, look_at, perspective
    from hairloom.addon.render.card_snapshot import CardSnapshot
    from hairloom.addon.render.frame import render_image
    from hairloom.addon.render.snapshot import Snapshot

    snapshot = Snapshot(
        np.zeros((0, 2, 3), np.float32),
        np.zeros((0, 2), np.float32),
        cards=CardSnapshot(
            written.mesh,
            written.maps.textures,
            written.maps.has_tangent_map,
            is_view_compensated=written.maps.is_view_compensated,
        ),
        lights=(Light.sun(tuple(-x for x in TO_SUN), (1.0, 1.0, 1.0), IRRADIANCE),),
        ambient=(AMBIENT[look.model],) * 3,
        shading=look,
        volume=VolumeSettings(shadows="none"),
    )
    projection = perspective(math.radians(FIELD_OF_VIEW), 1.0, NEAR, FAR)
    return render_image(snapshot, Camera(look_at(EYE, TARGET), projection), SIZE, SIZE, 1)


def check_picture(asset: Asset, picture_path: Path) -> None:
    """The engine's picture equals ours within limits, both in display values."""
    theirs = read_texture(picture_path, is_color=False)[..., :3]
    ours = read_encoded(asset.picture)
    difference = np.abs(theirs - ours)
    assert (ours.max(axis=-1) > 0.1).mean() > 0.1  # there is hair in it
    assert difference.mean() < MAX_MEAN_DIFFERENCE
    assert (difference.max(axis=-1) > 8.0 / 255.0).mean() < MAX_DIFFERENT_FRACTION[
        asset.folder.name
    ]


def read_encoded(linear: np.ndarray) -> np.ndarray:
    """A scene-linear picture before black, encoded with the sRGB curve, (height, width, 3)."""
    color = np.clip(linear[..., :3], 0.0, 1.0)
    return np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)
