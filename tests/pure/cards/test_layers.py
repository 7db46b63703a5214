"""Layers of cards that lie on concentric spheres of known radius."""

from __future__ import annotations

import numpy as np

from hairloom.addon.cards.layers import card_depths, card_layers
from hairloom.addon.cards.strip import CardFrames, Strips
from hairloom.addon.strands.frames import tangents, transported_normals


def shell(radius: float, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Short cards that lie on a ball of this radius: centers (count, 9, 3), normals (count, 3)."""
    random = np.random.default_rng(seed)
    outwards = random.normal(size=(count, 3))
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    way = np.cross(outwards, random.normal(size=(count, 3)))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    turn = np.linspace(0.0, 0.6, 9)[None, :, None]
    center = radius * (outwards[:, None] * np.cos(turn) + way[:, None] * np.sin(turn))
    return center.astype(np.float32), outwards.astype(np.float32)


def strips_of(center: np.ndarray, outwards: np.ndarray, width: float = 0.02) -> Strips:
    tangent = tangents(center)
    normal = transported_normals(tangent, outwards)
    frames = CardFrames(center, tangent, normal, np.cross(tangent, normal))
    return Strips(frames, np.full(center.shape[:2], width, np.float32))


def test_shells_are_layers_from_the_inside_to_the_outside() -> None:
    parts = [shell(0.10 + 0.01 * k, 150, k) for k in range(3)]
    center, outwards = (np.concatenate(part) for part in zip(*parts, strict=True))
    layer = card_layers(strips_of(center, outwards), 3)
    truth = np.repeat([0, 1, 2], 150)
    assert (layer == truth).mean() > 0.9
    np.testing.assert_array_equal(np.bincount(layer), [150, 150, 150])


def test_hair_that_hangs_far_from_the_head_has_layers_too() -> None:
    """A curtain of three sheets, whose distance from the head does not tell their depth."""
    random = np.random.default_rng(1)
    depth = np.repeat([0.0, 0.01, 0.02], 100)
    center = np.zeros((300, 9, 3), np.float32)
    center[..., 0] = random.uniform(-0.15, 0.15, size=(300, 1))
    center[..., 1] = -depth[:, None]
    center[..., 2] = -0.3 - np.linspace(0.0, 0.3, 9)
    outwards = np.tile(np.float32([0.0, -1.0, 0.0]), (300, 1))
    layer = card_layers(strips_of(center, outwards), 3)
    assert (layer == np.repeat([0, 1, 2], 100)).mean() > 0.95


def test_thin_hair_has_the_lowest_layer_only() -> None:
    center = np.zeros((6, 9, 3), np.float32)
    center[..., 0] = np.arange(6)[:, None] * 0.05
    center[..., 2] = -np.linspace(0.0, 0.2, 9)
    outwards = np.tile(np.float32([0.0, -1.0, 0.0]), (6, 1))
    np.testing.assert_array_equal(card_layers(strips_of(center, outwards, 0.001), 4), 0)


def test_both_sides_of_a_head_do_not_count_as_each_other_s_layers() -> None:
    random = np.random.default_rng(5)
    center = np.zeros((200, 9, 3), np.float32)
    center[..., 0] = random.uniform(-0.05, 0.05, size=(200, 1))
    center[..., 1] = np.repeat([-0.005, 0.005], 100)[:, None]
    center[..., 2] = -np.linspace(0.0, 0.2, 9)
    outwards = np.zeros((200, 3), np.float32)
    outwards[:, 1] = np.repeat([-1.0, 1.0], 100)
    depth = card_depths(strips_of(center, outwards))
    np.testing.assert_array_equal(depth, 0.0)


def test_one_card_and_one_layer_are_layer_0() -> None:
    center, outwards = shell(0.1, 1, 0)
    np.testing.assert_array_equal(card_layers(strips_of(center, outwards), 3), [0])
    center, outwards = shell(0.1, 50, 0)
    np.testing.assert_array_equal(card_layers(strips_of(center, outwards), 1), np.zeros(50))


def test_sampled_neighbours_give_the_same_layers_as_all() -> None:
    """Of this many cards only a sample is evaluated; the layers are those of the shells all the
    same."""
    parts = [shell(0.10 + 0.01 * k, 700, k) for k in range(2)]
    center, outwards = (np.concatenate(part) for part in zip(*parts, strict=True))
    layer = card_layers(strips_of(center, outwards), 2)
    assert (layer == np.repeat([0, 1], 700)).mean() > 0.9
