"""Settings of the shadows of strands and of scattering between them."""

from __future__ import annotations

from dataclasses import dataclass

from ...params import Settings, both, choice, integer, number, toggle, when

_KIM = "Kim and Neumann 2001, opacity shadow maps"
_YUKSEL = "Yuksel and Keyser 2008, deep opacity maps"
_ZINKE = "Zinke et al. 2008, dual scattering"

SHADOWS = (
    ("deep", "Deep Opacity", "Layers that follow the lit side of the hair"),
    ("slices", "Opacity Slices", "Evenly spaced slices through the hair"),
    ("none", "None", "No shadows; ambient occlusion replaces them"),
)
_CAN_SCATTER = when("shading.model", "marschner", unmet_reason="needs Marschner")
_SCATTERS = both(_CAN_SCATTER, when("volume.scattering", unmet_reason="needs Scattering"))


@dataclass(frozen=True, kw_only=True)
class VolumeSettings(Settings):
    """Shadows of strands, and scattering between them."""

    section = "volume"
    title = "Shadows"
    help_page = "shading#shadows"
    owner = "groom"

    shadows: str = choice(
        "deep",
        SHADOWS,
        label="Shadows",
        description="How the shadow of hair on itself is stored",
        source=f"{_KIM}; {_YUKSEL}",
    )
    extinction: float = number(
        1.0,
        label="Extinction",
        description="Factor on the light that a strand blocks; 1 matches its width",
        soft=(0.0, 4.0),
        hard=(0.0, 1000.0),
        source=_KIM,
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    resolution: int = integer(
        512,
        label="Resolution",
        description="Texels along each side of a light's shadow map",
        soft=(128, 1024),
        hard=(16, 2048),
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    slices: int = integer(
        16,
        label="Slices",
        description="Number of slices through the hair, in the direction of the light",
        soft=(4, 64),
        hard=(4, 64),
        source=_KIM,
        shown_when=when("volume.shadows", "slices"),
    )
    layers: int = integer(
        16,
        label="Layers",
        description="Number of layers behind the first lit hair, each thicker than the previous "
        "one",
        soft=(4, 32),
        hard=(2, 64),
        source=_YUKSEL,
        shown_when=when("volume.shadows", "deep"),
    )
    layer_depth: float = number(
        0.25,
        label="Layer Depth",
        description="Depth of the first half of the layers, as a fraction of the hair there; 0.5 "
        "makes all equally thick",
        soft=(0.05, 0.5),
        hard=(0.001, 0.9),
        unit="factor",
        source=_YUKSEL,
        shown_when=when("volume.shadows", "deep"),
    )
    bias: float = number(
        0.0005,
        label="Bias",
        description="Minimum distance at which strands shade each other, as a fraction of the "
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
        description="Fraction of the strands that cast shadows; each is weighted to represent the "
        "rest",
        soft=(0.05, 1.0),
        hard=(0.001, 1.0),
        unit="factor",
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    max_lights: int = integer(
        3,
        label="Max Lights",
        description="Maximum number of lights that cast shadows, the strongest first",
        soft=(0, 8),
        hard=(0, 8),
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    on_body: bool = toggle(
        True,
        label="Shadow on Surface",
        description="In 3D views with scene lights, let the hair as shown cast its shadow on the "
        "head drawn by Blender. If off, Blender's own strands at rest cast shadows instead, on "
        "all meshes",
        shown_when=when("volume.shadows", "deep", "slices"),
    )
    scattering: bool = toggle(
        True,
        label="Scattering",
        description="Compute multiple scattering between strands, without which light hair looks "
        "brown; needs Shadows and the Marschner model",
        source=_ZINKE,
        shown_when=when("volume.shadows", "deep", "slices"),
        active_when=_CAN_SCATTER,
    )
    density: float = number(
        0.88,
        label="Scatter Density",
        description="Density of the surrounding hair: 0 is a single strand, 1 is completely "
        "filled with hair",
        soft=(0.5, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source=_ZINKE,
        shown_when=when("volume.shadows", "deep", "slices"),
        active_when=_SCATTERS,
    )
