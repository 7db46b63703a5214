"""The atlas of Sintel's cards: how long its bake takes, and how near cards come to strands.

From eight views around her at 1 m, hair alone, drawn as strands and as cards with the atlas that
was baked from them: how much of the picture it covers, and its mean colour. The sheet
out/cards_atlas.png has strands above and cards below, on her head.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from extension_loader import REPOSITORY

from hairloom.addon import pipeline
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.build import CardBuild
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.host.card_atlas import baked_atlas
from hairloom.addon.host.card_maps import made_maps
from hairloom.addon.host.images import contact_sheet, write_png
from hairloom.addon.host.mesh_files import read_mesh_file
from hairloom.addon.pipeline import Rig
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.card_snapshot import CardSnapshot
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.ambient import AmbientSettings
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.textures import HairTextures, TextureSettings

SHEET = REPOSITORY / "out" / "cards_atlas.png"
SIZE, SAMPLES, ROUNDS, VIEWS = 256, 4, 3, 8
DISTANCE, FIELD_OF_VIEW = 1.0, np.radians(30.0)
CARDS = CardSettings(way="clusters", card_count=800)
ATLAS = AtlasSettings(size="2048")
#: 11,400 strands stand for many more
STRANDS = StrandSettings(width_scale=2.0)
SHADING = ShadingSettings()


@dataclass(frozen=True)
class _Choices:
    """What the maps hang on."""

    texture: TextureSettings = field(default_factory=TextureSettings)
    shading: ShadingSettings = SHADING
    strands: StrandSettings = STRANDS
    pictures: dict[str, np.ndarray] = field(default_factory=dict)


def atlas_figures() -> dict[str, float]:
    """The figures by name.

    atlas_seconds: of the bake, the least of some; atlas_cpu_seconds: of all processors together.
    coverage_difference, color_difference: of cards from strands, relative, the worst of all views;
        the colour is the mean of what is covered.
    """
    rig = sintel()
    seconds: list[tuple[float, float]] = []
    found: list[HairTextures] = []

    def alpha_of(build: CardBuild) -> np.ndarray:
        assert build.plan is not None
        for _ in range(ROUNDS):
            begin = time.perf_counter(), time.process_time()
            maps = baked_atlas(rig, build.plan, SHADING, STRANDS)
            seconds.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
        found.append(made_maps(rig, build, _Choices()).textures)
        return maps.alpha

    build = pipeline.card_build(rig, CARDS, ATLAS, CardOcclusionSettings(), alpha_of)
    differences = differences_of(rig, CardSnapshot(build.finest, found[0], has_tangent_map=True))
    wall, cpu = np.min(seconds, axis=0)
    return {"atlas_seconds": float(wall), "atlas_cpu_seconds": float(cpu), **differences}


def sintel() -> Rig:
    data = os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data")
    folder = Path(data) / "sintel"
    strands = read_tfx(folder / "SintelHairOriginal-sintel_hair.16points.tfx").strands
    head = read_mesh_file(folder / "sintel.obj", need_uv=False)
    return pipeline.prepare(strands, head, GuideSettings(), place="Sintel")


def differences_of(rig: Rig, cards: CardSnapshot) -> dict[str, float]:
    grid = rig.strands.grid
    radius = rig.strands.radius.reshape(grid.shape[:2])
    assert rig.head is not None
    head = MeshSnapshot.of(rig.head, is_skin=True)
    strands = Snapshot(
        grid,
        radius,
        occlusion=pipeline.rest_occlusion(rig, AmbientSettings()),
        shading=SHADING,
        strand_settings=STRANDS,
    )
    none = np.zeros((0, *grid.shape[1:]), np.float32)
    as_cards = Snapshot(none, none[..., 0], shading=SHADING, cards=cards)
    coverage, color, sheet = [], [], []
    for view in range(VIEWS):
        camera = camera_at(grid, 2.0 * np.pi * view / VIEWS)
        lights = three_point_lights(camera.view)
        pictures = []
        for snapshot in (strands, as_cards):
            lit = replace(snapshot, lights=lights)
            alone = replace(lit, casters=(head,))
            pictures.append(render_image(alone, camera, SIZE, SIZE, SAMPLES))
            sheet.append(render_image(replace(lit, meshes=(head,)), camera, SIZE, SIZE, SAMPLES))
        (strand_cover, strand_color), (card_cover, card_color) = map(hair_of, pictures)
        coverage.append(abs(card_cover / strand_cover - 1.0))
        color.append(np.abs(card_color - strand_color).mean() / strand_color.mean())
    write_png(SHEET, contact_sheet([*sheet[::2], *sheet[1::2]], VIEWS))
    return {
        "coverage_difference": float(np.max(coverage)),
        "color_difference": float(np.max(color)),
    }


def hair_of(picture: np.ndarray) -> tuple[float, np.ndarray]:
    """Share of the picture that is covered, and the mean colour there."""
    cover = float(picture[..., 3].mean())
    return cover, picture[..., :3].mean(axis=(0, 1)) / cover


def camera_at(grid: np.ndarray, turn: float) -> Camera:
    middle = grid.reshape(-1, 3).mean(axis=0)
    away = np.array([np.sin(turn), -np.cos(turn), 0.15])
    eye = middle + DISTANCE * away / np.linalg.norm(away)
    return Camera(look_at(eye, middle), perspective(FIELD_OF_VIEW, 1.0, 0.1, 10.0))
