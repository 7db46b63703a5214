"""What the artist sets about the look of strands: their shading and their drawn width."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..params import Settings, both, choice, color, either, number, when
from .kajiya_kay_settings import KajiyaKaySettings
from .marschner.settings import MarschnerSettings

_PIGMENT = "Chiang et al. 2016; Blender's Principled Hair"

MODELS = (
    ("kajiya_kay", "Kajiya-Kay", "Two shifted highlights by Scheuermann: quick, and free to shape"),
    ("marschner", "Marschner", "Light reflected and refracted by a fibre: as real hair has it"),
)

PIGMENTS = (
    ("color", "Colour", "What absorbs light so much that a mass of hair has the colour above"),
    ("melanin", "Melanin", "The pigments of natural hair"),
    ("absorption", "Absorption", "Set outright"),
)

TRANSPARENCIES = (
    ("layers", "Layers", "Strands cover as much of each pixel as they are wide, in their order"),
    ("hashed", "Hashed", "The same on average, by chance: no memory, but noise"),
    ("none", "None", "Opaque strands with hard edges, no thinner than the minimum width"),
)
_IS_MARSCHNER = when("shading.model", "marschner")
_HAS_MELANIN = both(_IS_MARSCHNER, when("shading.pigment", "melanin"))
_HAS_ABSORPTION = both(_IS_MARSCHNER, when("shading.pigment", "absorption"))
_HAS_COLOR = either(when("shading.model", "kajiya_kay"), when("shading.pigment", "color"))


@dataclass(frozen=True, kw_only=True)
class SharedSettings(Settings):
    """Act in both models."""

    model: str = choice(
        "kajiya_kay",
        MODELS,
        label="Model",
        description="How the light on a strand becomes its colour",
    )
    pigment: str = choice(
        "color",
        PIGMENTS,
        label="Pigment",
        description="What says how much light is absorbed inside the hair",
        source=_PIGMENT,
        panel="Colour",
        shown_when=when("shading.model", "marschner"),
    )
    base_color: tuple[float, float, float] = color(
        (0.055, 0.03, 0.018),
        label="Colour",
        description="Colour of the hair; it tints the highlights as well",
        panel="Colour",
        shown_when=_HAS_COLOR,
    )
    melanin: float = number(
        0.75,
        label="Melanin",
        description="Amount of pigment: white 0, blond 0.25, brown 0.75, black 1",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source=_PIGMENT,
        panel="Colour",
        shown_when=_HAS_MELANIN,
    )
    redness: float = number(
        0.3,
        label="Redness",
        description="Share of the pigment that is red",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source=_PIGMENT,
        panel="Colour",
        shown_when=_HAS_MELANIN,
    )
    absorption: tuple[float, float, float] = color(
        (0.25, 0.42, 0.83),
        label="Absorption",
        description="How much red, green and blue hair absorbs inside, on the length of its radius",
        maximum=100.0,
        source=_PIGMENT,
        panel="Colour",
        shown_when=_HAS_ABSORPTION,
    )
    tip_tint: float = number(
        0.0,
        label="Tip Tint",
        description="How much the tips have their own colour",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Colour",
    )
    tip_color: tuple[float, float, float] = color(
        (0.23, 0.145, 0.065),
        label="Tip Colour",
        description="Colour at the tips, as far as Tip Tint lets it through",
        panel="Colour",
        active_when=when("shading.tip_tint"),
    )
    tint_start: float = number(
        0.3,
        label="Tint Start",
        description="Where between root and tip the colour begins to change",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Colour",
        active_when=when("shading.tip_tint"),
    )
    tint_end: float = number(
        0.9,
        label="Tint End",
        description="Where between root and tip the colour is that of the tips",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Colour",
        active_when=when("shading.tip_tint"),
    )
    color_variation: float = number(
        0.3,
        label="Colour Variation",
        description="How much strands differ in brightness",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Variation",
    )
    grey_fraction: float = number(
        0.0,
        label="Grey Strands",
        description="Fraction of the strands that have lost their colour",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Variation",
    )
    shift_noise: float = number(
        0.2,
        label="Shift Noise",
        description="How much the shift differs from strand to strand, which breaks up the bands",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
        source="Scheuermann 2004, specular shift texture",
        panel="Variation",
    )
    sparkle: float = number(
        0.6,
        label="Sparkle",
        description="How much noise breaks up the second highlight",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="Scheuermann 2004, specular noise texture",
        panel="Variation",
    )
    noise_cells: float = number(
        4.0,
        label="Noise Cells",
        description="Cells of the shift and sparkle noise between root and tip",
        soft=(0.0, 32.0),
        hard=(0.0, 1000.0),
        panel="Variation",
    )
    ambient: float = number(
        1.0,
        label="Ambient",
        description="Factor of the light that comes evenly from the world",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
    )


@dataclass(frozen=True, kw_only=True)
class ShadingSettings(MarschnerSettings, KajiyaKaySettings, SharedSettings):
    """How hair answers light: what both models share, then the parameters of each."""

    section = "shading"
    title = "Shading"
    owner = "groom"
    panels = (
        "Colour",
        "First Highlight",
        "Second Highlight",
        "Rim Light",
        "Fibre",
        "Variation",
    )


@dataclass(frozen=True, kw_only=True)
class StrandSettings(Settings):
    """How wide strands are drawn, and how much they hide."""

    section = "strands"
    title = "Strands"
    owner = "groom"

    width_scale: float = number(
        1.0,
        label="Width Scale",
        description="Factor of the strands' radius; raise it where few strands stand for many",
        soft=(0.1, 10.0),
        hard=(0.0, 1000.0),
    )
    tip_width: float = number(
        0.5,
        label="Tip Width",
        description="Width at the tip, as a factor of the width at the root",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    transparency: str = choice(
        "layers",
        TRANSPARENCIES,
        label="Transparency",
        description="How strands that are thinner than a pixel are drawn, and the edges of all",
        source="Yang et al. 2010, lists of each pixel; Wyman and McGuire 2017, hashed alpha",
    )
    opacity: float = number(
        1.0,
        label="Opacity",
        description="How much a strand hides of what lies behind it, in its full width, and how "
        "much light it takes from that; with transparency only",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    minimum_width: float = number(
        1.0,
        label="Minimum Width",
        description="Without transparency, strands are never drawn thinner than this at the root",
        soft=(0.0, 4.0),
        hard=(0.0, 100.0),
        unit="pixels",
    )

    @property
    def least_width(self) -> float:
        """What every strand covers at the root, however thin it is [pixels]."""
        return self.minimum_width if self.transparency == "none" else 0.0

    @property
    def as_drawn(self) -> StrandSettings:
        """With the opacity that strands have: without transparency they hide all."""
        return replace(self, opacity=1.0) if self.transparency == "none" else self
