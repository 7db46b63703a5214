"""The four procedural textures of hair cards, and a tangent map: Scheuermann 2004.

A texture stands on its root: row 0 is v = 0, the root, and the last row is the tip. It holds
several variants side by side, each a column that tiles with itself across.

    base     stretched noise that the hair's colour is multiplied by
    alpha    1 where the envelope of the strip (1 in the middle, 0 at the sides and the tip)
             exceeds a stretched noise. Noise distributed uniformly over [0, 1] makes the mean alpha
             follow the envelope and the middle fully opaque, as drawing in four passes needs, and
             leaves single strands towards the tip
    shift    how far each strand moves the highlights: s = shift + shift_noise (texture - 0.5)
    noise    breaks up the second highlight into sparkles
    tangent  the direction of the strands, which may replace the shift, see HairTextures

All of them follow the same strands, which wander a little to the sides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from .texture_noise import smooth, strand_drift, strand_slope, stretched_noise
from .texture_settings import TextureSettings

#: The textures by name; each may be replaced by a picture.
TEXTURES = ("base", "alpha", "shift", "noise", "tangent")
#: Cells of base and alpha along a strand: they hardly change from root to tip.
_CELLS_ALONG = 2


@dataclass(frozen=True)
class HairTextures:
    """The textures of hair cards, float32 in [0, 1], row 0 at the root; each of its own size.

    base: (height, width, 3) linear, to be multiplied by the hair's colour; it continues where alpha
        is 0, so that no dark fringe appears. In an atlas it may exceed 1.
    alpha: (height, width) straight coverage, 0 along both sides of each column.
    shift: (height, width) of the highlights, 0.5 is none; repeats in u and v.
    noise: (height, width) factor of the second highlight; repeats in u and v.
    tangent: (height, width, 3) direction d of the strand as 0.5 d + 0.5: x across the card, along
        u; y along the card from root to tip; z away from the head. Where it replaces the shift, the
        strand runs along x side + y tangent + shift_noise z normal. Its x holds for texels that
        are square on the card.
    normal: (height, width, 3) normal n of the strands as 0.5 n + 0.5, in the axes of `tangent`;
        None: the card's normal everywhere.
    place: (height, width) depth of the visible strand relative to the average of its tile, see
        cards.atlas_depth: 0.5 is the average, more is deeper; None: not known.
    """

    base: Floats
    alpha: Floats
    shift: Floats
    noise: Floats
    tangent: Floats
    normal: Floats | None = None
    place: Floats | None = None

    @property
    def card(self) -> Floats:
        """Base and alpha in one, (height, width, 4), of the larger size; pixels are repeated."""
        height, width = np.maximum(self.base.shape[:2], self.alpha.shape)
        row, column = np.arange(height)[:, None], np.arange(width)
        base, alpha = (
            image[row * len(image) // height, column * image.shape[1] // width]
            for image in (self.base, self.alpha)
        )
        return np.concatenate([base, alpha[..., None]], axis=-1)

    def with_pictures(self, pictures: Mapping[str, Floats]) -> HairTextures:
        """The textures with some replaced by pictures, by name, shaped as `picture_as` does."""
        return replace(self, **pictures)


@lru_cache(maxsize=2)
def hair_textures(settings: TextureSettings, columns: int) -> HairTextures:
    """Textures of `columns` strips of hair side by side, (height, columns * variant_width).

    The last results are cached, as cards are built again for settings that do not concern these; so
    the arrays are read-only.
    """
    random = np.random.default_rng(settings.seed)
    shape = settings.height, settings.variant_width
    drifts = [strand_drift(random, shape, settings.wander) for _ in range(columns)]
    strips = [_strip(settings, random, drift) for drift in drifts]
    base, alpha = (np.concatenate(parts, axis=1) for parts in zip(*strips, strict=True))

    drift, across = np.concatenate(drifts, axis=1), columns * settings.strand_count
    shift = stretched_noise(random, drift / columns, across, settings.shift_cells)
    noise = stretched_noise(random, drift / columns, across, settings.sparkle_cells)
    tangent = tangent_map(strand_slope(drift, columns), shift)
    grey = np.repeat(base[..., None], 3, axis=-1)
    images = [image.astype(np.float32) for image in (grey, alpha, shift, noise, tangent)]
    for image in images:
        image.setflags(write=False)
    return HairTextures(*images)


def _strip(
    settings: TextureSettings, random: np.random.Generator, drift: Floats
) -> tuple[Floats, Floats]:
    """Base and alpha of one column."""
    shade = stretched_noise(random, drift, settings.strand_count, _CELLS_ALONG)
    strands = stretched_noise(random, drift, settings.strand_count, _CELLS_ALONG)
    softness = settings.softness
    alpha = np.clip((envelope(settings) - strands * (1.0 - softness)) / softness, 0.0, 1.0)
    alpha[:, [0, -1]] = 0.0
    return 1.0 - settings.contrast * shade, alpha


def envelope(settings: TextureSettings) -> Floats:
    """How thick the strip is, (height, variant_width): 1 in the middle, 0 at sides and tip."""
    across = np.linspace(0.0, 1.0, settings.variant_width)
    along = np.linspace(0.0, 1.0, settings.height)
    sides = _ramp(np.minimum(across, 1.0 - across), settings.edge_width)
    root = 0.5 + 0.5 * _ramp(along, settings.root_length)
    tip = np.minimum((1.0 - along) / max(settings.tip_length, 1e-9), 1.0)
    return (root * tip)[:, None] * sides


def tangent_map(slope: Floats, shift: Floats) -> Floats:
    """The tangent map of strands, (..., 3): normalize(slope, 1, shift - 0.5), encoded.

    Without a slope it moves the highlights as the shift does, to first order.
    """
    direction = np.stack([slope, np.ones_like(slope), shift - 0.5], axis=-1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    return 0.5 * direction + 0.5


def picture_as(name: str, picture: Floats, *, place: str) -> Floats:
    """A picture as the texture of this name, float32 in [0, 1].

    Args:
        name: one of TEXTURES.
        picture: (height, width, 1 to 4): grey, grey and alpha, rgb, rgb and straight alpha; base
            linear, the others as they are stored. A texture of one channel is the picture's alpha
            where that is not 1 throughout, else its first channel.
        place: names it in error messages.

    Raises:
        HairloomError: it holds values that are not finite, or no pixels.
    """
    if not picture.size or not np.isfinite(picture).all():
        raise HairloomError(
            f"it cannot be the {name} texture, because it holds "
            + ("values that are not finite" if picture.size else "no pixels"),
            place=place,
            remedy="Choose another picture, or save it again in the program that made it",
        )
    picture = np.clip(picture, 0.0, 1.0).astype(np.float32)
    color = np.repeat(picture[..., :1], 3, axis=-1) if picture.shape[-1] < 3 else picture[..., :3]
    if name in ("base", "tangent"):
        return np.ascontiguousarray(color)
    has_alpha = picture.shape[-1] in (2, 4) and picture[..., -1].min() < 1.0
    return np.ascontiguousarray(picture[..., -1 if has_alpha else 0])


def _ramp(distance: Floats, length: float) -> Floats:
    """0 at distance 0, 1 from `length` on, smooth between; 1 everywhere for length 0."""
    if length == 0.0:
        return np.ones_like(distance)
    return smooth(np.clip(distance / length, 0.0, 1.0))
