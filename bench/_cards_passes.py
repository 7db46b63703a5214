"""Sintel's cards by four passes against fragments sorted in each pixel, and against three passes.

The reference draws each card alone, in the same light and with the shadows of all cards, and
composites them per pixel by depth. Cost is that of the passes alone: head, shadow maps and textures
are there already. All variants take turns, so that load on the machine affects them alike.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import gpu
import numpy as np
from _cards_groom import sintel_rig

from hairloom.addon.blender.cards.build import BuiltCards, CardInputs
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.drawing_settings import CardDrawingSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.exchange.textures.srgb import srgb_encoded
from hairloom.addon.params import SettingsMap
from hairloom.addon.render.accumulation import Target
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.card_pass import CardPass
from hairloom.addon.render.card_snapshot import CardSnapshot
from hairloom.addon.render.mesh_pass import MeshPass
from hairloom.addon.render.opacity_maps import OpacityMaps
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.textures import texture_to_array
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

SIZE, COST_SIZE = 288, 720
VIEWS = ((-0.55, -1.0, 0.18), (0.9, 0.25, 0.3), (0.1, 1.0, 0.1))
FIELD_OF_VIEW, MARGIN = np.radians(30.0), 0.85
ROUNDS = 9
CARDS = CardSettings(source="clusters", card_count=800)
WAYS = {
    "four": CardDrawingSettings(),
    "four_as_in_the_paper": CardDrawingSettings(skip_clear=False),
    "three": CardDrawingSettings(passes="three"),
    "four_by_view": CardDrawingSettings(order="view"),
}


@dataclass(frozen=True)
class Stage:
    """What is drawn, from where, and the shadows on it."""

    snapshot: Snapshot
    camera: Camera
    passes: CardPass
    maps: OpacityMaps | None

    def by(self, drawing: CardDrawingSettings) -> Snapshot:
        assert self.snapshot.cards is not None
        return replace(self.snapshot, cards=replace(self.snapshot.cards, drawing=drawing))


def passes_figures() -> dict[str, float]:
    """The figures by name.

    fourpass_error: mean difference of displayed colours (sRGB, 0 to 1) from the sorted reference
        where cards cover anything, over all views; fourpass_error_<way>: of the other variants.
    fourpass_speedup: time of three passes over that of four, each the minimum over ROUNDS;
        fourpass_speedup_as_in_the_paper: the same of four that test no alpha after the first.
    """
    stages = [stage(view) for view in VIEWS]
    errors = {name: [] for name in WAYS}
    for each in stages:
        expected, covered = sorted_picture(each)
        for name, drawing in WAYS.items():
            difference = np.abs(shown(drawn(each, drawing, SIZE)) - shown(expected))
            errors[name].append(float(difference[covered].mean()))
    times = cost(stages)
    found = {"fourpass_error": float(np.mean(errors["four"]))}
    found |= {
        f"fourpass_error_{name}": float(np.mean(errors[name])) for name in WAYS if name != "four"
    }
    return {
        **found,
        "fourpass_speedup": times["three"] / times["four"],
        "fourpass_speedup_as_in_the_paper": times["three"] / times["four_as_in_the_paper"],
        **{f"passes_ms_{name}": found for name, found in times.items()},
    }


def stage(direction: tuple[float, float, float]) -> Stage:
    """Sintel with 800 cards in Marschner's model, under three lights with deep shadows."""
    cards, head = sintel_cards()
    low, high = cards.mesh.bounds()
    camera = frame_camera((low, high), direction, FIELD_OF_VIEW, 1.0, margin=MARGIN)
    none = np.zeros((0, 2, 3), np.float32)
    snapshot = Snapshot(
        none,
        none[..., 0],
        meshes=(head,),
        lights=three_point_lights(camera.view),
        shading=ShadingSettings(model="marschner"),
        volume=VolumeSettings(shadows="deep"),
        cards=cards,
    )
    passes = CardPass()
    return Stage(snapshot, camera, passes, passes.opacity(snapshot))


_kept: list[tuple[CardSnapshot, MeshSnapshot]] = []


def sintel_cards() -> tuple[CardSnapshot, MeshSnapshot]:
    if not _kept:
        rig = sintel_rig()
        assert rig.head is not None
        settings = SettingsMap(CARDS, AtlasSettings(source="made"))
        built = BuiltCards.build(CardInputs(rig, settings))
        cards = built.with_drawing_settings(built.rest, settings)
        _kept.append((cards, MeshSnapshot.of(rig.head)))
    return _kept[0]


def drawn(each: Stage, drawing: CardDrawingSettings, size: int) -> np.ndarray:
    """Head and cards, (size, size, 4)."""
    target = Target()
    target.sized(size, size).clear((0.0, 0.0, 0.0, 1.0))
    snapshot = each.by(drawing)
    with target.drawing():
        MeshPass().draw(snapshot, each.camera, size, size, opacity=each.maps)
        each.passes.draw(snapshot, each.camera, size, size, opacity=each.maps)
    return texture_to_array(target.color).copy()


def sorted_picture(each: Stage) -> tuple[np.ndarray, np.ndarray]:
    """The reference, (SIZE, SIZE, 4), and where cards cover anything."""
    snapshot, target, passes = each.snapshot, Target(), CardPass()
    assert snapshot.cards is not None
    mesh = snapshot.cards.mesh
    target.sized(SIZE, SIZE).clear((0.0, 0.0, 0.0, 1.0))
    with target.drawing():
        MeshPass().draw(snapshot, each.camera, SIZE, SIZE, opacity=each.maps)
    picture = texture_to_array(target.color).reshape(-1, 4).copy()
    wall = target.depths().ravel()
    pixels, depths, colors = [], [], []
    for card in np.unique(mesh.card):
        own = mesh.card == card
        alone = replace(mesh, triangles=mesh.triangles[own], card=mesh.card[own])
        shot = replace(snapshot, cards=replace(snapshot.cards, mesh=alone, back_triangles=None))
        target.clear((0.0, 0.0, 0.0, 0.0))
        with target.drawing():
            passes.draw_depth(shot, each.camera, SIZE, SIZE, min_alpha=0.0)
        depth = target.depths().ravel()
        target.clear((0.0, 0.0, 0.0, 0.0))
        with target.drawing():
            passes.draw(shot, each.camera, SIZE, SIZE, opacity=each.maps)
        color = texture_to_array(target.color).reshape(-1, 4)
        seen = np.flatnonzero((color[:, 3] > 0.0) & (depth < wall))
        pixels.append(seen)
        depths.append(depth[seen])
        colors.append(color[seen])
    pixel, depth, color = (np.concatenate(parts) for parts in (pixels, depths, colors))
    order = np.lexsort((-depth, pixel))
    pixel, color = pixel[order], color[order]
    rank = np.arange(len(pixel)) - np.searchsorted(pixel, pixel)
    for turn in range(int(rank.max()) + 1):
        now = rank == turn
        picture[pixel[now]] = color[now] + picture[pixel[now]] * (1.0 - color[now, 3:])
    covered = np.zeros(SIZE * SIZE, bool)
    covered[pixel] = True
    return picture.reshape(SIZE, SIZE, 4), covered.reshape(SIZE, SIZE)


def shown(picture: np.ndarray) -> np.ndarray:
    return srgb_encoded(np.clip(picture[..., :3], 0.0, 1.0))


def cost(stages: list[Stage]) -> dict[str, float]:
    """The minimum time of the passes over the head [ms], by variant; mean over the views."""
    color = gpu.types.GPUTexture((COST_SIZE, COST_SIZE), format="RGBA16F")
    depth = gpu.types.GPUTexture((COST_SIZE, COST_SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    min_ms = {name: np.full(len(stages), np.inf) for name in WAYS}
    for _ in range(ROUNDS):
        for place, each in enumerate(stages):
            for name, drawing in WAYS.items():
                snapshot = each.by(drawing)
                with target.bind():
                    target.clear(color=(0.0, 0.0, 0.0, 1.0), depth=1.0)
                    MeshPass().draw(snapshot, each.camera, COST_SIZE, COST_SIZE)
                    target.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
                    begin = time.perf_counter()
                    each.passes.draw(snapshot, each.camera, COST_SIZE, COST_SIZE, opacity=each.maps)
                    target.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
                    milliseconds = (time.perf_counter() - begin) * 1000.0
                min_ms[name][place] = min(min_ms[name][place], milliseconds)
    return {name: float(found.mean()) for name, found in min_ms.items()}
