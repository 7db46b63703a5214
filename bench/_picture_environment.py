"""Hair in the light of three procedural worlds, beside Cycles' path tracing of the same curves.

The built-in groom on its head, with default settings; the world is read from the nodes of Cycles'
own world, as a user's is. FLIP and light are those of the pixels that hair covers; all colours
under one world share an exposure, at which the brightest of them is bright.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from _shading_room import CyclesRoom
from _sight_cover import coverage
from _sight_grooms import built_in, rig_of
from _sight_pictures import COLORS, _flip, _studio, plain_look

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.scene.world import read_environment
from hairloom.addon.render.snapshot import SKIN
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.drawn_strands import drawn_radius
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.strands.arc_length import length_fractions

SHEET = Path(__file__).resolve().parents[1] / "out" / "environment_sheet.png"
SIZE, SAMPLES = 160, 3
#: of Cycles' pictures, which are denoised: paths per pixel, bounces
PATHS, BOUNCES = 64, 64
#: pixels of a panorama
ROWS, COLUMNS = 128, 256
#: the brightest tenth of the brightest hair is this bright in a picture
SHOWN = 0.5
#: least coverage of a pixel that counts as hair
_IS_HAIR = 0.5


def _directions() -> np.ndarray:
    """The direction of each pixel of a panorama, (ROWS, COLUMNS, 3), row 0 at the bottom."""
    height = (np.arange(ROWS)[:, None] + 0.5) / ROWS * np.pi - 0.5 * np.pi
    turn = (0.5 - (np.arange(COLUMNS)[None, :] + 0.5) / COLUMNS) * 2.0 * np.pi
    flat = np.cos(height)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), np.sin(height) + 0.0 * turn], -1)


def _near(towards: tuple[float, float, float], degrees: float) -> np.ndarray:
    cosine = _directions() @ (np.array(towards) / np.linalg.norm(towards))
    return (cosine > np.cos(np.radians(degrees)))[..., None]


def sun_low() -> np.ndarray:
    """A sun of 3 degrees in a clear sky, over dark ground."""
    up = _directions()[..., 2:]
    sky = np.array([0.25, 0.38, 0.7]) * (0.4 + 0.6 * (1.0 - np.clip(up, 0.0, 1.0)) ** 2)
    world = np.where(up > 0.0, sky, np.array([0.06, 0.05, 0.04]))
    return np.where(_near((-0.5, -0.8, 0.3), 1.5), np.array([1400.0, 1150.0, 800.0]), world)


def overcast() -> np.ndarray:
    """The standard overcast sky of the CIE, three times as bright at the zenith."""
    up = _directions()[..., 2:]
    sky = np.array([0.95, 1.0, 1.08]) * (1.0 + 2.0 * np.clip(up, 0.0, 1.0)) / 3.0
    return np.where(up > 0.0, sky, np.array([0.12, 0.11, 0.1]))


def window() -> np.ndarray:
    """A bright window of 36 by 45 degrees in a dim room."""
    towards = _directions()
    turn = np.arctan2(towards[..., 1], towards[..., 0]) + np.radians(150.0)
    height = np.arcsin(towards[..., 2]) - np.radians(15.0)
    is_window = (np.abs(turn) < np.radians(18.0)) & (np.abs(height) < np.radians(22.5))
    return np.where(is_window[..., None], np.array([7.0, 7.6, 8.5]), np.array([0.10, 0.085, 0.07]))


WORLDS: dict[str, Callable[[], np.ndarray]] = {
    "sun_low": sun_low,
    "overcast": overcast,
    "window": window,
}


def truths(rig: Rig, camera: Any) -> Iterator[tuple[str, str, Any, np.ndarray]]:
    """The name of a world, that of a colour, Blender's world, and Cycles' picture."""
    room, strands = CyclesRoom(), rig.strands
    drawn = drawn_radius(
        strands.radius, StrandSettings(), length_fractions(strands.points, strands.offsets)
    )
    room.strands(strands.points, drawn, counts=strands.point_counts)
    room.body(rig.head.positions, rig.head.triangles, SKIN, casts_shadow=True)
    room.look(camera)
    room.sun(np.array([0.0, 0.0, 1.0]), 0.0)
    room.paths(PATHS, BOUNCES, is_denoised=True)
    for world, radiance in WORLDS.items():
        room.world(radiance())
        for color, absorption in COLORS.items():
            node, _ = plain_look(absorption)
            room.hair(
                absorption,
                Roughness=node.roughness,
                Radial_Roughness=node.radial_roughness,
                Offset=node.offset,
            )
            yield world, color, room.blender_world, room.picture(SIZE)


def environment() -> dict[str, Any]:
    """environment_flip_hair: the largest mean FLIP of hair, of all worlds and colours.
    environment_light_percent: largest error of a channel's light on hair.
    """
    rig = rig_of(built_in(), "built-in")
    camera = _studio(rig)._camera(1.0)
    is_hair = coverage(rig, camera, SIZE, SAMPLES) > _IS_HAIR
    pairs: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    for world, color, blender_world, truth in truths(rig, camera):
        picture = _ours(rig, camera, COLORS[color], blender_world)
        pairs.setdefault(world, {})[color] = truth, picture
    found: dict[str, Any] = {}
    pictures = []
    for world, of_colors in pairs.items():
        exposure = min(
            SHOWN / float(np.percentile(truth[is_hair, :3].max(axis=-1), 90.0))
            for truth, _ in of_colors.values()
        )
        for color, (truth, picture) in of_colors.items():
            name = f"environment_{world}_{color}"
            found[f"{name}_flip"] = _flip(truth * exposure, picture * exposure, is_hair)
            light = picture[is_hair, :3].mean(axis=0) / truth[is_hair, :3].mean(axis=0)
            found |= {f"{name}_light_{c}": float(light[n]) for n, c in enumerate("rgb")}
            pictures += [_shown(each, exposure) for each in (truth, picture)]
    SHEET.parent.mkdir(exist_ok=True)
    write_png(SHEET, contact_sheet(pictures, 2 * len(COLORS)))
    off = [abs(value - 1.0) for name, value in found.items() if "_light_" in name]
    max_flip = max(value for name, value in found.items() if name.endswith("_flip"))
    return {
        "environment_flip_hair": max_flip,
        "environment_light_percent": 100.0 * max(off),
        **found,
    }


def _ours(rig: Rig, camera: Any, absorption: tuple[float, float, float], world: Any) -> np.ndarray:
    """Our picture of the groom in the light of Blender's world."""
    _, look = plain_look(absorption)
    studio = _studio(rig, GroomSettings().with_settings(look))
    light = read_environment(SimpleNamespace(world=world))
    snapshot = replace(
        studio._rest_snapshot,
        points=rig.strands.points,
        meshes=studio.meshes(rig.rest_pose),
        lights=light.suns,
        ambient=light.ambient,
        harmonics=light.harmonics,
    )
    return studio._draw(snapshot, camera, SIZE, SIZE, SAMPLES)


def _shown(picture: np.ndarray, exposure: float) -> np.ndarray:
    shown = picture.copy()
    shown[..., :3] *= exposure
    shown[..., 3] = 1.0
    return shown
