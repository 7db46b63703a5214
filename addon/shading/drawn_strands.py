"""Width and colour with which strands are drawn, for baking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.face import is_face_hair
from .card_look import card_base
from .kajiya_kay import strand_base
from .marschner.look import root_absorption, strand_absorption, strand_color
from .marschner.pigment import color_absorption
from .settings import ShadingSettings, StrandSettings
from .strand_noise import strand_noise

#: Channels of the strands' noise, as in gpu_shaders/lib_strand_light.glsl.
_COLOR, _GREY = 2, 3
#: Maximum factor on the mean colour: grey strands among hair that is nearly black.
_MAX = 4.0
_DARKEST = 1e-4
#: Points whose colours represent those of all in a mean.
_FEW = 16_000


def drawn_radius(radius: Floats, settings: StrandSettings, along: Floats | None = None) -> Floats:
    """Half the width that strands are drawn with, as the radius [m], narrower towards the tip.

    Args:
        radius: (n, cv_count) [m]; any shape if along is given.
        along: of the same shape, 0 at the root to 1 at the tip; None: CVs are evenly spaced.
    """
    if along is None:
        along = np.linspace(0.0, 1.0, radius.shape[1])
    taper = (1.0 + (settings.tip_width - 1.0) * along).astype(np.float32)
    drawn: Floats = radius * (np.float32(settings.fullness) * taper)
    return drawn


def drawn_color(color: Floats | None, shading: ShadingSettings) -> Floats | None:
    """Strands' own colours if they are drawn in these, None if in the look's. Painted colours count
    as own, see `paint_flow.with_colors`."""
    return color if shading.color_source == "own" or shading.color_map else None


def own_colors(color: Floats | None, group: Ints | None, shading: ShadingSettings) -> Floats | None:
    """Strands' own colours as drawn, with those of brows and lashes that stay natural; None if all
    have the look's.

    Args:
        color: (..., 3) of strands or of their points; NaN or None where there are none.
        group: (...,) of the same; None: no face hair.
    """
    own = drawn_color(color, shading)
    is_natural = natural_strands(group, shading)
    if group is None or not is_natural.any():
        return own
    colors = np.full((*group.shape, 3), np.nan, np.float32) if own is None else own.copy()
    bare = is_natural & np.isnan(colors[..., 0])
    colors[bare] = shading.brow_color
    return colors


def natural_strands(group: Ints | None, shading: ShadingSettings) -> Bools:
    """Which strands, by their groups (...,), are brows or lashes that the look does not colour."""
    if group is None or shading.brow_source != "natural":
        return np.zeros(0 if group is None else group.shape, bool)
    return is_face_hair(group)


def look_color(shading: ShadingSettings) -> Floats:
    """The look's colour at the roots, (3,) scene-linear, whatever its pigment."""
    if shading.model == "marschner" and shading.pigment != "color":
        return strand_color(root_absorption(shading))
    return np.array(shading.base_color)


def in_color(color: Floats | tuple[float, ...], shading: ShadingSettings) -> ShadingSettings:
    """The look in another colour, (3,)."""
    red, green, blue = np.clip(color, 0.0, 1.0).tolist()
    return replace(shading, pigment="color", base_color=(red, green, blue))


def mean_look(color: Floats | None, shading: ShadingSettings) -> ShadingSettings:
    """The look in the mean of the strands' own colours, if they are drawn in these.

    Args:
        color: (..., 3) of strands or of their points, as in Snapshot.
    """
    own = drawn_color(color, shading)
    if own is None or not len(own):
        return shading
    few = own.reshape(-1, 3)
    if len(few) > _FEW:  # at random, since every nth may be the same point of every strand
        few = few[np.random.default_rng(0).integers(0, len(few), _FEW)]
    return in_color(_with_look_where_missing(few, shading).mean(axis=0), shading)


def brightest_look(color: Floats | None, shading: ShadingSettings) -> ShadingSettings:
    """The look that the factors in an atlas of strands with own colours refer to: the maximum of
    each channel, so that no factor is clipped above white; arguments as of `mean_look`.
    """
    own = drawn_color(color, shading)
    if own is None or not len(own):
        return shading
    return in_color(_with_look_where_missing(own.reshape(-1, 3), shading).max(axis=0), shading)


def strand_variation(
    seed: Ints,
    cv_count: int,
    shading: ShadingSettings,
    color: Floats | None = None,
    group: Ints | None = None,
) -> Floats:
    """Strand colours over the card's mean colour, (n, cv_count, 3), up to _MAX; for strands with
    own colours, over the mean of `brightest_look`.

    Args:
        seed: (n,) what the noise of a strand depends on, as in Snapshot.
        color: (n, cv_count, 3) as in Snapshot.
        group: (n,) as in Snapshot.
    """
    along = np.linspace(0.0, 1.0, cv_count)[None, :]
    every_cv = None if group is None else group[:, None].repeat(cv_count, axis=1)
    own = strand_colors(seed[:, None], along, shading, color, every_cv)
    mean = card_color(along, brightest_look(color, shading))
    return np.clip(own / np.maximum(mean, _DARKEST), 0.0, _MAX)


def card_color(along: Floats, shading: ShadingSettings) -> Floats:
    """Mean colour of the strands at places of a card, (..., 3); `along` is 0 at the root.

    Times the base texture, it corresponds to `strand_colors` of a strand.
    """
    if shading.model != "marschner":
        return card_base(along, shading)
    even = np.full(np.shape(along), 0.5)
    colored, grey = (strand_absorption(shading, along, even, even + s) for s in (1.0, -1.0))
    return strand_color(colored + (grey - colored) * shading.grey_fraction)


def strand_colors(
    seed: Ints,
    along: Floats,
    shading: ShadingSettings,
    color: Floats | None = None,
    group: Ints | None = None,
) -> Floats:
    """Colours at places of strands, (..., 3): the look's or their own, with the tip tint, the
    variation between strands, and grey strands.

    Args:
        seed: (...) what the noise of the strand depends on, as in Snapshot.
        along: (...) 0 at the root to 1 at the tip.
        color: (..., 3) the strands' own; NaN or None where they have none.
        group: (...) of the strand.
    """
    root = own_colors(color, group, shading)
    root = None if root is None else _with_look_where_missing(root, shading)
    is_natural = natural_strands(group, shading)
    tinted = np.where(is_natural, 0.0, along) if is_natural.any() else along
    color_noise = strand_noise(seed, _COLOR, np.zeros(1))
    grey_noise = strand_noise(seed, _GREY, np.zeros(1))
    if shading.model == "marschner":
        absorbing = None if root is None else color_absorption(root)
        return strand_color(strand_absorption(shading, tinted, color_noise, grey_noise, absorbing))
    return strand_base(tinted, color_noise, grey_noise, shading, root)


def _with_look_where_missing(color: Floats, shading: ShadingSettings) -> Floats:
    """Colours with the look's where strands have none."""
    return np.where(np.isnan(color), look_color(shading), color)
