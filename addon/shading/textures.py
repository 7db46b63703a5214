"""Procedural textures of hair cards: stretched noise, and strands that thin out to the edges.

A texture stands on its root: row 0 is v = 0, the root, and the last row is the tip. It holds
several variants side by side, each a column that tiles with itself across.

The alpha channel asks of each pixel whether the envelope of the strip (1 in the middle, 0 at the
sides and the tip) exceeds a noise that is stretched along the hair. Noise evenly spread over
[0, 1] makes the mean alpha follow the envelope, the middle fully opaque, as the four-pass drawing
of Scheuermann 2004 wants it, and single strands survive towards the tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..params import Settings, integer, number


@dataclass(frozen=True, kw_only=True)
class TextureSettings(Settings):
    """What the strips of hair on a card texture look like."""

    section = "card_texture"
    title = "Card texture"

    variant_width: int = integer(
        128,
        label="Variant width",
        description="Width of one strip of hair in pixels",
        soft=(32, 512),
        hard=(8, 4096),
    )
    height: int = integer(
        512,
        label="Height",
        description="Height from root to tip in pixels",
        soft=(128, 2048),
        hard=(8, 8192),
    )
    strand_count: int = integer(
        32,
        label="Strands",
        description="Strands side by side in one strip",
        soft=(8, 64),
        hard=(2, 1024),
    )
    contrast: float = number(
        0.6,
        label="Contrast",
        description="How much darker than full the darkest strand is",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        source="Scheuermann 2004, stretched noise as base texture",
    )
    edge_width: float = number(
        0.3,
        label="Edge width",
        description="Part of the width, from each side, in which the strip dissolves into strands",
        unit="factor",
        soft=(0.05, 0.5),
        hard=(0.001, 0.5),
    )
    root_length: float = number(
        0.04,
        label="Root length",
        description="Part of the length in which the strip gathers from strands at the root",
        unit="factor",
        soft=(0.0, 0.3),
        hard=(0.0, 1.0),
    )
    tip_length: float = number(
        0.6,
        label="Tip length",
        description="Part of the length, from the tip, in which the strip dissolves into strands",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
    )
    softness: float = number(
        0.25,
        label="Softness",
        description="How softly a strand ends; 0 gives hard edges",
        unit="factor",
        soft=(0.05, 1.0),
        hard=(0.001, 1.0),
    )
    seed: int = integer(
        0,
        label="Seed",
        description="Another number gives other strands",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )


def card_texture(settings: TextureSettings, columns: int) -> Floats:
    """A texture of `columns` strips of hair side by side.

    Returns:
        (height, columns * variant_width, 4) float32 in [0, 1], row 0 at the root: linear grey,
        to be multiplied by the hair's colour, and straight alpha; the grey goes on where alpha
        is 0, so that no dark fringe appears. Alpha is 0 along both sides of each strip.
    """
    random = np.random.default_rng(settings.seed)
    return np.concatenate([_strip(settings, random) for _ in range(columns)], axis=1)


def _strip(settings: TextureSettings, random: np.random.Generator) -> Floats:
    shape = (settings.height, settings.variant_width)
    shade = stretched_noise(random, shape, settings.strand_count)
    strands = stretched_noise(random, shape, settings.strand_count)
    softness = settings.softness
    alpha = np.clip((envelope(settings) - strands * (1.0 - softness)) / softness, 0.0, 1.0)
    alpha[:, [0, -1]] = 0.0
    grey = 1.0 - settings.contrast * shade
    return np.stack([grey, grey, grey, alpha], axis=-1).astype(np.float32)


def envelope(settings: TextureSettings) -> Floats:
    """How thick the strip is, (height, variant_width): 1 in the middle, 0 at sides and tip."""
    across = np.linspace(0.0, 1.0, settings.variant_width)
    along = np.linspace(0.0, 1.0, settings.height)
    sides = _ramp(np.minimum(across, 1.0 - across), settings.edge_width)
    root = 0.5 + 0.5 * _ramp(along, settings.root_length)
    tip = np.minimum((1.0 - along) / max(settings.tip_length, 1e-9), 1.0)
    return (root * tip)[:, None] * sides


def stretched_noise(
    random: np.random.Generator, shape: tuple[int, int], strand_count: int
) -> Floats:
    """Noise that is fast across and slow along, (height, width), evenly spread over [0, 1].

    Two octaves, strands and their fibres; it tiles across.
    """
    strands = _value_noise(random, shape, strand_count, along=2)
    fibers = _value_noise(random, shape, 3 * strand_count, along=4)
    noise = strands + 0.5 * fibers
    rank = np.empty(noise.size)
    rank[np.argsort(noise, axis=None, kind="stable")] = np.arange(noise.size)
    return (rank / max(noise.size - 1, 1)).reshape(shape)


def _value_noise(
    random: np.random.Generator, shape: tuple[int, int], across: int, along: int
) -> Floats:
    """Random values on a grid of `across` columns, which wrap, and `along` + 1 rows, blended."""
    values = random.random((along + 1, across))
    height, width = shape
    column = (np.arange(width) + 0.5) / width * across
    row = np.linspace(0.0, along, height)
    left, below = column.astype(int), np.minimum(row.astype(int), along - 1)
    blend_across = _smooth(column - left)
    blend_along = _smooth(row - below)[:, None]
    lines = values[:, left % across] * (1.0 - blend_across)
    lines += values[:, (left + 1) % across] * blend_across
    return lines[below] * (1.0 - blend_along) + lines[below + 1] * blend_along


def _ramp(distance: Floats, length: float) -> Floats:
    """0 at distance 0, 1 from `length` on, smooth between; 1 everywhere for length 0."""
    if length == 0.0:
        return np.ones_like(distance)
    return _smooth(np.clip(distance / length, 0.0, 1.0))


def _smooth(t: Floats) -> Floats:
    return t * t * (3.0 - 2.0 * t)
