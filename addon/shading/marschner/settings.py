"""What the artist sets about a fibre; shading/settings.py holds what both models share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...params import Settings, either, number, when

_MARSCHNER = "Marschner et al. 2003"
_WIDEST = float(np.radians(60.0))
_HAS_NO_SCATTERING = either(when("volume.shadows", "none"), when("volume.scattering", False))


@dataclass(frozen=True, kw_only=True)
class MarschnerSettings(Settings):
    """Act in the model Marschner alone. Angles are in radians."""

    index_of_refraction: float = number(
        1.55,
        label="IOR",
        description="Index of refraction of the hair against what surrounds it; 1.17 under water",
        soft=(1.2, 1.8),
        hard=(1.0, 4.0),
        source=_MARSCHNER,
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    cuticle_tilt: float = number(
        float(np.radians(3.0)),
        label="Separation",
        description="Tilt of the scales: the first highlight moves to the tips by this angle, "
        "the second by twice as much to the roots",
        soft=(0.0, float(np.radians(10.0))),
        hard=(-float(np.radians(30.0)), float(np.radians(30.0))),
        unit="angle",
        source=_MARSCHNER,
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    eccentricity: float = number(
        1.0,
        label="Eccentricity",
        description="One axis of the cross-section over the other; round hair has 1",
        soft=(0.8, 1.25),
        hard=(0.5, 2.0),
        source=f"{_MARSCHNER}, section 5.2.3",
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    strength_r: float = number(
        1.0,
        label="First Strength",
        description="Factor of the light reflected at the surface; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=_MARSCHNER,
        panel="First Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    width_r: float = number(
        float(np.radians(5.0)),
        label="First Width",
        description="How wide the first highlight is along the hair: standard deviation of the "
        "half angle",
        soft=(float(np.radians(1.0)), float(np.radians(20.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source=_MARSCHNER,
        panel="First Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    offset_r: float = number(
        0.0,
        label="First Offset",
        description="Moves the first highlight to the tips, beyond Separation",
        soft=(-float(np.radians(10.0)), float(np.radians(10.0))),
        hard=(-float(np.radians(45.0)), float(np.radians(45.0))),
        unit="angle",
        panel="First Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    strength_tt: float = number(
        1.0,
        label="Rim Strength",
        description="Factor of the light that passes through, seen against the light",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=_MARSCHNER,
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    width_tt: float = number(
        float(np.radians(3.0)),
        label="Rim Width",
        description="How wide the light that passes through is along the hair: standard deviation "
        "of the half angle",
        soft=(float(np.radians(1.0)), float(np.radians(20.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source=_MARSCHNER,
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    offset_tt: float = number(
        0.0,
        label="Rim Offset",
        description="Moves the light that passes through to the tips, beyond Separation",
        soft=(-float(np.radians(10.0)), float(np.radians(10.0))),
        hard=(-float(np.radians(45.0)), float(np.radians(45.0))),
        unit="angle",
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    strength_trt: float = number(
        1.0,
        label="Second Strength",
        description="Factor of the light reflected inside; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=_MARSCHNER,
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    width_trt: float = number(
        float(np.radians(8.0)),
        label="Second Width",
        description="How wide the second highlight is along the hair: standard deviation of the "
        "half angle",
        soft=(float(np.radians(1.0)), float(np.radians(20.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source=_MARSCHNER,
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    offset_trt: float = number(
        0.0,
        label="Second Offset",
        description="Moves the second highlight to the tips, beyond Separation",
        soft=(-float(np.radians(10.0)), float(np.radians(10.0))),
        hard=(-float(np.radians(45.0)), float(np.radians(45.0))),
        unit="angle",
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    glint_strength: float = number(
        1.0,
        label="Glint Strength",
        description="Factor of the glints beside the second highlight; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=f"{_MARSCHNER}, appendix A",
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    glint_width: float = number(
        float(np.radians(10.0)),
        label="Glint Width",
        description="How far around the hair a glint is blurred",
        soft=(float(np.radians(2.0)), float(np.radians(25.0))),
        hard=(float(np.radians(0.5)), float(np.radians(90.0))),
        unit="angle",
        source=f"{_MARSCHNER}, appendix A",
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    azimuthal_width: float = number(
        0.0,
        label="Width Around",
        description="How far a rough surface spreads light around the hair",
        soft=(0.0, float(np.radians(40.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source="d'Eon et al. 2011",
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    strength_rest: float = number(
        1.0,
        label="Higher-order Lobes",
        description="Factor of the light that was reflected inside twice or more; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source="d'Eon et al. 2011; Chiang et al. 2016",
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    scattered: float = number(
        0.6,
        label="Fake Scattering",
        description="Stands for light that comes from strand to strand, in the hair's own colour, "
        "where Shadows with Scattering do not give it",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        shown_when=when("shading.model", "marschner"),
        active_when=_HAS_NO_SCATTERING,
    )
    volume_shadow: float = number(
        1.0,
        label="Volume Shadow Term",
        description="How much strands on the side of the groom that faces away are in the dark, "
        "for lights that throw no shadows",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="Scheuermann 2004, highlights attenuated by the diffuse bias",
        shown_when=when("shading.model", "marschner"),
        active_when=when("volume.shadows", "none"),
    )
