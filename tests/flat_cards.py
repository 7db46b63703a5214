"""Flat rectangular cards for tests that draw them: meshes, plain textures, snapshots, a camera."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.shading.textures import HairTextures
from hairloom.addon.shading.volume.settings import VolumeSettings


def card(
    low: tuple[float, float],
    high: tuple[float, float],
    y: float,
    *,
    tilt: float = 0.0,
    u: tuple[float, float] = (0.0, 1.0),
    occlusion: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
) -> dict[str, np.ndarray]:
    """A rectangle from low to high (x, z) whose normals face -y, its root at the top.

    If low x is greater than high x, an eye that looks along +y sees the card's back.
    """
    (x0, z0), (x1, z1) = low, high
    lean = np.array([0.0, -np.cos(tilt), np.sin(tilt)])
    return {
        "positions": np.array([[x0, y, z1], [x1, y, z1], [x0, y, z0], [x1, y, z0]]),
        "triangles": np.array([[0, 2, 3], [0, 3, 1]]),
        "uv": np.array([[u[0], 0.0], [u[1], 0.0], [u[0], 1.0], [u[1], 1.0]]),
        "along": np.array([0.0, 0.0, 1.0, 1.0]),
        "normal": np.repeat([lean], 4, axis=0),
        "tangent": np.repeat([[0.0, -np.sin(tilt), -np.cos(tilt)]], 4, axis=0),
        "occlusion": np.array(occlusion),
    }


def mesh_of(*cards: dict[str, np.ndarray]) -> CardMesh:
    """Each card once, in this order."""
    joined = {name: np.concatenate([each[name] for each in cards]) for name in cards[0]}
    joined["triangles"] = joined["triangles"] + np.repeat(np.arange(len(cards)) * 4, 2)[:, None]
    return CardMesh(**joined, card=np.repeat(np.arange(len(cards)), 2))


def constant_textures(
    base: Any = 1.0,
    alpha: float = 1.0,
    shift: float = 0.5,
    noise: float = 1.0,
    tangent: Any = (0.5, 1.0, 0.5),
    **more: Any,
) -> HairTextures:
    """Textures of one colour each."""
    shape = (4, 4)
    return HairTextures(
        np.broadcast_to(np.float32(base), (*shape, 3)),
        np.full(shape, alpha, np.float32),
        np.full(shape, shift, np.float32),
        np.full(shape, noise, np.float32),
        np.broadcast_to(np.float32(tangent), (*shape, 3)),
        **more,
    )


def snapshot_of(mesh: CardMesh, textures: HairTextures, *, cards: Any = None, **more: Any) -> Any:
    """A snapshot of cards alone, without shadows by default.

    Args:
        cards: how cards are drawn, fields of CardSnapshot.
    """
    from hairloom.addon.render.card_snapshot import CardSnapshot
    from hairloom.addon.render.snapshot import Snapshot

    none = np.zeros((0, 2, 3), np.float32)
    values = {"volume": VolumeSettings(shadows="none"), **more}
    return Snapshot(
        none, none[..., 0], cards=CardSnapshot(mesh, textures, **(cards or {})), **values
    )


def camera(y: float = -1.0) -> Any:
    """Shows x and z from 0 to 1; looks along +y, or along -y from a greater y."""
    return Camera(look_at((0.5, y, 0.5), (0.5, 0.0, 0.5)), orthographic(1.0, 1.0, -3.0, 5.0))
