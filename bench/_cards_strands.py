"""Cards beside the strands that they represent: the sheet out/cards_sheet.png.

Sintel's hair from eight sides at one metre, lit by one sun and the world, with the head as a
holdout: strands above, cards below, in two looks and two widths of strands. With deep shadows,
strands shadow strands and cards shadow cards; without, only ambient occlusion darkens them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from _cards_groom import SETTINGS, sintel_rig
from extension_loader import REPOSITORY

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.cards.build import (
    BuiltCards,
    CardInputs,
    MappedCards,
    build_steps,
    card_maps,
    draw_maps,
)
from hairloom.addon.blender.cards.show import without_strands
from hairloom.addon.blender.properties.presets import named_preset
from hairloom.addon.cards.steps import result_of
from hairloom.addon.light_flow import HairLight, rest_light
from hairloom.addon.params import SettingsMap
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.card_snapshot import CardSnapshot
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.strand_layout import StrandLayout
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

SHEET = REPOSITORY / "out" / "cards_sheet.png"
VIEWS, DISTANCE, SIZE, SAMPLES = 8, 1.0, 256, 2
#: some views are also drawn larger, with strands that are a good part of a pixel wide
LARGE, LARGE_VIEWS = 1024, (0, 3)
SUN, STRENGTH, WORLD = (0.4, 0.6, -0.8), 4.0, (0.3, 0.3, 0.3)
LOOKS, WIDTHS, SHADOWS = ("brown", "blond"), (1.0, 2.0), ("deep", "none")


def strands_figures() -> dict[str, float]:
    """Write the sheet; relative differences of cards from strands, the worst of the eight views.

    coverage_difference: of the sum of alpha, over both widths; coverage_difference_<size>: of the
        larger pictures, with strands as wide as in the file.
    color_difference_<look>: of the mean colour where hair covers, the worst of the three channels
        and of both widths, with shadows; color_difference_<look>_unshadowed: without.
    """
    rig = sintel_rig()
    light = rest_light(rig, AmbientSettings())
    found: dict[str, float] = {"coverage_difference": 0.0}
    pictures: list[np.ndarray] = []
    for width in WIDTHS:
        made = _made(rig, width)
        for look in LOOKS:
            strands = _strands(rig, look, width, light)
            cards = _as_cards(strands, _cards(rig, made, look, width))
            for shadows in SHADOWS:
                rows = [_drawn(rig, hair, shadows) for hair in (strands, cards)]
                coverage, color = _differences(*rows)
                found["coverage_difference"] = max(found["coverage_difference"], coverage)
                name = f"color_difference_{look}{'_unshadowed' * (shadows == 'none')}"
                found[name] = max(found.get(name, 0.0), color)
                pictures += [*rows[0], *rows[1]] if shadows == SHADOWS[0] else []
            if width == WIDTHS[0] and look == LOOKS[0]:
                rows = [_drawn(rig, h, "none", LARGE_VIEWS, LARGE) for h in (strands, cards)]
                found[f"coverage_difference_{LARGE}"] = _differences(*rows)[0]
    SHEET.parent.mkdir(exist_ok=True)
    write_png(SHEET, contact_sheet([_shown(each) for each in pictures], VIEWS))
    return found


def _settings(look: str, width: float) -> SettingsMap:
    return SettingsMap(*SETTINGS, _look(look), StrandSettings(fullness=width))


def _made(rig: Rig, width: float) -> MappedCards:
    return result_of(build_steps(CardInputs(rig, _settings(LOOKS[0], width))))


def _cards(rig: Rig, made: MappedCards, look: str, width: float) -> CardSnapshot:
    """The cards in a look, on which only their maps depend."""
    settings = _settings(look, width)
    maps = card_maps(CardInputs(rig, settings), made.build, draw_maps)
    built = BuiltCards.of(rig, replace(made, maps=maps))
    return built.with_drawing_settings(built.rest, settings)


def _look(name: str) -> ShadingSettings:
    (shading,) = [s for s in named_preset(f"looks/{name}").all if s.section == "shading"]
    assert isinstance(shading, ShadingSettings)
    return shading


def _strands(rig: Rig, look: str, width: float, light: HairLight) -> Snapshot:
    strands = rig.strands
    assert rig.head is not None
    return Snapshot(
        points=strands.points,
        radius=strands.radius,
        layout=StrandLayout(strands.offsets),
        occlusion=light.occlusion,
        openness=light.openness,
        skin_seen=light.skin_seen,
        meshes=(replace(MeshSnapshot.of(rig.head), is_holdout=True),),
        lights=(Light.sun(SUN, (1.0, 1.0, 1.0), STRENGTH),),
        ambient=WORLD,
        shading=_look(look),
        strand_settings=StrandSettings(fullness=width),
    )


def _as_cards(hair: Snapshot, cards: CardSnapshot) -> Snapshot:
    return replace(without_strands(hair), cards=cards)


def _drawn(
    rig: Rig, hair: Snapshot, shadows: str, views: tuple[int, ...] = (), size: int = SIZE
) -> list[np.ndarray]:
    """Pictures from these views, or from all."""
    shaded = replace(hair, volume=VolumeSettings(shadows=shadows))
    chosen = views or range(VIEWS)
    return [render_image(shaded, _camera(rig, view), size, size, SAMPLES) for view in chosen]


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
    """The picture over grey."""
    backdrop = np.array([0.2, 0.2, 0.2, 1.0], np.float32)
    return picture + backdrop * (1.0 - picture[..., 3:])
