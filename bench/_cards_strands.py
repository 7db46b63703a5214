"""Cards beside the strands that they stand for: the sheet out/cards_sheet.png.

Sintel's hair from eight sides at one metre, by one sun and the world's light, in front of a head
that hides what is behind it: strands above, cards below. Both have the groom's own width, the looks
that ship, and shadows of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from _cards_groom import SETTINGS, sintel_rig
from extension_loader import REPOSITORY

from hairloom.addon import pipeline
from hairloom.addon.cards.build import CardBuild
from hairloom.addon.host.card_maps import CardMaps, made_maps
from hairloom.addon.host.images import contact_sheet, write_png
from hairloom.addon.host.presets import named_preset
from hairloom.addon.pipeline import Rig
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.card_snapshot import CardSnapshot
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.textures import TextureSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

SHEET = REPOSITORY / "out" / "cards_sheet.png"
VIEWS, DISTANCE, SIZE, SAMPLES = 8, 1.0, 256, 2
SUN, STRENGTH, WORLD = (0.4, 0.6, -0.8), 4.0, (0.3, 0.3, 0.3)
LOOKS = ("brown", "blond")


@dataclass(frozen=True)
class Choices:
    """What maps hang on."""

    shading: ShadingSettings
    texture: TextureSettings = field(default_factory=TextureSettings)
    strands: StrandSettings = field(default_factory=StrandSettings)
    pictures: Mapping[str, np.ndarray] = field(default_factory=dict)


def strands_figures() -> dict[str, float]:
    """Write the sheet; how far cards are from strands, relative, at worst of the eight views.

    coverage_difference: of the sum of alpha. color_difference_*: of the mean colour, at worst of
    the three channels.
    """
    rig = sintel_rig()
    found: dict[str, float] = {"coverage_difference": 0.0}
    pictures = []
    for name in LOOKS:
        shading = _look(name)
        build, maps = _cards(rig, shading)
        rows = [
            [_drawn(rig, shading, view, cards) for view in range(VIEWS)]
            for cards in (None, CardSnapshot(build.finest, maps.textures, True))
        ]
        coverage, color = _differences(*rows)
        found["coverage_difference"] = max(found["coverage_difference"], coverage)
        found[f"color_difference_{name}"] = color
        pictures += [*rows[0], *rows[1]]
    SHEET.parent.mkdir(exist_ok=True)
    write_png(SHEET, contact_sheet([_shown(each) for each in pictures], VIEWS))
    return found


def _cards(rig: Rig, shading: ShadingSettings) -> tuple[CardBuild, CardMaps]:
    made: list[CardMaps] = []

    def alpha_of(build: CardBuild) -> np.ndarray:
        made.append(made_maps(rig, build, Choices(shading)))
        return made[-1].textures.alpha

    build = pipeline.card_build(rig, *SETTINGS, alpha_of)
    return build, made[-1]


def _look(name: str) -> ShadingSettings:
    (shading,) = [s for s in named_preset(f"looks/{name}").all if s.section == "shading"]
    assert isinstance(shading, ShadingSettings)
    return shading


def _drawn(rig: Rig, shading: ShadingSettings, view: int, cards: CardSnapshot | None) -> np.ndarray:
    """One view of strands, or of cards in their place."""
    strands = rig.strands
    snapshot = Snapshot(
        strands=strands.grid.astype(np.float32),
        radius=strands.radius.reshape(strands.strand_count, -1).astype(np.float32),
        meshes=(replace(MeshSnapshot.of(rig.head), is_holdout=True),),
        lights=(Light.sun(SUN, (1.0, 1.0, 1.0), STRENGTH),),
        ambient=WORLD,
        shading=shading,
        volume=VolumeSettings(shadows="deep"),
    )
    if cards is not None:
        nothing = np.zeros((0, 2, 3), np.float32)
        snapshot = replace(snapshot, strands=nothing, radius=nothing[..., 0], cards=cards)
    return render_image(snapshot, _camera(rig, view), SIZE, SIZE, SAMPLES)


def _camera(rig: Rig, view: int) -> Camera:
    low, high = rig.strands.bounds()
    middle, turn = (low + high) / 2.0, 2.0 * np.pi * view / VIEWS
    away = np.array([np.sin(turn), -np.cos(turn), 0.15])
    eye = middle + DISTANCE * away / np.linalg.norm(away)
    reach = float(np.linalg.norm(high - low))
    angle = 2.0 * np.arctan(0.55 * reach / DISTANCE)
    return Camera(look_at(eye, middle), perspective(angle, 1.0, 0.05, 5.0))


def _differences(strands: list[np.ndarray], cards: list[np.ndarray]) -> tuple[float, float]:
    coverage, color = [], []
    for one, other in zip(strands, cards, strict=True):
        covered = one[..., 3].sum(), other[..., 3].sum()
        coverage.append(abs(covered[1] / covered[0] - 1.0))
        mean = [p[..., :3].sum(axis=(0, 1)) / c for p, c in zip((one, other), covered, strict=True)]
        color.append(np.abs(mean[1] / mean[0] - 1.0).max())
    return float(max(coverage)), float(max(color))


def _shown(picture: np.ndarray) -> np.ndarray:
    """In front of grey."""
    backdrop = np.array([0.2, 0.2, 0.2, 1.0], np.float32)
    return picture + backdrop * (1.0 - picture[..., 3:])
