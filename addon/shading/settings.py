"""Settings of the look of strands: their shading and their drawn width."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..params import Settings, both, choice, color, color_map, either, number, when
from .kajiya_kay_settings import KajiyaKaySettings
from .marschner.settings import MarschnerSettings

_PIGMENT = "Chiang et al. 2016; Blender's Principled Hair"

MODELS = (
    (
        "kajiya_kay",
        "Kajiya-Kay",
        "Two shifted highlights by Scheuermann: fast and easy to art-direct",
    ),
    ("marschner", "Marschner", "Light reflected and refracted by a fibre: physically based"),
)

PIGMENTS = (
    ("color", "Colour", "Set the colour of a mass of hair, from which absorption follows"),
    ("melanin", "Melanin", "Set the pigments of natural hair"),
    ("absorption", "Absorption", "Set absorption directly"),
)

COLOR_SOURCES = (
    ("own", "Curves", "Use the curves' own colours if they have an attribute named color"),
    ("look", "Look", "Use only the look's colour"),
)

BROW_SOURCES = (
    ("look", "Look", "Use the look's colour, as for all hair"),
    ("natural", "Natural", "Use Brow Colour, which stays natural when the hair is dyed"),
)

TRANSPARENCIES = (
    ("layers", "Layers", "Blend strands by their coverage of each pixel, sorted by depth"),
    ("hashed", "Hashed", "Stochastic coverage: needs little memory, but is noisy"),
    ("none", "None", "Opaque strands with hard edges, never thinner than Minimum Width"),
)
_HAS_TIPS = when("shading.tip_tint", unmet_reason="needs Tip Tint")
_HAS_DUST = when("shading.dust", unmet_reason="needs Dust")
_IS_MARSCHNER = when("shading.model", "marschner")
_HAS_MELANIN = both(_IS_MARSCHNER, when("shading.pigment", "melanin"))
_HAS_ABSORPTION = both(_IS_MARSCHNER, when("shading.pigment", "absorption"))
_HAS_COLOR = either(when("shading.model", "kajiya_kay"), when("shading.pigment", "color"))


@dataclass(frozen=True, kw_only=True)
class SharedSettings(Settings):
    """Parameters of both models."""

    model: str = choice(
        "marschner",
        MODELS,
        label="Model",
        description="Shading model of the strands",
    )
    color_source: str = choice(
        "own",
        COLOR_SOURCES,
        label="Colour Source",
        description="Source of the colour; strands without a colour of their own use the look's",
    )
    color_map: str = color_map(
        label="Colour Map",
        description="Colours painted on the surface: a colour attribute, or an image on its UVs. "
        "Each strand takes the colour at its root, or that of Colour Source where the map is "
        "transparent. If empty, no map is used",
    )
    pigment: str = choice(
        "color",
        PIGMENTS,
        label="Pigment",
        description="How the absorption inside the hair is set",
        source=_PIGMENT,
        shown_when=when("shading.model", "marschner"),
    )
    base_color: tuple[float, float, float] = color(
        (0.03, 0.0145, 0.007),
        label="Colour",
        description="Colour of the hair; also tints the highlights",
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
        shown_when=_HAS_MELANIN,
    )
    redness: float = number(
        0.3,
        label="Redness",
        description="Fraction of the pigment that is red",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source=_PIGMENT,
        shown_when=_HAS_MELANIN,
    )
    absorption: tuple[float, float, float] = color(
        (0.25, 0.42, 0.83),
        label="Absorption",
        description="Absorption of red, green and blue inside the hair, per hair radius",
        maximum=100.0,
        source=_PIGMENT,
        shown_when=_HAS_ABSORPTION,
    )
    tip_tint: float = number(
        0.0,
        label="Tip Tint",
        description="Amount of Tip Colour at the tips",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Tips & Brows",
    )
    tip_color: tuple[float, float, float] = color(
        (0.23, 0.145, 0.065),
        label="Tip Colour",
        description="Colour of the tips, blended in by Tip Tint",
        panel="Tips & Brows",
        active_when=_HAS_TIPS,
    )
    tint_start: float = number(
        0.3,
        label="Tint Start",
        description="Position between root and tip at which the colour begins to change",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Tips & Brows",
        active_when=_HAS_TIPS,
    )
    tint_end: float = number(
        0.9,
        label="Tint End",
        description="Position between root and tip from which on the colour is Tip Colour",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Tips & Brows",
        active_when=_HAS_TIPS,
    )
    brow_source: str = choice(
        "look",
        BROW_SOURCES,
        label="Brow Source",
        description="Source of the colour of brows and lashes (strands in groups 9001 and 9002)",
        panel="Tips & Brows",
    )
    brow_color: tuple[float, float, float] = color(
        (0.03, 0.017, 0.011),
        label="Brow Colour",
        description="Colour of natural brows and lashes without a colour of their own",
        panel="Tips & Brows",
        active_when=when("shading.brow_source", "natural", unmet_reason="as the hair"),
    )
    wetness: float = number(
        0.0,
        label="Wetness",
        description="Amount of water in the hair; 1 is soaked. Wet hair is darker and heavier, "
        "has a sharp highlight, and its children clump",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="Lekner and Dorf 1988",
        panel="Wet & Dusty",
    )
    dust: float = number(
        0.0,
        label="Dust",
        description="Fraction of the hair covered by dust, which dulls its highlights",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Wet & Dusty",
    )
    dust_color: tuple[float, float, float] = color(
        (0.22, 0.17, 0.115),
        label="Dust Colour",
        description="Colour of the dry dust",
        panel="Wet & Dusty",
        active_when=_HAS_DUST,
    )
    color_variation: float = number(
        0.3,
        label="Colour Variation",
        description="Variation of brightness between strands",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Variation",
    )
    grey_fraction: float = number(
        0.0,
        label="Grey Strands",
        description="Fraction of the strands that are grey",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Variation",
    )
    shift_noise: float = number(
        0.2,
        label="Shift Noise",
        description="Variation of the highlight shift between strands, which breaks up the bands",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
        source="Scheuermann 2004, specular shift texture",
        panel="Variation",
    )
    sparkle: float = number(
        0.6,
        label="Sparkle",
        description="Amount of noise that breaks up the second highlight",
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
        description="Factor on ambient light from the world",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        panel="Light",
    )


@dataclass(frozen=True, kw_only=True)
class ShadingSettings(MarschnerSettings, KajiyaKaySettings, SharedSettings):
    """How hair scatters light: the parameters of both models, then those of each."""

    section = "shading"
    title = "Shading"
    help_page = "shading#look-settings"
    owner = "groom"
    panels = (
        "First Highlight",
        "Second Highlight",
        "Rim Light",
        "Tips & Brows",
        "Wet & Dusty",
        "Variation",
        "Fibre",
        "Light",
    )


@dataclass(frozen=True, kw_only=True)
class StrandSettings(Settings):
    """How wide strands are drawn, and how much they hide."""

    section = "strands"
    title = "Strands"
    help_page = "user_guide#strands-and-children"
    owner = "groom"

    fullness: float = number(
        1.0,
        label="Fullness",
        description="Factor on the widths of strands, and thus on the light that they block",
        soft=(0.1, 10.0),
        hard=(0.0, 1000.0),
    )
    tip_width: float = number(
        0.5,
        label="Tip Width",
        description="Width at the tip relative to the root",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    transparency: str = choice(
        "layers",
        TRANSPARENCIES,
        label="Transparency",
        description="How strand edges and strands thinner than a pixel are drawn",
        source="Yang et al. 2010, lists of each pixel; Wyman and McGuire 2017, hashed alpha",
    )
    opacity: float = number(
        1.0,
        label="Opacity",
        description="Opacity of a strand across its full width, to light and to anything behind "
        "it; needs Transparency",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    minimum_width: float = number(
        1.0,
        label="Minimum Width",
        description="Minimum width at the root if Transparency is None",
        soft=(0.0, 4.0),
        hard=(0.0, 100.0),
        unit="pixels",
    )

    @property
    def min_width(self) -> float:
        """Minimum width of strands at the root [pixels]; 0 with transparency."""
        return self.minimum_width if self.transparency == "none" else 0.0

    @property
    def as_drawn(self) -> StrandSettings:
        """The settings with the opacity as drawn: 1 without transparency."""
        return replace(self, opacity=1.0) if self.transparency == "none" else self
