"""Patches of standing, leaning or lying blond strands on black ground under one sun, beside Cycles.

Cycles renders the same picture with few and with many bounces, which shows how many strands scatter
light before it reaches the eye. Means are taken over the middle of a patch, so that only light
among strands counts: no outline, no head, no hairstyle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from _shading_room import CyclesRoom
from _sight_pictures import COLORS, plain_look

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

COLOR = "blond"
#: height of the layer of strands, their radius [m], and metres of strand per cubic metre; a path of
#: a metre crosses 20 strands
HEIGHT, RADIUS, DENSITY = 0.5, 0.002, 5000.0
#: angles from the ground's normal [rad]; deviation of strands from them
LEANS, DISORDER = {"standing": 0.0, "leaning": np.radians(60.0), "lying": 0.5 * np.pi}, 0.15
#: angle from the normal towards +X, where strands lean, and around the normal [degrees]
SUN = (40.0, 0.0)
EYES = {"ahead": (60.0, 0.0), "against": (60.0, 180.0), "aside": (60.0, 90.0)}
DISTANCE, SHOWN = 50.0, 0.5
SIZE, SAMPLES, PATHS = 48, 2, 24
BOUNCES = (0, 4, 16, 64)


def patch_figures() -> dict[str, float]:
    """For each patch and eye, in red and blue: the ratio of our light to Cycles', and the fraction
    of Cycles' light that each number of bounces yields.
    """
    found = {}
    sun, room = _direction(*SUN), CyclesRoom()
    node, _ = plain_look(COLORS[COLOR])
    room.body(_GROUND.positions, _GROUND.triangles, casts_shadow=True)
    room.sun(sun, float(np.pi))
    room.hair(
        COLORS[COLOR],
        Roughness=node.roughness,
        Radial_Roughness=node.radial_roughness,
        Offset=node.offset,
    )
    for kind, eye, points, camera in _views():
        room.strands(points, RADIUS)
        room.look(camera)
        theirs = {bounces: _theirs(room, bounces) for bounces in BOUNCES}
        whole = theirs[BOUNCES[-1]]
        ratio = _ours(points, sun, camera) / whole
        for channel, name in ((0, "red"), (2, "blue")):
            found[f"patch_{kind}_{eye}_{name}"] = float(ratio[channel])
            for bounces in BOUNCES[:-1]:
                fraction = theirs[bounces][channel] / whole[channel]
                found[f"patch_{kind}_{eye}_{name}_{bounces}_bounces"] = float(fraction)
    return found


def _views() -> Iterator[tuple[str, str, np.ndarray, Camera]]:
    lens = perspective(2.0 * float(np.arctan(0.5 * SHOWN / DISTANCE)), 1.0, 1.0, 2.0 * DISTANCE)
    middle = np.array([0.0, 0.0, 0.7 * HEIGHT])
    for kind, lean in LEANS.items():
        points = _patch(lean)
        for name, angles in EYES.items():
            to_eye = _direction(*angles)
            up = (1.0, 0.0, 0.0) if abs(to_eye[1]) > 0.8 else (0.0, 1.0, 0.0)
            view = look_at(tuple(middle + DISTANCE * to_eye), tuple(middle), up=up)
            yield kind, name, points, Camera(view, lens)


def _patch(lean: float) -> np.ndarray:
    """Strands over an area of two by two metres, (n, 4, 3) float32, root first."""
    chance = np.random.default_rng(3)
    if lean < 1.5:
        count, length = int(4.0 * DENSITY * np.cos(lean)), HEIGHT / np.cos(lean)
        root = chance.uniform(-1.0, 1.0, (count, 3)) * np.array([1.0, 1.0, 0.0])
        root[:, 0] -= 0.5 * HEIGHT * np.tan(lean)
        spread = np.full(3, DISORDER)
    else:
        # a little longer than the patch, and nearly horizontal
        length = 2.6
        count = int(DENSITY * 2.0 * HEIGHT)
        root = chance.uniform(-1.0, 1.0, (count, 3))
        root[:, 0], root[:, 2] = -0.5 * length, 0.5 * HEIGHT * (root[:, 2] + 1.0)
        spread = DISORDER * np.array([1.0, 1.0, 0.3])
    direction = np.array([np.sin(lean), 0.0, np.cos(lean)]) + spread * chance.normal(
        size=(count, 3)
    )
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    if lean >= 1.5:
        root[:, 1:] -= 0.5 * length * direction[:, 1:]
    along = np.linspace(0.0, length, 4)[None, :, None]
    return (root[:, None] + along * direction[:, None]).astype(np.float32)


def _direction(lean: float, around: float) -> np.ndarray:
    away, turn = np.radians([lean, around])
    return np.array([np.sin(away) * np.cos(turn), np.sin(away) * np.sin(turn), np.cos(away)])


def _ours(points: np.ndarray, sun: np.ndarray, camera: Camera) -> np.ndarray:
    snapshot = Snapshot(
        points,
        np.full(points.shape[:2], RADIUS, np.float32),
        meshes=(replace(MeshSnapshot.of(_GROUND, color=(0.0, 0.0, 0.0)), specular=0.0),),
        lights=(Light.sun(-sun, (1.0, 1.0, 1.0), float(np.pi)),),
        ambient=(0.0, 0.0, 0.0),
        shading=plain_look(COLORS[COLOR])[1],
        strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0),
        detail=DetailSettings(culling="none", lod_size=0.0),
        volume=VolumeSettings(strand_fraction=1.0),
    )
    picture = render_image(snapshot, camera, SIZE, SIZE, SAMPLES)
    found: np.ndarray = picture[..., :3].mean(axis=(0, 1))
    return found


def _theirs(room: CyclesRoom, bounces: int) -> np.ndarray:
    room.paths(PATHS, bounces)
    found: np.ndarray = room.picture(SIZE)[..., :3].mean(axis=(0, 1))
    return found


_GROUND = Surface(
    np.array([[-1.6, -1.6, 0.0], [1.6, -1.6, 0.0], [1.6, 1.6, 0.0], [-1.6, 1.6, 0.0]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]]),
)
