"""What the artist sets about light that dies, and light that spreads, between strands."""

from __future__ import annotations

from dataclasses import dataclass

from ...params import Settings, both, choice, integer, number, toggle, when

_KIM = "Kim and Neumann 2001, opacity shadow maps"
_YUKSEL = "Yuksel and Keyser 2008, deep opacity maps"
_ZINKE = "Zinke et al. 2008, dual scattering"

SHADOWS = (
    ("deep", "Deep Opacity", "Layers that follow the side of the hair that faces the light"),
    ("slices", "Opacity Slices", "Even slices through the whole of the hair"),
    ("none", "None", "Ambient occlusion replaces shadows"),
)
_CAN_SCATTER = when("shading.model", "marschner")
_SCATTERS = both(_CAN_SCATTER, when("volume.scattering"))


@dataclass(frozen=True, kw_only=True)
class VolumeSettings(Settings):
    """Shadows of strands, and scattering between them."""

    section = "volume"
    title = "Shadows"
    owner = "groom"

    shadows: str = choice(
        "deep",
        SHADOWS,
        label="Shadows",
        description="How the hair's shadow on itself is kept",
        source=f"{_KIM}; {_YUKSEL}",
    )
    extinction: float = number(
        1.0,
        label="Extinction",
        description="How much light a strand keeps from what lies behind it; 1 is what its width "
        "asks for",
        soft=(0.0, 4.0),
        hard=(0.0, 1000.0),
        source=_KIM,
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    resolution: int = integer(
        512,
        label="Resolution",
        description="Texels along a side of each light's map",
        soft=(128, 1024),
        hard=(16, 2048),
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    slices: int = integer(
        16,
        label="Slices",
        description="Opacity slices: even layers through the hair, away from the light",
        soft=(4, 64),
        hard=(4, 64),
        source=_KIM,
        shown_when=when("volume.shadows", "slices"),
    )
    layers: int = integer(
        8,
        label="Layers",
        description="Deep opacity: layers behind the first hair that the light meets, thicker "
        "from one to the next",
        soft=(4, 16),
        hard=(2, 64),
        source=_YUKSEL,
        shown_when=when("volume.shadows", "deep"),
    )
    layer_depth: float = number(
        0.25,
        label="Layer Depth",
        description="Deep opacity: how deep the first half of the layers reach, as a fraction of "
        "the hair there; 0.5 makes all equally thick",
        soft=(0.05, 0.5),
        hard=(0.001, 0.9),
        unit="factor",
        source=_YUKSEL,
        shown_when=when("volume.shadows", "deep"),
    )
    bias: float = number(
        0.01,
        label="Bias",
        description="How far in front of a place strands must be to shade it, as a fraction of the "
        "hair's size",
        soft=(0.0, 0.05),
        hard=(0.0, 1.0),
        unit="factor",
        source=_KIM,
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    strand_fraction: float = number(
        0.5,
        label="Strand Fraction",
        description="Fraction of the strands that throw the shadow; each stands for more of them",
        soft=(0.05, 1.0),
        hard=(0.001, 1.0),
        unit="factor",
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    max_lights: int = integer(
        3,
        label="Max Lights",
        description="Lights that throw shadows at most, the strongest first",
        soft=(0, 8),
        hard=(0, 8),
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    on_body: bool = toggle(
        False,
        label="Shadow on Surface",
        description="Where a 3D view goes by the scene's lights, hair as it moves shades the head "
        "that Blender draws, in place of Blender's own strands at rest, which shade all meshes",
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    scattering: bool = toggle(
        True,
        label="Scattering",
        description="With shadows and in the model Marschner: light that has passed from strand to "
        "strand, without which light hair is brown",
        source=_ZINKE,
        shown_when=when("volume.shadows", "deep", "slices"),
        active_when=_CAN_SCATTER,
    )
    density: float = number(
        0.75,
        label="Scattering Density",
        description="How closely strands around a place are packed: 0 is a single strand, 1 is "
        "full of hair",
        soft=(0.5, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source=_ZINKE,
        shown_when=when("volume.shadows", "deep", "slices"),
        active_when=_SCATTERS,
    )
